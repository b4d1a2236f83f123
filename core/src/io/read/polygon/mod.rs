//! A polygon in space, cut into triangles.
//!
//! **In:** the corners in order, at least nearly in one plane. A hole is joined by a bridge that is walked twice (a keyhole polygon).
//!
//! **Out:** n - 2 triangles for n corners, in the polygon's direction.
//!
//! **Promise:** of a polygon that does not cross itself, no triangle overlaps another or has the wrong direction; corners that repeat and edges that
//! go back on themselves cost triangles without area. Of every other polygon the triangles are the same each time. Work and memory are bounded for
//! each polygon: beyond the bounds the rest of it is a fan, which may lie outside, and the caller is told.
//!
//! The polygon is looked at along the axis that is nearest to its normal (M. E. Newell's, in I. E. Sutherland, R. F. Sproull, R. A. Schumacker,
//! "A characterization of ten hidden-surface algorithms", 1974). Coordinates stay as they are, so that predicates decide exactly.

mod cells;
mod ears;
#[cfg(test)]
mod tests;

use robust::{Coord, orient2d};

use crate::io::record::Point;

/// Corners of a polygon that is clipped, at most: beyond them it becomes a fan, for want of memory. Real files have faces of some thousands.
const MOST_CLIPPED: usize = 1 << 17;

/// Whether the triangles of a polygon cover it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// As far as any can.
    Whole,
    /// Some are a fan that may lie outside of it: its halves cancel, it crosses itself too much, or has too many corners.
    Fan,
}

/// Calls `take` with the corners of each triangle, as places in `polygon`, in the polygon's direction; n - 2 of them for n corners.
///
/// A convex polygon becomes a fan from its first corner, as most readers have it. O(n log n) for the polygons of real files; at most about
/// 64 n log n steps, or 2^26, for any, and 128 bytes per corner of those that are clipped.
pub(crate) fn cut(polygon: &[Point], take: impl FnMut([usize; 3])) -> Cut {
    let plane = Plane::of(polygon).filter(|_| polygon.len() > 3);
    match (plane, polygon) {
        (Some(plane), &[a, b, c, d]) => {
            quad([a, b, c, d].map(|corner| plane.flat(corner))).into_iter().for_each(take);
            Cut::Whole
        }
        (Some(plane), _) if is_convex(polygon, plane) => fan(polygon.len(), take, Cut::Whole),
        (Some(plane), _) if polygon.len() <= MOST_CLIPPED => {
            if ears::clip(polygon.iter().map(|corner| plane.flat(*corner)), take) { Cut::Whole } else { Cut::Fan }
        }
        _ => fan(polygon.len(), take, if polygon.len() > 3 && !is_line(polygon) { Cut::Fan } else { Cut::Whole }),
    }
}

fn fan(corners: usize, take: impl FnMut([usize; 3]), cut: Cut) -> Cut {
    (2..corners).map(|last| [0, last - 1, last]).for_each(take);
    cut
}

/// The two coordinates to look at, in the order that turns the polygon counter-clockwise.
#[derive(Clone, Copy, Debug)]
struct Plane([usize; 2]);

impl Plane {
    /// `None` for a polygon without a normal.
    fn of(polygon: &[Point]) -> Option<Self> {
        let origin = polygon.first()?.map(f64::from);
        let offset = |corner: &Point| [0, 1, 2].map(|axis| f64::from(corner[axis]) - origin[axis]);
        let mut normal = [0.0; 3];
        let mut before = offset(polygon.last()?);
        for corner in polygon {
            let here = offset(corner);
            for (axis, sum) in normal.iter_mut().enumerate() {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                *sum += before[u] * here[v] - before[v] * here[u];
            }
            before = here;
        }
        // A coordinate that is not finite leaves no number.
        let largest = |best: usize, axis: usize| if normal[axis].abs() > normal[best].abs() { axis } else { best };
        let axis = largest(largest(0, 1), 2);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let usable = normal.iter().all(|sum| sum.is_finite()) && normal[axis] != 0.0;
        usable.then_some(Self(if normal[axis] > 0.0 { [u, v] } else { [v, u] }))
    }

    #[inline]
    fn flat(self, corner: Point) -> Coord<f64> {
        let Self([u, v]) = self;
        Coord { x: f64::from(corner[u]), y: f64::from(corner[v]) }
    }
}

/// All corners on a line, or in one place: no triangle has an area.
fn is_line(polygon: &[Point]) -> bool {
    let Some((a, b)) = polygon.first().and_then(|a| Some((a, polygon.iter().find(|b| *b != a)?))) else { return true };
    let planes = [Plane([0, 1]), Plane([1, 2]), Plane([2, 0])];
    let is_on = |corner: &Point| planes.iter().all(|plane| orient2d(plane.flat(*a), plane.flat(*b), plane.flat(*corner)) == 0.0);
    polygon.iter().all(is_on)
}

/// The first diagonal that leaves no triangle of the wrong direction, with preference for two that have an area.
fn quad([a, b, c, d]: [Coord<f64>; 4]) -> [[usize; 3]; 2] {
    let first = [orient2d(a, b, c), orient2d(a, c, d)];
    let other = [orient2d(b, c, d), orient2d(b, d, a)];
    let all = |turns: [f64; 2], fits: fn(f64) -> bool| turns.into_iter().all(fits);
    let takes_other = !all(first, |turn| turn > 0.0)
        && (all(other, |turn| turn > 0.0) || !all(first, |turn| turn >= 0.0) && all(other, |turn| turn >= 0.0));
    if takes_other { [[1, 2, 3], [1, 3, 0]] } else { [[0, 1, 2], [0, 2, 3]] }
}

/// Turning left at every corner, and once around.
fn is_convex(polygon: &[Point], plane: Plane) -> bool {
    let [.., last, end] = polygon else { return false };
    let (mut a, mut b) = (plane.flat(*last), plane.flat(*end));
    let forward = |a: Coord<f64>, b: Coord<f64>| (a.x, a.y) < (b.x, b.y);
    let mut was_forward = forward(a, b);
    let mut changes = 0;
    for corner in polygon {
        let c = plane.flat(*corner);
        if orient2d(a, b, c) <= 0.0 {
            return false;
        }
        // Each time around, the direction changes twice between rising and falling.
        let is_forward = forward(b, c);
        changes += usize::from(is_forward != was_forward);
        (a, b, was_forward) = (b, c, is_forward);
    }
    changes == 2
}
