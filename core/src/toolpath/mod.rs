//! Tool paths of milling machines: G-code and APT/CL files, and the tools that CAMotics projects and tool tables describe.
//!
//! **In:** the bytes of a file.
//! **Out:** a [`Program`]: moves of the tool's programmed point in millimetres, tools, and what is odd; [`stream`] gives the
//! moves one by one.
//! **Promise:** the same moves for the same bytes; nothing that moves the tool is skipped in silence: it is a finding, or the
//! file is refused with the line. Time is linear in the blocks that are executed, of which there are bounds ([`Options`]).
//!
//! *Frame.* Points are those that the program writes: coordinates in the work coordinate system that is active at the first feed
//! move. Other systems, `G92` and `G52` count relative to it. Offsets of tool length (`G43`) do not: the programmed point is the
//! tip of the tool, or whatever point of it the program controls.
//!
//! Based on: T. R. Kramer, F. M. Proctor, E. Messina, "The NIST RS274NGC Interpreter - Version 3", NISTIR 6556, 2000; ISO 6983-1;
//! the APT part programming language, ANSI X3.37 / ISO 4343.

mod apt;
mod emit;
mod gcode;
mod lines;
mod model;
mod moves;
mod options;
mod program;
pub mod project;
mod read;
mod tool;
pub mod tools;
mod vector;

#[cfg(test)]
mod tests;

pub use model::{Kind, Move, Plane};
pub use moves::Moves;
pub use options::{Options, Rotary, Units};
pub use program::{Dialect, Header, Program, ReadError, Travel};
pub use read::{read, stream};
pub use tool::{Cutter, Shape, Tool};
