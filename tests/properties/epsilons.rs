//! No magic distance: where rays start and end and light is carried, no small constant stands in the code.

use crate::order::sources;
use std::fs;
use std::path::Path;

/// Numbers between zero and a hundredth, but for those in comments and in tests.
fn small_numbers(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\n").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    let word = |c: char| !(c.is_ascii_alphanumeric() || "._-".contains(c));
    lines
        .flat_map(|line| line.split(word).map(str::to_owned).collect::<Vec<_>>())
        .filter(|number| number.starts_with(|c: char| c.is_ascii_digit()))
        .map(|number| number.replace('_', "").replace("f32", "").replace("f64", ""))
        .filter(|number| number.parse::<f64>().is_ok_and(|x| x > 0.0 && x < 0.01))
        .collect()
}

#[test]
fn nothing_small_decides_where_light_goes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    for part in ["rays", "emission", "shoot", "path_trace", "scene/mesh.rs"] {
        sources(&root.join(part), &mut files);
    }
    assert!(files.len() > 15, "{files:?}");
    for file in files {
        let found = small_numbers(&fs::read_to_string(&file).expect("a source"));
        assert!(found.is_empty(), "{}: {found:?}", file.display());
    }
    // It can fail.
    assert_eq!(small_numbers("let t_min = 1e-4_f32; // 1e-5\nlet half = 0.5 - 0.001;"), ["1e-4", "0.001"]);
}
