//! How renders end before they are complete, and what breaks around them.

#![cfg(unix)]

use crate::support::skipped;
use crate::{halflight, said};
use halflight::film::{Value, read_exr};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn command(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_halflight"));
    command.current_dir(folder).args(arguments.split_whitespace());
    command
}

fn send(signal: &str, child: &Child) {
    let status = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
    assert!(status.success());
}

/// Starts a render and sends a signal when it has said a line with `word` in it; its exit code and all that it said.
fn interrupted(folder: &Path, arguments: &str, word: &str, signals: &[&str]) -> (Option<i32>, String) {
    let mut child = command(folder, arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    while !said.lines().last().is_some_and(|line| line.contains(word)) {
        assert!(lines.read_line(&mut said).expect("text") > 0, "it ended: {said}");
    }
    signals.iter().for_each(|signal| send(signal, &child));
    lines.read_to_string(&mut said).expect("text");
    (child.wait().expect("it ends").code(), said)
}

/// As below `nohup`.
fn hang_up_is_ignored_here() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

const SMALL: &str = "render builtin:cornell-spheres --size 32x32 --photons 2000 --time 10m -o cut.exr";

#[test]
fn an_interrupted_render_says_so_writes_the_picture_and_has_the_exit_code_of_the_signal() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        if signal == "-HUP" && hang_up_is_ignored_here() {
            skipped("a hang-up is ignored by whoever started this test, and so by what it starts");
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let (exit, said) = interrupted(folder.path(), SMALL, "1 pass", &[signal]);
        assert_eq!(exit, Some(code), "{said}");
        assert!(said.contains("interrupted: the picture so far") && said.contains("wrote cut.exr"), "{said}");
        let picture = read_exr(&folder.path().join("cut.exr")).expect("a picture");
        let passes = picture.header.get("passes").and_then(Value::as_real).expect("passes");
        assert!(passes >= 1.0);
    }
}

#[test]
fn a_pass_under_way_is_dropped() {
    let folder = tempfile::tempdir().expect("a folder");
    // A pass of some seconds; the first is over when it says so.
    let long = "render builtin:cornell-spheres --size 64x64 --photons 3000000 --passes 100 -o cut.exr";
    let (exit, said) = interrupted(folder.path(), long, "1 pass", &["-INT"]);
    assert_eq!(exit, Some(130), "{said}");
    let cut = read_exr(&folder.path().join("cut.exr")).expect("a picture");
    let passes = cut.header.get("passes").map(ToString::to_string).expect("passes");
    let whole = format!("{} --passes {passes} -o whole.exr", long.replace("--passes 100 -o cut.exr", ""));
    assert!(halflight(folder.path(), &whole).status.success());
    let whole = read_exr(&folder.path().join("whole.exr")).expect("a picture");
    assert!(cut.layers == whole.layers, "the picture of {passes} passes is another");
}

#[test]
fn before_the_first_pass_is_complete_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = "render builtin:cornell-spheres --photons 100000000 --passes 1 -o cut.exr";
    let begin = Instant::now();
    let (exit, said) = interrupted(folder.path(), long, "photon paths a pass", &["-TERM"]);
    assert_eq!(exit, Some(143), "{said}");
    assert!(said.contains("interrupted before the first pass was complete: nothing was written"), "{said}");
    assert!(begin.elapsed() < Duration::from_secs(60), "it went on");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn nohup_keeps_a_render_going() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut render = Command::new("nohup");
    render.arg(env!("CARGO_BIN_EXE_halflight")).current_dir(folder.path());
    render.args(["render", "--size", "32x32", "--photons", "1000", "--passes", "40", "-o", "kept.exr"]);
    let mut child =
        render.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("nohup");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    while !said.contains("1 pass") {
        assert!(lines.read_line(&mut said).expect("text") > 0, "it ended: {said}");
    }
    send("-HUP", &child);
    lines.read_to_string(&mut said).expect("text");
    let status = child.wait().expect("it ends");
    assert!(status.success() && status.signal().is_none(), "{status}: {said}");
    assert!(said.contains("40 passes") && !said.contains("interrupted"), "{said}");
}

#[test]
fn passes_are_made_small_enough_for_the_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = "render builtin:cornell-spheres --size 32x32 --photons 60000000 --time 4s -o a.exr";
    let output = halflight(folder.path(), arguments);
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("photon paths (not 60000000) keep to --time"), "{}", said(&output));
    let header = read_exr(&folder.path().join("a.exr")).expect("a picture").header;
    let fact = |name: &str| header.get(name).and_then(Value::as_real).expect(name);
    assert!(fact("paths_per_pass") < 3e7 && fact("passes") >= 2.0, "{}", said(&output));
}

#[test]
fn a_log_that_breaks_does_not_end_a_render() {
    let folder = tempfile::tempdir().expect("a folder");
    let render = "render --size 16x16 --photons 500 --passes 30 -o a.exr";
    let full = || File::options().write(true).open("/dev/full").expect("a full device");
    let is_whole = || {
        let header = read_exr(&folder.path().join("a.exr")).expect("a picture").header;
        assert_eq!(header.get("passes").and_then(Value::as_real), Some(30.0));
        std::fs::remove_file(folder.path().join("a.exr")).expect("there");
    };
    if cfg!(target_os = "linux") {
        assert!(command(folder.path(), render).stderr(full()).status().expect("a status").success());
        is_whole();
        // Errors keep their exit code.
        let wrong = command(folder.path(), "render nowhere.glb").stderr(full()).status();
        assert_eq!(wrong.expect("a status").code(), Some(2));
    }
    let mut child = command(folder.path(), render).stderr(Stdio::piped()).spawn().expect("it starts");
    drop(child.stderr.take());
    assert!(child.wait().expect("it ends").success());
    is_whole();
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_is_lost_is_an_error_and_a_pipe_that_is_closed_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = "plan builtin:cornell-spheres --illumination one-bounce --size 16x16";
    let json = format!("{plan} --json");
    for arguments in [plan, &json, "--help", "render --help", "--version"] {
        let full = File::options().write(true).open("/dev/full").expect("a full device");
        let output = command(folder.path(), arguments).stdout(full).output().expect("it starts");
        assert_eq!(output.status.code(), Some(2), "{arguments}: {}", said(&output));
        assert_eq!(said(&output).lines().count(), 1, "{arguments}: {}", said(&output));
        assert!(said(&output).contains("standard output: cannot write"), "{arguments}: {}", said(&output));
        let mut child = command(folder.path(), arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success() && said(&output).is_empty(), "{arguments}: {}", said(&output));
    }
}

#[test]
fn many_more_threads_than_processors_are_not_started() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = halflight(folder.path(), "render --size 16x16 --photons 500 --passes 1 --threads 1000");
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("note: --threads 1000: for "), "{}", said(&output));
}

#[cfg(target_os = "linux")]
#[test]
fn what_does_not_fit_into_memory_is_refused_before_it_is_taken() {
    let folder = tempfile::tempdir().expect("a folder");
    for (limit, arguments) in [
        ("-v 4000000", "render --size 12000x12000 -o a.exr"),
        ("-v 4000000", "render --size 65536x65536 -o a.exr"),
        ("-v 4000000", "render --size 65536x65536 --method path -o a.exr"),
        (
            "-v 4000000",
            "render builtin:cornell-spheres --size 3000x3000 --atlas --illumination local -o a.exr",
        ),
    ] {
        let program = env!("CARGO_BIN_EXE_halflight");
        let line = format!("ulimit {limit}; exec {program} {arguments} --threads 2");
        let output = Command::new("sh").args(["-c", &line]).current_dir(folder.path()).output().expect("sh");
        assert_eq!(output.status.code(), Some(2), "{arguments}: {}", said(&output));
        assert_eq!(said(&output).lines().count(), 1, "{}", said(&output));
        assert!(said(&output).contains("GB of memory and ulimit -v leaves"), "{}", said(&output));
    }
    // It would tell before.
    let output = halflight(
        folder.path(),
        "plan builtin:cornell-spheres --size 65536x65536 --atlas --illumination local",
    );
    let plan = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && plan.contains(", atlas "), "{plan} {}", said(&output));
    assert!(plan.contains("refused: this render takes about"), "{plan}");
}
