//! Loops that are narrow: each vertex has another side of the hole near it.
//!
//! A side across runs the other way, since both are traversed by one patch: so a neighbouring edge of the same chain is never taken for
//! it. Nor is the other rim of a thin wall, where the surface ends in the same direction. The ends of a slit, where the loop turns back, have
//! no side across and are not asked for one.

use glam::DVec3;

use super::loops::Loop;
use crate::contract::report::LoopClass;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{cosine, nearest_of_segment};
use crate::geometry::sums::Bounds;
use crate::submesh::near::{self, Tolerance};
use crate::submesh::{self, Submesh};
use crate::util::words::Count;

/// Cosine between a chain and the side across it, at most.
const AGAINST: f64 = -0.5;
/// Cosine between the directions in which the surface ends at a vertex and at the side across it, at most; sides that touch may end in any.
const ALIKE: f64 = 0.5;
/// So many of its vertices, of five, must have a side across to make a loop narrow.
const OF_FIVE: usize = 4;
/// A side that does not run alike is looked for so many times as far as one that does.
const WIDER: f64 = 1.6;
/// Sides do not run alike beyond this [`Sides::unevenness`]: between what noise of a twentieth of an edge does to a parallel side, and what
/// a shift of a seventh does, each way by chance.
const UNEVEN: f64 = 0.42;

/// A slit too wide for a gap is none of these below this: its sides are parallel.
const EVEN: f64 = 0.1;

/// The surface across a loop, as seen from each of its vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Sides {
    /// Vertices that are no ends; those of them with a side across; within the share of their edges that a gap may have; and within the weld
    /// tolerance.
    inner: usize,
    across: usize,
    near: usize,
    touching: usize,
    share: f64,
    /// Largest distance of a side across; `None` unless the loop is narrow.
    pub(super) width: Option<f64>,
    /// How the way across changes from one vertex to the next: in the surface as a share of its length, and twice what it rises or falls as
    /// a share of the edges, since rough surfaces are rough that way.
    unevenness: f64,
    /// The other loop on which most of what is across lies, if it is not this one.
    pub(super) partner: Option<u32>,
}

impl Sides {
    pub(super) fn class(&self) -> Option<(LoopClass, String)> {
        let width = self.width?;
        let Self { share, unevenness, .. } = self;
        let [inner, across, near] = [self.inner, self.across, self.near].map(Count);
        if self.touching == self.inner {
            let rule = format!("all {inner} vertices between its ends lie within the weld tolerance of the other side");
            return Some((LoopClass::Crack, rule));
        }
        if *unevenness > UNEVEN {
            let rule = format!(
                "{across} of {inner} vertices lie within {width:.4} of the other side, which does not run alike: {unevenness:.2}, above {UNEVEN}"
            );
            return Some((LoopClass::Misaligned, rule));
        }
        if most(self.near, self.inner) {
            let rule =
                format!("{near} of {inner} vertices lie within {share} of their edges of the other side, which runs alike");
            return Some((LoopClass::Gap, rule));
        }
        // Too wide for a gap.
        (*unevenness > EVEN).then(|| {
            let rule = format!(
                "{across} of {inner} vertices lie within {width:.4} of the other side, only {near} within {share} of their edges; it does not run alike: {unevenness:.2}, above {EVEN}"
            );
            (LoopClass::Misaligned, rule)
        })
    }
}

fn most(some: usize, all: usize) -> bool {
    all > 0 && 5 * some >= OF_FIVE * all
}

/// The way across from vertex to vertex.
#[derive(Default)]
struct Ways {
    before: Option<DVec3>,
    /// Sums over the steps: of what changes in the surface, of the way's length there, of what rises or falls, of the edges.
    changed: f64,
    length: f64,
    risen: f64,
    along: f64,
}

impl Ways {
    fn step(&mut self, way: DVec3, normal: DVec3, edge: f64) {
        if let Some(before) = self.before.replace(way) {
            let change = way - before;
            let rise = change.dot(normal);
            self.changed += (change - normal * rise).length();
            self.length += (way - normal * way.dot(normal)).length();
            self.risen += rise.abs();
            self.along += edge;
        }
    }

    fn unevenness(&self) -> f64 {
        let share = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
        share(self.changed, self.length) + 2.0 * share(self.risen, self.along)
    }
}

/// An edge of a loop, in its direction.
struct Segment {
    of_loop: u32,
    ends: [submesh::Vertex; 2],
    triangle: u32,
}

impl Segment {
    /// The direction in which the surface ends there, as long as the edge.
    fn ahead(&self, submesh: &Submesh) -> DVec3 {
        // The edge runs against its triangle.
        submesh.normal(self.triangle).normalize_or_zero().cross(submesh.vector(self.ends[0], self.ends[1]))
    }
}

/// Of every loop. O(n log n) in all their vertices.
pub(super) fn measure(submesh: &Submesh, loops: &[Loop], tolerance: &Tolerance, share: f64) -> Vec<Sides> {
    let segments: Vec<Segment> = loops
        .iter()
        .zip(0..)
        .flat_map(|(rim, of_loop)| {
            let n = rim.vertices.len();
            (0..n).map(move |i| Segment {
                of_loop,
                ends: [rim.vertices[i], rim.vertices[(i + 1) % n]],
                triangle: rim.triangles[i],
            })
        })
        .collect();
    let boxes: Vec<Bounds> = segments.iter().map(|s| Bounds::of(&s.ends.map(|v| submesh.positions[v as usize]))).collect();
    if boxes.is_empty() {
        return Vec::new();
    }
    let around = Around { submesh, tree: BoxTree::new(&boxes), segments: &segments, tolerance, share };
    let (mut found, mut first) = (Vec::new(), 0);
    let of = |(rim, number): (&Loop, u32)| {
        let own = &segments[first..first + rim.vertices.len()];
        first += own.len();
        around.sides_of(rim, number, own, &mut found)
    };
    loops.iter().zip(0..).map(of).collect()
}

/// The edges of all loops, to be searched.
struct Around<'s> {
    submesh: &'s Submesh,
    tree: BoxTree,
    segments: &'s [Segment],
    tolerance: &'s Tolerance,
    share: f64,
}

impl<'s> Around<'s> {
    /// Of one loop, by its number; `own`: its edges.
    fn sides_of(&self, rim: &Loop, number: u32, own: &[Segment], found: &mut Vec<u32>) -> Sides {
        let submesh = self.submesh;
        let mut sides = Sides { share: self.share, ..Sides::default() };
        let mut ways = Ways::default();
        let mut width: f64 = 0.0;
        let mut others: Vec<u32> = Vec::new();
        let n = rim.vertices.len();
        for i in 0..n {
            let before = (i + n - 1) % n;
            let [previous, v, next] = [before, i, (i + 1) % n].map(|k| rim.vertices[k]);
            let (coming, going) = (submesh.vector(previous, v), submesh.vector(v, next));
            if coming.dot(going) < 0.0 {
                ways.before = None;
                continue;
            }
            sides.inner += 1;
            let touching = self.tolerance.at(submesh, v);
            let near = touching.max(self.share * coming.length().min(going.length()));
            let ahead = own[before].ahead(submesh) + own[i].ahead(submesh);
            let Some((way, of_loop)) = self.across(v, [coming, going], ahead, touching, found) else {
                ways.before = None;
                continue;
            };
            sides.across += 1;
            sides.near += usize::from(way.length() <= near);
            sides.touching += usize::from(way.length() <= touching);
            width = width.max(way.length());
            if of_loop != number {
                others.push(of_loop);
            }
            let normal = [before, i].map(|k| submesh.normal(rim.triangles[k]).normalize_or_zero()).into_iter().sum::<DVec3>();
            ways.step(way, normal.normalize_or_zero(), coming.length());
        }
        sides.width = most(sides.across, sides.inner).then_some(width);
        sides.unevenness = ways.unevenness();
        if 2 * others.len() > sides.across {
            others.sort_unstable();
            let most = others.chunk_by(|a, b| a == b).max_by_key(|same| (same.len(), std::cmp::Reverse(same[0])));
            sides.partner = most.map(|same| same[0]).filter(|_| sides.class().is_some());
        }
        sides
    }

    /// The nearest edge that runs against the loop at one of its vertices, on the side where it is open: the way to it, and its loop.
    fn across(
        &self,
        v: submesh::Vertex,
        [coming, going]: [DVec3; 2],
        ahead: DVec3,
        touching: f64,
        found: &mut Vec<u32>,
    ) -> Option<(DVec3, u32)> {
        let submesh = self.submesh;
        let reach = touching.max(WIDER * self.share * 0.5 * (coming.length() + going.length()));
        self.tree.meeting(&near::around(&[submesh.positions[v as usize]], reach), found);
        found
            .iter()
            .map(|s| &self.segments[*s as usize])
            .filter(|s| !s.ends.contains(&v))
            .filter(|s| cosine(submesh.vector(s.ends[0], s.ends[1]), coming + going) < AGAINST)
            .map(|s| (way_to(submesh, v, s), s))
            .filter(|(way, s)| way.length() <= touching || cosine(ahead, s.ahead(submesh)) <= ALIKE)
            .map(|(way, s)| (way, s.of_loop))
            .min_by(|a, b| a.0.length().total_cmp(&b.0.length()))
            .filter(|(way, _)| way.length() <= reach)
    }
}

/// From a vertex to the nearest point of a segment.
fn way_to(submesh: &Submesh, v: submesh::Vertex, segment: &Segment) -> DVec3 {
    let [a, b] = segment.ends.map(|v| submesh.place(v));
    let p = submesh.place(v);
    nearest_of_segment(a, b, p) - p
}
