//! `halflight check`.

use crate::{halflight, said};

#[test]
fn check_prints_cases_with_their_rows_and_the_time_of_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = halflight(folder.path(), "check --case grazing --csv table.csv --html page.html");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<_> = text.lines().collect();
    assert!(lines[0].starts_with("grazing: parallel light"), "{text}");
    assert_eq!(lines.iter().filter(|line| line.starts_with("  pass  ")).count(), 5, "{text}");
    let last =
        lines[lines.len() - 1].strip_prefix("5 rows, 0 failed, in ").and_then(|rest| rest.strip_suffix(" s"));
    assert!(last.is_some_and(|seconds| seconds.parse::<f64>().is_ok()), "{text}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file of that name");
    assert_eq!(read("table.csv").lines().count(), 6);
    let page = read("page.html");
    assert!(page.contains("1 case, 5 rows: <b class=\"pass\">all pass</b>"), "{page}");
    assert_eq!(page.matches("<td class=\"pass\">pass</td>").count(), 5, "{page}");
}

#[test]
fn with_json_nothing_else_is_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = halflight(folder.path(), "check --case grazing --json");
    let rows: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    assert_eq!(rows.as_array().map(Vec::len), Some(5), "{rows}");
}
