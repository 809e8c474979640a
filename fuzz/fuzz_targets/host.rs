#![no_main]

#[path = "../both_ends.rs"]
#[allow(dead_code)]
mod both_ends;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| both_ends::host(bytes));
