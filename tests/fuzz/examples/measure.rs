//! Reads files on one thread, by the reader that their bytes choose, and says how long that took and how much memory.

fn main() {
    for path in std::env::args().skip(1) {
        let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        let measured = suture_fuzz::measure(&bytes);
        println!(
            "{:9.3} s {:6} KiB of {:5} KiB  {path}: {}",
            measured.seconds,
            measured.most >> 10,
            bytes.len() >> 10,
            measured.said
        );
    }
}
