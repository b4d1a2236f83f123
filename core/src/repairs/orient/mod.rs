//! Triangles face outward: by their neighbours, by what can be seen, by the volume that they enclose.

pub(crate) mod directions;
mod groups;
pub(crate) mod hollow;
mod inverted;
mod points;
pub(crate) mod shell_copies;
mod shells;
pub(crate) mod visibility;
