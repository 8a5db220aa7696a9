//! A window of a real browser that is clicked in: the DevTools protocol over two pipes, JSON that ends with a zero byte.

use crate::support::text;
use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longer than anything here takes on a machine that does other things besides.
const PATIENCE: Duration = Duration::from_secs(60);

pub struct Window {
    browser: Child,
    asks: File,
    answers: BufReader<File>,
    session: String,
    count: u64,
    _folder: tempfile::TempDir,
}

impl Window {
    /// Opens a page.
    pub fn open(browser: &Path, address: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let [asks, answers] = ["asks", "answers"].map(|name| folder.path().join(name));
        assert!(Command::new("mkfifo").args([&asks, &answers]).status().expect("mkfifo").success());
        let child = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<\"$0\" 4>\"${0%asks}answers\"", text(&asks)])
            .arg(browser)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync"])
            .args(["--disable-background-networking", "--disable-component-update", "--window-size=1280,900"])
            .args([format!("--user-data-dir={}", text(folder.path())).as_str(), "--remote-debugging-pipe"])
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        let asks = OpenOptions::new().write(true).open(asks).expect("a pipe");
        let answers = BufReader::new(File::open(answers).expect("a pipe"));
        let mut window =
            Self { browser: child, asks, answers, session: String::new(), count: 0, _folder: folder };
        let target = window.call("Target.createTarget", json!({ "url": address }));
        let target = target["targetId"].as_str().expect("a page");
        let session = window.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        window.session = session["sessionId"].as_str().expect("a session").into();
        window.until("document.readyState === 'complete' && document.documentElement.dataset.status");
        window
    }

    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.count += 1;
        let mut message = json!({ "id": self.count, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.asks.write_all(format!("{message}\0").as_bytes()).expect("a browser that listens");
        loop {
            let mut answer = Vec::new();
            self.answers.read_until(0, &mut answer).expect("a browser that answers");
            assert_eq!(answer.pop(), Some(0), "the browser went away");
            let answer: Value = serde_json::from_slice(&answer).expect("JSON");
            if answer["id"] == self.count {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// What an expression comes to, in the page; promises are waited for.
    pub fn value(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let answer = self.call("Runtime.evaluate", parameters);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Waits until an expression is true in the page.
    pub fn until(&mut self, expression: &str) {
        let begin = Instant::now();
        while self.value(&format!("Boolean(document.documentElement && {expression})")) != true {
            if begin.elapsed() > PATIENCE {
                let marks = self.value("JSON.stringify(document.documentElement.dataset)");
                panic!("{expression} does not come true: {marks}");
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Clicks in the middle of an element, as a mouse does.
    pub fn click(&mut self, id: &str) {
        self.until(&format!("!document.getElementById('{id}').matches(':disabled')"));
        let middle = self.value(&format!(
            "(() => {{ const e = document.getElementById('{id}'); e.scrollIntoView(); const r = e.getBoundingClientRect();
               return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
        ));
        for kind in ["mousePressed", "mouseReleased"] {
            let at =
                json!({ "type": kind, "x": middle[0], "y": middle[1], "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", at);
        }
    }

    /// Chooses a value of an input or a list.
    pub fn choose(&mut self, id: &str, value: &str) {
        self.value(&format!(
            "(() => {{ const e = document.getElementById('{id}'); e.value = '{value}'; e.dispatchEvent(new Event('input')); }})()"
        ));
    }

    /// A PNG file of what is seen.
    pub fn picture(&mut self) -> Vec<u8> {
        use base64::Engine;
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let data = shot["data"].as_str().expect("a picture");
        base64::engine::general_purpose::STANDARD.decode(data).expect("base64")
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        self.browser.kill().ok();
        self.browser.wait().ok();
    }
}
