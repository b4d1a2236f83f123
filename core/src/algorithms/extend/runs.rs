//! A closed outline cut into as few runs as lie in a plane each.

use glam::DVec3;

/// A plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    pub(super) at: DVec3,
    /// Of length one.
    pub(super) normal: DVec3,
}

impl Flat {
    pub(super) fn off(&self, p: DVec3) -> f64 {
        (p - self.at).dot(self.normal).abs()
    }
}

/// How some places lie.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lie {
    /// On a line, or nearly: they tell no plane.
    Line,
    Plane(Flat),
    Space,
}

/// Places tell no plane if they are off a line by less than this share of its length.
const LEAN: f64 = 1e-3;

/// How places lie that are known as well as `tolerance` says. O(places).
pub(super) fn lie(places: impl Iterator<Item = DVec3> + Clone, tolerance: f64) -> Lie {
    let farthest = |from: DVec3| places.clone().fold((from, 0.0), |best, p| keep_farther(best, p, p.distance_squared(from))).0;
    let Some(first) = places.clone().next() else { return Lie::Line };
    let a = farthest(first);
    let b = farthest(a);
    let along = (b - a).normalize_or_zero();
    let from_line = |p: DVec3| (p - a).cross(along).length();
    let (c, width) = places.clone().fold((a, 0.0), |best, p| keep_farther(best, p, from_line(p)));
    if width <= tolerance.max(LEAN * a.distance(b)) {
        return Lie::Line;
    }
    let flat = Flat { at: a, normal: along.cross(c - a).normalize_or_zero() };
    if places.clone().all(|p| flat.off(p) <= tolerance) { Lie::Plane(flat) } else { Lie::Space }
}

fn keep_farther(best: (DVec3, f64), p: DVec3, away: f64) -> (DVec3, f64) {
    if away > best.1 { (p, away) } else { best }
}

/// More runs are looked at by nobody: the outline is none of a few planes.
pub(super) const MOST_RUNS: usize = 10;
/// Ways of cutting an outline that are looked at.
const MOST_WAYS: usize = 8;

/// The ways to cut a closed outline into the fewest runs that lie in a plane each, by the vertices where one run ends and the next one begins,
/// ascending. None if the runs are many. O(n²), for most outlines of curved surfaces O(n).
pub(super) fn fewest(places: &[DVec3], tolerance: f64) -> Vec<Vec<usize>> {
    let n = places.len();
    let is_flat = |from: usize, to: usize| {
        let run = (from..=to).map(|i| places[i % n]);
        !matches!(lie(run, tolerance), Lie::Space)
    };
    let mut hops = 0;
    let mut at = 0;
    while at < n {
        let mut end = at + 2;
        while end < n && is_flat(at, end + 1) {
            end += 1;
        }
        (at, hops) = (end, hops + 1);
        // From another start, there may be one run less.
        if hops > MOST_RUNS + 1 {
            return Vec::new();
        }
    }
    let mut ends = Vec::with_capacity(n);
    let mut end = 2;
    for from in 0..n {
        end = end.max(from + 2);
        while end + 1 < from + n && is_flat(from, end + 1) {
            end += 1;
        }
        ends.push(end);
    }
    let is_longest = |from: usize| ends[from] > if from == 0 { ends[n - 1].saturating_sub(n) } else { ends[from - 1] };
    let mut ways: Vec<Vec<usize>> = Vec::new();
    for start in (0..n).filter(|from| is_longest(*from)) {
        let mut way = vec![start];
        let mut at = start;
        loop {
            let end = if at < n { ends[at] } else { ends[at - n] + n };
            if end >= start + n || way.len() > MOST_RUNS {
                break;
            }
            way.push(end);
            at = end;
        }
        way.iter_mut().for_each(|v| *v %= n);
        way.sort_unstable();
        if ways.first().is_some_and(|best| way.len() < best.len()) {
            ways.clear();
        }
        if way.len() <= MOST_RUNS && ways.first().is_none_or(|best| way.len() == best.len()) && !ways.contains(&way) {
            ways.push(way);
        }
    }
    ways.truncate(MOST_WAYS);
    ways
}
