//! Ends of sixteen triangles along diagonals ([`crate::geometry::askew`]): where boxes select badly, these are asked, too. They are those of
//! whole triangles, not cut to a cell, so whether two of them overlap is a property of the mesh.

use super::lanes::{Ends, Triangles};
use crate::geometry::askew::{Askew, DIRECTIONS};

/// Begins are widened to the neighbouring float, so that what touches overlaps.
pub(super) type Slabs = Ends<DIRECTIONS>;

/// The ends of the first `count` of sixteen triangles.
#[inline(always)]
pub(super) fn slabs(triangles: &Triangles, count: usize) -> Slabs {
    let mut slabs = Slabs::EMPTY;
    for i in 0..count {
        let ends = Askew::of(&[triangles.corner(0, i), triangles.corner(1, i), triangles.corner(2, i)]);
        slabs.set(i, ends.lo.map(f32::next_down), ends.hi);
    }
    slabs
}
