//! Points and vectors, in millimetres where they are places.

pub(crate) use crate::curves::vector::{Point, add, cross, dot, is_finite, plain_norm as length, plain_unit as unit, scale, sub};
