//! Any bytes as packed geometry.

#![no_main]

#[path = "../../tests/inputs/damage.rs"]
mod damage;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| damage::packed(bytes));
