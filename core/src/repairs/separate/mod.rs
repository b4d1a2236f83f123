//! Surfaces that share an edge or a vertex get one of their own.

pub(crate) mod nonmanifold;
pub(crate) mod pinch_vertices;
pub(crate) mod places;
pub(crate) mod separated;
