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
fn sets_of_options_compete_under_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let wide = "wide: --indirect-radius 24";
    let few = "few.paths: --method path --samples 1";
    let sizes = ["--size", "48x48", "--budgets", "0.05s,0.3s", "--seeds", "2", "--photons", "20k"];
    let rest = ["--reference-time", "60s", "--quiet", "-o", text(folder.path())];
    let scene = "builtin:cornell-spheres";
    done(&[&["compare", scene, "--variant", wide, "--variant", few][..], &sizes, &rest].concat());
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let json: Value = serde_json::from_str(&read("compare.json")).unwrap();
    assert_eq!(json["methods"], serde_json::json!(["wide", "few.paths"]));
    let runs = json["scenes"][0]["runs"].as_array().unwrap().clone();
    assert_eq!(runs.len(), 2 * 2 * 2, "variants, budgets, seeds");
    for run in &runs {
        let (passes, paths) = (run["passes"].as_u64().unwrap(), run["photon_paths"].as_u64().unwrap());
        let expected = if run["method"] == "wide" { 20_000 * passes } else { 0 };
        assert_eq!(paths, expected, "{run}");
        let samples = run["camera_samples"].as_u64().unwrap();
        assert_eq!(samples, 48 * 48 * passes, "{run}");
    }
    let (svg, page) = (read("compare.svg"), read("compare.html"));
    assert_eq!(svg.matches("<polyline class=\"curve\"").count(), 2);
    assert!(svg.contains("--colour: ") && svg.contains(">few.paths</text>") && page.contains("few.paths"));
}

#[test]
fn variants_that_are_wrong_are_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let with = |variants: &[&str]| {
        let variants: Vec<&str> = variants.iter().flat_map(|variant| ["--variant", variant]).collect();
        refused(&[&["compare", "-o", text(folder.path())][..], &variants].concat())
    };
    let message = with(&["a: --indirect-radius 9", "b: --photns 3"]);
    assert!(message.contains("'b: --photns 3'") && message.contains("'--photns'"), "{message}");
    assert!(with(&["b: --indirect-radius 0"]).contains("no radius"));
    assert!(with(&["b: --samples 3"]).contains("photons take one camera sample"));
    assert!(with(&["b: --keep nothing"]).contains("--keep nothing"));
    assert!(with(&["b: --size 8x8"]).contains("--size is the same for all"));
    assert!(with(&["b: --max-reflections 2"]).contains("--max-reflections is the same for all"));
    assert!(with(&["a:", "a: --photons 9"]).contains("names a twice"));
    assert!(with(&["two words: --photons 9"]).contains("a name has letters"));
    assert!(with(&["Gold", "Silver"]).contains("one at a time"));
    let both = ["compare", "-o", text(folder.path()), "--methods", "path", "--variant", "a: --photons 9"];
    assert!(refused(&both).contains("both say who competes"));
}

#[test]
fn what_is_wrong_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = text(folder.path());
    let with = |more: &[&str]| refused(&[&["compare", "-o", output][..], more].concat());
    assert!(
        with(&["--methods", "photon,pth"])
            .contains("'pth'; the methods are photon, path, path-plain, nearest")
    );
    assert!(with(&["--methods", "path,path"]).contains("twice"));
    assert!(with(&["builtin:nothing"]).contains("no such scene"));
    assert!(with(&["--reference", "not-there.exr"]).contains("not-there.exr"));
    assert!(with(&["a.glb", "b.glb", "--reference", "not-there.exr"]).contains("one at a time"));
}
