//! Triangles face outward: by their neighbours, by what can be seen, by the volume that they enclose.

pub(crate) mod directions;
pub(crate) mod visibility;
