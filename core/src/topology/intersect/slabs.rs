//! Ends of sixteen triangles along diagonals ([`crate::geometry::askew`]), and their angles around the line through the two largest hubs, if there
//! are two ([`crate::geometry::axis`]): where boxes select badly, these are asked, too. They are those of whole triangles, not cut to a cell,
//! so whether two of them overlap is a property of the mesh.

use super::lanes::{Ends, Triangles};
use crate::geometry::askew::{Askew, DIRECTIONS};
use crate::geometry::axis::{self, Axis};

/// Begins are widened to the neighbouring float, so that what touches overlaps. The last are the angles.
pub(super) type Slabs = Ends<{ DIRECTIONS + 1 }>;

/// The ends of the first `count` of sixteen triangles.
#[inline(always)]
pub(super) fn slabs(triangles: &Triangles, count: usize, around: Option<&Axis>) -> Slabs {
    let mut slabs = Slabs::EMPTY;
    for i in 0..count {
        let triangle = [triangles.corner(0, i), triangles.corner(1, i), triangles.corner(2, i)];
        let ends = Askew::of(&triangle);
        let [from, to] = around.map_or(axis::ALL, |axis| axis.angles(&triangle));
        let (mut lo, mut hi) = ([from; DIRECTIONS + 1], [to; DIRECTIONS + 1]);
        lo[..DIRECTIONS].copy_from_slice(&ends.lo.map(f32::next_down));
        hi[..DIRECTIONS].copy_from_slice(&ends.hi);
        slabs.set(i, lo, hi);
    }
    slabs
}
