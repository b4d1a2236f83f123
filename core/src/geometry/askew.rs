//! Ends of a triangle along the diagonals of the axes' planes.
//!
//! Long thin triangles that lie askew fill little of their boxes: thin rods side by side along a diagonal, or a cone above its base, overlap as boxes
//! each with each. Bodies of which one ends before the other begins along x + y, say, are apart all the same (after Klosowski
//! et al., "Efficient collision detection using bounding volume hierarchies of k-DOPs", IEEE TVCG 4(1), 1998).
//!
//! A sum of two coordinates is rounded to f32, which keeps the order of sums, so that what ends before something begins as computed does so in
//! truth. What only touches is not apart.

use crate::geometry::tri_tri::Triangle;

/// x + y, x − y, x + z, x − z, y + z, y − z.
pub(crate) const DIRECTIONS: usize = 6;

/// The two axes of each two directions.
const AXES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// The ends along all directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Askew {
    pub(crate) lo: [f32; DIRECTIONS],
    pub(crate) hi: [f32; DIRECTIONS],
}

impl Askew {
    #[inline]
    pub(crate) fn of(triangle: &Triangle) -> Self {
        let mut ends = Self { lo: [f32::MAX; DIRECTIONS], hi: [f32::MIN; DIRECTIONS] };
        for p in triangle {
            for (k, [x, y]) in AXES.into_iter().enumerate() {
                for (side, sum) in [p[x] + p[y], p[x] - p[y]].into_iter().enumerate() {
                    // Within what is finite, also where the sum is not: in the same order.
                    let sum = sum.clamp(f32::MIN, f32::MAX);
                    let (lo, hi) = (&mut ends.lo[2 * k + side], &mut ends.hi[2 * k + side]);
                    (*lo, *hi) = (lo.min(sum), hi.max(sum));
                }
            }
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::tri_tri::{Contact, triangles_cross};

    impl Askew {
        /// Does one end before the other begins, for sure?
        fn is_apart(&self, other: &Self) -> bool {
            (0..DIRECTIONS).any(|k| self.hi[k] < other.lo[k] || other.hi[k] < self.lo[k])
        }
    }

    #[test]
    fn rods_along_a_diagonal_are_apart() {
        let rod = |x: f32| Askew::of(&[[x, 0.0, 0.0], [x + 0.25, 0.0, 0.0], [x + 99.0, 99.0, 99.0]]);
        assert!(rod(0.0).is_apart(&rod(0.5)));
        assert!(!rod(0.0).is_apart(&rod(0.25)), "what touches is not");
        let far = |x: f32| Askew::of(&[[x, x, x]; 3]);
        assert!(!far(f32::MAX).is_apart(&far(f32::MAX / 1.5)), "sums that are not finite say nothing");
    }

    proptest! {
        #[test]
        fn what_is_apart_does_not_meet(
            a in prop::array::uniform3(prop::array::uniform3(-9..9_i8)),
            b in prop::array::uniform3(prop::array::uniform3(-9..9_i8)),
            scale in prop::sample::select(vec![1.0_f32, 0.1, 1e-45, 3e37]),
        ) {
            let [a, b] = [a, b].map(|t| t.map(|p| p.map(|x| f32::from(x) * scale)));
            prop_assert!(!Askew::of(&a).is_apart(&Askew::of(&b)) || triangles_cross(&a, &b) == Contact::Apart);
        }
    }
}
