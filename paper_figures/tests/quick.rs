//! The program as a user runs it, at a tiny size.

use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

fn run(folder: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_paper_figures"))
        .args(["--quick", "--width", "64", "--seconds", "0.5", "-o"])
        .arg(folder)
        .args(more)
        .output()
        .expect("it starts")
}

/// What it wrote: the page and the numbers.
fn made(folder: &Path, more: &[&str]) -> (String, Value) {
    let output = run(folder, more);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a file of that name");
    (read("index.html"), serde_json::from_str(&read("numbers.json")).expect("JSON"))
}

fn number(numbers: &Value, figure: &str, key: &str) -> f64 {
    numbers["figures"][figure][key].as_f64().unwrap_or_else(|| panic!("{figure} has no {key}: {numbers}"))
}

/// Every picture of the page is there and is one.
fn pictures_must_be_there(folder: &Path, page: &str, count: usize) {
    let files: Vec<&str> = page.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(files.len(), count, "{files:?}");
    for file in files {
        let bytes = std::fs::read(folder.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let begins = if file.ends_with(".svg") { b"<svg" } else { b"\x89PNG" };
        assert!(bytes.starts_with(begins) && bytes.len() > 150, "{file} of {} bytes", bytes.len());
        if file.ends_with(".svg") {
            let text = String::from_utf8(bytes).expect("text");
            assert!(!text.contains("NaN") && !text.contains("inf"), "{file}");
        }
    }
}

fn figure_1_must_agree(numbers: &Value) {
    for name in ["global", "shadowless", "one-bounce", "local"] {
        let get = |key: &str| number(numbers, "figure_1", &format!("{name}_{key}"));
        assert!(get("z").abs() < 3.5, "{name}: z = {}", get("z"));
        assert!(get("within") > 0.95, "{name}: {} within 1 %", get("within"));
        assert!(get("relmse") < 2.0 * get("relmse_expected"), "{name}: relMSE {}", get("relmse"));
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn the_numbers_of_the_paper_are_reached() {
    let folder = tempfile::tempdir().expect("a folder");
    let (page, numbers) = made(folder.path(), &[]);
    figure_1_must_agree(&numbers);
    if numbers["missing"].as_array().is_some_and(|missing| !missing.is_empty()) {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no OpenGL here, so figure 4 was not compared with it: {}",
            numbers["missing"]
        );
        return;
    }
    pictures_must_be_there(folder.path(), &page, 16 + 2 + 3 + 3 + 3 + 1 + 12);
    let four = |key: &str| number(&numbers, "figure_4", key);
    // Paper §3.
    assert!(four("e_pixel") <= 0.004, "{}", four("e_pixel"));
    assert!(four("mean_colour") < 1.0 / 255.0, "{}", four("mean_colour"));
    assert!((four("triangles") - 500_000.0).abs() < 5_000.0);
    // Like with like there is only rounding, and antialiasing at edges. The scale would show 2 % at once.
    assert!(four("like_e_pixel") <= 1.0 / 255.0, "{}", four("like_e_pixel"));
    // The largest of a thousand normal errors is below five of the largest standard error.
    let (largest, noise) = (four("like_e_pixel_max_inside"), four("like_noise_max_inside"));
    assert!(largest <= 5.0 * noise && noise < 0.004, "{largest}, noise {noise}");
    assert!((four("like_scale") - 1.0).abs() < 0.002, "{}", four("like_scale"));
    // Five points are not quite a lamp, but no fit was needed.
    assert!((four("fitted_scale") - 1.0).abs() < 0.01, "{}", four("fitted_scale"));
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn without_opengl_the_rest_is_made_and_the_page_says_what_brings_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (page, numbers) = made(folder.path(), &["--no-opengl"]);
    figure_1_must_agree(&numbers);
    pictures_must_be_there(folder.path(), &page, 16 + 2 + 2 + 2 + 3 + 1 + 12);
    assert!(page.contains("apt-get install libegl1 libgl1-mesa-dri"));
    assert!(numbers["figures"]["figure_4"]["like_e_pixel"].is_null());
    assert!(number(&numbers, "figure_4", "e_pixel") <= 0.004);
}

#[test]
fn what_cannot_be_is_said_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("taken");
    std::fs::write(&file, "a file").expect("written");
    for (folder, more) in [(&*file, &[][..]), (folder.path(), &["--no-opengl", "--seconds", "0"][..])] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_paper_figures"));
        let output = command.arg("-o").arg(folder).args(more).output().expect("it starts");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains("taken: cannot write") || text.contains("--seconds"), "{text}");
    }
}
