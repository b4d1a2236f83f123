//! OBJ.
#![no_main]

use libfuzzer_sys::fuzz_target;
use suture_fuzz::Reader;

fuzz_target!(|bytes: &[u8]| suture_fuzz::check_rows(Reader::Obj, bytes));
