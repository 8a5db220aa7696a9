//! Imports run one way: a module uses those that stand before it in the order of src/lib.rs, and no other.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Files of Rust under a folder, but those of tests; or the one file.
pub fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    if folder.is_file() {
        found.push(folder.into());
        return;
    }
    for entry in fs::read_dir(folder).expect("a folder of sources").flatten() {
        let path = entry.path();
        let name = path.file_stem().and_then(|name| name.to_str()).expect("a name").to_owned();
        let of_tests = name == "tests" || name.ends_with("_tests");
        match path.is_dir() {
            _ if of_tests => {}
            true => sources(&path, found),
            false => found.extend(path.extension().is_some_and(|ending| ending == "rs").then_some(path)),
        }
    }
}

/// The modules as src/lib.rs orders them: words of the block after "Imports run".
fn order(lib: &str) -> Vec<String> {
    let block = lib.split("Imports run").nth(1).and_then(|rest| rest.split("```").nth(1)).expect("an order");
    let words = block.trim_start_matches("text").split(|c: char| !(c.is_ascii_lowercase() || c == '_'));
    words.filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// The modules of this crate that code names, comments and tests left out.
fn used(text: &str) -> BTreeSet<String> {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines
        .flat_map(|line| line.split("crate::").skip(1).map(str::to_owned).collect::<Vec<_>>())
        .map(|rest| rest.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect())
        .collect()
}

/// Arrows that run up the order, each in words.
fn upward(order: &[String], module: &str, text: &str) -> Vec<String> {
    let place = |name: &str| order.iter().position(|known| known == name);
    let own = place(module);
    let wrong =
        |name: &String| name != module && (own.is_none() || place(name).is_none_or(|at| Some(at) >= own));
    used(text).iter().filter(|name| wrong(name)).map(|name| format!("{module} uses {name}")).collect()
}

#[test]
fn no_module_uses_one_that_stands_after_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let lib = fs::read_to_string(root.join("lib.rs")).expect("the crate's front page");
    let order = order(&lib);
    let declared: BTreeSet<_> = lib
        .lines()
        .filter_map(|line| line.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect();
    assert_eq!(order.iter().cloned().collect::<BTreeSet<_>>(), declared, "modules in the order, and modules");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let mut wrong = Vec::new();
    for file in files {
        let inside = file.strip_prefix(&root).expect("under src");
        let first = inside.iter().next().and_then(|part| part.to_str()).expect("a name");
        let module = first.trim_end_matches(".rs");
        if !["lib", "main"].contains(&module) {
            let text = fs::read_to_string(&file).expect("a source");
            wrong.extend(
                upward(&order, module, &text)
                    .into_iter()
                    .map(|arrow| format!("{arrow} ({})", inside.display())),
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn an_arrow_that_runs_upward_is_seen() {
    let order = ["light", "scene", "plan"].map(str::to_owned);
    let text = "use crate::light::Row; // not crate::plan\nuse crate::plan::Plan;\n#[cfg(test)]\nmod tests { use crate::plan; }";
    assert_eq!(upward(&order, "scene", text), ["scene uses plan"]);
    assert_eq!(upward(&order, "plan", text), [""; 0]);
    assert_eq!(upward(&order, "light", "crate::nowhere::x()"), ["light uses nowhere"]);
}
