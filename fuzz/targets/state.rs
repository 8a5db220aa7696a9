//! Any bytes as the state of a render.

#![no_main]

#[path = "../../tests/inputs/damage.rs"]
mod damage;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| damage::state(bytes));
