//! Triangles of no area on three distinct vertices: removed, and the T-junction they covered closed.
//!
//! Such a triangle lies along its longest edge, with the third vertex inside it. Every other triangle at the long edge is split at
//! that vertex, which closes the surface without moving anything; dropping the triangle alone would open it.

use crate::contract::report::RepairName;
use crate::repairs::cleanup::duplicates;
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

use crate::repairs::shared::work::{Pass, Work};
use crate::submesh::{Submesh, Vertex};
use crate::util::steps;

/// The report's note on triangles without area.
const NOTE: &str = "triangles without area removed, their T-junctions closed";

/// Triangles with a repeated vertex, and with them what of those without area needs no neighbours.
pub(crate) const REPEATED: Repair = Repair {
    name: RepairName::Degenerate,
    changes: Changes::Surface,
    run: |cx| Ok(Done::count(duplicates::drop_repeated(&mut cx.work), NOTE)),
};

/// All triangles without area.
pub(crate) const DEGENERATE: Repair = Repair {
    name: RepairName::Degenerate,
    changes: Changes::Surface,
    run: |cx| Ok(Done::count(duplicates::drop_repeated(&mut cx.work) + remove(&mut cx.work), NOTE)),
};

/// Removes collinear triangles; returns how many there were. O((triangles in the stars along their long edges, and parts made of them) · log).
pub(crate) fn remove(work: &mut Work<'_>) -> u64 {
    // After a pass none is left, and only a new vertex makes one.
    let found: Vec<u32> = match work.changed_for(Pass::Collinear) {
        None => work.living().filter(|t| work.is_collinear(*t)).collect(),
        Some(changed) => changed.into_iter().filter(|t| work.lives(*t) && work.is_collinear(*t)).collect(),
    };
    if !found.is_empty() {
        let mut removal = Removal::default();
        found.iter().for_each(|t| removal.register(work, *t, 0));
        removal.run(work);
    }
    found.len() as u64
}

/// So many middle vertices on one edge are taken in the order of their triangles.
const FEW: usize = 16;

/// Edges by their ends, the smaller number first.
type Ends = [Vertex; 2];

fn ends(a: Vertex, b: Vertex) -> Ends {
    [a.min(b), a.max(b)]
}

/// A collinear triangle: its longest edge, the vertex in the middle, and how long the edge is.
#[derive(Clone, Copy)]
struct Flat {
    triangle: u32,
    long: [Vertex; 2],
    middle: Vertex,
    length: f64,
}

impl Flat {
    fn of(submesh: &Submesh, triangle: u32) -> Self {
        let v = submesh.triangles[triangle as usize].v;
        let length = |k: usize| submesh.distance(v[k], v[(k + 1) % 3]);
        let (k, length) = (1..3).fold((0, length(0)), |best, k| if length(k) > best.1 { (k, length(k)) } else { best });
        Self { triangle, long: [v[k], v[(k + 1) % 3]], middle: v[(k + 2) % 3], length }
    }
}

/// The living collinear triangles at an edge.
#[derive(Default)]
struct Line {
    /// How many have each vertex opposite to the edge.
    opposite: BTreeMap<Vertex, u32>,
    /// Places in the list of those whose longest edge this is.
    long: Vec<u32>,
}

/// The removal of some collinear triangles.
///
/// A triangle waits while another collinear triangle, on other vertices, is at its longest edge. The triangles are tried in rounds, each in
/// the order of the list, so that the order of all new triangles is fixed; one that waits is tried again only when nothing keeps it any more.
#[derive(Default)]
struct Removal {
    list: Vec<Flat>,
    /// The place of a triangle in the list.
    place_of: HashMap<u32, u32>,
    lines: HashMap<Ends, Line>,
    around: Around,
    /// The next tries, by round and place.
    tries: BinaryHeap<Reverse<(u32, u32)>>,
    /// The list by length, the longest and of these the first one on top. (Lengths are positive: their bits have their order.)
    by_length: BinaryHeap<(u64, Reverse<u32>)>,
    /// The round and place of the triangle that is tried.
    now: (u32, u32),
}

impl Removal {
    fn run(&mut self, work: &mut Work<'_>) {
        loop {
            while let Some(Reverse(now)) = self.tries.pop() {
                steps::count(1);
                self.now = now;
                let flat = self.list[now.1 as usize];
                if work.lives(flat.triangle) && self.is_free(&flat) {
                    self.take_out(work, &flat);
                }
            }
            // A knot of collinear triangles that wait for each other. What their neighbours are split into is shorter, so that this ends.
            let Some(flat) = self.middle_of_longest(work) else { return };
            self.now.1 = u32::MAX;
            let first = work.triangles.len() as u32;
            self.take_out(work, &flat);
            for t in first..work.triangles.len() as u32 {
                if work.lives(t) && work.is_collinear(t) {
                    self.register(work, t, self.now.0 + 1);
                }
            }
        }
    }

    /// Takes a collinear triangle into the list, to be tried first in this round.
    fn register(&mut self, submesh: &Submesh, t: u32, round: u32) {
        let (place, flat) = (self.list.len() as u32, Flat::of(submesh, t));
        self.list.push(flat);
        self.place_of.insert(t, place);
        self.tries.push(Reverse((round, place)));
        self.by_length.push((flat.length.to_bits(), Reverse(place)));
        let [a, b] = flat.long;
        for (edge, opposite) in [([a, b], flat.middle), ([b, flat.middle], a), ([flat.middle, a], b)] {
            *self.lines.entry(ends(edge[0], edge[1])).or_default().opposite.entry(opposite).or_insert(0) += 1;
        }
        self.lines.entry(ends(a, b)).or_default().long.push(place);
    }

    /// The round in which the triangle at this place has its next turn.
    fn next_round_for(&self, place: u32) -> u32 {
        self.now.0 + u32::from(place <= self.now.1)
    }

    /// Is no collinear triangle on other vertices at its longest edge?
    fn is_free(&self, flat: &Flat) -> bool {
        self.lines.get(&ends(flat.long[0], flat.long[1])).is_none_or(|line| line.opposite.len() <= 1)
    }

    fn kill(&mut self, work: &mut Work<'_>, t: u32) {
        let v = work.triangles[t as usize].v;
        work.kill(t);
        if self.place_of.contains_key(&t) {
            (0..3).for_each(|k| self.leave(work, ends(v[k], v[(k + 1) % 3]), v[(k + 2) % 3]));
        }
    }

    /// A collinear triangle with this opposite vertex is no longer at an edge. Triangles that waited for it get their turn.
    fn leave(&mut self, submesh: &Submesh, edge: Ends, opposite: Vertex) {
        let Some(line) = self.lines.get_mut(&edge) else { return };
        if let Some(count) = line.opposite.get_mut(&opposite) {
            *count -= 1;
            if *count == 0 {
                line.opposite.remove(&opposite);
            }
        }
        if line.opposite.len() == 1 {
            let mut long = std::mem::take(&mut line.long);
            steps::count(long.len());
            long.retain(|place| submesh.lives(self.list[*place as usize].triangle));
            let turns = long.iter().map(|place| Reverse((self.next_round_for(*place), *place)));
            self.tries.extend(turns.collect::<Vec<_>>());
            self.lines.entry(edge).or_default().long = long;
        }
    }

    /// Of the collinear triangles along the longest edge of all, the first one if they are few. Of more, the one with the middle vertex: what is
    /// on its two sides is a knot of half as many triangles. (The order decides nothing but the order of new triangles.)
    fn middle_of_longest(&mut self, submesh: &Submesh) -> Option<Flat> {
        let lives = |place: u32| submesh.lives(self.list[place as usize].triangle);
        while self.by_length.peek().is_some_and(|(_, Reverse(place))| !lives(*place)) {
            self.by_length.pop();
        }
        let (_, Reverse(longest)) = self.by_length.peek()?;
        let [a, b] = self.list[*longest as usize].long;
        let line = self.lines.get(&ends(a, b))?;
        let mut along: Vec<(f64, Vertex, u32)> = Vec::new();
        for place in line.long.iter().copied().filter(|place| lives(*place)) {
            let middle = self.list[place as usize].middle;
            along.push((submesh.distance(a, middle), middle, place));
        }
        steps::count(line.long.len());
        along.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        along.dedup_by_key(|(_, middle, _)| *middle);
        if along.len() <= FEW {
            return Some(self.list[*longest as usize]);
        }
        let middle = along.get(along.len().saturating_sub(1) / 2..=along.len() / 2)?;
        middle.iter().map(|(_, _, place)| *place).min().map(|place| self.list[place as usize])
    }

    /// Kills a triangle, and splits all others at its longest edge at its middle vertex.
    fn take_out(&mut self, work: &mut Work<'_>, flat: &Flat) {
        let Flat { triangle, long: [a, b], middle, .. } = *flat;
        let others = self.around.edge(work, a, b);
        self.kill(work, triangle);
        for o in others.into_iter().filter(|o| *o != triangle) {
            // On the same three vertices: it goes, too, since nothing would be left for its long edge.
            if work.triangles[o as usize].v.contains(&middle) {
                self.kill(work, o);
                continue;
            }
            let (first, v) = (work.triangles.len() as u32, work.triangles[o as usize].v);
            split(work, o, [a, b], &[middle]);
            self.around.add(work, first);
            if self.place_of.contains_key(&o) {
                (0..3).for_each(|k| self.leave(work, ends(v[k], v[(k + 1) % 3]), v[(k + 2) % 3]));
            }
        }
    }
}

/// The triangles at each edge of some vertices: a star is gone through once, whatever number of its edges is asked for.
#[derive(Default)]
struct Around(HashMap<Vertex, HashMap<Vertex, Vec<u32>>>);

impl Around {
    /// The living triangles at an edge, in the order of the star of `a`.
    fn edge(&mut self, submesh: &Submesh, a: Vertex, b: Vertex) -> Vec<u32> {
        let star = self.0.entry(a).or_insert_with(|| {
            let mut edges: HashMap<Vertex, Vec<u32>> = HashMap::new();
            let all: Vec<u32> = submesh.star(a).map(|(t, _)| t).collect();
            // The last triangle comes first in a star, and new triangles come last here.
            for t in all.into_iter().rev() {
                submesh.triangles[t as usize].v.iter().filter(|v| **v != a).for_each(|v| edges.entry(*v).or_default().push(t));
            }
            edges
        });
        let there = star.get_mut(&b).map(std::mem::take).unwrap_or_default();
        steps::count(there.len());
        let living: Vec<u32> = there.into_iter().filter(|t| submesh.lives(*t)).collect();
        star.insert(b, living.clone());
        living.into_iter().rev().collect()
    }

    /// Takes in the triangles from this one on.
    fn add(&mut self, submesh: &Submesh, first: u32) {
        for t in first..submesh.triangles.len() as u32 {
            let v = submesh.triangles[t as usize].v;
            for (a, b) in (0..3).flat_map(|k| [(v[k], v[(k + 1) % 3]), (v[(k + 1) % 3], v[k])]) {
                if let Some(star) = self.0.get_mut(&a) {
                    star.entry(b).or_default().push(t);
                }
            }
        }
    }
}

/// Splits triangle `t` at vertices on its edge between `ends`, given in order from `ends[0]` to `ends[1]`, into a fan from the
/// opposite corner. Vertices that are the opposite corner are left out.
pub(crate) fn split(submesh: &mut Work<'_>, t: u32, ends: [u32; 2], at: &[u32]) {
    let triangle = submesh.triangles[t as usize];
    let Some(k) = (0..3).find(|k| !ends.contains(&triangle.v[*k])) else { return };
    let (apex, from, to) = (triangle.v[k], triangle.v[(k + 1) % 3], triangle.v[(k + 2) % 3]);
    let mut stops: Vec<u32> = at.iter().copied().filter(|v| *v != apex).collect();
    if from == ends[1] {
        stops.reverse();
    }
    if stops.is_empty() {
        return;
    }
    submesh.kill(t);
    let mut last = from;
    for next in stops.into_iter().chain([to]) {
        submesh.add([apex, last, next], triangle.origin.of_part(), triangle.region);
        last = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, after, cube, diagnose, records};

    #[test]
    fn a_knot_of_nothing_but_triangles_of_no_area_goes() {
        // A loop on one line closed twice, by different triangles: every edge is used once each way.
        let [a, b, c, d] = [0.0, 3.0, 1.0, 2.0].map(|x| [x, 0.0, 0.0]);
        let mesh = [[a, b, c], [a, c, d], [b, a, d], [b, d, c]];
        let got = after(&mesh, |d, _| remove(&mut Work::new(&mut d.submesh)));
        assert_eq!(got.defects.triangles, 0);
    }

    #[test]
    fn two_caps_back_to_back_go_together() {
        // A cube all whose edges are used once each way, and two triangles of no area on one of its edges, which take nothing from that.
        let mut mesh = cube();
        let [a, b, _] = mesh[0];
        let m = [0, 1, 2].map(|k| (a[k] + b[k]) / 2.0);
        mesh.extend([[a, b, m], [b, a, m]]);
        let got = after(&mesh, |_, _| ());
        assert_eq!((got.defects.degenerate_area, got.defects.unbalanced_edges), (2, 0));
        let got = after(&mesh, |d, _| remove(&mut Work::new(&mut d.submesh)));
        assert_eq!((got.result, got.defects.degenerate_area, got.defects.unbalanced_edges), (2, 0, 0));
        assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn a_cap_over_a_t_junction_goes_and_the_neighbour_is_split() {
        // The first triangle is split in the middle of its long edge, its neighbour is not, and a triangle of no area joins them.
        let mut mesh = cube();
        let [a, b, c] = mesh.remove(0);
        let m = [0, 1, 2].map(|k| (a[k] + c[k]) / 2.0);
        mesh.extend([[a, b, m], [m, b, c], [a, m, c]]);
        let got = after(&mesh, |d, _| {
            assert_eq!((d.defects.degenerate_area, d.defects.boundary_edges), (1, 0), "closed by the cap");
            remove(&mut Work::new(&mut d.submesh))
        });
        // One goes, one becomes two.
        assert_eq!((got.result, got.defects.triangles), (1, 14));
        assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn collinear_triangles_that_do_not_wait_are_taken_in_their_order() {
        // Three caps far from each other, each over the edge of a triangle, which is split into two.
        let cap = |x: f32| {
            let [a, m, b] = [0.0, 1.0, 2.0].map(|y| [x, y, 0.0]);
            [[a, m, b], [b, a, [x + 1.0, 0.0, 0.0]]]
        };
        let records = records(&[5.0, 9.0, 1.0].map(cap).concat());
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        assert_eq!(remove(&mut work), 3);
        let split: Vec<f32> = work.living().map(|t| work.points(t)[0][0]).collect();
        assert_eq!(split, [6.0, 6.0, 10.0, 10.0, 2.0, 2.0]);
    }

    /// The steps that the removal of all collinear triangles takes.
    fn steps_for(mesh: &[Corners]) -> u64 {
        let records = records(mesh);
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        let (steps, removed) = steps::of(|| remove(&mut work));
        assert!(removed > 0 && work.living().all(|t| !work.is_collinear(t)));
        steps
    }

    fn at(x: usize) -> [f32; 3] {
        [x as f32, 0.0, 0.0]
    }

    #[test]
    fn many_collinear_triangles_on_one_long_edge_take_steps_in_proportion() {
        // Two by two, seen from both sides, and their middle vertices differ: all of them wait for each other.
        for stride in [1, 7] {
            steps::assert_near_linear(250, |n| {
                let (a, b) = (at(0), at(8 * n));
                let middle = |i: usize| at(1 + i * stride % (8 * n - 1));
                steps_for(&(0..n).flat_map(|i| [[a, b, middle(2 * i)], [b, a, middle(2 * i + 1)]]).collect::<Vec<_>>())
            });
        }
    }

    #[test]
    fn a_chain_of_collinear_triangles_takes_steps_in_proportion_whichever_end_comes_first() {
        // All of them have the vertex at 0; the longest one meets a triangle with an area.
        for backward in [false, true] {
            steps::assert_near_linear(250, |n| {
                let mut chain: Vec<Corners> = (1..n).map(|i| [at(0), at(i), at(i + 1)]).collect();
                if backward {
                    chain.reverse();
                }
                chain.push([at(0), at(n), [0.0, 1.0, 0.0]]);
                steps_for(&chain)
            });
        }
    }

    #[test]
    fn collinear_triangles_around_one_vertex_take_steps_in_proportion() {
        // Each has a long edge of its own, from the origin to a place on a parabola, which a triangle with an area has, too.
        steps::assert_near_linear(250, |n| {
            let spoke = |i: usize| [[0.0; 3], [2.0, 2.0 * i as f32, 2.0], [1.0, i as f32, 1.0], [0.0, 0.0, -1.0]];
            steps_for(&(0..n).map(spoke).flat_map(|[o, far, middle, off]| [[o, far, middle], [far, o, off]]).collect::<Vec<_>>())
        });
    }

    #[test]
    fn a_knot_leaves_edges_that_are_used_as_before() {
        // A square hole in a plate, of which a strip of no width is left, is closed by collinear triangles along two sides of the strip.
        let (up, down) = ([4.0, 4.0, 0.0], [4.0, -4.0, 0.0]);
        let (above, below) = ([0, 1, 4, 5, 8], [0, 2, 3, 6, 8]);
        let mut mesh: Vec<Corners> = above.windows(2).map(|x| [at(x[0]), at(x[1]), up]).collect();
        mesh.extend(below.windows(2).map(|x| [at(x[1]), at(x[0]), down]));
        // Fans over the two sides of the strip, and nothing between: they share their long edge.
        mesh.extend((1..4).map(|i| [at(0), at(above[i + 1]), at(above[i])]));
        mesh.extend((1..4).map(|i| [at(0), at(below[i]), at(below[i + 1])]));
        let edges_of_one = |mesh: &[Corners]| after(mesh, |_, _| ()).defects.boundary_edges;
        assert_eq!(edges_of_one(&mesh), 4);
        let got = after(&mesh, |d, _| remove(&mut Work::new(&mut d.submesh)));
        assert_eq!((got.result, got.defects.degenerate_area, got.defects.boundary_edges), (6, 0, 4));
        // Each side of the strip has the vertices of both: 7 places, 7 triangles, twice.
        assert_eq!(got.defects.triangles, 14);
    }
}
