use std::path::Path;
use std::process::{Command, Output};

/// Runs `halflight` with these arguments.
pub fn halflight(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_halflight")).args(arguments).output().expect("the binary runs")
}

/// Runs it and expects it to succeed.
pub fn done(arguments: &[&str]) -> Output {
    let output = halflight(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Runs it and expects one line of complaint and exit code 2.
pub fn refused(arguments: &[&str]) -> String {
    let output = halflight(arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

pub fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// A small and quick comparison; the reference ends as soon as it is good enough.
pub fn small_comparison(folder: &Path, more: &[&str]) -> Output {
    let mut arguments =
        vec!["compare", "builtin:cornell-spheres", "--size", "64x64", "--methods", "photon,path"];
    arguments.extend([
        "--budgets",
        "0.1s,1s",
        "--photons",
        "20000",
        "--reference-time",
        "60s",
        "-o",
        text(folder),
    ]);
    arguments.extend(more);
    done(&arguments)
}

/// Says that something was not tested where a person sees it: what tests print is kept back.
pub fn skipped(why: impl std::fmt::Display) {
    use std::io::Write;
    writeln!(std::io::stderr(), "SKIPPED: {why}").expect("a terminal or a log");
}
