//! What takes the place of a patch: its neighbours' surfaces, continued to where they meet.
//!
//! A boundary loop of the patch runs along carriers: surfaces of the segments next to it. Each carrier gets the directed edges
//! that bound its new piece: the loop's own, and curves along which it meets other carriers. What they enclose is then filled
//! carrier by carrier.

use super::super::mesh::Mesh;
use super::super::reason::Reason;
use super::super::segments::{Segment, Segments};
use super::super::surface::{Surface, radial};
use super::super::vector::{Point, cross, distance, dot, mean, sub, unit};
use super::fill::{self, Fault, Filling, fill};
use super::meet;
use super::trial::Trial;

/// Carriers of one patch.
const MOST_CARRIERS: usize = 64;
/// Runs of one loop.
const MOST_RUNS: usize = 64;

/// A surface that goes on where the patch was.
pub(crate) struct Carrier {
    pub(crate) surface: Surface,
    is_concave: bool,
    segments: Vec<u32>,
    edges: Vec<(u32, u32)>,
    /// The largest turn of its triangles, radians.
    turn: f64,
}

/// An edit: triangles to remove, and those that take their place. Vertices from `first` on are new.
pub(crate) struct Edit {
    pub(crate) removed: Vec<u32>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The segment that goes on in each new triangle.
    pub(crate) owners: Vec<u32>,
    /// Segments that are one from now on if all of the second one lies on the first one's surface.
    pub(crate) joined: Vec<(u32, u32)>,
    pub(crate) fresh: Vec<Point>,
}

impl Edit {
    /// The position of an old or new vertex.
    pub(crate) fn at(&self, mesh: &Mesh, vertex: u32) -> Point {
        match (vertex as usize).checked_sub(mesh.points.len()) {
            Some(k) => self.fresh.get(k).copied().unwrap_or([0.0; 3]),
            None => mesh.at(vertex),
        }
    }
}

/// The plan of one removal.
pub(crate) struct Plan<'a> {
    mesh: &'a Mesh,
    segments: &'a Segments,
    pub(crate) carriers: Vec<Carrier>,
    fresh: Vec<Point>,
    tolerance: f64,
    /// The patch's extent: curves and corners lie within it.
    reach: f64,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(mesh: &'a Mesh, segments: &'a Segments, reach: f64) -> Self {
        Self { mesh, segments, carriers: Vec::new(), fresh: Vec::new(), tolerance: 8.0 * mesh.flatness(), reach }
    }

    /// The position of an old or new vertex.
    pub(crate) fn at(&self, vertex: u32) -> Point {
        let first = self.mesh.points.len();
        self.mesh
            .points
            .get(vertex as usize)
            .or_else(|| self.fresh.get((vertex as usize).checked_sub(first)?))
            .copied()
            .unwrap_or([0.0; 3])
    }

    /// The carrier of a segment: that of another one with the same surface, or a new one.
    pub(crate) fn carrier(&mut self, number: u32, near: Point) -> Result<usize, Reason> {
        let segment = &self.segments.list[number as usize];
        let same = |carrier: &Carrier| {
            carrier.segments.contains(&number)
                || (carrier.is_concave == segment.is_concave
                    && carrier.surface.is_same(&segment.surface, near, self.tolerance, self.reach))
        };
        if let Some(found) = self.carriers.iter().position(same) {
            let carrier = &mut self.carriers[found];
            if !carrier.segments.contains(&number) {
                // The larger piece fixes the surface better.
                let first = carrier.segments.first().map_or(0.0, |s| self.segments.list[*s as usize].area);
                if segment.area > first {
                    carrier.surface = segment.surface;
                    carrier.segments.insert(0, number);
                } else {
                    carrier.segments.push(number);
                }
            }
            return Ok(found);
        }
        if self.carriers.len() == MOST_CARRIERS {
            return Err(Reason::Neighbours);
        }
        let turn = turn(self.mesh, segment);
        let (surface, is_concave) = (segment.surface, segment.is_concave);
        self.carriers.push(Carrier { surface, is_concave, segments: vec![number], edges: Vec::new(), turn });
        Ok(self.carriers.len() - 1)
    }

    /// Gives a loop's edges to the carriers next to it: runs as (carrier, first vertex), one for each stretch along one carrier.
    pub(crate) fn follow(&mut self, rim: &[u32]) -> Result<Vec<(usize, u32)>, Reason> {
        let mut runs: Vec<(usize, u32)> = Vec::new();
        for half in rim {
            let (from, to) = (self.mesh.from(*half), self.mesh.to(*half));
            let (number, _) = self.segments.get(self.mesh.across(*half));
            let carrier = self.carrier(number, self.mesh.at(from))?;
            self.carriers[carrier].edges.push((from, to));
            if runs.last().is_none_or(|(last, _)| *last != carrier) {
                runs.push((carrier, from));
            }
        }
        // The first run may be the end of the last one.
        if runs.len() > 1 && runs.first().map(|r| r.0) == runs.last().map(|r| r.0) {
            runs.remove(0);
        }
        if runs.len() > MOST_RUNS { Err(Reason::Neighbours) } else { Ok(runs) }
    }

    /// A new vertex, rounded to f32.
    pub(crate) fn vertex(&mut self, point: Point) -> u32 {
        self.fresh.push(meet::rounded(point));
        (self.mesh.points.len() + self.fresh.len() - 1) as u32
    }

    /// The point in which carriers meet near `start`.
    pub(crate) fn meet(&self, carriers: &[usize], start: Point) -> Result<Point, Reason> {
        let surfaces: Vec<Surface> = carriers.iter().map(|c| self.carriers[*c].surface).collect();
        meet::point(&surfaces, start, self.tolerance, self.reach).ok_or(Reason::NoMeeting)
    }

    /// The curve from `a` to `b` in which two carriers meet: it bounds the new piece of the first one, and, the other way, that
    /// of the second.
    pub(crate) fn join(&mut self, one: usize, other: usize, a: u32, b: u32) -> Result<(), Reason> {
        if a == b || one == other {
            return Ok(());
        }
        let surfaces = [&self.carriers[one].surface, &self.carriers[other].surface];
        let chord = self.chord(&[one, other]);
        let (p, q) = (self.at(a), self.at(b));
        let found = meet::curve(surfaces, p, q, self.tolerance, chord).ok_or(Reason::NoMeeting)?;
        let mut way = vec![a];
        way.extend(found.into_iter().map(|p| self.vertex(p)).collect::<Vec<_>>());
        way.push(b);
        self.along(one, other, &way);
        Ok(())
    }

    /// Gives a way's edges to two carriers, the second one the other way round.
    pub(crate) fn along(&mut self, one: usize, other: usize, way: &[u32]) {
        for pair in way.windows(2) {
            if let &[a, b] = pair {
                self.carriers[one].edges.push((a, b));
                self.carriers[other].edges.push((b, a));
            }
        }
    }

    /// How far chords of the carriers' triangles lie from their surfaces.
    fn chord(&self, carriers: &[usize]) -> f64 {
        let depth = |carrier: &Carrier| carrier.surface.radius().map(|radius| radius * (1.0 - (carrier.turn / 2.0).cos()));
        carriers.iter().filter_map(|c| depth(&self.carriers[*c])).fold(self.reach * 0.02, f64::min)
    }

    /// Closes a loop of several runs: ears are cut off until the rest lies on one carrier, or three meet in a point.
    pub(crate) fn close(&mut self, mut runs: Vec<(usize, u32)>) -> Result<(), Reason> {
        // Each turn takes at least one run.
        while runs.len() > 1 {
            let n = runs.len();
            if let [(one, a), (other, b)] = runs[..] {
                return self.join(one, other, b, a);
            }
            if let Some(i) = self.bridge(&runs) {
                let ((carrier, a), (after, b)) = (runs[i], runs[(i + 1) % n]);
                self.join(carrier, after, b, a)?;
                let next = (i + 1) % n;
                (0..n).filter(|k| *k == i || *k == next).rev().for_each(|k| {
                    runs.remove(k);
                });
                continue;
            }
            let (i, point) = self.ear(&runs)?;
            let ((before, _), (carrier, a), (after, b)) = (runs[(i + n - 1) % n], runs[i], runs[(i + 1) % n]);
            let x = self.vertex(point);
            self.join(before, carrier, a, x)?;
            self.join(carrier, after, b, x)?;
            if n == 3 {
                let (_, c) = runs[(i + 2) % n];
                return self.join(after, before, c, x);
            }
            runs[(i + 1) % n].1 = x;
            runs.remove(i);
        }
        Ok(())
    }

    /// The shortest run between two of the same carrier.
    fn bridge(&self, runs: &[(usize, u32)]) -> Option<usize> {
        let n = runs.len();
        let length = |i: usize| distance(self.at(runs[i].1), self.at(runs[(i + 1) % n].1));
        let fits = |i: &usize| runs[(*i + n - 1) % n].0 == runs[(*i + 1) % n].0;
        (0..n).filter(fits).min_by(|a, b| length(*a).total_cmp(&length(*b)))
    }

    /// The run whose carrier meets those before and after it nearest to its ends, and where.
    fn ear(&self, runs: &[(usize, u32)]) -> Result<(usize, Point), Reason> {
        let n = runs.len();
        let mut best: Option<(f64, usize, Point)> = None;
        for i in 0..n {
            let (a, b) = (self.at(runs[i].1), self.at(runs[(i + 1) % n].1));
            let carriers = [runs[(i + n - 1) % n].0, runs[i].0, runs[(i + 1) % n].0];
            let Ok(point) = self.meet(&carriers, mean(&[a, b])) else { continue };
            let cost = distance(a, point) + distance(b, point);
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, i, point));
            }
        }
        best.map(|(_, i, point)| (i, point)).ok_or(Reason::NoMeeting)
    }

    /// Fills what the edges of each carrier enclose. Flat carriers that become smaller are made anew as a whole; with
    /// `trial.is_anew`, all flat ones are.
    pub(crate) fn finish(mut self, patch: &[u32], trial: &Trial) -> Result<Edit, Reason> {
        let mut removed = patch.to_vec();
        let (mut triangles, mut owners) = (Vec::new(), Vec::new());
        for number in 0..self.carriers.len() {
            let is_whole = trial.is_anew && self.carriers[number].surface.is_plane() && !self.carriers[number].edges.is_empty();
            let filled = if is_whole { self.rebuild(number, &mut removed, trial) } else { self.fill(number, trial) };
            let filled = filled.or_else(|fault| match fault {
                Fault::Sense | Fault::Crossing if !is_whole && self.carriers[number].surface.is_plane() => {
                    self.rebuild(number, &mut removed, trial)
                }
                Fault::Crossing if !is_whole => Err(Fault::Sense),
                _ => Err(fault),
            });
            let filled = filled.map_err(Reason::from)?;
            let first = (self.mesh.points.len() + self.fresh.len()) as u32;
            self.fresh.extend(filled.points);
            let name = |v: u32| if v >= fill::NEW { first + (v - fill::NEW) } else { v };
            triangles.extend(filled.triangles.into_iter().map(|t| t.map(name)));
            owners.resize(triangles.len(), self.carriers[number].segments.first().copied().unwrap_or(0));
        }
        let pairs = |carrier: &Carrier| {
            let first = carrier.segments.first().copied();
            carrier.segments.iter().skip(1).filter_map(|s| first.map(|f| (f, *s))).collect::<Vec<_>>()
        };
        let joined = self.carriers.iter().flat_map(pairs).collect();
        Ok(Edit { removed, triangles, owners, joined, fresh: self.fresh })
    }

    fn fill(&self, number: usize, trial: &Trial) -> Result<Filling, Fault> {
        let carrier = &self.carriers[number];
        let limits = (carrier.turn.max(0.03), &trial.avoided[..]);
        let filling = fill(carrier.surface, carrier.is_concave, &carrier.edges, |v| self.at(v), limits)?;
        let at = |v: u32| match v.checked_sub(fill::NEW) {
            Some(k) => filling.points.get(k as usize).copied().unwrap_or([0.0; 3]),
            None => self.at(v),
        };
        // A round carrier's triangles may not turn away from it.
        let faces = |t: &[u32; 3]| {
            let [a, b, c] = t.map(at);
            let middle = mean(&[a, b, c]);
            let gradient = carrier.surface.gradient(middle);
            let side = if carrier.is_concave { -1.0 } else { 1.0 };
            unit(cross(sub(b, a), sub(c, a))).is_none_or(|n| side * dot(n, gradient) > 0.3)
        };
        if carrier.surface.is_plane() || filling.triangles.iter().all(faces) { Ok(filling) } else { Err(Fault::Surface) }
    }

    /// Fills a carrier's segments and its new piece together.
    fn rebuild(&mut self, number: usize, removed: &mut Vec<u32>, trial: &Trial) -> Result<Filling, Fault> {
        let carrier = &self.carriers[number];
        let mut added = Vec::new();
        let mut gone = Vec::new();
        for segment in &carrier.segments {
            for triangle in &self.segments.list[*segment as usize].triangles {
                gone.push(*triangle);
                for half in 3 * triangle..3 * triangle + 3 {
                    if self.segments.of[self.mesh.across(half) as usize] != *segment {
                        added.push((self.mesh.from(half), self.mesh.to(half)));
                    }
                }
            }
        }
        self.carriers[number].edges.extend(added);
        let filling = self.fill(number, trial)?;
        removed.extend(gone);
        Ok(filling)
    }
}

/// A flat or cylindrical face within its outline, without the vertices inside that former rims left; `None` where that makes no
/// fewer triangles. O(n log n).
pub(crate) fn remade(mesh: &Mesh, segments: &Segments, number: u32) -> Option<Edit> {
    let segment = &segments.list[number as usize];
    if !matches!(segment.surface, Surface::Plane { .. } | Surface::Cylinder { .. }) {
        return None;
    }
    let mut plan = Plan::new(mesh, segments, 0.0);
    let carrier = plan.carrier(number, mesh.centroid(*segment.triangles.first()?)).ok()?;
    let mut removed = Vec::new();
    let filling = plan.rebuild(carrier, &mut removed, &Trial::default()).ok()?;
    removed.sort_unstable();
    let most = 1.05 * turn(mesh, segment);
    let turns = |t: &[u32; 3]| largest_turn(segment, t.map(|v| mesh.at(v)));
    let is_round = segment.surface.axis().is_some();
    let is_good = filling.points.is_empty() && filling.triangles.len() < removed.len();
    if !is_good || (is_round && filling.triangles.iter().any(|t| turns(t) > most)) {
        return None;
    }
    let owners = vec![number; filling.triangles.len()];
    Some(Edit { removed, triangles: filling.triangles, owners, joined: Vec::new(), fresh: Vec::new() })
}

/// The largest turn of a segment's triangles around its axis, radians; of 2,000 triangles at most.
fn turn(mesh: &Mesh, segment: &Segment) -> f64 {
    if segment.surface.is_plane() {
        return 0.4;
    }
    let triangles = segment.triangles.iter().take(2_000).map(|t| mesh.triangles[*t as usize].map(|v| mesh.at(v)));
    triangles.map(|corners| largest_turn(segment, corners)).fold(0.0, f64::max).clamp(0.01, 0.85)
}

/// The largest turn of an edge of a triangle around a segment's axis, radians.
fn largest_turn(segment: &Segment, corners: [Point; 3]) -> f64 {
    let away = match (segment.surface, segment.surface.axis()) {
        (_, Some((origin, axis))) => corners.map(|p| radial(origin, axis, p)),
        (Surface::Sphere { centre, .. }, _) => corners.map(|p| sub(p, centre)),
        _ => return 0.0,
    };
    let away = away.map(|d| unit(d).unwrap_or([0.0; 3]));
    let turn = |(a, b): (usize, usize)| dot(away[a], away[b]).clamp(-1.0, 1.0).acos();
    [(0, 1), (1, 2), (2, 0)].into_iter().map(turn).fold(0.0, f64::max)
}
