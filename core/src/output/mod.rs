//! Output: the repaired file, written once and looked at again.

pub(crate) mod edit;
pub(crate) mod emit;
pub(crate) mod incremental;
pub(crate) mod readback;
