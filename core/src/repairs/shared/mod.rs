//! What all repairs share: the submesh and its changes, what is known of it, and the account of what was done.

pub(crate) mod account;
pub(crate) mod admission;
pub(crate) mod collisions;
pub(crate) mod context;
pub(crate) mod gather;
pub(crate) mod lone_sheets;
pub(crate) mod overlay;
pub(crate) mod pieces;
pub(crate) mod probes;
pub(crate) mod region_report;
pub(crate) mod snapshot;
pub(crate) mod unsaid;
pub(crate) mod work;
