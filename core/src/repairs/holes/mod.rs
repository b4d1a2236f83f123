//! Boundary loops are closed.

pub(crate) mod annular;
pub(crate) mod fair;
pub(crate) mod fill;
pub(crate) mod islands;
pub(crate) mod patches;
pub(crate) mod sheet_solids;
pub(crate) mod skirt;
