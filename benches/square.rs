//! Frames a second of the page of `halflight view` while it walks by itself, at 512×512, in Chromium without a GPU (Mesa's
//! llvmpipe): `cargo bench --bench square`. Three turns, each with the picture drawn and without, which is the browser's own maximum.

#[path = "../tests/cli/browser.rs"]
mod browser;

use browser::chromium;
use halflight::film::Layer;
use halflight::plan::Settings;
use halflight::render::Render;
use halflight::report::square_page;
use halflight::scene::Scene;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Walks for eight seconds and sends what it counted to the port.
const COUNT: &str = r#"<script>
addEventListener("load", () => setTimeout(() => {
  document.getElementById("play").click();
  const begin = performance.now();
  let frames = 0;
  const count = () => {
    const seconds = (performance.now() - begin) / 1000;
    if (seconds < 8) { frames++; requestAnimationFrame(count); return; }
    fetch(`http://127.0.0.1:PORT/${(frames / seconds).toFixed(1)} frames a second, ${document.documentElement.dataset.drawer}`);
  };
  requestAnimationFrame(count);
}, 3000));
</script></body>"#;

/// So long for a browser to start, and to walk.
const PATIENCE: Duration = Duration::from_secs(60);

fn main() {
    let Some(browser) = chromium() else {
        println!("SKIPPED: no Chromium here; install it (apt-get install chromium) or set CHROMIUM");
        return;
    };
    let scene = Scene::load("builtin:cornell-spheres").expect("built in");
    let settings = Settings { atlas: true, ..Settings::default() };
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("an atlas");
    while render.film().passes() < 4 {
        render.pass();
    }
    let atlas = render.atlas().expect("asked for");
    let drawn = square_page(&atlas, &render.header(), usize::MAX).expect("it encodes").html;
    let draw = "gl.drawArrays(gl.TRIANGLES, 0, 3);";
    assert_eq!(drawn.matches(draw).count(), 1, "the page draws otherwise than this bench knows");
    let empty = drawn.replace(draw, "");
    for _ in 0..3 {
        for (name, page) in [("drawn", &drawn), ("not drawn", &empty)] {
            println!("{name}: {}", frames(&browser, page));
        }
    }
}

/// What the page counted.
fn frames(browser: &Path, page: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let server = TcpListener::bind("127.0.0.1:0").expect("a port");
    server.set_nonblocking(true).expect("it can");
    let port = server.local_addr().expect("bound").port().to_string();
    let file = folder.path().join("square.html");
    let counting = page.replace("</body>", &COUNT.replace("PORT", &port));
    std::fs::write(&file, counting).expect("room for a page");
    let mut running = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--no-first-run", "--remote-debugging-port=0"])
        .args(["--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist", "--window-size=700,700"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", file.display()))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    let begin = Instant::now();
    let mut counted = String::from("no answer");
    while begin.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(100));
        let Ok((mut stream, _)) = server.accept() else { continue };
        stream.set_nonblocking(false).expect("it can");
        stream.set_read_timeout(Some(Duration::from_secs(1))).expect("it can");
        let mut request = [0; 256];
        let length = stream.read(&mut request).unwrap_or(0);
        let request = String::from_utf8_lossy(&request[..length]).replace("%20", " ");
        // A browser may also connect and ask for nothing.
        if let Some((found, _)) = request.strip_prefix("GET /").and_then(|asked| asked.split_once(" HTTP")) {
            counted = found.into();
            stream.write_all(b"HTTP/1.1 204 No Content\r\n\r\n").ok();
            break;
        }
    }
    running.kill().ok();
    running.wait().ok();
    counted
}
