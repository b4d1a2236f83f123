//! Facts that a program does not say itself.

use super::tool::Tool;

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// Millimetres.
    Millimetres,
    /// Inches of 25.4 mm.
    Inches,
}

impl Units {
    /// Millimetres in one.
    #[must_use]
    pub fn millimetres(self) -> f64 {
        match self {
            Self::Millimetres => 1.0,
            Self::Inches => 25.4,
        }
    }
}

/// The part of the machine that the rotary axes A, B, C turn, where its points are those of the part (tool centre point control:
/// `G43.4`, LinuxCNC's kinematics of the part). Angles are in degrees about X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotary {
    /// The head: the tool's axis is the Z direction turned by A, then B, then C.
    Head,
    /// The table, and the part with it: as a head that turns the other way.
    Table,
}

/// How a file is read.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Options {
    /// The unit of a file that names none; by default the one that its comments speak of, or else millimetres.
    pub units: Option<Units>,
    /// Tools by number; they count more than what the file says about the same number.
    pub tools: Vec<Tool>,
    /// The part that A, B, C turn; without it, programs that move them are refused.
    pub rotary: Option<Rotary>,
    /// Whether lines that begin with `/` are left out.
    pub block_delete: bool,
    /// Moves, at most.
    pub moves_max: u64,
    /// Blocks executed in loops and subprograms, at most; those outside are bounded by the file itself.
    pub steps_max: u64,
    /// How far a spline may be from the lines that it is made of, in millimetres.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        let (moves_max, steps_max) = (1 << 25, 20_000_000);
        Self { units: None, rotary: None, tools: Vec::new(), block_delete: false, moves_max, steps_max, tolerance: 0.001 }
    }
}
