//! Triangles with whole coordinates, and the segments that pairs of them have in common.

use std::sync::OnceLock;

use crate::geometry::arrange::point::{BITS, Corner, Plane, Point, parts};

/// A segment that two triangles have in common: in which order the ends stand depends on their order.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) ends: [Point; 2],
    /// For a crossing of two planes, that of the other triangle.
    pub(crate) edge: Option<[Corner; 2]>,
}

/// Triangles with their corners in units in which all of these are whole.
pub(crate) struct Soup<'a> {
    pub(crate) triangles: &'a [[[f32; 3]; 3]],
    /// Two to this power is the unit.
    pub(crate) power: i32,
    planes: Vec<OnceLock<Box<Plane>>>,
}

impl<'a> Soup<'a> {
    /// `None` if coordinates have too many bits between the largest and the smallest.
    pub(crate) fn new(triangles: &'a [[[f32; 3]; 3]]) -> Option<Self> {
        let all = || triangles.as_flattened().as_flattened().iter().filter(|x| **x != 0.0).map(|x| parts(f64::from(*x)));
        let power = all().map(|(mantissa, power)| power + mantissa.trailing_zeros() as i32).min().unwrap_or(0);
        let top = all().map(|(_, power)| power + 53).max().unwrap_or(0);
        let planes = (0..triangles.len()).map(|_| OnceLock::new()).collect();
        (top - power <= BITS as i32).then_some(Self { triangles, power, planes })
    }

    pub(crate) fn corners(&self, t: usize) -> [Corner; 3] {
        self.triangles[t].map(|p| p.map(|x| self.whole(x)))
    }

    fn whole(&self, x: f32) -> i128 {
        if x == 0.0 {
            return 0;
        }
        let (mantissa, power) = parts(f64::from(x));
        let by = power - self.power;
        let magnitude = if by >= 0 { i128::from(mantissa) << by } else { i128::from(mantissa) >> -by };
        if x < 0.0 { -magnitude } else { magnitude }
    }

    pub(crate) fn plane(&self, t: usize) -> &Plane {
        self.planes[t].get_or_init(|| Box::new(Plane::of(&self.corners(t))))
    }
}
