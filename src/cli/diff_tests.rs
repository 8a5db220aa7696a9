//! What `halflight diff` promises: figures, masks, limits, and one-line errors.

use super::diff::{DiffArgs, Report, Verdict, measure, run};
use crate::error::Error;
use crate::film::{Header, Image, read_exr, write_image_exr};
use clap::{Args, FromArgMatches};
use glam::Vec3;
use std::path::PathBuf;
use tempfile::TempDir;

const SIDE: u32 = 16;

fn image(value: impl Fn(usize) -> Vec3) -> Image {
    let plane: Vec<Vec3> = (0..(SIDE * SIDE) as usize).map(value).collect();
    let lamp = plane.iter().map(|v| if v.x > 5.0 { *v } else { Vec3::ZERO }).collect();
    let layers = vec![("visible".into(), plane.clone()), ("emitted".into(), lamp), ("depth".into(), plane)];
    Image { width: SIDE, height: SIDE, layers, header: Header::new() }
}

/// A ramp with a lamp of 10 in one pixel.
fn scene(i: usize) -> Vec3 {
    if i == 40 { Vec3::splat(10.0) } else { Vec3::splat(0.1 + i as f32 / 512.0) }
}

struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new(picture: impl Fn(usize) -> Vec3) -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        write_image_exr(&bench.path("a.exr"), &image(picture)).unwrap();
        write_image_exr(&bench.path("b.exr"), &image(scene)).unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn args(&self, more: &str) -> DiffArgs {
        let command = DiffArgs::augment_args(clap::Command::new("diff"));
        let words = ["diff".into(), self.path("a.exr"), self.path("b.exr")];
        let more = more.split_whitespace().map(PathBuf::from);
        DiffArgs::from_arg_matches(&command.try_get_matches_from(words.into_iter().chain(more)).unwrap())
            .unwrap()
    }

    fn report(&self, more: &str) -> Report {
        measure(&self.args(more)).unwrap()
    }

    fn refusal(&self, more: &str) -> Error {
        let error = measure(&self.args(more)).unwrap_err();
        assert!(!error.to_string().contains('\n') && error.exit_code() == 2, "{error}");
        error
    }
}

#[test]
fn the_layers_both_have_are_compared_and_printed_in_a_table() {
    let bench = Bench::new(|i| 1.02 * scene(i));
    let report = bench.report("--hdr-flip");
    let names: Vec<&str> = report.layers.iter().map(|l| l.layer.as_str()).collect();
    assert_eq!(names, ["visible", "emitted", "depth"]);
    let visible = &report.layers[0];
    assert!((visible.metrics.relative_bias.unwrap() - 0.02).abs() < 1e-6);
    assert!(visible.flip.is_some_and(|e| e > 0.0) && visible.hdr_flip.is_some());
    // A depth is one number: its error is that of the number, not a third of it, and it has no FLIP.
    let depth = &report.layers[2];
    assert_eq!((depth.metrics.rmse, depth.flip), (visible.metrics.rmse, None));
    let text = report.text();
    let table: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(table.len(), 4, "{text}");
    assert!(table.iter().all(|line| line.len() == table[0].len()), "{text}");
    let json: serde_json::Value = serde_json::from_str(&report.json()).unwrap();
    assert_eq!(json["layers"][0]["layer"], "visible");
    assert!((json["layers"][0]["relative_bias"].as_f64().unwrap() - 0.02).abs() < 1e-6);
}

#[test]
fn masks_leave_out_luminaires_and_their_surroundings() {
    let wrong_at_the_lamp = |i: usize| if [40, 41].contains(&i) { Vec3::splat(20.0) } else { scene(i) };
    let bench = Bench::new(wrong_at_the_lamp);
    assert!(bench.report("").layers[0].metrics.rmse > 1.0);
    for mask in ["--mask-above 5", "--mask-emitted"] {
        let report = bench.report(mask);
        assert_eq!(report.layers[0].metrics.masked, 1);
        assert!(report.layers[0].metrics.rmse > 1.0);
        let report = bench.report(&format!("{mask} --dilate 1"));
        assert_eq!((report.layers[0].metrics.masked, report.layers[0].metrics.rmse), (9, 0.0));
        assert_eq!(report.layers[0].flip, Some(0.0));
        assert!(report.text().contains("left out: 9 of 256 pixels"), "{}", report.text());
    }
    let error = bench.refusal("--mask-above 5 --dilate 99").to_string();
    assert!(error.contains("no pixel"), "{error}");
}

#[test]
fn limits_decide_the_exit_code() {
    let bench = Bench::new(|i| 1.02 * scene(i));
    let kept = bench.args("--fail-above relmse=0.001 --fail-above relative-bias=0.021 --layer visible");
    assert_eq!(run(&kept).unwrap(), Verdict::Within);
    let broken = bench.args("--fail-above relmse=0.001 --fail-above relative-bias=0.019 --json");
    assert_eq!(run(&broken).unwrap().exit_code(), 1);
    let report = measure(&broken).unwrap();
    assert_eq!(report.exceeded, ["visible: relative-bias 0.02000 is above 0.019"]);
    assert!(report.text().ends_with("is above 0.019\n"));
}

#[test]
fn a_lost_pixel_is_said_and_keeps_no_limit() {
    let bench = Bench::new(|i| if i == 3 { Vec3::NAN } else { scene(i) });
    let report = bench.report("--fail-above relmse=1e9");
    assert_eq!(report.exceeded.len(), 1);
    assert!(report.text().contains("visible: pixels not finite, and in no figure: 1;"), "{}", report.text());
}

#[test]
fn what_is_wrong_is_named() {
    let bench = Bench::new(scene);
    for (more, expected) in [
        ("--layer glow", "has no layer 'glow'; it has visible, "),
        ("--fail-above psnr=3", "no metric 'psnr'; the metrics are rmse, relmse"),
        ("--fail-above relmse", "write METRIC=X"),
        ("--fail-above relmse=-1", "not a number from 0 up"),
        ("--fail-above relmse=NaN", "not a number from 0 up"),
        ("--layer depth --fail-above flip=1", "has no flip"),
        ("-o error.jpg", "is .exr or .png"),
        ("-o /no/such/folder/error.png", "cannot write"),
    ] {
        let error = bench.refusal(more).to_string();
        assert!(error.contains(expected), "{more}: {error}");
    }
    let small =
        Image { width: 1, height: 1, layers: vec![("glow".into(), vec![Vec3::ONE])], header: Header::new() };
    write_image_exr(&bench.path("b.exr"), &small).unwrap();
    assert!(bench.refusal("").to_string().contains("16 x 16 pixels, but"));
    write_image_exr(&bench.path("a.exr"), &small).unwrap();
    assert!(bench.refusal("--mask-above 1").to_string().contains("needs its layer 'visible'"));
    assert_eq!(bench.report("").layers[0].metrics.rmse, 0.0);
    std::fs::remove_file(bench.path("b.exr")).unwrap();
    assert!(matches!(bench.refusal(""), Error::Read { .. }));
}

#[test]
fn the_error_picture_shows_where() {
    let bench = Bench::new(|i| if i < 128 { scene(i) } else { 1.1 * scene(i) });
    let (exr, png) = (bench.path("error.exr"), bench.path("error.png"));
    for path in [&exr, &png] {
        measure(&DiffArgs { output: Some(path.clone()), ..bench.args("--mask-emitted") }).unwrap();
    }
    let error = read_exr(&exr).unwrap();
    let signed = error.layer("visible").unwrap();
    assert_eq!((signed[0], signed[40]), (Vec3::ZERO, Vec3::ZERO));
    assert!((signed[255].x - 0.1).abs() < 1e-3);
    assert!((error.layer("difference").unwrap()[255].x - 0.1 * scene(255).x).abs() < 1e-6);
    assert_eq!(std::fs::read(&png).unwrap()[1..4], *b"PNG");
}
