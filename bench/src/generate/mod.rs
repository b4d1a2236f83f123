//! Binary STL files of any size with defects that are known exactly, written as a stream in memory that hardly grows with the
//! size (tables as long as one row and one column of the surface).
//!
//! The surface is cut into cells of 512 triangles; about one cell in ten, or every one, holds one defect, away from the cell's border, so that
//! defects never interact and the truth is their sum. Same case, size and seed give the same bytes on every platform.

mod case;
mod cell;
mod defect;
mod noise;
mod surface;
mod write;

use std::fs::File;
use std::io::Write;
use std::path::Path;

pub use case::{Case, Density, Error, Result, Truth};
pub(crate) use noise::{Random, turn};

/// Writes about `triangles` triangles (at least one cell of 512; the truth says how many) of `case` as binary STL.
///
/// # Errors
/// When `out` fails, or when the count does not fit a binary STL.
pub fn write(case: Case, triangles: u64, seed: u64, out: &mut impl Write) -> Result<Truth> {
    write::write((case, Density::Sparse), triangles, seed, out)
}

/// The same, into a file that is created or replaced.
///
/// # Errors
/// As [`write()`], and when the file cannot be created.
pub fn write_file(case: Case, triangles: u64, seed: u64, path: &Path) -> Result<Truth> {
    write_file_at(case, Density::Sparse, triangles, seed, path)
}

/// The same, with defects as dense as that.
///
/// # Errors
/// As [`write_file`].
pub fn write_file_at(case: Case, density: Density, triangles: u64, seed: u64, path: &Path) -> Result<Truth> {
    let mut file = File::create(path).map_err(|source| Error::Create { path: path.into(), source })?;
    let truth = write::write((case, density), triangles, seed, &mut file)?;
    file.flush()?;
    Ok(truth)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generated(case: Case, triangles: u64, seed: u64) -> (Vec<u8>, Truth) {
        let mut bytes = Vec::new();
        let truth = write(case, triangles, seed, &mut bytes).unwrap();
        (bytes, truth)
    }

    #[test]
    fn header_promises_what_follows() {
        for case in Case::ALL {
            for triangles in [1, 512, 5_000, 20_000] {
                let (bytes, truth) = generated(case, triangles, 3);
                let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap());
                assert_eq!(u64::from(count), truth.counts.triangles, "{case} {triangles}");
                assert_eq!(bytes.len() as u64, 84 + 50 * truth.counts.triangles, "{case} {triangles}");
                assert!(!bytes.starts_with(b"solid"));
            }
        }
    }

    #[test]
    fn everywhere_is_in_every_cell() {
        let folder = tempfile::tempdir().unwrap();
        for case in Case::ALL.into_iter().filter(|case| case.has_density()) {
            let truth = write_file_at(case, Density::Everywhere, 50_000, 1, &folder.path().join("a.stl")).unwrap();
            let cells = truth.injected.values().sum::<u64>();
            let sparse = generated(case, 50_000, 1).1.injected.values().sum::<u64>();
            // Of two bodies one is sound.
            let all = if case == Case::TwoBodies { 45 } else { 90 };
            assert!(cells >= all && cells >= 4 * sparse && truth.sound.len() as u64 <= cells, "{case}: {cells}, {sparse}");
        }
    }

    #[test]
    fn only_seed_and_size_decide() {
        for case in Case::ALL {
            assert!(generated(case, 5_000, 1) == generated(case, 5_000, 1), "{case}");
            assert!(generated(case, 5_000, 1).0[84..] != generated(case, 5_000, 2).0[84..], "{case}");
        }
    }

    #[test]
    fn sound_records_stand_in_the_clean_file() {
        let (clean, _) = generated(Case::Clean, 20_000, 1);
        let records: std::collections::BTreeSet<_> = clean[84..].chunks_exact(50).collect();
        let (mixed, truth) = generated(Case::Mixed, 20_000, 1);
        assert_eq!(truth.injected.len(), Case::Mixed.kinds().len());
        let sound: Vec<_> = truth.sound.iter().flat_map(|range| range.clone()).collect();
        assert!(sound.len() as u64 > truth.counts.triangles / 2);
        for record in sound {
            let start = 84 + 50 * record as usize;
            assert!(records.contains(&mixed[start..start + 50]), "record {record}");
        }
    }

    #[test]
    fn size_is_near_the_one_asked_for() {
        for triangles in [5_000, 100_000, 1_000_000] {
            let (_, truth) = generated(Case::Clean, triangles, 1);
            let ratio = truth.counts.triangles as f64 / triangles as f64;
            assert!((0.9..1.1).contains(&ratio), "{triangles}: {ratio}");
        }
    }

    #[test]
    fn too_many_triangles_for_the_format_are_refused() {
        assert!(matches!(write(Case::Clean, 1 << 33, 1, &mut std::io::sink()), Err(Error::TooMany { .. })));
    }

    #[test]
    fn names_read_back() {
        for case in Case::ALL {
            assert_eq!(case.name().parse::<Case>().unwrap(), case);
        }
        assert!("nonsense".parse::<Case>().is_err());
    }
}
