//! What `halflight plan` says a render takes in memory, and what it takes: six scenes and two atlases, as Markdown.
//!
//! `cargo run --release --example memory -- target/release/halflight [WITHIN]` fails where one is off by more than WITHIN (0.15).
//! Linux alone: the peak is that of the process, as the system tells it when it ends.

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Duration;

/// Arguments of `plan` and `render`.
const RENDERS: [&str; 8] = [
    "builtin:caustic-box --size 640x640",
    "builtin:cornell-spheres --size 512x512 --layers all",
    "builtin:cornell-spheres --size 800x600 --cryptomatte",
    "builtin:two-spheres --size 256x256 --illumination global",
    "builtin:cornell-spheres --size 1024x1024 --method path --samples 1",
    "scenes/cornell-spheres.gltf --size 256x256 --environment SKY",
    "builtin:cornell-spheres --size 256x256 --atlas",
    "builtin:caustic-box --size 96x96 --atlas",
];
/// The longer side of the environment.
const SKY: usize = 4096;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let program = arguments.next().expect("the program halflight");
    let within: f64 = arguments.next().map_or(0.15, |text| text.parse().expect("a fraction"));
    let folder = tempfile::tempdir().expect("a folder");
    write_sky(&folder.path().join("sky.hdr"));
    println!("| render | forecast, MB | peak, MB | forecast / peak |\n|---|---|---|---|");
    let mut worst: f64 = 0.0;
    for render in RENDERS {
        let arguments = render.replace("SKY", folder.path().join("sky.hdr").to_str().expect("a plain path"));
        let forecast = forecast(&program, &arguments);
        let peak = peak(&program, &arguments, folder.path());
        let ratio = forecast / peak;
        worst = worst.max((ratio - 1.0).abs());
        println!("| `{render}` | {:.1} | {:.1} | {ratio:.3} |", 1e-6 * forecast, 1e-6 * peak);
    }
    println!("\nthe worst is off by {:.1} %", 100.0 * worst);
    if worst <= within { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Bytes, as `plan` has them.
fn forecast(program: &str, arguments: &str) -> f64 {
    let plan = Command::new(program).arg("plan").args(arguments.split(' ')).arg("--json").output();
    let plan = plan.expect("the program runs");
    assert!(plan.status.success(), "{}", String::from_utf8_lossy(&plan.stderr));
    let json: Value = serde_json::from_slice(&plan.stdout).expect("JSON");
    json["memory_bytes"]["total"].as_f64().expect("a number")
}

/// Bytes that three passes hold at the most, their picture included; of an atlas twenty, of which the last four are made together.
fn peak(program: &str, arguments: &str, folder: &Path) -> f64 {
    let passes = if arguments.contains("--atlas") { "20" } else { "3" };
    let mut render = Command::new(program);
    render
        .arg("render")
        .args(arguments.split(' '))
        .args(["--passes", passes, "-q", "-o"])
        .arg(folder.join("a.exr"));
    let mut child = render.spawn().expect("the program runs");
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0.0;
    // The kernel keeps the most itself; only what is added in the last hundredth of a second may be missed.
    let ended = loop {
        most = high_water(&status).unwrap_or(0.0).max(most);
        match child.try_wait().expect("a child") {
            Some(ended) => break ended,
            None => std::thread::sleep(Duration::from_millis(10)),
        }
    };
    assert!(ended.success(), "{arguments}");
    most
}

/// Bytes. None: the process has ended.
fn high_water(status: &str) -> Option<f64> {
    let text = fs::read_to_string(status).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}

/// An environment of one colour as a Radiance picture without run lengths.
fn write_sky(path: &Path) {
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {SKY}\n", SKY / 2).into_bytes();
    bytes.extend([128, 128, 128, 129].repeat(SKY * SKY / 2));
    fs::write(path, bytes).expect("written");
}
