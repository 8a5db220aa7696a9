//! The page in a real browser.

use crate::browser::chromium;
use crate::support::skipped;
use crate::support::{small_comparison, text};
use std::path::Path;
use std::process::Command;

/// Opens the page (`at`: what follows its address) in a window of its own profile, and returns what the browser printed.
pub fn open(browser: &Path, page: &Path, at: &str, dark: bool, more: &[&str]) -> String {
    let profile = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]);
    command.args(["--disable-background-networking", "--disable-component-update", "--disable-sync"]);
    command.args(["--hide-scrollbars", "--window-size=1280,1800", "--virtual-time-budget=20000"]);
    command.arg(format!("--user-data-dir={}", text(profile.path())));
    if dark {
        command.args(["--force-dark-mode", "--blink-settings=preferredColorScheme=0"]);
    }
    let output = command.args(more).arg(format!("file://{}{at}", text(page))).output().expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn the_page_draws_its_curves_and_pictures_without_errors() {
    let Some(browser) = chromium() else {
        skipped("no Chromium here, so compare.html was not opened; install it or set CHROMIUM");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    small_comparison(folder.path(), &["--illumination", "global", "--illumination", "one-bounce"]);
    let page = folder.path().join("compare.html");
    let dom = open(&browser, &page, "", false, &["--dump-dom"]);
    let opening = dom.find("<html").map_or("", |at| &dom[at..at + dom[at..].find('>').unwrap_or(0)]);
    for marker in ["data-ready=\"1\"", "data-errors=\"0\"", "data-curves=\"4\"", "data-pictures=\"6\""] {
        assert!(opening.contains(marker), "{marker} in {opening}");
    }
    // Tables are filled, and by numbers.
    assert_eq!(dom.matches("<span class=\"name photon\">photon</span> against").count(), 2);
    for table in dom.split("<table").skip(1).filter_map(|rest| rest.split("</table>").next()) {
        assert!(!table.contains("NaN") && !table.contains("undefined"), "{table}");
    }
    for dark in [false, true] {
        let picture = folder.path().join(format!("page-{dark}.png"));
        open(&browser, &page, "", dark, &[&format!("--screenshot={}", text(&picture))]);
        let size = std::fs::metadata(&picture).unwrap().len();
        assert!(size > 20_000, "a screenshot of {size} bytes shows nothing");
    }
}
