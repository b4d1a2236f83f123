//! The collapses within one cell, cheapest first.

use glam::DVec3;

use crate::geometry::exact::Point;
use crate::geometry::tri_tri::Triangle;
use crate::simplify::guard::Guard;
use crate::simplify::legal::{self, Marks};
use crate::simplify::partition;
use crate::simplify::patch::{CREASE, FIXED, MOST, Patch, RIM, Star};
use crate::simplify::queue::{self, Queue};
use crate::simplify::task::Barred;

/// A short edge is cheaper by this share of its length, squared, where surfaces are flat, so that triangles stay round.
const STABILITY: f64 = 1e-3;

/// So many edges before its turn, the triangles around the ends of an edge are asked for, and twice as many before, the ends.
const AHEAD: usize = 4;

/// How many limits there are.
pub(super) const LIMITS: usize = 3;

/// Rules of all cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) shape: legal::Bounds,
    /// Lengths are multiplied by this power of two, so that the mesh has about the size 1, and no quadric is out of the range of f32.
    pub(super) unit: f64,
    /// The largest value of a quadric by its weight, without the share for short edges: a squared length in this unit, by how strict a vertex is.
    pub(super) limits: [f64; LIMITS],
    /// New vertices may lie where the quadric is least, besides at the ends and the middle of the edge.
    pub(super) optimal: bool,
}

/// A triangle of more than one cell, by the mesh's vertices and by points.
pub(super) type Obstacle = ([u32; 3], Triangle);

/// A cell at work.
pub(super) struct Work {
    pub(super) patch: Patch,
    pub(super) cell: partition::Cell,
    /// Triangles of more than one cell that reach into this one, by the mesh's vertices and by points. They stay as they are.
    pub(super) obstacles: Vec<Obstacle>,
    /// Edges of such triangles with both ends in this cell, the smaller one first, in order.
    outer: Vec<[u32; 2]>,
    /// Why edges were left alone.
    pub(super) barred: Barred,
    rules: Rules,
    queue: Queue,
    guard: Option<Guard>,
    marks: Marks,
    stars: [Star; 2],
    /// Vertices with an edge that could not collapse, and is not in the queue: it may when one of its ends changes.
    is_refused: Vec<bool>,
}

impl Work {
    /// O(n). With a guard, each collapse is tested exactly; without one, the whole is to be looked at in the end.
    pub(super) fn new(
        patch: Patch,
        cell: partition::Cell,
        (obstacles, outer): (Vec<Obstacle>, Vec<[u32; 2]>),
        rules: Rules,
        is_guarded: bool,
    ) -> Self {
        let guard = is_guarded.then(|| Guard::new(&patch, obstacles.iter().map(|o| o.1).collect()));
        let marks = Marks::new(patch.points.len());
        let queue = Queue::new(patch.corners.len());
        let (is_refused, stars) = (vec![false; patch.points.len()], Default::default());
        let mut work =
            Self { patch, cell, obstacles, outer, barred: Barred::default(), rules, queue, guard, marks, stars, is_refused };
        for corner in 0..work.patch.corners.len() {
            let after = if corner % 3 == 2 { corner - 2 } else { corner + 1 };
            let ends = [work.patch.corners[corner], work.patch.corners[after]];
            // An edge of a vertex that is not fixed has two triangles, and is seen both ways; or it may be of the rim.
            let may_be_rim = || ends.iter().all(|v| work.patch.kinds[*v as usize] >= RIM);
            if ends[0] < ends[1] || may_be_rim() {
                work.enter(ends);
            }
        }
        work
    }

    /// Puts an edge into the queue, at what it costs now.
    #[inline]
    fn enter(&mut self, ends: [u32; 2]) {
        if let Some((cost, _)) = self.cost(ends) {
            self.queue.push(cost, ends);
        }
    }

    /// The cost of an edge that may collapse, and where to.
    #[inline]
    fn cost(&mut self, ends: [u32; 2]) -> Option<(f32, Point)> {
        let (value, cost, to) = self.price(ends)?;
        let strict = ends.iter().map(|v| usize::from(self.patch.strict[*v as usize])).fold(0, usize::max);
        if value > self.rules.limits[strict.min(LIMITS - 1)] {
            self.barred.by_distance = true;
            self.refuse(ends);
            return None;
        }
        Some((cost as f32, to))
    }

    #[inline]
    fn refuse(&mut self, ends: [u32; 2]) {
        ends.iter().for_each(|v| self.is_refused[*v as usize] = true);
    }

    /// The quadric's value by its weight, the cost, and the best place for the vertex that two become. The first one is no freer than the second.
    ///
    /// The cost is the value by the root of its weight. By the value itself, flat places, whose vertices stand for many planes, stay fine, and curved ones
    /// pay for that; by the value by its weight, some places go too far in the end.
    #[inline]
    fn price(&self, [u, v]: [u32; 2]) -> Option<(f64, f64, Point)> {
        let (patch, [i, j]) = (&self.patch, [u as usize, v as usize]);
        let kinds = [patch.kinds[i], patch.kinds[j]];
        if kinds == [FIXED; 2] || kinds == [CREASE, RIM] || kinds == [RIM, CREASE] {
            return None;
        }
        let from = patch.place_of(u);
        let edge = patch.place_of(v) - from;
        let sum = patch.quadrics[i].wide().plus(&patch.quadrics[j].wide().around(-edge));
        let share = sum.weight().max(1.0).recip();
        let scale = share.sqrt();
        let cost = |x: DVec3| {
            let value = sum.at(x);
            let short = STABILITY * STABILITY * (x.length_squared() + (x - edge).length_squared());
            (value * share, value * scale + short)
        };
        if kinds[0] != kinds[1] {
            let (x, point) = if kinds[0] > kinds[1] { (DVec3::ZERO, patch.points[i]) } else { (edge, patch.points[j]) };
            let (value, cost) = cost(x);
            return Some((value, cost, point));
        }
        let rounded = |x: DVec3| patch.point(from + x);
        let least = (self.rules.optimal && kinds[0] != CREASE)
            .then(|| sum.least(2.0 * STABILITY * STABILITY / scale, 0.5 * edge))
            .filter(|x| x.length_squared() < 4.0 * edge.length_squared());
        if let Some(x) = least {
            // The cost is least there, so that the ends need not be looked at.
            let (value, cost) = cost(x);
            return Some((value, cost, rounded(x)));
        }
        let ways = [(DVec3::ZERO, patch.points[i]), (edge, patch.points[j]), (0.5 * edge, rounded(0.5 * edge))];
        let priced = ways.map(|(x, point)| (cost(x), point));
        let best = priced[1..].iter().fold(priced[0], |best, other| if other.0.1 < best.0.1 { *other } else { best });
        Some((best.0.0, best.0.1, best.1))
    }

    /// How many edges are still to be looked at, by buckets of what they cost when they were priced last; some are gone.
    pub(super) fn counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.queue.counts()
    }

    /// Collapses edges up to the bucket `most`, until no more than `count` triangles are left. Returns at how many it looked.
    ///
    /// An edge whose ends have changed is priced anew when it comes up, not before: most change several times until then.
    pub(super) fn advance(&mut self, most: usize, count: usize) -> usize {
        let mut stars = std::mem::take(&mut self.stars);
        let mut looked_at = 0;
        while self.patch.live > count {
            let Some(bucket) = self.queue.cheapest().filter(|bucket| *bucket <= most) else { break };
            let Some(ends) = self.queue.pop(bucket) else { break };
            looked_at += 1;
            self.ask_ahead(bucket);
            if !ends.iter().all(|v| self.patch.is_there(*v)) {
                continue;
            }
            let Some((cost, to)) = self.cost(ends) else { continue };
            if queue::bucket(cost) > bucket {
                self.queue.push(cost, ends);
            } else if !self.collapse(ends, to, &mut stars) {
                self.barred.by_rules = true;
                self.refuse(ends);
            }
        }
        self.stars = stars;
        looked_at
    }

    /// Has the processor bring near what the next edges of a bucket need: in a cell, they are anywhere.
    #[inline]
    fn ask_ahead(&self, bucket: usize) {
        if let Some(ends) = self.queue.ahead(bucket, 2 * AHEAD) {
            ends.into_iter().for_each(|v| self.patch.ask_for_vertex(v));
        }
        if let Some(ends) = self.queue.ahead(bucket, AHEAD) {
            ends.into_iter().for_each(|v| self.patch.ask_for_star(v));
        }
    }

    /// Collapses an edge, if it may be.
    fn collapse(&mut self, [mut u, mut v]: [u32; 2], to: Point, [of_u, of_v]: &mut [Star; 2]) -> bool {
        if self.patch.kinds[u as usize] > self.patch.kinds[v as usize] || to == self.patch.points[u as usize] {
            (u, v) = (v, u);
        }
        if !self.patch.star(u, of_u) || !self.patch.star(v, of_v) || of_u.len + of_v.len > MOST + 4 {
            return false;
        }
        of_u.iter().for_each(|(_, [w, _])| self.patch.ask_for_quadric(w));
        let stays = to == self.patch.points[v as usize];
        let shape = self.rules.shape;
        let patch = &self.patch;
        let is_rim = self.patch.kinds[u as usize] == RIM;
        let is_joined = |w: u32| {
            self.patch.kinds[v as usize] == FIXED
                && self.patch.kinds[w as usize] == FIXED
                && self.outer.binary_search(&[v.min(w), v.max(w)]).is_ok()
        };
        let is_legal = self.cell.holds(&to)
            && to.iter().all(|x| x.is_finite())
            && legal::keeps_topology(([u, v], is_rim), of_u, of_v, &mut self.marks, is_joined)
            && legal::keeps_shape(patch, [u, v], of_u, &to, shape.turn)
            && (stays || legal::keeps_shape(patch, [v, u], of_v, &to, shape.turn))
            && legal::keeps_features(patch, [u, v], of_u, shape.feature)
            && self.guard.as_mut().is_none_or(|guard| guard.allows(patch, [u, v], &to, of_u, of_v));
        if !is_legal {
            return false;
        }
        let patch = &mut self.patch;
        let at = |w: u32| patch.quadrics[w as usize].wide().around(patch.place(&to) - patch.place_of(w));
        patch.quadrics[v as usize] = at(u).plus(&at(v)).narrow();
        patch.points[v as usize] = to;
        patch.merge([u, v], of_u, of_v);
        if let Some(guard) = &mut self.guard {
            of_u.without(v).chain(of_v.without(u)).for_each(|(corner, _)| guard.grow(patch, corner));
        }
        self.enter_around([u, v], of_u, of_v);
        true
    }

    /// Puts the edges that `u` has brought to `v` into the queue. Those that `v` had are there, but for some that were refused.
    fn enter_around(&mut self, [u, v]: [u32; 2], of_u: &Star, of_v: &Star) {
        self.marks.clear();
        for w in of_v.without(u).flat_map(|(_, ring)| ring) {
            if self.marks.mark(w) && self.is_refused[v as usize] && self.is_refused[w as usize] {
                self.enter([v, w]);
            }
        }
        for w in of_u.without(v).flat_map(|(_, ring)| ring) {
            if self.marks.mark(w) {
                self.enter([v, w]);
            }
        }
        self.is_refused[v as usize] |= self.is_refused[u as usize];
    }
}
