//! What can be generated, and what is known of it.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

use super::defect::Kind;
use crate::counts::Counts;

/// A kind of mesh to generate.
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

    /// Are there local defects in it, which can be few or many?
    pub fn has_density(self) -> bool {
        !self.kinds().is_empty()
    }

    /// The local defects of the case, dealt out in turn.
    pub(super) fn kinds(self) -> &'static [Kind] {
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

/// How many of the cells of 512 triangles hold a defect of the case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Density {
    /// About one in ten.
    #[default]
    Sparse,
    /// Every one.
    Everywhere,
}

impl Density {
    /// Every density.
    pub const ALL: [Self; 2] = [Self::Sparse, Self::Everywhere];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sparse => "sparse",
            Self::Everywhere => "everywhere",
        }
    }

    /// The name of a case at this density: its own, if it is sparse.
    pub fn of_case(self, case: Case) -> String {
        match self {
            Self::Sparse => case.name().into(),
            Self::Everywhere => format!("{case} {}", self.name()),
        }
    }

    pub(super) fn cells_per_defect(self) -> u64 {
        match self {
            Self::Sparse => 10,
            Self::Everywhere => 1,
        }
    }
}

impl std::str::FromStr for Density {
    type Err = String;

    fn from_str(name: &str) -> std::result::Result<Self, String> {
        let found = Self::ALL.into_iter().find(|density| density.name() == name);
        found.ok_or_else(|| format!("the densities are {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// Why a file could not be generated.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant says what its fields are")]
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

/// A mesh that was written: its case, and the truth about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The case: which defects it has.
    pub case: Case,
    /// The seed: equal seeds give equal bytes.
    pub seed: u64,
    /// The counts that an exact check must find.
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
