//! Planes of corners that are near to each other or have few bits, by integers of 128 bits: nearly all are.

use crate::geometry::arrange::point::{Corner, Point};

/// Bits of a number and its sign.
const BITS: u32 = 126;

/// A plane by its normal, in any unit, and one of its corners.
#[derive(Clone, Debug)]
pub(crate) struct Small {
    pub(crate) normal: [i128; 3],
    through: Corner,
}

impl Small {
    /// `None` if it has too many bits.
    pub(crate) fn of(t: &[Corner; 3]) -> Option<Self> {
        let (u, v) = (less(&t[1], &t[0]), less(&t[2], &t[0]));
        let power = zeros(&[u, v]);
        let (u, v) = (shifted(&u, power), shifted(&v, power));
        if bits(&u) + bits(&v) >= BITS {
            return None;
        }
        let minor = |a: usize, b: usize| u[a] * v[b] - u[b] * v[a];
        let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
        let power = zeros(&[normal]);
        Some(Self { normal: shifted(&normal, power), through: t[0] })
    }

    /// Through an edge, and along an axis.
    pub(crate) fn upright([a, b]: &[Corner; 2], axis: usize) -> Self {
        let along = less(b, a);
        let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut normal = [0; 3];
        (normal[x], normal[y]) = (along[y], -along[x]);
        let power = zeros(&[normal]);
        Self { normal: shifted(&normal, power), through: *a }
    }

    /// Where the line through two corners meets it: `Some(None)` if they are parallel, `None` if that has too many bits.
    pub(crate) fn meets(&self, [a, b]: &[Corner; 2]) -> Option<Option<Point>> {
        let (along, to) = (less(b, a), less(&self.through, a));
        let power = zeros(&[along, to, *a]);
        let (along, to, start) = (shifted(&along, power), shifted(&to, power), shifted(a, power));
        if bits(&self.normal) + bits(&along) + bits(&to).max(bits(&start)) + 3 > BITS {
            return None;
        }
        let dot = |v: &Corner| self.normal[0] * v[0] + self.normal[1] * v[1] + self.normal[2] * v[2];
        let (w, far) = (dot(&along), dot(&to));
        if w == 0 {
            return Some(None);
        }
        let x = |k: usize| (start[k] * w + along[k] * far) * w.signum();
        // Along an edge or in a plane that stands straight.
        let stands = |k: usize| self.normal[(k + 1) % 3] == 0 && self.normal[(k + 2) % 3] == 0;
        let whole = |k: usize| if stands(k) { Some(start[k] + to[k]) } else { (along[k] == 0).then_some(start[k]) };
        let (x, known) = ([x(0), x(1), x(2)], [whole(0), whole(1), whole(2)]);
        Some(Some(Point::of(x, w.unsigned_abs(), power, known)))
    }
}

fn less(a: &Corner, b: &Corner) -> Corner {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn shifted(v: &[i128; 3], power: u32) -> [i128; 3] {
    [v[0] >> power, v[1] >> power, v[2] >> power]
}

/// Bits of the largest magnitude.
fn bits(v: &[i128; 3]) -> u32 {
    128 - (v[0].unsigned_abs() | v[1].unsigned_abs() | v[2].unsigned_abs()).leading_zeros()
}

/// Zeros at the ends of all of these.
fn zeros(all: &[[i128; 3]]) -> u32 {
    match all.iter().fold(0, |any, v| any | v[0] | v[1] | v[2]) {
        0 => 0,
        any => any.trailing_zeros(),
    }
}
