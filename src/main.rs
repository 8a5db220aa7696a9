//! halflight
fn main() {}
