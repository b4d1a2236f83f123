//! A closed outline taken apart into flat pieces, run by run.
//!
//! What is beside a run in the plane of that run ends at the planes of the runs before and after: at the line between its ends if these two
//! lie in one plane, else in the point where the three planes meet. So a run is replaced by that line or point, until what is left lies in
//! a plane, as a roof is made from the walls under it.

use glam::DVec3;

use super::runs::{Flat, Lie, fewest, lie};
use crate::geometry::exact::{Point, at};
use crate::geometry::position::Position;
use crate::geometry::sums::step_at;

/// Outlines looked at for one loop.
const MOST_OUTLINES: usize = 48;
/// Pieces of one patch.
const MOST_PIECES: usize = 8;
/// Planes meet in a point if their normals span at least this volume.
const SPANNED: f64 = 0.05;
/// Planes are one if their normals have at least this cosine.
const ONE_PLANE: f64 = 1.0 - 1e-6;
/// A new vertex is no farther from the loop's middle than so many of its radii.
const FARTHEST: f64 = 2.5;

/// The search for pieces.
pub(super) struct Search<'a, F> {
    /// The loop's vertices, then the new ones.
    pub(super) points: Vec<Point>,
    /// Of each edge of the loop the normal beyond.
    pub(super) beyond: &'a [Option<DVec3>],
    pub(super) tolerance: f64,
    /// Centre and radius of the loop.
    pub(super) reach: (DVec3, f64),
    pub(super) may_add: bool,
    /// Outlines that were looked at: one comes up again when runs apart are closed in another order.
    seen: Vec<Vec<Position>>,
    pieces: Vec<Vec<u32>>,
    /// Is shown each way.
    show: F,
}

/// A way to take a loop apart.
pub(super) struct Shown<'a> {
    /// The loop's vertices, then the new ones.
    pub(super) points: &'a [Point],
    pub(super) pieces: &'a [Vec<u32>],
    /// Surface beyond the loop lies in the plane of each piece.
    pub(super) told: bool,
}

/// A run of an outline.
struct Run {
    /// Places in the outline, the ends included.
    vertices: Vec<u32>,
    plane: Option<Flat>,
}

impl<'a, F: FnMut(&Shown<'_>)> Search<'a, F> {
    pub(super) fn new(rim: &[Point], beyond: &'a [Option<DVec3>], tolerance: f64, reach: (DVec3, f64), show: F) -> Self {
        Self { points: rim.to_vec(), beyond, tolerance, reach, may_add: true, seen: Vec::new(), pieces: Vec::new(), show }
    }

    /// Shows a corner or an edge that surface around it tells: the loop runs through two or three planes of surface beyond it, one after the other.
    pub(super) fn peel_told(&mut self) {
        let n = self.beyond.len();
        let place = |i: usize| at(&self.points[i % n]);
        let Some(normals) = self.beyond.iter().copied().collect::<Option<Vec<DVec3>>>() else { return };
        let turns = |i: &usize| normals[*i].dot(normals[(*i + n - 1) % n]) < ALONG;
        let starts: Vec<usize> = (0..n).filter(turns).collect();
        let k = starts.len();
        if !(2..=3).contains(&k) {
            return;
        }
        let mut runs: Vec<Vec<u32>> = Vec::new();
        let mut planes: Vec<Flat> = Vec::new();
        for (r, from) in starts.iter().enumerate() {
            let to = if r + 1 < k { starts[r + 1] } else { starts[0] + n };
            let flat = Flat { at: place(*from), normal: normals[*from] };
            if (*from..=to).any(|i| flat.off(place(i)) > self.tolerance) {
                return;
            }
            runs.push((*from..=to).map(|i| (i % n) as u32).collect());
            planes.push(flat);
        }
        if let [a, b, c] = planes[..] {
            let Some(apex) =
                meeting(&[a, b, c]).filter(|apex| self.may_add && apex.distance(self.reach.0) <= FARTHEST * self.reach.1)
            else {
                return;
            };
            if starts.iter().any(|i| place(*i).distance(apex) <= self.tolerance) {
                return;
            }
            let added = self.add(apex);
            runs.iter_mut().for_each(|run| run.push(added));
        }
        (self.show)(&Shown { points: &self.points, pieces: &runs, told: true });
        self.points.truncate(n);
    }

    /// Shows every way to take an outline apart that it finds.
    pub(super) fn peel(&mut self, outline: &[u32]) {
        let mut seen: Vec<Position> = outline.iter().map(|v| Position::of(self.points[*v as usize])).collect();
        seen.sort_unstable();
        if outline.len() < 3 || self.pieces.len() >= MOST_PIECES || self.seen.len() >= MOST_OUTLINES || self.seen.contains(&seen)
        {
            return;
        }
        self.seen.push(seen);
        let places: Vec<DVec3> = outline.iter().map(|v| at(&self.points[*v as usize])).collect();
        match lie(places.iter().copied(), self.tolerance) {
            Lie::Line => return,
            Lie::Plane(_) => {
                self.pieces.push(outline.to_vec());
                (self.show)(&Shown { points: &self.points, pieces: &self.pieces, told: false });
                self.pieces.pop();
                return;
            }
            Lie::Space => {}
        }
        for ends in fewest(&places, self.tolerance) {
            let runs = self.runs(outline, &ends);
            let last = if runs.len() == 2 { 1 } else { runs.len() };
            for run in 0..last {
                self.close(&runs, run);
            }
        }
    }

    /// Closes a run, and goes on with what is left.
    fn close(&mut self, runs: &[Run], run: usize) -> Option<()> {
        let k = runs.len();
        let [before, after] = [(run + k - 1) % k, (run + 1) % k].map(|r| runs[r].plane);
        let vertices = &runs[run].vertices;
        let plane = runs[run].plane?;
        let (first, last) = (*vertices.first()?, *vertices.last()?);
        let ends = [first, last].map(|v| at(&self.points[v as usize]));
        let apex = match (before, after) {
            _ if k < 3 => None,
            (Some(a), Some(b)) if a.normal.dot(b.normal).abs() < ONE_PLANE || a.off(b.at) > self.tolerance => {
                let apex = meeting(&[a, plane, b])?;
                if apex.distance(self.reach.0) > FARTHEST * self.reach.1 {
                    return None;
                }
                Some(apex).filter(|apex| ends.iter().all(|end| end.distance(*apex) > self.tolerance))
            }
            _ => None,
        };
        // The line between the ends is in one of the planes beside.
        let is_off = |beside: Option<Flat>, end: usize| beside.is_some_and(|plane| plane.off(ends[end]) > self.tolerance);
        if apex.is_none() && is_off(before, 1) && is_off(after, 0) {
            return None;
        }
        if apex.is_some() && !self.may_add {
            return None;
        }
        let added = apex.map(|apex| self.add(apex));
        let (pieces, mut rest) = self.closed(vertices, added);
        for other in (1..k).map(|i| (run + i) % k) {
            rest.extend(&runs[other].vertices[..runs[other].vertices.len() - 1]);
        }
        let count = self.pieces.len();
        self.pieces.extend(pieces);
        self.peel(&rest);
        self.pieces.truncate(count);
        if added.is_some() {
            self.points.pop();
        }
        Some(())
    }

    /// The pieces between a run and what closes it, the line between its ends or the two to a new vertex, and that line, from where the run
    /// begins to before its end. The run may touch it in between.
    fn closed(&self, run: &[u32], apex: Option<u32>) -> (Vec<Vec<u32>>, Vec<u32>) {
        let place = |v: u32| at(&self.points[v as usize]);
        let (first, last) = (place(run[0]), place(run[run.len() - 1]));
        let lies = |v: u32, from: DVec3, to: DVec3| {
            let along = (to - from).normalize_or_zero();
            let p = place(v) - from;
            p.dot(along) > 0.0 && p.dot(along) < from.distance(to) && p.cross(along).length() <= self.tolerance
        };
        let corner = apex.map_or(last, place);
        // The run's places on the first line, then those on the second one.
        let before = (0..run.len()).take_while(|i| *i + 1 < run.len()).filter(|i| *i == 0 || lies(run[*i], first, corner));
        let before: Vec<usize> = before.collect();
        let turn = *before.last().unwrap_or(&0);
        let after = (turn + 1..run.len()).filter(|i| *i + 1 == run.len() || apex.is_some() && lies(run[*i], corner, last));
        let cuts: Vec<usize> = before.iter().copied().chain(after).collect();
        let (mut pieces, mut line) = (Vec::new(), Vec::new());
        for w in cuts.windows(2) {
            let mut piece = run[w[0]..=w[1]].to_vec();
            line.push(run[w[0]]);
            if w[0] == turn {
                piece.extend(apex);
                line.extend(apex);
            }
            if piece.len() > 2 {
                pieces.push(piece);
            }
        }
        (pieces, line)
    }

    /// A new vertex; its coordinates are those of vertices of the loop where they hardly differ.
    fn add(&mut self, place: DVec3) -> u32 {
        let mut point = Position::nearest(place).coordinates();
        for (k, x) in point.iter_mut().enumerate() {
            let near = 4.0 * step_at(*x);
            let away = |y: f32| (f64::from(y) - place[k]).abs();
            let nearest = self.points.iter().map(|p| p[k]).min_by(|a, b| away(*a).total_cmp(&away(*b)));
            *x = nearest.filter(|y| away(*y) <= near).unwrap_or(*x);
        }
        self.points.push(point);
        self.points.len() as u32 - 1
    }

    /// The runs of an outline that is cut at these places.
    fn runs(&self, outline: &[u32], ends: &[usize]) -> Vec<Run> {
        let (n, k) = (outline.len(), ends.len());
        let mut ends: Vec<usize> = ends.to_vec();
        let run = |from: usize, to: usize| {
            let to = if to <= from { to + n } else { to };
            (from..=to).map(|i| outline[i % n]).collect::<Vec<u32>>()
        };
        let planes: Vec<Option<Flat>> = (0..k).map(|r| self.plane(&run(ends[r], ends[(r + 1) % k]))).collect();
        // An edge in two planes is of the one that the surface beyond is not in.
        for r in 0..k {
            let (Some(before), Some(after)) = (planes[(r + k - 1) % k], planes[r]) else { continue };
            let lies = |plane: &Flat, v: usize| plane.off(at(&self.points[outline[v % n] as usize])) <= self.tolerance;
            let is_beyond = |plane: &Flat, v: usize| {
                self.beyond(outline[v % n], outline[(v + 1) % n]).is_some_and(|b| b.dot(plane.normal).abs() > ALONG)
            };
            for _ in 0..n {
                let (back, here) = (ends[r] + n - 1, ends[r]);
                if lies(&after, back) && is_beyond(&before, back) && !is_beyond(&after, back) {
                    ends[r] = back % n;
                } else if lies(&before, here + 1) && is_beyond(&after, here) && !is_beyond(&before, here) {
                    ends[r] = (here + 1) % n;
                } else {
                    break;
                }
            }
        }
        (0..k).map(|r| Run { vertices: run(ends[r], ends[(r + 1) % k]), plane: planes[r] }).collect()
    }

    /// The plane of a run. One on a line goes on at right angles to the surface beyond it.
    fn plane(&self, run: &[u32]) -> Option<Flat> {
        let places = || run.iter().map(|v| at(&self.points[*v as usize]));
        match lie(places(), self.tolerance) {
            Lie::Plane(flat) => Some(flat),
            Lie::Space => None,
            Lie::Line => {
                let [first, last] = [*run.first()?, *run.last()?].map(|v| at(&self.points[v as usize]));
                let mut normals = run.windows(2).map(|w| self.beyond(w[0], w[1]));
                let beyond = normals.next()??;
                if normals.any(|other| other.is_none_or(|other| other.dot(beyond) < ALONG)) {
                    return None;
                }
                Some(Flat { at: first, normal: (last - first).cross(beyond).normalize_or_zero() })
            }
        }
    }

    /// The normal beyond an edge of the loop; `None` for any other edge.
    fn beyond(&self, from: u32, to: u32) -> Option<DVec3> {
        let n = self.beyond.len();
        let i = from as usize;
        (i < n && (i + 1) % n == to as usize).then(|| self.beyond[i])?
    }
}

/// Triangles lie in a plane if their normals have at least this cosine with its normal.
const ALONG: f64 = 0.9999;

/// Where three planes meet.
fn meeting(planes: &[Flat; 3]) -> Option<DVec3> {
    let [a, b, c] = planes;
    let spanned = a.normal.dot(b.normal.cross(c.normal));
    // About a place near all of them, for the digits.
    let origin = b.at;
    let [p, q, r] = [a, b, c].map(|f| f.normal.dot(f.at - origin));
    let sum = b.normal.cross(c.normal) * p + c.normal.cross(a.normal) * q + a.normal.cross(b.normal) * r;
    (spanned.abs() >= SPANNED).then(|| origin + sum / spanned)
}
