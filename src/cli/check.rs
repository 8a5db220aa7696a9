use super::check_page::page;
use super::out::print;
use super::output::refuse_input;
use super::scene_args::{AroundArgs, SceneArgs};
use super::settings_args::whole;
use crate::error::{Error, Result};
use crate::scene::{MAX_TRIANGLES, Pose};
use crate::stability::{Case, Check, Effort, Outcome, cases, scene_check::check_scene};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

#[derive(Args)]
pub struct CheckArgs {
    /// A scene to check. Without one: the built-in suite of stiff and extreme cases.
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    /// Which scene of a file that has several, as for render.
    #[arg(id = "scene-of-file", long = "scene", value_name = "NAME|N", requires = "scene")]
    scene_of_file: Option<String>,

    /// Which camera sees the scene, as for render.
    #[arg(long, value_name = "NAME|N", requires = "scene")]
    camera: Option<String>,

    /// A moment of an animation, as for render.
    #[arg(long, value_name = "[NAME:]SECONDS", allow_negative_numbers = true, requires = "scene")]
    pose: Option<Pose>,

    /// Which variant of its materials, as for render.
    #[arg(long, value_name = "NAME|N", requires = "scene")]
    variant: Option<String>,

    /// Illumination over the whole scene, as for render.
    #[arg(long, value_name = "NAME|S,T", requires = "scene")]
    illumination: Option<String>,

    /// Illumination of one material, as for render; may be repeated.
    #[arg(long, value_name = "MATERIAL=…", requires = "scene")]
    set: Vec<String>,

    #[command(flatten)]
    around: AroundArgs,

    /// The most triangles that the scene may have, every instance counted.
    #[arg(long, value_name = "N", default_value_t = MAX_TRIANGLES, value_parser = whole::<u64>)]
    max_triangles: u64,

    /// Cases of the suite whose name contains this.
    #[arg(long, value_name = "NAME", conflicts_with = "scene")]
    case: Option<String>,

    /// Leave out the settings that take longest.
    #[arg(long, conflicts_with = "scene")]
    quick: bool,

    /// Print the table as JSON.
    #[arg(long)]
    json: bool,

    /// Also write the table as one HTML page.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,

    /// Also write the table as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// Exit code 1 where a promise is not kept.
pub fn run(args: CheckArgs) -> Result<ExitCode> {
    let begin = Instant::now();
    let outcomes = match &args.scene {
        Some(scene) => {
            let scene_args = SceneArgs {
                scene: scene.clone(),
                scene_of_file: args.scene_of_file.clone(),
                camera: args.camera.clone(),
                pose: args.pose.clone(),
                variant: args.variant.clone(),
                illumination: args.illumination.clone(),
                set: args.set.clone(),
                around: args.around.clone(),
                max_triangles: args.max_triangles,
            };
            let loaded = scene_args.load_with_files()?;
            args.html.iter().chain(&args.csv).try_for_each(|path| refuse_input(path, &loaded.files))?;
            check_scene(&loaded.scene, |outcome| tell(&args, || text(outcome)))?
        }
        None if args.around.says_something() => {
            let why = "the suite has skies of its own; name a scene for --environment and what belongs to it";
            return Err(Error::Usage(why.into()));
        }
        None => suite(&args)?,
    };
    let seconds = begin.elapsed().as_secs_f64();
    if args.json {
        print(&format!("{}\n", json(&outcomes)))?;
    }
    if let Some(path) = &args.csv {
        write(path, csv(&outcomes))?;
    }
    if let Some(path) = &args.html {
        write(path, page(&table(&outcomes)))?;
    }
    let failed = rows(&outcomes).filter(|(_, check)| !check.passes()).count();
    if !args.json {
        print(&format!("{} rows, {failed} failed, in {seconds:.1} s\n", rows(&outcomes).count()))?;
    }
    Ok(ExitCode::from(u8::from(failed > 0)))
}

/// Whole lines, which standard output hands on at once; with --json it holds nothing else.
fn tell(args: &CheckArgs, lines: impl FnOnce() -> String) {
    if !args.json {
        // Where it cannot be written, the last line says so.
        let _ = print(&lines());
    }
}

fn suite(args: &CheckArgs) -> Result<Vec<Outcome>> {
    let wanted = args.case.as_deref().unwrap_or("");
    let chosen: Vec<_> = cases().into_iter().filter(|case| case.name.contains(wanted)).collect();
    if chosen.is_empty() {
        let known: Vec<_> = cases().iter().map(|case| case.name).collect();
        return Err(Error::Usage(format!(
            "--case {wanted}: there is no such case; there are {}",
            known.join(", ")
        )));
    }
    let effort = if args.quick { Effort::Quick } else { Effort::Full };
    let run = |case: Case| {
        tell(args, || heading(case.name, case.promise));
        let outcome = case.outcome(effort, |check| tell(args, || line(check)));
        tell(args, || time(&outcome));
        outcome
    };
    Ok(chosen.into_iter().map(run).collect())
}

fn rows(outcomes: &[Outcome]) -> impl Iterator<Item = (&Outcome, &Check)> {
    outcomes.iter().flat_map(|outcome| outcome.checks.iter().map(move |check| (outcome, check)))
}

fn expected_and_got(check: &Check) -> [String; 2] {
    match check {
        Check::Number { expected, got, error, .. } if *error > 0.0 => {
            [number(*expected), format!("{} ± {}", number(*got), number(*error))]
        }
        Check::Number { expected, got, .. } => [number(*expected), number(*got)],
        Check::Fact { expected, got, .. } => [expected.clone(), got.clone()],
    }
}

fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e7).contains(&x.abs()) { format!("{x:.5}") } else { format!("{x:.4e}") }
}

fn z(check: &Check) -> String {
    check.z().map_or(String::new(), |z| format!("{z:.2}"))
}

fn relative(check: &Check) -> String {
    check.relative_error().map_or(String::new(), |error| format!("{error:+.1e}"))
}

fn verdict(check: &Check) -> &'static str {
    if check.passes() { "pass" } else { "FAIL" }
}

fn text(outcome: &Outcome) -> String {
    let lines: String = outcome.checks.iter().map(line).collect();
    heading(&outcome.name, &outcome.promise) + &lines + &time(outcome)
}

fn heading(name: &str, promise: &str) -> String {
    format!("{name}: {promise}\n")
}

fn line(check: &Check) -> String {
    let [expected, got] = expected_and_got(check);
    let measures = match check {
        Check::Number { .. } => format!("  z {}  off {}", z(check), relative(check)),
        Check::Fact { .. } => String::new(),
    };
    format!("  {}  {:<32} expected {expected}, got {got}{measures}\n", verdict(check), check.what())
}

fn time(outcome: &Outcome) -> String {
    format!("  {:.1} s\n", outcome.seconds)
}

/// Of the table, as CSV names them.
pub const COLUMNS: [&str; 9] =
    ["case", "promise", "what", "expected", "got", "z", "relative_error", "seconds", "verdict"];

fn fields(outcome: &Outcome, check: &Check) -> [String; 9] {
    let [expected, got] = expected_and_got(check);
    [
        outcome.name.clone(),
        outcome.promise.clone(),
        check.what().into(),
        expected,
        got,
        z(check),
        relative(check),
        format!("{:.2}", outcome.seconds),
        verdict(check).into(),
    ]
}

fn table(outcomes: &[Outcome]) -> Vec<[String; 9]> {
    rows(outcomes).map(|(outcome, check)| fields(outcome, check)).collect()
}

fn csv(outcomes: &[Outcome]) -> String {
    let quoted = |field: &String| format!("\"{}\"", field.replace('"', "\"\""));
    let mut text = COLUMNS.join(",") + "\n";
    for fields in table(outcomes) {
        text += &(fields.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

fn json(outcomes: &[Outcome]) -> serde_json::Value {
    let row = |(outcome, check): (&Outcome, &Check)| {
        let mut row = serde_json::json!({
            "case": outcome.name, "promise": outcome.promise, "what": check.what(), "seconds": outcome.seconds,
            "z": check.z(), "relative_error": check.relative_error(), "pass": check.passes(),
        });
        match check {
            Check::Number { expected, got, error, .. } => {
                row["expected"] = (*expected).into();
                row["got"] = (*got).into();
                row["error"] = (*error).into();
            }
            Check::Fact { expected, got, .. } => {
                row["expected"] = expected.as_str().into();
                row["got"] = got.as_str().into();
            }
        }
        row
    };
    rows(outcomes).map(row).collect()
}

fn write(path: &Path, text: String) -> Result<()> {
    std::fs::write(path, text).map_err(|why| Error::Write { path: path.into(), reason: why.to_string() })
}
