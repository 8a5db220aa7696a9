//! Any bytes as a scene file.

#![no_main]

#[path = "../../tests/inputs/damage.rs"]
mod damage;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| damage::scene(bytes));
