//! The text of a model in a package that is sound.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| suture_fuzz::check_package(&suture_fuzz::package_of_model(bytes)));
