//! Projects of CAMotics, tables of tools, and tools of the command line.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| suture_fuzz::check_tools(bytes));
