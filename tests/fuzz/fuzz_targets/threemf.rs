//! Archives: 3MF packages and packed AMF. Checksums count for nothing here, since no fuzzer finds them.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| suture_fuzz::check_package(bytes));
