//! A file as it is read.

use super::moves::Moves;
use super::options::Units;
use super::tool::Tool;
use crate::curves::Finding;

/// A language of tool paths, as far as a file shows which.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Dialect {
    /// G-code, no sign of a dialect.
    GCode,
    /// LinuxCNC and NIST's interpreter: O-words with names or conditions, expressions in brackets, named parameters.
    LinuxCnc,
    /// Fanuc, Haas, Mach: program numbers, `M98`, `G10`, scaling and rotation.
    Fanuc,
    /// WinCNC and Vectric's output for it: comments in brackets.
    WinCnc,
    /// GRBL: `$` commands.
    Grbl,
    /// Marlin, RepRap: checksums, extruders.
    Marlin,
    /// APT or CL data.
    Apt,
}

/// How far the tool moves, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Travel {
    /// In rapids; those between places that are not known do not count.
    pub rapid: f64,
    /// Cutting.
    pub feed: f64,
}

/// A file, its moves left out.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Header {
    /// Its language.
    pub dialect: Dialect,
    /// The unit that it is first written in.
    pub units: Units,
    /// Whether it names the unit itself.
    pub has_units: bool,
    /// Tools, in the order of their numbers.
    pub tools: Vec<Tool>,
    /// Numbers of tools that move, in their order; 0 stands for a path that names none.
    pub used: Vec<u32>,
    /// Moves to or from places that are not known.
    pub references: u64,
    /// Rapid moves.
    pub rapids: u64,
    /// Straight cuts.
    pub feeds: u64,
    /// Arcs and helices.
    pub arcs: u64,
    /// Corners of a box around all moves between known places, in millimetres; `None` without one.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Corners of a box around all cuts.
    pub cut: Option<[[f64; 3]; 2]>,
    /// How far it moves.
    pub travel: Travel,
    /// Lines of the file that are not read, each a finding.
    pub unread: u64,
    /// Oddities, in the order of lines.
    pub findings: Vec<Finding>,
}

/// A file and its moves.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Program {
    /// All but the moves.
    pub header: Header,
    /// The moves.
    pub moves: Moves,
}

/// Why a file is not read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// Neither G-code nor APT, by its content.
    #[error("neither G-code nor APT; it begins with “{0}”")]
    Unknown(String),
    /// A project of CAMotics, which names its paths: [`super::project::read`] reads it.
    #[error("a project of CAMotics; its tool paths are in other files")]
    Project,
    /// A table of tools: [`super::tools::read_table`] reads it.
    #[error("a table of tools, not a tool path")]
    ToolTable,
    /// The file asks for something that is not done, and without which the path is another one; or an expression of it has no
    /// value.
    #[error("line {line}: {what}")]
    Refused {
        /// Where, from 1.
        line: u64,
        /// The thing that is refused, and why.
        what: String,
    },
    /// More moves or executed blocks than [`super::Options`] allow.
    #[error("line {line}: more than {most} {what}")]
    TooMany {
        /// Where, from 1.
        line: u64,
        /// The bound.
        most: u64,
        /// The things of which there are too many.
        what: &'static str,
    },
    /// JSON that is no project.
    #[error("{path}: {problem}")]
    Json {
        /// Where: `tools.1.diameter`.
        path: String,
        /// The problem.
        problem: String,
    },
    /// A tool that is not understood.
    #[error("tool “{text}”: {problem}")]
    Tool {
        /// As it is written.
        text: String,
        /// The problem.
        problem: String,
    },
    /// The receiver of the moves wants no more of them.
    #[error("stopped at line {line}")]
    Stopped {
        /// Where, from 1.
        line: u64,
    },
}
