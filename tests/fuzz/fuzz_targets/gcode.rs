//! G-code.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| suture_fuzz::check_path(bytes));
