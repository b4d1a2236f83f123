//! Contract: what a caller gives and gets.
//!
//! **In:** a profile (what is to be repaired), limits (memory, threads, bounds), a progress to tell.
//! **Out:** a report (schema in `core/REPORT.md`) or an error.
//! **Promise:** a profile or a limit that makes no sense is refused by name before work begins ([`ranges`]). Every number of a report is
//! finite ([`finite`]). An error says whether more memory, another machine, or nothing at all would help ([`error`]).

pub(crate) mod access;
pub(crate) mod builder;
pub(crate) mod defects;
pub(crate) mod edit_report;
pub mod error;
pub(crate) mod features;
pub(crate) mod file_facts;
pub(crate) mod finite;
pub(crate) mod hint;
pub(crate) mod judgement;
pub(crate) mod loop_class;
pub(crate) mod progress;
pub(crate) mod ranges;
pub(crate) mod repair_name;
pub mod report;
pub(crate) mod residue_settings;
pub mod settings;
pub(crate) mod shaping;
pub(crate) mod skin;
pub(crate) mod thin_walls;
pub(crate) mod volumes;
