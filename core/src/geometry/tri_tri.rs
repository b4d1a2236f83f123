//! How two triangles meet, decided exactly.
//!
//! Two triangles may meet in what they share (a vertex, an edge; sharing is by equal position) and they may touch: in a
//! point, or edge along edge. They *cross* when they meet along a segment that is inside at least one of them (so also when an
//! edge of one lies in the face of the other), and *overlap* when they are coplanar and share an area.
//!
//! Triangles in different planes meet in a part of the line common to both planes; each cuts an interval out of it. The ends
//! of these intervals lie on edges, and the order of an end on edge e and one on edge f is the sign of one determinant of the
//! four end points (the idea of Guigue & Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation
//! Predicates", JGT 8(1), 2003), so no coordinate of an intersection is ever computed.

use crate::geometry::exact::{Plane, Point, collinear, orientation_along, side};

/// A triangle by the positions of its corners.
pub(crate) type Triangle = [Point; 3];

/// How two triangles meet beyond the corners they share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Contact {
    /// Not at all.
    Apart,
    /// In a point, or edge along edge.
    Touch,
    /// Along a segment inside at least one of them.
    Cross,
    /// Coplanar, in an area.
    Overlap,
}

impl Contact {
    /// Is it a self-intersection of a mesh that has both?
    pub(crate) fn is_crossing(self) -> bool {
        matches!(self, Self::Cross | Self::Overlap)
    }
}

/// The contact of two triangles; exact for all finite coordinates. A triangle of zero area meets nothing.
pub(crate) fn triangles_cross(a: &Triangle, b: &Triangle) -> Contact {
    if boxes_meet(a, b) { meet(a, b, common(a, b), true) } else { Contact::Apart }
}

/// Do two triangles cross or overlap? As [`triangles_cross`] finds it, sooner.
pub(crate) fn do_cross(a: &Triangle, b: &Triangle) -> bool {
    boxes_meet(a, b) && boxed_cross(a, b)
}

fn boxes_meet(a: &Triangle, b: &Triangle) -> bool {
    (0..3).all(|k| {
        let range = |t: &Triangle| (t[0][k].min(t[1][k]).min(t[2][k]), t[0][k].max(t[1][k]).max(t[2][k]));
        let ((a_lo, a_hi), (b_lo, b_hi)) = (range(a), range(b));
        a_lo <= b_hi && b_lo <= a_hi
    })
}

/// The same for two whose boxes meet.
pub(crate) fn boxed_cross(a: &Triangle, b: &Triangle) -> bool {
    meet(a, b, common(a, b), false).is_crossing()
}

/// Which corners of the one are also corners of the other, both ways.
pub(crate) fn common(a: &Triangle, b: &Triangle) -> [[bool; 3]; 2] {
    let mut common = [[false; 3]; 2];
    for (i, p) in a.iter().enumerate() {
        for (j, q) in b.iter().enumerate() {
            if p == q {
                (common[0][i], common[1][j]) = (true, true);
            }
        }
    }
    common
}

/// The same where it does not matter whether two triangles touch or are apart, which is often known sooner. Both have an area;
/// `common` as [`common`] finds it.
pub(crate) fn self_intersection(a: &Triangle, b: &Triangle, common: [[bool; 3]; 2]) -> Option<Contact> {
    let contact = if common[0] == [true; 3] { Contact::Overlap } else { meet(a, b, common, false) };
    contact.is_crossing().then_some(contact)
}

/// Do two edges of two triangles, which are not the same edge, have a stretch in common? [`Contact::Touch`] is told if so: it is no
/// self-intersection, but what is on the two sides of each of them may not be what it is without the other.
pub(crate) fn edge_along_edge(a: &Triangle, b: &Triangle) -> Option<Contact> {
    let meets = |i: usize, j: usize| have_a_stretch_in_common([&a[i], &a[(i + 1) % 3]], [&b[j], &b[(j + 1) % 3]]);
    for i in 0..3 {
        if meets(i, 0) || meets(i, 1) || meets(i, 2) {
            return Some(Contact::Touch);
        }
    }
    None
}

fn have_a_stretch_in_common([a, b]: [&Point; 2], [c, d]: [&Point; 2]) -> bool {
    let range = |p: &Point, q: &Point, k: usize| (p[k].min(q[k]), p[k].max(q[k]));
    let (mut longest, mut length) = (0, 0.0);
    for k in 0..3 {
        let ((lo, hi), (other_lo, other_hi)) = (range(a, b, k), range(c, d, k));
        if lo > other_hi || other_lo > hi {
            return false;
        }
        if hi - lo > length {
            (longest, length) = (k, hi - lo);
        }
    }
    let ((lo, hi), (other_lo, other_hi)) = (range(a, b, longest), range(c, d, longest));
    let is_same = (a == c && b == d) || (a == d && b == c);
    lo.max(other_lo) < hi.min(other_hi) && !is_same && collinear(a, b, c) && collinear(a, b, d)
}

/// `touching`: tell [`Contact::Touch`] from [`Contact::Apart`].
#[inline]
fn meet(a: &Triangle, b: &Triangle, common: [[bool; 3]; 2], touching: bool) -> Contact {
    let shared = common[0].iter().filter(|c| **c).count();
    let of_b = sides_of(a, b, common[1]);
    if one_sided(of_b) || (!touching && in_a_point(of_b)) {
        return Contact::Apart;
    }
    if of_b == [0; 3] {
        return coplanar(a, b, shared, touching);
    }
    if shared >= 2 {
        return Contact::Apart;
    }
    let of_a = sides_of(b, a, common[0]);
    // All zero although b is not in a's plane: b has no area.
    if one_sided(of_a) || of_a == [0; 3] || (!touching && in_a_point(of_a)) {
        return Contact::Apart;
    }
    on_common_line(&Cut::new(a, of_a), &Cut::new(b, of_b), shared)
}

/// The sides of `a`'s plane on which the corners of `b` lie, of which some are `common` to both.
#[inline]
pub(crate) fn sides_of(a: &Triangle, b: &Triangle, common: [bool; 3]) -> [i8; 3] {
    let plane = Plane::new(&a[0], &a[1], &a[2]);
    let side = |k: usize| if common[k] { 0 } else { plane.side(&b[k]) };
    [side(0), side(1), side(2)]
}

/// Is one corner in the plane, with the others on one side of it?
pub(crate) fn in_a_point(signs: [i8; 3]) -> bool {
    signs.iter().filter(|&&s| s == 0).count() == 1 && signs.iter().sum::<i8>().abs() == 2
}

/// Are all corners on one side of the plane?
pub(crate) fn one_sided(signs: [i8; 3]) -> bool {
    signs.iter().all(|&s| s > 0) || signs.iter().all(|&s| s < 0)
}

/// The interval that a triangle cuts out of the line common to both planes.
struct Cut<'a> {
    /// The corner of the two edges on which the interval's ends lie, and the other corners of these edges.
    apex: &'a Point,
    others: [&'a Point; 2],
    /// The interval is one point: a corner.
    point: bool,
    /// The interval is an edge of the triangle.
    edge: bool,
}

impl<'a> Cut<'a> {
    /// `signs`: sides of the other triangle's plane on which the corners lie; neither all equal nor all zero.
    fn new(t: &'a Triangle, signs: [i8; 3]) -> Self {
        let count = |s: i8| signs.iter().filter(|&&x| x == s).count();
        // The corner whose two edges hold the two ends.
        let alone = if count(1) == 1 {
            1
        } else if count(-1) == 1 {
            -1
        } else {
            0
        };
        let apex = signs.iter().position(|&s| s == alone).unwrap_or(0);
        let others = [&t[(apex + 1) % 3], &t[(apex + 2) % 3]];
        Self { apex: &t[apex], others, point: alone == 0, edge: count(0) == 2 }
    }
}

fn on_common_line(a: &Cut<'_>, b: &Cut<'_>, shared: usize) -> Contact {
    // Lines through the ends lie in different planes and cross the common line, so the sign of the determinant says which end
    // comes first: the same way round for all pairs, as a's edges both begin at its apex, on one side of b's plane, and so do b's.
    let (mut below, mut above, mut equal) = (false, false, false);
    for e in a.others {
        let plane = Plane::new(a.apex, e, b.apex);
        for f in b.others {
            let order = plane.side(f);
            (below, above, equal) = (below | (order < 0), above | (order > 0), equal | (order == 0));
        }
    }
    if below != above && !equal {
        return Contact::Apart;
    }
    if a.point || b.point || !(below && above) {
        return if shared > 0 { Contact::Apart } else { Contact::Touch };
    }
    if a.edge && b.edge { Contact::Touch } else { Contact::Cross }
}

/// What rounded arithmetic says of two triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Sure {
    /// Nothing.
    No,
    /// [`Contact::Apart`].
    Apart,
    /// [`Contact::Cross`].
    Cross,
}

/// The contact of two triangles without a common corner as [`triangles_cross`] finds it, as long as no sign that it takes is in doubt
/// or zero. Without branches, so that a loop over many pairs can be compiled to vectors.
#[inline(always)]
pub(crate) fn sure(a: &Triangle, b: &Triangle) -> Sure {
    let (of_b, of_a) = (PlaneSides::new(a, b), PlaneSides::new(b, a));
    let one_sided = of_b.all_above | of_b.all_below | of_a.all_above | of_a.all_below;
    // As in `on_common_line`; meaningless where a plane has all corners on one side, or a sign is in doubt.
    let ((p, others), (q, [f, g])) = (of_a.alone(a), of_b.alone(b));
    let (mut below, mut above, mut all_below, mut all_above) = (false, false, true, true);
    for e in others {
        let plane = Plane::new(&p, &e, &q);
        for f in [f, g] {
            let (order, error) = plane.rounded(&f);
            below |= order < -error;
            above |= order > error;
            all_below &= order < -error;
            all_above &= order > error;
        }
    }
    let signs = of_a.sure & of_b.sure;
    let apart = one_sided | (signs & (all_below | all_above));
    let cross = signs & !one_sided & below & above;
    if apart {
        Sure::Apart
    } else if cross {
        Sure::Cross
    } else {
        Sure::No
    }
}

/// The same for two triangles of which `a[0]` and `b[0]` are one common corner, and the others either are not common, or of `a` one is
/// and `b[1]` and `b[2]` are the corner of the other triangle that is not. Without branches too.
///
/// Where the other corners are on different sides of the other's plane, each triangle cuts out of the common line what begins at
/// the common corner o and goes to the opposite edge. As in `on_common_line`, the order of o on the edge from p, the corner of a above
/// b's plane, and the end on the edge from q, that of b above a's plane, is the sign of −det(p, q, q′) from o on; the order of
/// the end of a and of o is that of −det(p, p′, q). The first is the side of p, above, turned round if (o, q, q′) runs against b,
/// the second the side of q, above, turned round if (o, p, p′) runs against a. They cross where these are different.
#[inline(always)]
pub(crate) fn sure_of_neighbours(a: &Triangle, b: &Triangle) -> Sure {
    let (of_a, of_b) = (Plane::new(&b[0], &b[1], &b[2]), Plane::new(&a[0], &a[1], &a[2]));
    let [(p, x), (q, y)] = [of_a.rounded(&a[1]), of_a.rounded(&a[2])];
    let [(r, z), (s, w)] = [of_b.rounded(&b[1]), of_b.rounded(&b[2])];
    let one_sided = ((p > x) & (q > y)) | ((p < -x) & (q < -y)) | ((r > z) & (s > w)) | ((r < -z) & (s < -w));
    let signs = (p.abs() > x) & (q.abs() > y) & (r.abs() > z) & (s.abs() > w);
    let cross = (p > 0.0) != (r > 0.0);
    if one_sided | (signs & !cross) {
        Sure::Apart
    } else if signs {
        Sure::Cross
    } else {
        Sure::No
    }
}

/// The sides of one triangle's plane on which the corners of another lie, by rounded arithmetic.
struct PlaneSides {
    above: [bool; 3],
    all_above: bool,
    all_below: bool,
    /// None is in doubt or zero.
    sure: bool,
}

impl PlaneSides {
    #[inline(always)]
    fn new(a: &Triangle, b: &Triangle) -> Self {
        let plane = Plane::new(&a[0], &a[1], &a[2]);
        let [(p, x), (q, y), (r, z)] = [plane.rounded(&b[0]), plane.rounded(&b[1]), plane.rounded(&b[2])];
        let all_above = (p > x) & (q > y) & (r > z);
        let all_below = (p < -x) & (q < -y) & (r < -z);
        let sure = (p.abs() > x) & (q.abs() > y) & (r.abs() > z);
        Self { above: [p > 0.0, q > 0.0, r > 0.0], all_above, all_below, sure }
    }

    /// The corner that is alone on its side, and the others.
    #[inline(always)]
    fn alone(&self, t: &Triangle) -> (Point, [Point; 2]) {
        let [p, q, r] = self.above;
        let choose = |first: bool, a: &Point, b: &Point| {
            let coordinate = |k: usize| if first { a[k] } else { b[k] };
            [coordinate(0), coordinate(1), coordinate(2)]
        };
        let (first, second) = (q == r, p == r);
        let apex = choose(first, &t[0], &choose(second, &t[1], &t[2]));
        // Turned round so that the apex comes first.
        (apex, [choose(first, &t[1], &choose(second, &t[2], &t[0])), choose(first, &t[2], &choose(second, &t[0], &t[1]))])
    }
}

/// Both in one plane, or `a` without area.
fn coplanar(a: &Triangle, b: &Triangle, shared: usize, touching: bool) -> Contact {
    // Looking down an axis along which `a` shows an area keeps what is in its plane apart.
    let Some(axis) = (0..3).find(|&k| orientation_along(&a[0], &a[1], &a[2], k) != 0) else { return Contact::Apart };
    let (of_a, of_b) = (orientation_along(&a[0], &a[1], &a[2], axis), orientation_along(&b[0], &b[1], &b[2], axis));
    if of_b == 0 {
        return Contact::Apart;
    }
    if shared == 3 {
        return Contact::Overlap;
    }
    // Convex polygons are apart, or only touch, exactly when an edge of one has the other beyond, or beyond or on it.
    let mut deepest = 1;
    for (x, y, sense) in [(a, b, of_a), (b, a, of_b)] {
        for k in 0..3 {
            let mut inner = -1;
            for p in y {
                inner = inner.max(sense * orientation_along(&x[k], &x[(k + 1) % 3], p, axis));
                if inner == 1 {
                    break;
                }
            }
            deepest = deepest.min(inner);
            if deepest < 1 && !touching {
                return Contact::Apart;
            }
        }
    }
    match (deepest, shared) {
        (1, _) => Contact::Overlap,
        (0, 0) => Contact::Touch,
        (0, 1) if along_each_other(a, b, axis) => Contact::Touch,
        _ => Contact::Apart,
    }
}

/// Coplanar triangles with one common corner and disjoint interiors: do edges from that corner run along each other?
fn along_each_other(a: &Triangle, b: &Triangle, axis: usize) -> bool {
    let Some((i, j)) = (0..3).find_map(|i| b.iter().position(|q| *q == a[i]).map(|j| (i, j))) else { return false };
    let apex = &a[i];
    let ahead = |p: &Point, q: &Point| (0..3).any(|k| (p[k] > apex[k] && q[k] > apex[k]) || (p[k] < apex[k] && q[k] < apex[k]));
    (1..3).any(|s| {
        let p = &a[(i + s) % 3];
        (1..3).any(|t| {
            let q = &b[(j + t) % 3];
            orientation_along(apex, p, q, axis) == 0 && ahead(p, q)
        })
    })
}

/// Does the segment pass through the inside of the triangle, or along it? Touching (an end in the plane, a point of the
/// triangle's border) is not passing. Exact.
pub(crate) fn segment_pierces(a: &Point, b: &Point, t: &Triangle) -> bool {
    segment_pierces_plane(a, b, t, &Plane::new(&t[0], &t[1], &t[2]))
}

/// The same with the triangle's plane, where it is known.
pub(crate) fn segment_pierces_plane(a: &Point, b: &Point, t: &Triangle, plane: &Plane<'_>) -> bool {
    for k in 0..3 {
        let (lo, hi) = (t[0][k].min(t[1][k]).min(t[2][k]), t[0][k].max(t[1][k]).max(t[2][k]));
        if a[k].max(b[k]) < lo || a[k].min(b[k]) > hi {
            return false;
        }
    }
    let (at_a, at_b) = (plane.side(a), plane.side(b));
    if at_a != 0 || at_b != 0 {
        let turns = || [0, 1, 2].map(|k| side(a, b, &t[k], &t[(k + 1) % 3]));
        return at_a * at_b < 0 && one_sided(turns());
    }
    let Some(axis) = (0..3).find(|&k| orientation_along(&t[0], &t[1], &t[2], k) != 0) else { return false };
    let sense = orientation_along(&t[0], &t[1], &t[2], axis);
    let beyond = |k: usize| [a, b].iter().all(|p| sense * orientation_along(&t[k], &t[(k + 1) % 3], p, axis) <= 0);
    let across = t.map(|p| orientation_along(a, b, &p, axis));
    !(0..3).any(beyond) && across.contains(&1) && across.contains(&-1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_run_along_each_other_on_a_stretch_of_one_line() {
        let one = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let along = |from: f32, to: f32| edge_along_edge(&one, &[[from, 0.0, 0.0], [to, 0.0, 0.0], [1.0, 0.0, 3.0]]).is_some();
        assert!(along(1.0, 3.0) && along(0.0, 1.0) && along(3.0, -1.0) && along(2.0, 1.0));
        assert!(!along(2.0, 3.0), "they meet in a point");
        assert!(!along(0.0, 2.0) && !along(2.0, 0.0), "the same edge");
        assert!(edge_along_edge(&one, &[[1.0, 0.0, 1e-30], [3.0, 0.0, 0.0], [1.0, 0.0, 3.0]]).is_none(), "beside it");
    }
}
