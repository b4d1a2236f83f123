//! Triangles with whole coordinates, and the segments that pairs of them have in common.

use std::sync::OnceLock;

use crate::geometry::arrange::plane::Plane;
use crate::geometry::arrange::point::{BITS, Corner, Point};
use crate::geometry::arrange::quotient::parts;

/// The segments that a triangle has in common with later ones, by the pairs that were looked at.
#[derive(Debug, Default)]
pub(crate) struct Contacts {
    pub(crate) all: Vec<Contact>,
    /// Where they end, if not at corners.
    pub(crate) points: Vec<Point>,
}

/// A segment that a triangle has in common with another one: in which order the ends stand depends on their order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub(crate) other: u32,
    pub(crate) ends: [End; 2],
    /// For triangles in one plane the edge that it lies on.
    pub(crate) edge: Option<Edge>,
}

impl Contacts {
    /// The end at a point.
    pub(crate) fn end_at(&mut self, point: Point) -> End {
        self.points.push(point);
        End::Point(self.points.len() as u32 - 1)
    }
}

/// The edge of a triangle from a corner on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    pub(crate) triangle: u32,
    pub(crate) k: u8,
}

/// Where a segment ends.
#[derive(Clone, Copy, Debug)]
pub(crate) enum End {
    /// At the corner of a triangle where this edge begins.
    Corner(Edge),
    /// At one of the points of the contacts.
    Point(u32),
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
        let [a, b, c] = &self.triangles[t];
        [self.position(a), self.position(b), self.position(c)]
    }

    /// The position where an edge begins, as it was read.
    pub(crate) fn corner(&self, Edge { triangle, k }: Edge) -> [f32; 3] {
        self.triangles[triangle as usize][k as usize]
    }

    /// Where an edge begins and ends.
    pub(crate) fn edge(&self, Edge { triangle, k }: Edge) -> [Corner; 2] {
        let (t, k) = (&self.triangles[triangle as usize], k as usize);
        [self.position(&t[k]), self.position(&t[(k + 1) % 3])]
    }

    fn position(&self, p: &[f32; 3]) -> Corner {
        [self.whole(p[0]), self.whole(p[1]), self.whole(p[2])]
    }

    #[inline]
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
