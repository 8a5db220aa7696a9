//! Renders from the command line: what is on disk afterwards.

use crate::{halflight, said};
use halflight::film::{Image, read_exr};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

fn picture(folder: &Path, name: &str) -> Image {
    read_exr(&folder.join(name)).expect("a picture")
}

#[test]
fn without_arguments_the_caustic_box_is_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = halflight(folder.path(), "render --size 48x32 --passes 3");
    assert!(output.status.success(), "{}", said(&output));
    let image = picture(folder.path(), "halflight.exr");
    assert_eq!((image.width, image.height), (48, 32));
    assert!(image.layer("visible").expect("the picture").iter().any(|rgb| rgb.x > 0.0));
    assert!(image.layer("error").is_some());
    let fact = |name: &str| image.header.get(name).map(ToString::to_string);
    assert_eq!(fact("scene").as_deref(), Some("builtin:caustic-box"));
    assert_eq!(fact("passes").as_deref(), Some("3"));
    assert_eq!(fact("seed").as_deref(), Some("0"));
    assert_eq!(fact("illumination").as_deref(), Some("global"));
    for name in ["version", "scene_hash", "photons", "seconds", "method"] {
        assert!(fact(name).is_some(), "no {name} in the header");
    }
    assert!(folder.path().join("halflight.png").exists());
}

#[test]
fn layers_add_up_to_the_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let output =
        halflight(folder.path(), "render --size 40x40 --passes 2 --photons 20000 --layers all -o all.exr");
    assert!(output.status.success(), "{}", said(&output));
    let image = picture(folder.path(), "all.exr");
    let layer = |name: &str| image.layer(name).unwrap_or_else(|| panic!("no {name} layer"));
    for (i, whole) in layer("visible").iter().enumerate() {
        let sum = ["emitted", "direct", "caustic", "indirect"]
            .iter()
            .map(|name| layer(name)[i])
            .sum::<glam::Vec3>();
        assert!(
            (*whole - sum).abs().max_element() <= 1e-5 * whole.max_element().max(1e-3),
            "{whole} against {sum}"
        );
    }
    for name in ["invisible", "depth", "normal", "albedo", "denoising-albedo", "error", "caustic"] {
        assert!(layer(name).iter().any(|rgb| rgb.max_element() > 0.0), "the {name} layer is black");
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    for threads in 1..=3 {
        let arguments =
            format!("render --size 40x40 --passes 2 --threads {threads} --seed 9 -o {threads}.exr");
        assert!(halflight(folder.path(), &arguments).status.success());
    }
    let one = picture(folder.path(), "1.exr").layers;
    assert!(picture(folder.path(), "2.exr").layers == one && picture(folder.path(), "3.exr").layers == one);
}

#[test]
fn an_error_to_reach_ends_the_render_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |error: f64, name: &str| -> f64 {
        let arguments = format!(
            "render builtin:cornell-spheres --illumination local --size 32x32 --error {error} -o {name}"
        );
        assert!(halflight(folder.path(), &arguments).status.success());
        let header = picture(folder.path(), name).header;
        header.get("passes").and_then(halflight::film::Value::as_real).expect("passes")
    };
    // Both beyond the eight passes that every error is judged by.
    let (coarse, fine) = (run(0.03, "a.exr"), run(0.015, "b.exr"));
    // Half the error takes four times the passes.
    assert!((2.5..=6.0).contains(&(fine / coarse)), "{coarse} passes, then {fine}");
}

#[cfg(unix)]
#[test]
fn a_killed_render_leaves_the_last_good_file() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(halflight(folder.path(), "render --size 32x32 --passes 1 -o kept.exr").status.success());
    let before = std::fs::read(folder.path().join("kept.exr")).expect("a file");
    let mut child = Command::new(env!("CARGO_BIN_EXE_halflight"))
        .current_dir(folder.path())
        .args(["render", "builtin:two-spheres", "--size", "2048x2048", "--time", "10m", "-o", "kept.exr"])
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(300));
    child.kill().expect("killed");
    child.wait().expect("it ends");
    let after = std::fs::read(folder.path().join("kept.exr")).expect("a file");
    assert!(after == before || read_exr(&folder.path().join("kept.exr")).is_ok());
}

#[test]
fn plan_says_what_is_left_out_and_why() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = |arguments: &str| {
        let output = halflight(folder.path(), arguments);
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    let local = told("plan builtin:cornell-spheres --illumination local");
    assert!(local.contains("photons:") && local.contains("visibility:"), "{local}");
    let one_bounce = told("plan builtin:cornell-spheres --illumination one-bounce");
    assert!(one_bounce.contains("photons:") && !one_bounce.contains("visibility:"), "{one_bounce}");
    let global = told("plan builtin:cornell-spheres");
    assert!(global.contains("caustic-photons:") && global.contains("visible-half:"), "{global}");
}

#[test]
fn plan_tells_programs_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = halflight(
        folder.path(),
        "plan builtin:cornell-spheres --json --size 64x48 --photons 5000 --seed 3 --layers visible,invisible",
    );
    assert!(output.status.success(), "{}", said(&output));
    let plan: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(plan["size"], serde_json::json!([64, 48]));
    assert_eq!(plan["photons"]["paths"], 5000);
    assert_eq!(plan["scene"]["triangles"], 7948);
    assert!(plan["multiplication_factor"]["at_most"].as_f64().is_some_and(|k| (k - 0.73).abs() < 1e-6));
    assert!(plan["memory_bytes"]["total"].as_u64().is_some_and(|bytes| bytes > 300_000));
    assert!(plan["processor_seconds"]["pass"].as_f64().is_some_and(|seconds| seconds > 0.0));
    let techniques = plan["techniques"].as_array().expect("a list");
    let of: Vec<&str> = techniques.iter().filter_map(|technique| technique["paths"].as_str()).collect();
    assert_eq!(of, ["direct light", "caustics", "inter-reflection", "starts of photons"]);
    let omissions = plan["omissions"].as_array().expect("a list");
    let names: Vec<&str> = omissions.iter().filter_map(|omission| omission["name"].as_str()).collect();
    assert!(names.contains(&"existence") && names.contains(&"visible-half"), "{names:?}");
    for omission in omissions {
        assert!(omission["reason"].as_str().is_some_and(|reason| !reason.is_empty()));
        assert!(
            omission["saves"]["pass_share"].is_f64() && omission["saves"]["bytes"].is_i64(),
            "{omission}"
        );
    }
}

#[test]
fn what_is_kept_by_name_is_not_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let small = "builtin:cornell-spheres --illumination local --size 16x16 --passes 2 --photons 500 --quiet";
    let run = |more: &str| {
        let output = halflight(folder.path(), &format!("render {small} {more}"));
        assert!(output.status.success(), "{}", said(&output));
    };
    run("-o lean.exr");
    run("-o full.exr --keep photons --keep visibility");
    let (lean, full) = (picture(folder.path(), "lean.exr"), picture(folder.path(), "full.exr"));
    let omitted = |image: &Image| image.header.get("omitted").map(ToString::to_string).unwrap_or_default();
    assert!(omitted(&lean).contains("photons") && omitted(&lean).contains("visibility"));
    assert!(!omitted(&full).contains("photons") && !omitted(&full).contains("visibility"));
    assert!(full.header.get("plan").is_some_and(|plan| plan.to_string().contains("500 photon paths a pass")));
    assert!(lean.header.get("plan").is_some_and(|plan| plan.to_string().contains("no photons; left out:")));
    assert_eq!(lean.layer("visible"), full.layer("visible"));
}
