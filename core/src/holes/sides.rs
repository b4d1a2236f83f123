//! Loops that are narrow: each vertex has another side of the hole near it (METHODS C2 to C4).
//!
//! A side across runs the other way, since both are traversed by one patch: so a neighbouring edge of the same chain is never taken for
//! it. The ends of a slit, where the loop turns back, have no side across and are not asked for one.

use glam::DVec3;

use super::loops::Loop;
use crate::boxes::BoxTree;
use crate::report::LoopClass;
use crate::shop::edges::Edges;
use crate::shop::near::{self, Tolerance};
use crate::shop::{self, Shop};
use crate::sums::Bounds;

/// Cosine between a chain and the side across it, at most.
const AGAINST: f64 = -0.5;
/// So many of its vertices, of five, must have a side across to make a loop narrow.
const OF_FIVE: usize = 4;
/// Sides do not run alike if the way across changes from vertex to vertex by more than this share of itself.
const UNEVEN: f64 = 0.3;

/// What lies across a loop.
#[derive(Clone, Debug, Default)]
pub(super) struct Sides {
    /// Vertices that are no ends, and those of them with a side across, and within the weld tolerance of it.
    inner: usize,
    across: usize,
    touching: usize,
    /// Largest distance of a side across; `None` unless the loop is narrow.
    pub(super) width: Option<f64>,
    /// Mean change of the way across from one vertex to the next, as a share of its length.
    unevenness: f64,
    /// The other loop on which most of what is across lies, if it is not this one.
    pub(super) partner: Option<u32>,
    share: f64,
}

impl Sides {
    pub(super) fn class(&self) -> Option<(LoopClass, String)> {
        let width = self.width?;
        let Self { inner, across, touching, unevenness, share, .. } = self;
        Some(if touching == inner {
            (LoopClass::Crack, format!("all {inner} vertices between its ends lie within the weld tolerance of the other side"))
        } else if *unevenness > UNEVEN {
            let rule = format!(
                "{across} of {inner} vertices lie within {width:.4} of the other side, which does not run alike: {unevenness:.2} over {UNEVEN}"
            );
            (LoopClass::Misaligned, rule)
        } else {
            (LoopClass::Gap, format!("{across} of {inner} vertices lie within {share} of their edges of the other side"))
        })
    }
}

/// An edge of a loop, in its direction.
struct Segment {
    of_loop: u32,
    ends: [shop::Vertex; 2],
}

/// Of every loop. O(n log n) in all their vertices.
pub(super) fn measure(shop: &Shop, edges: &Edges, loops: &[Loop], tolerance: &Tolerance, share: f64) -> Vec<Sides> {
    let segments: Vec<Segment> = loops
        .iter()
        .zip(0..)
        .flat_map(|(rim, of_loop)| {
            let n = rim.vertices.len();
            (0..n).map(move |i| Segment { of_loop, ends: [rim.vertices[i], rim.vertices[(i + 1) % n]] })
        })
        .collect();
    let boxes: Vec<Bounds> = segments.iter().map(|s| Bounds::of(&s.ends.map(|v| shop.positions[v as usize]))).collect();
    if boxes.is_empty() {
        return Vec::new();
    }
    let tree = BoxTree::new(&boxes);
    let _ = edges;
    let mut found = Vec::new();
    loops
        .iter()
        .zip(0..)
        .map(|(rim, number)| {
            let mut sides = Sides { share, ..Sides::default() };
            let (mut width, mut change, mut length): (f64, f64, f64) = (0.0, 0.0, 0.0);
            let mut others: Vec<u32> = Vec::new();
            let mut before: Option<DVec3> = None;
            let n = rim.vertices.len();
            for i in 0..n {
                let [previous, v, next] = [(i + n - 1) % n, i, (i + 1) % n].map(|k| rim.vertices[k]);
                let (coming, going) = (shop.vector(previous, v), shop.vector(v, next));
                if coming.dot(going) < 0.0 {
                    before = None;
                    continue;
                }
                sides.inner += 1;
                let touching = tolerance.at(shop, v);
                let reach = touching.max(share * coming.length().min(going.length()));
                tree.meeting(&near::around(&[shop.positions[v as usize]], reach), &mut found);
                let across = found
                    .iter()
                    .map(|s| &segments[*s as usize])
                    .filter(|s| !s.ends.contains(&v))
                    .filter(|s| shop::cosine(shop.vector(s.ends[0], s.ends[1]), coming + going) < AGAINST)
                    .map(|s| (way_to(shop, v, s), s.of_loop))
                    .min_by(|a, b| a.0.length().total_cmp(&b.0.length()))
                    .filter(|(way, _)| way.length() <= reach);
                let Some((way, of_loop)) = across else {
                    before = None;
                    continue;
                };
                sides.across += 1;
                sides.touching += usize::from(way.length() <= touching);
                width = width.max(way.length());
                if of_loop != number {
                    others.push(of_loop);
                }
                if let Some(before) = before {
                    change += before.distance(way);
                    length += 0.5 * (before.length() + way.length());
                }
                before = Some(way);
            }
            sides.width = (sides.inner > 0 && 5 * sides.across >= OF_FIVE * sides.inner).then_some(width);
            sides.unevenness = if length > 0.0 { change / length } else { 0.0 };
            if 2 * others.len() > sides.across {
                others.sort_unstable();
                let most = others.chunk_by(|a, b| a == b).max_by_key(|same| (same.len(), std::cmp::Reverse(same[0])));
                sides.partner = most.map(|same| same[0]).filter(|_| sides.width.is_some());
            }
            sides
        })
        .collect()
}

/// From a vertex to the nearest point of a segment.
fn way_to(shop: &Shop, v: shop::Vertex, segment: &Segment) -> DVec3 {
    let [a, b] = segment.ends.map(|v| shop.place(v));
    let (p, d) = (shop.place(v), b - a);
    let at = ((p - a).dot(d) / d.dot(d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    a + d * at - p
}
