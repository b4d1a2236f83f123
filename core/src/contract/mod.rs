//! Contract: what a caller gives (settings and limits) and gets (a report or an error).

pub(crate) mod access;
pub mod error;
pub(crate) mod finite;
pub(crate) mod judgement;
pub(crate) mod loop_class;
pub(crate) mod progress;
pub(crate) mod ranges;
pub mod report;
pub mod settings;
