//! Rust is all it takes: nothing that halflight is built from compiles another language.

use std::process::Command;

/// Crates by which build scripts compile C and C++, or read their headers.
const COMPILERS: [&str; 6] = ["autotools", "bindgen", "cc", "cmake", "cxx", "cxx-build"];

/// Those of them in what `cargo tree --prefix none` prints: a line a crate, its name first.
fn compilers(tree: &str) -> Vec<&str> {
    let names = tree.lines().filter_map(|line| line.split(' ').next());
    names.filter(|name| COMPILERS.contains(name)).collect()
}

/// What halflight is built from, a line a crate. What tests and benches need besides, and the workspace of fuzz targets, may
/// compile C. Cargo.lock alone would not do: it holds crates that no platform builds.
fn tree(more: &[&str]) -> String {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["tree", "--locked", "-p", "halflight", "-e", "normal,build", "--prefix", "none"])
        .args(more)
        .output()
        .expect("cargo");
    let tree = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(tree.starts_with("halflight v") && tree.lines().count() > 50, "{tree}");
    tree
}

/// kiddo's `generator` has a compiler at hand for PowerPC, and calls it there alone; but there kiddo does not ask for it.
#[test]
fn no_dependency_compiles_another_language() {
    for more in [["--prune", "generator"], ["--target", "powerpc64le-unknown-linux-gnu"]] {
        let tree = tree(&more);
        let found = compilers(&tree);
        assert!(found.is_empty(), "{found:?}: see `cargo tree -e normal,build -i NAME`");
    }
    // It can fail.
    assert_eq!(compilers("nv-flip-sys v0.1.1\ncc v1.11.3\nccx v0.1.0"), ["cc"]);
}
