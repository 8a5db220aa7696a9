//! What leaving out is worth: the table of `docs/omissions.md`, as Markdown.
//!
//! `cargo run --release --example omissions` renders each scene with and without one omission (or all), in turns, and
//! prints the processor time of a pass, medians. `-- NAME …` prints some rows only.

use cpu_time::ProcessTime;
use halflight::film::{Film, Layer};
use halflight::plan::{Frame, Omittable, Plan, Settings};
use halflight::render::{learn, render_pass};
use halflight::scene::Scene;
use omission_scenes::{Row, What, rows};

#[path = "../benches/omission_scenes.rs"]
mod omission_scenes;

/// Passes with and without, in turns: times are their medians, errors their spread.
const PASSES: u32 = 15;

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    println!("| left out | scene | pass with | without | ratio | to equal error | why it is exact |");
    println!("|---|---|---|---|---|---|---|");
    for row in rows() {
        let name = row.what.name();
        if asked.is_empty() || asked.iter().any(|asked| asked == name) {
            println!("{}", measured(name, &row));
        }
    }
}

fn measured(name: &str, row: &Row) -> String {
    let settings = Settings { width: 256, height: 256, paths: Some(65_536), ..Settings::default() };
    let with = match row.what {
        What::One(what) => Settings { keep: vec![what], ..settings.clone() },
        What::Everything => Settings { keep_everything: true, ..settings.clone() },
    };
    let (given, again) = ((row.make)(), (row.make)());
    let (lean_planning, lean) = timed(|| planned(given, settings));
    let (full_planning, full) = timed(|| planned(again, with));
    assert!(
        matches!(row.what, What::Everything) || lean.0.omissions.iter().any(|omission| omission.name == name)
    );
    if matches!(row.what, What::One(Omittable::Existence)) {
        let [full, lean] =
            [full_planning, lean_planning].map(|seconds| format!("{:.1} ms once", 1e3 * seconds));
        return format!("| {name} | {} | {full} | {lean} | | | {} |", row.scene, row.why);
    }
    let pass = |(plan, frame): &(Plan, Frame), pass: u32| {
        timed(|| render_pass(plan, frame, pass, &[Layer::Visible, Layer::Bias]).0)
    };
    let (mut lean_times, mut full_times, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    let mut films = [(); 2].map(|()| Film::new(256, 256, &[Layer::Visible]));
    for n in 0..PASSES {
        let (a, lean_image) = pass(&lean, n);
        let (b, full_image) = pass(&full, n);
        films[0].add(&lean_image);
        films[1].add(&full_image);
        lean_times.push(a);
        full_times.push(b);
        ratios.push(b / a);
    }
    // Noise falls as the root of time; bias is the same with and without.
    let noise = films.map(|film| film.relative_error().expect("several passes"));
    let ratio = median(ratios);
    let milliseconds = |times: Vec<f64>| format!("{:.1} ms", 1e3 * median(times));
    format!(
        "| {name} | {} | {} | {} | {ratio:.2} | {:.2} | {} |",
        row.scene,
        milliseconds(full_times),
        milliseconds(lean_times),
        ratio * (noise[1] / noise[0]).powi(2),
        row.why
    )
}

fn planned(scene: Scene, settings: Settings) -> (Plan, Frame) {
    let plan = Plan::new(scene, settings);
    let frame = learn(&plan);
    (plan, frame)
}

fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begin = ProcessTime::now();
    let made = work();
    (begin.elapsed().as_secs_f64(), made)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
