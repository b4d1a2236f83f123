//! Binary STL files of any size with defects that are known exactly, written as a stream in memory that hardly grows with the
//! size (tables as long as one row and one column of the surface).
//!
//! The surface is cut into cells of 512 triangles; about one cell in ten holds one defect, away from the cell's border, so that
//! defects never interact and the truth is their sum. Same case, size and seed give the same bytes on every platform.

mod cell;
mod defect;
mod noise;
mod surface;
mod write;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::Counts;
use defect::Kind;

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Case {
    /// Nothing wrong.
    Clean,
    /// Patches and single triangles missing.
    Holes,
    /// Triangles and patches written twice.
    Duplicates,
    /// Patches turned inside out.
    Flipped,
    /// Every corner jittered by up to 0.0001 mm: no two triangles share a vertex.
    Soup,
    /// All local defects but those of [`Case::Touching`].
    Mixed,
    /// T-junctions.
    Cracks,
    /// Slits between edges that do not quite meet.
    Gaps,
    /// Triangles with repeated corners or without area.
    Degenerate,
    /// The whole body inside out.
    InsideOut,
    /// Two bodies, the second with holes.
    TwoBodies,
    /// Tiny closed bodies floating about.
    NoiseShells,
    /// Two vertices that half of all triangles share each; one triangle is missing.
    HugeFan,
    /// Triangles in random order, one in about five thousand quads missing.
    Shuffled,
    /// Surplus triangles standing on edges.
    Fins,
    /// Holes with loose patches inside, and chains of holes that touch in vertices.
    Islands,
    /// Small bodies that touch the surface in one vertex.
    Touching,
}

impl Case {
    /// Every case.
    pub const ALL: [Self; 17] = [
        Self::Clean,
        Self::Holes,
        Self::Duplicates,
        Self::Flipped,
        Self::Soup,
        Self::Mixed,
        Self::Cracks,
        Self::Gaps,
        Self::Degenerate,
        Self::InsideOut,
        Self::TwoBodies,
        Self::NoiseShells,
        Self::HugeFan,
        Self::Shuffled,
        Self::Fins,
        Self::Islands,
        Self::Touching,
    ];

    /// Its name on the command line and in file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Holes => "holes",
            Self::Duplicates => "duplicates",
            Self::Flipped => "flipped",
            Self::Soup => "soup",
            Self::Mixed => "mixed",
            Self::Cracks => "cracks",
            Self::Gaps => "gaps",
            Self::Degenerate => "degenerate",
            Self::InsideOut => "inside_out",
            Self::TwoBodies => "two_bodies",
            Self::NoiseShells => "noise_shells",
            Self::HugeFan => "huge_fan",
            Self::Shuffled => "shuffled",
            Self::Fins => "fins",
            Self::Islands => "islands",
            Self::Touching => "touching",
        }
    }

    /// The local defects of the case, dealt out in turn.
    fn kinds(self) -> &'static [Kind] {
        match self {
            Self::Holes | Self::TwoBodies => &[Kind::Hole],
            Self::Duplicates => &[Kind::Duplicate, Kind::DuplicatePatch, Kind::OppositeDuplicate],
            Self::Flipped => &[Kind::FlippedPatch],
            Self::Cracks => &[Kind::Crack],
            Self::Gaps => &[Kind::Gap, Kind::MisalignedGap],
            Self::Degenerate => &[Kind::RepeatedVertex, Kind::Cap, Kind::Sliver],
            Self::NoiseShells => &[Kind::NoiseShell],
            Self::Fins => &[Kind::Fin],
            Self::Islands => &[Kind::Island, Kind::HoleChain],
            Self::Touching => &[Kind::TouchingBody],
            Self::Mixed => &[
                Kind::Hole,
                Kind::Crack,
                Kind::FlippedPatch,
                Kind::Duplicate,
                Kind::Gap,
                Kind::RepeatedVertex,
                Kind::Island,
                Kind::Fin,
                Kind::MisalignedGap,
                Kind::OppositeDuplicate,
                Kind::Cap,
                Kind::HoleChain,
                Kind::NoiseShell,
                Kind::DuplicatePatch,
                Kind::Sliver,
            ],
            Self::Clean | Self::Soup | Self::InsideOut | Self::HugeFan | Self::Shuffled => &[],
        }
    }
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Case {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|case| case.name() == name).ok_or_else(|| Error::UnknownCase { name: name.into() })
    }
}

/// Why a file could not be generated.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A name that is not in [`Case::ALL`].
    #[error("there is no case `{name}`; the cases are {}", Case::ALL.map(Case::name).join(", "))]
    UnknownCase { name: String },
    /// Binary STL counts its triangles in 32 bits.
    #[error("{triangles} triangles are more than a binary STL can count")]
    TooMany { triangles: u64 },
    /// The file could not be created.
    #[error("{}: cannot be created: {source}", path.display())]
    Create { path: PathBuf, source: io::Error },
    /// Writing failed.
    #[error("writing failed: {0}")]
    Write(#[from] io::Error),
}

/// The result of generating.
pub type Result<T> = std::result::Result<T, Error>;

/// What was written, and what is wrong with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    pub case: Case,
    pub seed: u64,
    /// What an exact check must find.
    pub counts: Counts,
    /// How many defects of each kind were injected.
    pub injected: BTreeMap<&'static str, u64>,
    /// Records (numbered from 0) out of reach of any defect: no repair has a reason to touch them. In order, never empty ranges.
    pub sound: Vec<Range<u64>>,
    /// Volume in mm³ that the sound bodies enclose.
    pub volume: f64,
    /// Bodies of the sound model; noise shells and touching bodies are not among them.
    pub bodies: u64,
    /// Noise shells and touching bodies: a repair may keep or drop them.
    pub extra_bodies: u64,
}

/// Writes about `triangles` triangles (at least one cell of 512; the truth says how many) of `case` as binary STL.
///
/// # Errors
/// When `out` fails, or when the count does not fit a binary STL.
pub fn write(case: Case, triangles: u64, seed: u64, out: &mut impl Write) -> Result<Truth> {
    write::write(case, triangles, seed, out)
}

/// The same, into a file that is created or replaced.
///
/// # Errors
/// As [`write`], and when the file cannot be created.
pub fn write_file(case: Case, triangles: u64, seed: u64, path: &Path) -> Result<Truth> {
    let mut file = File::create(path).map_err(|source| Error::Create { path: path.into(), source })?;
    let truth = write(case, triangles, seed, &mut file)?;
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
        assert!(matches!(write(Case::Clean, 1 << 33, 1, &mut io::sink()), Err(Error::TooMany { .. })));
    }

    #[test]
    fn names_read_back() {
        for case in Case::ALL {
            assert_eq!(case.name().parse::<Case>().unwrap(), case);
        }
        assert!("nonsense".parse::<Case>().is_err());
    }
}
