//! The three ways to split a triangle. The corners are counted from the special one: A, B, C, in the triangle's order.
//!
//! | way | cut | children |
//! |---|---|---|
//! | one | side BC at its middle M | A B M, M C A |
//! | two | AB at M, CA at N | A M N, M B N, B C N |
//! | three | AB at L, BC at M, CA at N | A L N, L B M, M C N, L M N |

/// How many sides are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    One,
    Two,
    Three,
}

/// A triangle's share of the painted triangle: 2 to the power of minus this. Each cut halves exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Share(u32);

/// The smallest share, 2⁻⁵². Then each middle of a side has exact coordinates in f64, and areas have exact sums. Slicers stop at sides of
/// a few hundredths of a millimetre, after 45 halvings for a side of a metre at most.
const MOST_HALVINGS: u32 = 52;

impl Share {
    pub(super) const WHOLE: Share = Share(0);

    pub(super) fn halved(self, times: u32) -> Share {
        Share(self.0 + times)
    }

    /// Whether it is as large as the smallest one, at least.
    pub(super) fn representable(self) -> bool {
        self.0 <= MOST_HALVINGS
    }

    /// As a multiple of the smallest share.
    pub(super) fn units(self) -> u64 {
        1 << MOST_HALVINGS.saturating_sub(self.0)
    }

    /// The number of these units in the whole.
    pub(super) const UNITS: u64 = 1 << MOST_HALVINGS;
}

/// Points of a split triangle: A, B, C, and the middles of AB, BC, CA.
const MIDDLES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

impl Way {
    pub(super) fn from_sides(sides: u8) -> Option<Way> {
        [Way::One, Way::Two, Way::Three].into_iter().find(|way| way.sides() == sides)
    }

    pub(super) fn sides(self) -> u8 {
        match self {
            Way::One => 1,
            Way::Two => 2,
            Way::Three => 3,
        }
    }

    /// Corners of each child, as numbers of the six points.
    pub(super) fn points(self) -> &'static [[usize; 3]] {
        match self {
            Way::One => &[[0, 1, 4], [4, 2, 0]],
            Way::Two => &[[0, 3, 5], [3, 1, 5], [1, 2, 5]],
            Way::Three => &[[0, 3, 5], [3, 1, 4], [4, 2, 5], [3, 4, 5]],
        }
    }

    /// How often each child's area is halved.
    pub(super) fn halvings(self) -> &'static [u32] {
        match self {
            Way::One => &[1, 1],
            Way::Two => &[2, 2, 1],
            Way::Three => &[2, 2, 2, 2],
        }
    }

    /// Corners of the children, in the coordinates of these corners.
    pub(super) fn corners<const N: usize>(self, first: u8, corners: [[f64; N]; 3]) -> impl Iterator<Item = [[f64; N]; 3]> {
        let counted = [0, 1, 2].map(|k| corners[(k + usize::from(first)) % 3]);
        let middles = MIDDLES.map(|[a, b]| std::array::from_fn(|k| (counted[a][k] + counted[b][k]) / 2.0));
        let all = [counted[0], counted[1], counted[2], middles[0], middles[1], middles[2]];
        self.points().iter().map(move |child| child.map(|point| all[point]))
    }

    /// The child with this place, and the place in it: weights of the corners A, B, C, and of the child's corners. Exact for weights
    /// that are multiples of a power of two. A place on a cut is in the child that comes first.
    pub(super) fn child_at(self, [a, b, c]: [f64; 3]) -> (usize, [f64; 3]) {
        match self {
            Way::One if b >= c => (0, [a, b - c, 2.0 * c]),
            Way::One => (1, [2.0 * b, c - b, a]),
            Way::Two if a >= b + c => (0, in_quarter(0, [a, b, c])),
            Way::Two if a >= c => (1, [2.0 * (a - c), b + c - a, 2.0 * c]),
            Way::Two => (2, [b, c - a, 2.0 * a]),
            Way::Three => {
                let child = if a >= b + c {
                    0
                } else if b >= a + c {
                    1
                } else if c >= a + b {
                    2
                } else {
                    3
                };
                (child, in_quarter(child, [a, b, c]))
            }
        }
    }
}

/// Weights of the corners of a child of three cuts, from weights of A, B, C. Outside of the child, some are negative.
pub(super) fn in_quarter(child: usize, [a, b, c]: [f64; 3]) -> [f64; 3] {
    match child {
        0 => [a - (b + c), 2.0 * b, 2.0 * c],
        1 => [2.0 * a, b - (a + c), 2.0 * c],
        2 => [2.0 * b, c - (a + b), 2.0 * a],
        _ => [a + b - c, b + c - a, a + c - b],
    }
}
