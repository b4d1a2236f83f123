//! A strip of triangles between two polylines: between the two rims of a missing ring, or between the two sides of a narrow loop.
//!
//! Every triangle stands on an edge of one side and has its apex on the other, so that a strip is a path through the grid of pairs (a
//! vertex of the one side, a vertex of the other), one step for each triangle, and has the right topology whatever its shape. The best
//! path comes from dynamic programming (Fuchs, Kedem & Uselton, "Optimal surface reconstruction from planar contours", CACM 20 (1977);
//! across gaps in space: Barequet & Sharir, "Filling gaps in the boundary of a polyhedron", CAGD 12 (1995)). A state of it says by which kind of step it
//! was come to, so that the triangle before is known and bends are weighed exactly.
//!
//! Around a ring the path begins and ends at one pair: the nearest one. Where triangles of the best path are not valid they are
//! banned and the next best path is looked for; then the path begins elsewhere.

use std::ops::Range;

use glam::DVec3;

use super::patch::{Method, Patch, Unfillable, in_order, patch};
use super::rim::{Fault, Rim, Surroundings, are_distinct, crosses_itself, runs_once};
use crate::geometry::exact::{Point, at};

/// Pairs of vertices up to which all are looked at; beyond, those at about the same share of both lengths.
const ALL_PAIRS: usize = 4_000_000;
/// Pairs looked at for one strip, over all attempts, but for the first one of each kind.
const WORK: usize = 16_000_000;
/// Paths looked for from one beginning.
const ATTEMPTS: usize = 48;
/// Weight of an edge between the sides, as a share of its square: of strips of equal area and bend, that with the shortest edges.
const SHORT: f64 = 0.25;

/// The weight beside the edges' lengths.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Weight {
    /// The area, and how much it bends.
    Bend,
    /// The area.
    Area,
}

/// One way along a rim, as triangles meet it.
struct Side {
    /// Vertices in order; the first one again at the end of a ring.
    vertices: Vec<u32>,
    positions: Vec<DVec3>,
    /// Unit normal of the mesh's triangle beyond the edge from each vertex to the next; zero: unknown.
    beyond: Vec<DVec3>,
}

impl Side {
    /// Edges.
    fn len(&self) -> usize {
        self.vertices.len() - 1
    }

    /// Of `count` edges of a rim from its vertex `start`, forwards or backwards; `first`: number of the rim's first vertex.
    fn along(rim: &Rim<'_>, first: u32, start: usize, count: usize, forwards: bool) -> Self {
        let n = rim.len();
        let place = |i: usize| if forwards { (start + i) % n } else { (start + n - i % n) % n };
        let positions = (0..=count).map(|i| at(&rim.points[place(i)])).collect();
        let beyond = (0..count).map(|i| rim.normal_beyond(if forwards { place(i) } else { place(i + 1) })).collect();
        Self { vertices: (0..=count).map(|i| first + place(i) as u32).collect(), positions, beyond }
    }

    /// For each vertex, the share of the length that lies before it.
    fn shares(&self) -> Vec<f64> {
        let mut shares = vec![0.0];
        let mut length = 0.0;
        for pair in self.positions.windows(2) {
            length += pair[0].distance(pair[1]);
            shares.push(length);
        }
        if length > 0.0 {
            shares.iter_mut().for_each(|s| *s /= length);
        }
        shares
    }
}

/// Triangles between two rims, over the vertices of the first and then those of the second: n + m of them, each rim's edges in their
/// rim's direction. The rims have no vertex in common and run opposite ways round, as rims of a missing ring do. `joined`: is there an
/// edge of the mesh between a vertex of the first and one of the second already, both by their place in the strip?
///
/// For the strip holds, exactly: it is an annulus with the rims as its border; no triangle has zero area; no edge across is there
/// already; it neither crosses nor overlaps itself, nor any of the mesh's triangles along the rims. O(n m) for rims of up to some
/// thousand vertices each, about O(n + m) beyond.
pub(crate) fn bridge(rims: [&Rim<'_>; 2], joined: &dyn Fn(u32, u32) -> bool) -> Result<Vec<[u32; 3]>, Unfillable> {
    let [a, b] = rims;
    let points = [a.points, b.points].concat();
    let (n, m) = (a.len(), b.len());
    if n < 3 || m < 3 || u32::try_from(n + m).is_err() || !are_distinct(&points) {
        return Err(Unfillable::NotALoop);
    }
    let second = n as u32;
    let beyond = (0..n).map(|i| a.neighbour(i)).chain((0..m).map(|i| b.neighbour(i))).collect();
    let allows = |p: u32, q: u32| (p < second) == (q < second) || !joined(p.min(q), p.max(q));
    let around = Surroundings::new(&points, beyond, &allows);
    let mut search = Search { points: &points, around, work: WORK, fault: None };
    let (i, j) = nearest_pair(&points[..n], &points[n..]);
    // And from elsewhere around the ring.
    let other = |i: usize| (i, nearest_pair(&points[i..=i], &points[n..]).1);
    for weight in [Weight::Bend, Weight::Area] {
        for (i, j) in [(i, j), other((i + n / 3) % n), other((i + 2 * n / 3) % n)] {
            let sides = [Side::along(a, 0, i, n, true), Side::along(b, second, j, m, false)];
            // Once around the one rim from a single vertex of the other, it would come back to the edge that it began with.
            if let Some(triangles) = search.run(&sides, weight).filter(|triangles| runs_once(triangles, |v| v)) {
                return Ok(in_order(triangles));
            }
        }
    }
    Err(search.fault.unwrap_or(Unfillable::Blocked))
}

/// Closes a loop by a strip between its two sides, which meet at the vertices `folds`: n − 2 triangles, valid as those of
/// [`super::triangulate`] are. Time as for [`bridge`].
pub(crate) fn zip(rim: &Rim<'_>, folds: [usize; 2]) -> Result<Patch, Unfillable> {
    let n = rim.len();
    if !rim.is_loop() || folds.iter().any(|f| *f >= n) || folds[0] == folds[1] {
        return Err(Unfillable::NotALoop);
    }
    let count = (folds[1] + n - folds[0]) % n;
    let sides = [Side::along(rim, 0, folds[0], count, true), Side::along(rim, 0, folds[0], n - count, false)];
    let beyond = (0..n).map(|i| rim.neighbour(i)).collect();
    let allows = |a: u32, b: u32| rim.allows(a, b);
    let around = Surroundings::new(rim.points, beyond, &allows);
    let mut search = Search { points: rim.points, around, work: WORK, fault: None };
    for weight in [Weight::Bend, Weight::Area] {
        if let Some(triangles) = search.run(&sides, weight) {
            return Ok(patch(triangles, Method::Zipped));
        }
    }
    Err(search.fault.unwrap_or(Unfillable::Blocked))
}

/// The nearest of the one and the other points; of very many, nearly.
fn nearest_pair(some: &[Point], others: &[Point]) -> (usize, usize) {
    let nearest = |p: DVec3, points: &[Point], step: usize| {
        let distances = points.iter().map(|q| at(q).distance_squared(p)).enumerate().step_by(step);
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or((0, f64::INFINITY), |(i, d)| (i, d))
    };
    let step = (some.len() * others.len()).div_ceil(ALL_PAIRS);
    let pairs = (0..some.len()).step_by(step).map(|i| (i, nearest(at(&some[i]), others, 1)));
    let (i, (j, _)) = pairs.min_by(|a, b| a.1.1.total_cmp(&b.1.1)).unwrap_or((0, (0, 0.0)));
    if step == 1 { (i, j) } else { (nearest(at(&others[j]), some, 1).0, j) }
}

/// A step of the path: from a vertex of the first side to the next, or of the second.
#[derive(Clone, Copy)]
struct Step {
    of_second: bool,
    i: usize,
    j: usize,
}

/// Looks for a valid strip, as long as there is work left.
struct Search<'a> {
    points: &'a [Point],
    around: Surroundings<'a>,
    work: usize,
    /// The fault that the first path came to grief on.
    fault: Option<Unfillable>,
}

impl Search<'_> {
    fn run(&mut self, sides: &[Side; 2], weight: Weight) -> Option<Vec<[u32; 3]>> {
        let mut grid = Grid::new(sides);
        for _ in 0..ATTEMPTS {
            // The first path of all is looked for however large the grid.
            if self.work < grid.cells.len() && self.work < WORK {
                return None;
            }
            self.work = self.work.saturating_sub(grid.cells.len());
            let path = grid.best(sides, weight)?;
            let (steps, triangles): (Vec<Step>, Vec<[u32; 3]>) = path.into_iter().unzip();
            let mut wrong: Vec<usize> = (0..steps.len()).filter(|k| !self.around.admits(&triangles[*k])).collect();
            let mut fault = Fault::Inadmissible;
            if wrong.is_empty() {
                fault = match crosses_itself(self.points, &triangles) {
                    Ok(()) => return Some(triangles),
                    Err(fault) => fault,
                };
                if let Fault::Crossing(i, j) = fault {
                    wrong.push(if self.area(triangles[i]) > self.area(triangles[j]) { i } else { j });
                }
            }
            self.fault.get_or_insert(fault.into());
            if wrong.is_empty() {
                return None;
            }
            wrong.iter().for_each(|k| grid.ban(steps[*k], sides));
        }
        None
    }

    fn area(&self, t: [u32; 3]) -> f64 {
        let [a, b, c] = t.map(|v| at(&self.points[v as usize]));
        (b - a).cross(c - a).length()
    }
}

/// Bits of a cell: where the path to each step from it came from, and whether the step is banned.
const FROM_SECOND: [u8; 2] = [1, 2];
const BANNED: [u8; 2] = [4, 8];

/// The pairs of vertices that the path may go through.
struct Grid {
    /// For each vertex of the first side, those of the second; both ends ascend, and neighbouring rows overlap.
    rows: Vec<Range<usize>>,
    /// Where each row begins in `cells`.
    starts: Vec<usize>,
    cells: Vec<u8>,
}

impl Grid {
    fn new(sides: &[Side; 2]) -> Self {
        let [n, m] = [sides[0].len(), sides[1].len()];
        let rows: Vec<Range<usize>> = if (n + 1) * (m + 1) <= ALL_PAIRS {
            vec![0..m + 1; n + 1]
        } else {
            let (shares, others) = (sides[0].shares(), sides[1].shares());
            let middle: Vec<usize> = shares.iter().map(|s| others.partition_point(|o| o <= s).saturating_sub(1)).collect();
            let reach = (ALL_PAIRS / 2 / (n + 1)).max(16);
            (0..=n)
                .map(|i| middle[i.saturating_sub(1)].saturating_sub(reach)..(middle[(i + 1).min(n)] + reach).min(m) + 1)
                .collect()
        };
        let mut starts = Vec::with_capacity(n + 1);
        let mut count = 0;
        for row in &rows {
            starts.push(count);
            count += row.len();
        }
        Self { rows, starts, cells: vec![0; count] }
    }

    fn cell(&mut self, i: usize, j: usize) -> &mut u8 {
        &mut self.cells[self.starts[i] + j - self.rows[i].start]
    }

    /// Bans a step, and its copy where the apex is both the first and the last vertex of its side.
    fn ban(&mut self, step: Step, sides: &[Side; 2]) {
        let Step { of_second, i, j } = step;
        let copies = |k: usize, side: &Side| {
            let ring = side.vertices.first() == side.vertices.last() && (k == 0 || k == side.len());
            if ring { [0, side.len()] } else { [k, k] }
        };
        for k in if of_second { copies(i, &sides[0]) } else { copies(j, &sides[1]) } {
            let (i, j) = if of_second { (k, j) } else { (i, k) };
            if self.rows[i].contains(&j) {
                *self.cell(i, j) |= BANNED[usize::from(of_second)];
            }
        }
    }

    /// The best path without banned steps and its triangles, but for those (at the ends of a loop's sides) that have a vertex twice.
    fn best(&mut self, sides: &[Side; 2], weight: Weight) -> Option<Vec<(Step, [u32; 3])>> {
        let [first, second] = sides;
        let (n, m) = (first.len(), second.len());
        // Costs of coming to a cell by a step of the first side, and the normals of their triangles: of this row and of the next.
        let mut come = vec![(f64::INFINITY, DVec3::ZERO); m + 1];
        let mut next = come.clone();
        come[0] = (0.0, DVec3::ZERO);
        let mut last_of_second = false;
        for i in 0..=n {
            if let Some(row) = self.rows.get(i + 1) {
                next[row.clone()].fill((f64::INFINITY, DVec3::ZERO));
            }
            // And by a step of the second.
            let mut across = (f64::INFINITY, DVec3::ZERO);
            for j in self.rows[i].clone() {
                let (p, q) = (first.positions[i], second.positions[j]);
                let square = p.distance_squared(q);
                let ways = [come[j], across];
                let onward = |a: DVec3, b: DVec3, apex: DVec3, new_edge: f64, beyond: DVec3| {
                    onward(ways, weight, square, [a, b, apex], new_edge, beyond)
                };
                if (i, j) == (n, m) {
                    last_of_second = across.0 < come[j].0;
                    if !across.0.min(come[j].0).is_finite() {
                        return None;
                    }
                    break;
                }
                let mut bits = *self.cell(i, j) & (BANNED[0] | BANNED[1]);
                if i < n && bits & BANNED[0] == 0 && self.rows[i + 1].contains(&j) {
                    let onto = first.positions[i + 1];
                    let (cost, normal, from_second) = onward(p, onto, q, onto.distance_squared(q), first.beyond[i]);
                    next[j] = (cost, normal);
                    bits |= if from_second { FROM_SECOND[0] } else { 0 };
                }
                let mut stepped = (f64::INFINITY, DVec3::ZERO);
                if j < m && bits & BANNED[1] == 0 {
                    let onto = second.positions[j + 1];
                    let (cost, normal, from_second) = onward(onto, q, p, onto.distance_squared(p), second.beyond[j]);
                    stepped = (cost, normal);
                    bits |= if from_second { FROM_SECOND[1] } else { 0 };
                }
                across = stepped;
                *self.cell(i, j) = bits;
            }
            std::mem::swap(&mut come, &mut next);
        }
        Some(self.walk_back(sides, last_of_second))
    }

    fn walk_back(&mut self, [first, second]: &[Side; 2], mut of_second: bool) -> Vec<(Step, [u32; 3])> {
        let (mut i, mut j) = (first.len(), second.len());
        let mut path = Vec::with_capacity(i + j);
        while (i, j) != (0, 0) {
            let triangle = if of_second {
                j -= 1;
                [second.vertices[j + 1], second.vertices[j], first.vertices[i]]
            } else {
                i -= 1;
                [first.vertices[i], first.vertices[i + 1], second.vertices[j]]
            };
            if triangle[0] != triangle[2] && triangle[1] != triangle[2] {
                path.push((Step { of_second, i, j }, triangle));
            }
            of_second = *self.cell(i, j) & FROM_SECOND[usize::from(of_second)] != 0;
        }
        path.reverse();
        path
    }
}

/// 1 − cos of the angle between unit normals; 0 where one is unknown.
fn bend(a: DVec3, b: DVec3) -> f64 {
    if a == DVec3::ZERO || b == DVec3::ZERO { 0.0 } else { 1.0 - a.dot(b) }
}

/// The cost of going on by a triangle, its normal, and whether the way to it by the second side is the cheaper one. `ways`: what it costs to come by
/// each side, and the normals there; `square`: of the edge in between.
#[inline(always)]
fn onward(
    ways: [(f64, DVec3); 2],
    weight: Weight,
    square: f64,
    [a, b, apex]: [DVec3; 3],
    new_edge: f64,
    beyond: DVec3,
) -> (f64, DVec3, bool) {
    let normal = (b - a).cross(apex - a) * 0.5;
    let area = normal.length();
    let normal = if area > 0.0 { normal / area } else { DVec3::ZERO };
    let [by_first, by_second] = ways.map(|(cost, before)| match weight {
        Weight::Bend => cost + square * bend(before, normal),
        Weight::Area => cost,
    });
    let (cost, from_second) = if by_second < by_first { (by_second, true) } else { (by_first, false) };
    let own = match weight {
        Weight::Bend => area * (1.0 + bend(normal, beyond)),
        Weight::Area => area,
    };
    (cost + own + SHORT * new_edge, normal, from_second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tri_tri::triangles_cross;
    use proptest::prelude::*;
    use std::collections::HashMap;

    /// `radii.len()` points around z.
    fn around(radii: &[f32], height: impl Fn(usize) -> f32, forwards: bool) -> Vec<Point> {
        let n = radii.len();
        let mut points: Vec<Point> = (0..n)
            .map(|i| {
                let (sin, cos) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
                [radii[i] * cos, radii[i] * sin, height(i)]
            })
            .collect();
        if !forwards {
            points.reverse();
        }
        points
    }

    fn circle(n: usize, radius: f32, z: f32, forwards: bool) -> Vec<Point> {
        around(&vec![radius; n], |_| z, forwards)
    }

    fn between(a: &[Point], b: &[Point]) -> Result<Vec<[u32; 3]>, Unfillable> {
        let free = |_: u32, _: u32| false;
        let [a, b] = [a, b].map(|points| Rim { points, apexes: &[], obstacles: &[], forbidden: &free });
        bridge([&a, &b], &free)
    }

    /// Each rim's edges are used once, in their direction, all others once in each, and no two triangles cross: by brute force.
    fn check(rims: &[&[Point]], triangles: &[[u32; 3]]) {
        let points: Vec<Point> = rims.concat();
        let mut uses: HashMap<(u32, u32), u32> = HashMap::new();
        for t in triangles {
            (0..3).for_each(|k| *uses.entry((t[k], t[(k + 1) % 3])).or_default() += 1);
        }
        let mut first = 0;
        for rim in rims {
            let n = rim.len() as u32;
            for i in 0..n {
                let (a, b) = (first + i, first + (i + 1) % n);
                assert_eq!((uses.remove(&(a, b)), uses.remove(&(b, a))), (Some(1), None));
            }
            first += n;
        }
        assert!(uses.iter().all(|((a, b), count)| *count == 1 && uses.get(&(*b, *a)) == Some(&1)));
        let corners: Vec<_> = triangles.iter().map(|t| t.map(|v| points[v as usize])).collect();
        for (i, s) in corners.iter().enumerate() {
            assert!(corners[..i].iter().all(|t| !triangles_cross(s, t).is_crossing()));
        }
    }

    #[test]
    fn rims_of_different_density_are_bridged_in_one_plane_and_in_two() {
        for (n, m) in [(24, 400), (400, 24), (3, 3), (3, 50), (200, 200), (31, 37)] {
            for (radius, z) in [(5.0, 0.0), (10.0, 1.0), (10.0, 20.0), (7.0, 0.5)] {
                let (a, b) = (circle(n, 10.0, 0.0, true), circle(m, radius, z, false));
                if radius == 5.0 && n.min(m) == 3 {
                    // A triangle of circumradius 10 only touches the circle of radius 5.
                    continue;
                }
                let strip = between(&a, &b).unwrap();
                assert_eq!(strip.len(), n + m);
                check(&[&a, &b], &strip);
            }
        }
    }

    #[test]
    fn very_large_rims_are_bridged_within_a_band() {
        let (a, b) = (circle(5000, 10.0, 0.0, true), circle(3000, 9.0, 1.0, false));
        let strip = between(&a, &b).unwrap();
        assert_eq!(strip.len(), 8000);
        // No edge goes astray.
        let points = [a, b].concat();
        assert!(
            strip
                .iter()
                .flatten()
                .zip(strip.iter().flat_map(|t| [t[1], t[2], t[0]]))
                .all(|(p, q)| { at(&points[*p as usize]).distance(at(&points[q as usize])) < 2.0 })
        );
    }

    #[test]
    fn an_edge_that_is_there_already_is_avoided() {
        let (a, b) = (circle(8, 10.0, 0.0, true), circle(8, 10.0, 5.0, false));
        let free = |_: u32, _: u32| false;
        let rims = [&a, &b].map(|points| Rim { points, apexes: &[], obstacles: &[], forbidden: &free });
        let straight = |i: u32, j: u32| i == 2 && a[2][..2] == b[j as usize - 8][..2];
        let strip = bridge([&rims[0], &rims[1]], &straight).unwrap();
        check(&[&a, &b], &strip);
        assert!(!strip.iter().any(|t| (8..16).any(|j| straight(2, j) && t.contains(&2) && t.contains(&j))));
        assert_eq!(bridge([&rims[0], &rims[1]], &|_, _| true), Err(Unfillable::Blocked));
    }

    #[test]
    fn a_strip_does_not_come_back_to_an_edge_that_it_has_run_through() {
        // Two skins of a plate lack a triangle each; what stands beside leaves only edges at one vertex of each rim.
        let upper: Vec<Point> = vec![[12.0, 0.0, 0.2], [13.0, 1.0, 0.2], [12.0, 1.0, 0.2]];
        let lower: Vec<Point> = vec![[12.0, 1.0, 0.0], [13.0, 1.0, 0.0], [12.0, 0.0, 0.0]];
        let free = |_: u32, _: u32| false;
        let rims = [&upper, &lower].map(|points| Rim { points, apexes: &[], obstacles: &[], forbidden: &free });
        check(&[&upper, &lower], &bridge([&rims[0], &rims[1]], &free).unwrap());
        let left = [(0, 3), (1, 3), (2, 3), (1, 4), (1, 5)];
        assert!(bridge([&rims[0], &rims[1]], &|i, j| !left.contains(&(i, j))).is_err());
    }

    #[test]
    fn a_narrow_loop_is_closed_from_fold_to_fold() {
        // Two sides of ten edges over a wave.
        let side = |y: f32| (0..11).map(move |i| [i as f32, y, (i as f32).sin()]);
        let mut points: Vec<Point> = side(0.0).collect();
        points.extend(side(0.3).take(10).skip(1).collect::<Vec<_>>().into_iter().rev());
        let free = |_: u32, _: u32| false;
        let rim = Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &free };
        for folds in [[0, 10], [10, 0], [0, 9], [1, 11]] {
            let triangles = zip(&rim, folds).unwrap().triangles;
            assert_eq!(triangles.len(), points.len() - 2, "{folds:?}");
            check(&[&points], &triangles);
        }
        assert_eq!(zip(&rim, [3, 3]), Err(Unfillable::NotALoop));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Rough rims: what comes of them is valid, and something does as long as they are not too rough.
        #[test]
        fn a_strip_between_rough_rims_is_valid(
            outer in prop::collection::vec(8.0_f32..10.0, 6..40),
            inner in prop::collection::vec(3.0_f32..4.0, 5..40),
            heights in prop::collection::vec(-0.5_f32..0.5, 40),
            apart in 0.0_f32..9.0,
        ) {
            let a = around(&outer, |i| heights[i], true);
            let b = around(&inner, |i| apart + heights[39 - i], false);
            let strip = between(&a, &b).unwrap();
            check(&[&a, &b], &strip);
            prop_assert_eq!(&strip, &between(&a, &b).unwrap());
        }
    }
}
