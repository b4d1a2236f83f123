//! The texts of all parts of a package.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| suture_fuzz::check_package(&suture_fuzz::package_of_parts(bytes)));
