//! What is no surface goes: repeated and copied triangles, triangles without area, debris, sheets.

pub(crate) mod back_to_back;
pub(crate) mod copies;
pub(crate) mod debris;
pub(crate) mod degenerate;
pub(crate) mod drawn_again;
pub(crate) mod duplicates;
pub(crate) mod sheets;
pub(crate) mod surplus;
pub(crate) mod walls;
