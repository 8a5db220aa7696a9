use crate::support::{done, refused, small_comparison, text};
use serde_json::Value;
use std::fs;

#[test]
fn a_small_comparison_writes_its_files_and_takes_the_reference_up_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let read = |name: &str| fs::read_to_string(file(name)).unwrap();
    let first = small_comparison(folder.path(), &[]);
    let said = String::from_utf8_lossy(&first.stderr).into_owned();
    assert!(said.contains("reference by path") && said.contains("kept in"), "{said}");

    let csv = read("compare.csv");
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    for name in
        ["scene", "method", "seed", "budget", "seconds", "setup_seconds", "passes", "photon_paths", "relmse"]
    {
        assert!(names.contains(&name), "{name} in {names:?}");
    }
    for name in ["camera_samples", "rmse", "bias", "e_pixel", "mean_colour", "flip", "mask_share"] {
        assert!(names.contains(&name), "{name} in {names:?}");
    }
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 2 * 2 * 5, "methods, budgets, seeds");
    assert!(rows.iter().all(|row| row.len() == names.len()));
    let column = |row: &[&str], name: &str| -> f64 {
        row[names.iter().position(|n| *n == name).unwrap()].parse().unwrap()
    };
    for row in &rows {
        assert!(column(row, "seconds") >= column(row, "budget"));
        assert!(column(row, "setup_seconds") > 0.0 && column(row, "relmse") > 0.0);
    }

    let json: Value = serde_json::from_str(&read("compare.json")).unwrap();
    let scene = &json["scenes"][0];
    assert_eq!(scene["runs"].as_array().unwrap().len(), rows.len());
    let share = scene["mask"]["share"].as_f64().unwrap();
    assert!(share > 0.0 && share < 0.5, "the lamp is seen: {share}");
    for curve in scene["curves"].as_array().unwrap() {
        let slope = &curve["slope"];
        let of = |name: &str| slope[name].as_f64().unwrap();
        assert!(of("value").is_finite() && of("low") <= of("high"), "{curve}");
    }
    let pair = &scene["pairs"][0];
    assert_eq!((pair["a"].as_str(), pair["b"].as_str()), (Some("photon"), Some("path")));
    assert!(pair["error_ratio"]["value"].as_f64().unwrap() > 0.0);
    let svg = read("compare.svg");
    assert_eq!(svg.matches("<polyline class=\"curve\"").count(), 2);
    let page = read("compare.html");
    assert!(page.len() < 8 << 20 && !page.contains("src=\"http") && !page.contains("href=\"http"));
    let reference =
        || fs::read_dir(file("cache")).unwrap().map(|entry| entry.unwrap().path()).collect::<Vec<_>>();
    assert_eq!(reference().len(), 1);

    let second = small_comparison(folder.path(), &["--seeds", "2"]);
    let said = String::from_utf8_lossy(&second.stderr).into_owned();
    assert!(said.contains("taken up from"), "{said}");
    assert_eq!(reference().len(), 1);
}

#[test]
fn a_reference_has_as_many_samples_as_the_runs_it_judges() {
    // Of paths against paths: three fifths of a run's passes would do for the noise.
    let folder = tempfile::tempdir().unwrap();
    done(&[
        "compare",
        "builtin:cornell-spheres",
        "--size",
        "64x64",
        "--methods",
        "path",
        "--budgets",
        "3s",
        "--seeds",
        "2",
        "--reference-method",
        "path",
        "--reference-time",
        "12s",
        "-o",
        text(folder.path()),
    ]);
    let json: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("compare.json")).unwrap()).unwrap();
    let scene = &json["scenes"][0];
    let passes = |of: &Value| of["passes"].as_u64().unwrap();
    let reference = passes(&scene["reference"]);
    for run in scene["runs"].as_array().unwrap() {
        assert!(passes(run) <= reference, "{reference} passes judge {}", passes(run));
    }
}

#[test]
fn a_reference_that_proves_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (noisy, bare, out) =
        (folder.path().join("noisy.exr"), folder.path().join("bare.exr"), folder.path().join("out"));
    let scene = "builtin:cornell-spheres";
    let render =
        ["render", scene, "--size", "48x48", "--method", "path", "--passes", "3", "--quiet", "--seed", "9"];
    done(&[&render[..], &["-o", text(&noisy)]].concat());
    done(&[&render[..], &["--layers", "visible", "-o", text(&bare)]].concat());
    let against = |reference: &str, size: &str, scene: &str| {
        let common = ["--budgets", "0.05s,0.1s", "--seeds", "2", "--quiet", "--photons", "5000"];
        let rest = ["--methods", "photon,path", "--size", size, "--reference", reference, "-o", text(&out)];
        refused(&[&["compare", scene][..], &common, &rest].concat())
    };
    let message = against(text(&noisy), "48x48", scene);
    assert!(message.contains("10 times below") && message.contains("more passes"), "{message}");
    assert!(out.join("compare.csv").exists(), "the raw runs are kept");
    assert!(!out.join("compare.html").exists() && !out.join("compare.svg").exists());
    let message = against(text(&bare), "48x48", scene);
    assert!(message.contains("layer `error`"), "{message}");
    let message = against(text(&noisy), "32x48", scene);
    assert!(message.contains("--size 48x48"), "{message}");
    let message = against(text(&noisy), "48x48", "builtin:caustic-box");
    assert!(message.contains("another scene"), "{message}");
}

#[test]
fn what_is_wrong_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = text(folder.path());
    let with = |more: &[&str]| refused(&[&["compare", "-o", output][..], more].concat());
    assert!(with(&["--methods", "photon,pth"]).contains("'pth'; the methods are photon, path, path-plain"));
    assert!(with(&["--methods", "path,path"]).contains("twice"));
    assert!(with(&["builtin:nothing"]).contains("no such scene"));
    assert!(with(&["--reference", "not-there.exr"]).contains("not-there.exr"));
    assert!(with(&["a.glb", "b.glb", "--reference", "not-there.exr"]).contains("one at a time"));
}
