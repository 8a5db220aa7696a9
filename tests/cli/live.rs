//! A render that is watched: its page in a real browser and by hand, tev, files that change.

use crate::browser::chromium;
use crate::support::{done, skipped, text};
use crate::window::Window;
use halflight::film::read_exr;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(60);
const SMALL: &str = "--size 48x48 --photons 20000 --threads 2";

/// A render under way, and what it says.
struct Running {
    child: Child,
    lines: Receiver<String>,
}

impl Running {
    fn new(folder: &Path, arguments: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_halflight"))
            .current_dir(folder)
            .args(arguments.split_whitespace())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let said = BufReader::new(child.stderr.take().expect("a pipe"));
        let (send, lines) = channel();
        std::thread::spawn(move || said.lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
        Self { child, lines }
    }

    /// The next line that has these words.
    fn line(&self, words: &str) -> String {
        let (begin, mut before) = (Instant::now(), Vec::new());
        while let Ok(line) = self.lines.recv_timeout(PATIENCE.saturating_sub(begin.elapsed())) {
            if line.contains(words) {
                return line;
            }
            before.push(line);
        }
        panic!("{words:?} was not said, but {before:#?}");
    }

    /// The address of its page.
    fn page(&self) -> String {
        self.line("live: http").trim_start_matches("live: ").into()
    }

    fn ends(mut self) -> i32 {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status.code().expect("an end of its own");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("it goes on and on");
    }

    /// A number of /proc/self/status.
    fn fact(&self, name: &str) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).expect("a process");
        let rest = status.lines().find_map(|line| line.strip_prefix(name)).expect("a fact");
        rest.split_whitespace().next().and_then(|number| number.parse().ok()).expect("a number")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Port and token of an address.
fn parts(address: &str) -> (u16, &str) {
    let (port, token) =
        address.strip_prefix("http://127.0.0.1:").and_then(|rest| rest.split_once('/')).expect("an address");
    (port.parse().expect("a port"), token.trim_end_matches('/'))
}

/// Sends bytes and reads what comes back, to its end.
fn exchange(port: u16, bytes: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("a page");
    stream.set_read_timeout(Some(PATIENCE)).expect("it can");
    // It may be refused before all is sent.
    stream.write_all(bytes).ok();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).ok();
    answer
}

/// The status code and the body of an answer.
fn asked(address: &str, method: &str, what: &str, more: &str) -> (u16, Vec<u8>) {
    let (port, token) = parts(address);
    let host = if more.contains("Host:") { String::new() } else { format!("Host: 127.0.0.1:{port}\r\n") };
    let answer = exchange(port, format!("{method} /{token}/{what} HTTP/1.1\r\n{host}{more}\r\n").as_bytes());
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
    let head = String::from_utf8_lossy(&answer[..end]).into_owned();
    (head[9..12].parse().expect("a status"), answer[end..].to_vec())
}

fn state(address: &str) -> serde_json::Value {
    let (status, body) = asked(address, "GET", "state", "");
    assert_eq!(status, 200);
    serde_json::from_slice(&body).expect("JSON")
}

fn until(address: &str, mut what: impl FnMut(&serde_json::Value) -> bool) -> serde_json::Value {
    let begin = Instant::now();
    loop {
        let state = state(address);
        if what(&state) {
            return state;
        }
        assert!(begin.elapsed() < PATIENCE, "{state}");
        std::thread::sleep(Duration::from_millis(30));
    }
}

#[test]
fn who_watches_changes_no_pixel() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let command = format!("render builtin:cornell-spheres {SMALL} --passes 24 --layers all");
    let alone = folder.join("alone.exr");
    done(&[command.split_whitespace().collect::<Vec<_>>(), vec!["-q", "-o", text(&alone)]].concat());
    let running = Running::new(folder, &format!("{command} -o watched.exr --live"));
    let address = running.page();
    let mut seen = std::collections::BTreeSet::new();
    until(&address, |state| {
        let layers = ["visible", "error", "bias", "normal", "depth"];
        for layer in layers.map(|layer| format!("picture?layer={layer}&exposure=auto&view=agx")) {
            let (status, png) = asked(&address, "GET", &layer, "");
            assert!(status == 503 || (status == 200 && png.starts_with(b"\x89PNG")), "{layer}: {status}");
            seen.insert(png);
        }
        assert_eq!(asked(&address, "POST", "pause", "").0, 200);
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(asked(&address, "POST", "go", "").0, 200);
        state["facts"]["status"] == "complete"
    });
    assert!(seen.len() >= 5, "{} pictures", seen.len());
    assert_eq!(asked(&address, "POST", "quit", "").0, 200);
    assert_eq!(running.ends(), 0);
    let [alone, watched] =
        ["alone.exr", "watched.exr"].map(|name| read_exr(&folder.join(name)).expect("a picture"));
    assert_eq!(alone.layers, watched.layers);
}

#[test]
fn only_who_knows_the_address_is_served_and_nobody_holds_the_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let running = Running::new(
        folder.path(),
        &format!("render builtin:cornell-spheres {SMALL} --time 1h -o a.exr --live"),
    );
    let address = running.page();
    let (port, token) = parts(&address);
    let status = |bytes: &str| -> String {
        String::from_utf8_lossy(&exchange(port, bytes.as_bytes())).chars().skip(9).take(3).collect()
    };
    let host = format!("Host: 127.0.0.1:{port}\r\n");
    assert_eq!(status(&format!("GET /{token}/ HTTP/1.1\r\n{host}\r\n")), "200");
    for wrong in ["", "0".repeat(32).as_str(), "../../etc/passwd", "..%2f..%2fetc%2fpasswd"] {
        assert_eq!(status(&format!("GET /{wrong} HTTP/1.1\r\n{host}\r\n")), "404", "{wrong}");
    }
    for file in ["a.exr", "../a.exr", "picture/../../a.exr"] {
        assert_eq!(status(&format!("GET /{token}/{file} HTTP/1.1\r\n{host}\r\n")), "404", "{file}");
    }
    // A name that was made to lead here.
    assert_eq!(status(&format!("GET /{token}/state HTTP/1.1\r\nHost: evil.example:{port}\r\n\r\n")), "403");
    assert_eq!(
        status(&format!("POST /{token}/quit HTTP/1.1\r\n{host}Origin: http://evil.example\r\n\r\n")),
        "403"
    );
    assert_eq!(status(&format!("GET /{token}/quit HTTP/1.1\r\n{host}\r\n")), "405");
    // Too much.
    assert_eq!(
        status(&format!("GET /{token}/state HTTP/1.1\r\n{host}A: {}\r\n\r\n", "a".repeat(100_000))),
        "431"
    );
    assert_eq!(status(&format!("GET /{} HTTP/1.1\r\n{host}\r\n", "a".repeat(9000))), "431");
    assert_eq!(
        status(&format!("POST /{token}/more HTTP/1.1\r\n{host}Content-Length: 10\r\n\r\n0123456789")),
        "413"
    );
    // Others that say a little now and then, or nothing, are sent away, and take no thread with them.
    // Those of the render itself are all there once a pass is done.
    until(&address, |state| state["facts"]["passes"].as_u64() > Some(0));
    let threads = running.fact("Threads:");
    let mut slow: Vec<TcpStream> =
        (0..40).map(|_| TcpStream::connect(("127.0.0.1", port)).expect("it listens")).collect();
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(4) {
        slow.iter_mut().for_each(|stream| drop(stream.write_all(b"G")));
        assert!(running.fact("Threads:") <= threads + 17, "{} threads", running.fact("Threads:"));
        std::thread::sleep(Duration::from_millis(100));
    }
    until(&address, |state| state["facts"]["passes"].as_u64() > Some(0));
    assert!(running.fact("Threads:") <= threads + 1);
    drop(slow);
    assert_eq!(asked(&address, "POST", "stop", "").0, 200);
    running.line("wrote a.exr");
    assert_eq!(asked(&address, "POST", "quit", "").0, 200);
    assert_eq!(running.ends(), 0);
}

#[test]
fn a_render_is_paused_stopped_and_told_to_take_more_by_clicks() {
    let Some(browser) = chromium() else {
        skipped("no Chromium here, so the page of --live was not opened; install it or set CHROMIUM");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = "render builtin:cornell-spheres --size 160x160 --photons 60000 --passes 20000 --layers all -o a.exr --live";
    let running = Running::new(folder.path(), arguments);
    let address = running.page();
    let mut window = Window::open(&browser, &address);
    let marks = "document.documentElement.dataset";
    let sum = "(() => { const image = document.getElementById('picture'), canvas = document.createElement('canvas');
        [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
        const pen = canvas.getContext('2d'); pen.drawImage(image, 0, 0);
        return pen.getImageData(0, 0, canvas.width, canvas.height).data.reduce((sum, x) => sum + x, 0) / 4 / 160 / 160; })()";
    window.until(&format!("{marks}.of && Number({marks}.passes) > 3"));
    // It has no width while the next one comes.
    window.until("document.getElementById('picture').naturalWidth === 160");
    // Pause: nothing happens any more.
    window.click("pause");
    window.until(&format!("{marks}.status === 'paused' && {marks}.of.endsWith(' ' + {marks}.passes)"));
    let paused = state(&address)["facts"]["passes"].clone();
    let brightness = window.value(sum).as_f64().expect("a mean");
    // A stop brighter, other layers, the error in false colour.
    window.value("document.getElementById('exposure').focus()");
    window.choose("exposure", "1");
    window.until(&format!("{marks}.shown === 'layer=visible&exposure=1&view=standard'"));
    let brighter = window.value(sum).as_f64().expect("a mean");
    assert!(brighter > brightness + 10.0, "{brightness}, {brighter}");
    for layer in ["invisible", "bias", "normal", "depth", "error"] {
        window.choose("layer", layer);
        window.until(&format!("{marks}.shown.startsWith('layer={layer}&')"));
        assert!(window.value(sum).as_f64() > Some(70.0), "{layer} is black");
    }
    assert_eq!(window.value("document.getElementById('key').hidden"), false);
    window.choose("layer", "visible");
    window.click("auto");
    window.until(&format!("{marks}.shown === 'layer=visible&exposure=auto&view=standard'"));
    let shot = window.picture();
    assert!(shot.len() > 20_000, "a screenshot of {} bytes shows nothing", shot.len());
    if let Some(keep) = std::env::var_os("HALFLIGHT_KEEP_SHOTS") {
        std::fs::write(PathBuf::from(&keep).join("live.png"), &shot).expect("a folder");
        window.choose("layer", "error");
        window.until(&format!("{marks}.shown.startsWith('layer=error&')"));
        std::fs::write(PathBuf::from(&keep).join("live-error.png"), window.picture()).expect("a folder");
    }
    assert_eq!(state(&address)["facts"]["passes"], paused, "a render that is paused goes on");
    window.click("pause");
    window.until(&format!("{marks}.status === 'rendering' && Number({marks}.passes) > {paused}"));
    // Stop keeps the picture, and more can be taken.
    window.click("stop");
    running.line("wrote a.exr");
    window.until(&format!("{marks}.status === 'stopped'"));
    let stopped = state(&address)["facts"]["passes"].as_u64().expect("a number");
    let passes = |folder: &Path| {
        read_exr(&folder.join("a.exr")).expect("a picture").header.get("passes").expect("one").to_string()
    };
    assert_eq!(passes(folder.path()), stopped.to_string());
    window.value("document.getElementById('error-more').value = 90");
    window.click("take-error");
    running.line("live: asked for an error of 0.9");
    running.line("wrote a.exr");
    window.until(&format!("{marks}.status === 'complete'"));
    let complete = state(&address)["facts"]["passes"].as_u64().expect("a number");
    assert_eq!(complete, stopped.max(8));
    window.value("document.getElementById('passes-more').value = 3");
    window.click("take-passes");
    running.line(&format!("live: asked for {} passes", complete + 3));
    running.line("wrote a.exr");
    assert_eq!(passes(folder.path()), (complete + 3).to_string());
    window.until(&format!("{marks}.status === 'complete' && {marks}.of === '1 {}'", complete + 3));
    assert_eq!(window.value(&format!("{marks}.errors")), "0");
    window.click("stop");
    assert_eq!(running.ends(), 0);
    window.until(&format!("{marks}.status === 'ended' || {marks}.status === 'gone'"));
}

/// A scene of files: the glTF file and its buffer.
fn scene(folder: &Path) -> (PathBuf, String) {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    std::fs::copy(scenes.join("cornell-spheres.bin"), folder.join("cornell-spheres.bin")).expect("a buffer");
    let gltf = std::fs::read_to_string(scenes.join("cornell-spheres.gltf")).expect("a scene");
    let path = folder.join("box.gltf");
    std::fs::write(&path, &gltf).expect("written");
    (path, gltf)
}

/// The scene with another field of view.
fn seen_wider(gltf: &str, by: usize) -> String {
    let (before, after) = gltf.split_once("\"yfov\": 0.785").expect("a camera");
    format!("{before}\"yfov\": 0.{:03}{after}", 785 + by)
}

#[test]
fn thirty_renders_in_a_row_take_no_more_than_a_few() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, gltf) = scene(folder.path());
    let arguments =
        "render box.gltf --size 160x120 --photons 20000 --passes 3 --threads 2 -o a.exr --live --watch";
    let running = Running::new(folder.path(), arguments);
    let address = running.page();
    let (mut memory, mut threads) = (Vec::new(), Vec::new());
    for round in 1..=30 {
        running.line("watch: waiting");
        let facts = state(&address)["facts"].clone();
        assert_eq!((&facts["render"], &facts["passes"]), (&round.into(), &3.into()), "{facts}");
        assert_eq!(asked(&address, "GET", "picture", "").0, 200);
        memory.push(running.fact("VmRSS:"));
        threads.push(running.fact("Threads:"));
        std::fs::write(&path, seen_wider(&gltf, round)).expect("written");
    }
    // The first few find how much the allocator keeps; kB.
    let (early, late) = (memory[4..10].iter().max(), memory[24..].iter().max());
    assert!(late.zip(early).is_some_and(|(late, early)| late - early.min(late) < 6_000), "kB: {memory:?}");
    // Now and then a connection is still being closed.
    assert!(threads[24..].iter().min() <= threads[..10].iter().max(), "{threads:?}");
}

#[test]
fn what_is_half_written_is_said_once_and_waited_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, gltf) = scene(folder.path());
    let running = Running::new(
        folder.path(),
        "render box.gltf --size 40x40 --photons 5000 --passes 2 -o a.exr --watch",
    );
    running.line("watch: waiting");
    let first = read_exr(&folder.path().join("a.exr")).expect("a picture");
    // Half of it; the rest comes late.
    std::fs::write(&path, &gltf[..gltf.len() / 2]).expect("written");
    running.line("it is waited for");
    std::thread::sleep(Duration::from_millis(2500));
    // What was meant is the old scene after all.
    std::fs::write(&path, &gltf).expect("written");
    let next = running.line("");
    assert!(
        next.contains("shows the same"),
        "{next}: trouble was said more than once, or the same rendered anew"
    );
    // The buffer is gone for a moment, as where it is written anew under another name.
    let (buffer, aside) = (folder.path().join("cornell-spheres.bin"), folder.path().join("aside"));
    std::fs::rename(&buffer, &aside).expect("renamed");
    running.line("it is waited for");
    std::fs::write(&path, seen_wider(&gltf, 100)).expect("written");
    std::fs::rename(&aside, &buffer).expect("renamed");
    running.line("is rendered anew");
    running.line("watch: waiting");
    let second = read_exr(&folder.path().join("a.exr")).expect("a picture");
    assert_ne!(first.layers, second.layers);
}

/// The scene with walls that reflect so many times what meets them.
fn amplifying(gltf: &str, factor: f64) -> String {
    let mut scene: serde_json::Value = serde_json::from_str(gltf).expect("JSON");
    for material in scene["materials"].as_array_mut().expect("materials") {
        material["extras"] = serde_json::json!({ "opaque": [factor, 0, 0, factor] });
    }
    scene.to_string()
}

#[test]
fn a_scene_that_has_no_image_is_waited_out_and_left_by_quit() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, gltf) = scene(folder.path());
    let arguments = "render box.gltf --size 40x40 --photons 5000 --passes 2 -o a.exr --live --watch";
    let running = Running::new(folder.path(), arguments);
    let address = running.page();
    running.line("watch: waiting");
    std::fs::write(&path, amplifying(&gltf, 9.0)).expect("written");
    running.line("another scene is waited for");
    assert!(until(&address, |state| !state["facts"]["note"].is_null())["facts"]["status"] == "loading");
    std::fs::write(&path, &gltf).expect("written");
    running.line("watch: waiting");
    assert_eq!(state(&address)["facts"]["note"], serde_json::Value::Null);
    std::fs::write(&path, amplifying(&gltf, 8.0)).expect("written");
    running.line("another scene is waited for");
    assert_eq!(asked(&address, "POST", "quit", "").0, 200);
    assert_eq!(running.ends(), 0);
    // With the first scene that is the end.
    let arguments = "render box.gltf --size 40x40 --passes 2 -o b.exr --watch";
    assert_eq!(crate::halflight(folder.path(), arguments).status.code(), Some(3));
}

#[test]
fn what_cannot_be_watched_is_refused() {
    for (arguments, words) in [
        ("render builtin:cornell-spheres --watch", "built-in"),
        ("render builtin:cornell-spheres --live 70000", "no port"),
        ("render --live scene.glb", "before --live"),
        ("render --tev localhost", "127.0.0.1:14158"),
        ("render a.glb --watch --resume", "--watch"),
        ("render a.glb --watch --shard 1/2 --passes 8", "--watch"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let output = crate::halflight(folder.path(), arguments);
        let said = crate::said(&output);
        assert!(output.status.code() == Some(2) && said.contains(words), "{arguments}: {said}");
    }
    // A port that somebody has.
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port();
    let folder = tempfile::tempdir().expect("a folder");
    let output = crate::halflight(folder.path(), &format!("render --size 8x8 --passes 1 --live {port}"));
    let said = crate::said(&output);
    assert!(
        output.status.code() == Some(2) && said.lines().count() == 1 && said.contains("free port"),
        "{said}"
    );
}

/// What a viewer was sent: the name, the size and the channels of a picture, and its pixels.
#[derive(Debug, PartialEq)]
struct Sent {
    name: String,
    size: (usize, usize),
    channels: Vec<String>,
    values: Vec<Vec<f32>>,
}

/// The fields of a packet, one after another.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(count);
        self.0 = rest;
        taken
    }

    fn number(&mut self) -> usize {
        u32::from_le_bytes(self.take(4).try_into().expect("four")) as usize
    }

    fn long(&mut self) -> usize {
        u64::from_le_bytes(self.take(8).try_into().expect("eight")) as usize
    }

    fn string(&mut self) -> String {
        let length = self.0.iter().position(|byte| *byte == 0).expect("an end");
        let text = self.take(length + 1);
        String::from_utf8(text[..length].to_vec()).expect("UTF-8")
    }

    fn strings(&mut self, count: usize) -> Vec<String> {
        (0..count).map(|_| self.string()).collect()
    }
}

/// Reads packets as the protocol of tev describes them until the sender goes away, or `most` were read.
fn viewed(stream: TcpStream, most: usize) -> Option<Sent> {
    let mut stream = BufReader::new(stream);
    let mut sent: Option<Sent> = None;
    for _ in 0..most {
        let mut length = [0; 4];
        if stream.read_exact(&mut length).is_err() {
            break;
        }
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut packet).expect("a whole packet");
        let mut fields = Fields(&packet);
        let kind = fields.take(2)[0];
        let name = fields.string();
        match kind {
            4 => {
                let (width, height, count) = (fields.number(), fields.number(), fields.number());
                let values = vec![vec![f32::NAN; width * height]; count];
                sent = Some(Sent { name, size: (width, height), channels: fields.strings(count), values });
            }
            6 => sent.as_mut().expect("a picture was made before").update(&name, &mut fields),
            other => panic!("a packet of kind {other}"),
        }
        assert!(fields.0.is_empty(), "{} bytes too many", fields.0.len());
    }
    sent
}

impl Sent {
    fn update(&mut self, name: &str, fields: &mut Fields<'_>) {
        assert_eq!(name, self.name);
        let count = fields.number();
        assert_eq!(fields.strings(count), self.channels);
        let [x, y, width, height] = [(); 4].map(|()| fields.number());
        let offsets: Vec<usize> = (0..count).map(|_| fields.long()).collect();
        let strides: Vec<usize> = (0..count).map(|_| fields.long()).collect();
        let data: Vec<f32> =
            (0..count * width * height).map(|_| f32::from_bits(fields.number() as u32)).collect();
        for (channel, values) in self.values.iter_mut().enumerate() {
            for pixel in 0..width * height {
                let at = (y + pixel / width) * self.size.0 + x + pixel % width;
                values[at] = data[offsets[channel] + pixel * strides[channel]];
            }
        }
    }
}

#[test]
fn tev_is_sent_every_pixel_and_may_go_away() {
    let folder = tempfile::tempdir().expect("a folder");
    let viewer = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = viewer.local_addr().expect("bound").port();
    let arguments = "render builtin:cornell-spheres --size 200x150 --photons 20000 --layers all --passes 100000 -o a.exr --live";
    let running = Running::new(folder.path(), &format!("{arguments} --tev 127.0.0.1:{port}"));
    let address = running.page();
    // One that leaves in the middle.
    viewed(viewer.accept().expect("it comes").0, 3);
    let line = running.line("--tev");
    assert!(line.contains("went away") && line.contains("the render goes on"), "{line}");
    let second = viewer.accept().expect("it comes again").0;
    let reading = std::thread::spawn(move || viewed(second, usize::MAX));
    until(&address, |state| state["facts"]["passes"].as_u64() >= Some(2));
    assert_eq!(asked(&address, "POST", "quit", "").0, 200);
    let sent = reading.join().expect("packets").expect("a picture");
    assert_eq!(running.ends(), 0);
    let written = read_exr(&folder.path().join("a.exr")).expect("a picture");
    assert_eq!((sent.name.as_str(), sent.size), ("a.exr", (200, 150)));
    for (channel, values) in sent.channels.iter().zip(&sent.values) {
        let (layer, component) = channel.split_once('.').unwrap_or(("visible", channel));
        let plane = written.layer(layer).expect("a layer of the file");
        let component = match component {
            _ if layer == "depth" => 0,
            "R" | "X" => 0,
            "G" | "Y" => 1,
            _ => 2,
        };
        let same =
            values.iter().zip(plane).all(|(sent, written)| sent.to_bits() == written[component].to_bits());
        assert!(same, "{channel} is not what the file has");
    }
    assert!(
        sent.channels.len() > 20 && sent.channels.iter().any(|name| name == "depth.Z"),
        "{:?}",
        sent.channels
    );
}

#[test]
fn a_viewer_that_is_not_there_is_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = crate::halflight(
        folder.path(),
        "render builtin:cornell-spheres --size 16x16 --photons 500 --passes 40 -o a.exr --tev 127.0.0.1:1",
    );
    let said = crate::said(&output);
    assert!(output.status.success(), "{said}");
    assert_eq!(said.lines().filter(|line| line.contains("--tev")).count(), 1, "{said}");
}
