//! What one cell sees of a mesh.

use super::lanes::{Triangles, WIDTH};
use crate::geometry::tri_tri::{Contact, self_intersection};
use crate::stream::plan::HomeBox;
use crate::util::ids::NONE;

/// What one cell sees of a mesh. All coordinates are finite, −0.0 does not occur.
pub(crate) struct CellView<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    /// Members in input order, then visitors. A triangle with a repeated vertex has [`NONE`] first and is left out.
    pub(crate) triangles: &'a [[u32; 3]],
    /// The exactly collinear ones, ascending; left out too.
    pub(crate) left_out: &'a [u32],
    /// By vertex.
    pub(crate) standing: &'a [Standing],
    pub(crate) cell: HomeBox,
}

/// The state of a vertex in a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Standing {
    /// At home in another cell.
    Away,
    /// At home here, and not regular.
    Irregular,
    /// At home here, in the middle of a closed, coherent fan without collinear triangles.
    Regular,
}

impl CellView<'_> {
    #[inline(always)]
    pub(super) fn corners(&self, t: [u32; 3]) -> [[f32; 3]; 3] {
        let [a, b, c] = t;
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }

    /// Exactly. `common`: which corners of each are also corners of the other.
    pub(super) fn decide(&self, i: u32, j: u32, common: [[bool; 3]; 2], found: &mut impl FnMut(u32, u32, Contact)) {
        let [a, b] = [i, j].map(|i| self.corners(self.triangles[i as usize]));
        if let Some(contact) = self_intersection(&a, &b, common) {
            found(i.min(j), i.max(j), contact);
        }
    }

    /// The triangles that are not left out, with their numbers.
    #[inline]
    pub(super) fn solid_triangles(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        let mut left_out = self.left_out.iter().copied();
        let mut next = left_out.next().unwrap_or(NONE);
        self.triangles.iter().enumerate().filter_map(move |(i, t)| {
            if i as u32 == next {
                next = left_out.next().unwrap_or(NONE);
                return None;
            }
            (t[0] != NONE).then_some((i as u32, *t))
        })
    }
}

/// Up to sixteen triangles of a view, one batch after the other. Not a closure called for each, which would not be compiled for the
/// processor that its caller is compiled for.
pub(super) struct Batch {
    pub(super) numbers: [u32; WIDTH],
    pub(super) count: usize,
    pub(super) triangles: Triangles,
}

impl Batch {
    pub(super) const EMPTY: Self = Self { numbers: [0; WIDTH], count: 0, triangles: Triangles::NONE };

    /// Takes the next ones, if there are any.
    #[inline(always)]
    pub(super) fn fill(&mut self, view: &CellView<'_>, solid: &mut impl Iterator<Item = (u32, [u32; 3])>) -> bool {
        self.count = 0;
        for (number, t) in solid.take(WIDTH) {
            self.numbers[self.count] = number;
            self.triangles.set(self.count, &view.corners(t));
            self.count += 1;
        }
        self.count > 0
    }

    #[inline(always)]
    pub(super) fn numbers(&self) -> &[u32] {
        &self.numbers[..self.count]
    }
}

/// What is known of a vertex.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum State {
    /// At home in another cell.
    Away,
    /// At home here, and no two triangles around it meet beyond what they share.
    Certified,
    /// At home here, and nothing is known.
    Open,
}
