//! Places added within rings until triangles are even and small enough in space.
//!
//! Based on: L. P. Chew, *Guaranteed-quality mesh generation for curved surfaces*, SoCG 1993 (circles are measured in space, triangles
//! are valid on the map), and A. Üngör, *Off-centers*, LATIN 2004 (a place nearer to the shortest edge than the centre of the circle
//! does as well, with fewer places). Edges of rings are never split: a place that is too near to one gives way to one at a fair distance.
//!
//! A triangle below [`GOOD`] has an angle below 30°, so the circle around it is wider than its shortest edge is long; a place has to keep that
//! length away from the corners around it, so edges never become shorter than 0.6 of the shortest one of rings, and the number of
//! places is bounded, besides by `most`.

use std::collections::{BinaryHeap, VecDeque};

use super::lifted::{End, Lifted, NONE};
use crate::curves::vector::{Point, cross, dot, plain_distance, plain_norm, sub};
use crate::util::each::Each;

/// Twice the ratio of radii below which a triangle is divided: that of angles of 30°, 30° and 120° is 0.4641.
const GOOD: f64 = 0.46;
/// Height of a place above the shortest edge of a flat triangle, in lengths of that, at most.
const OFF: f64 = 1.5;
/// Heights of places above edges of rings, in lengths of these: the least, and what is chosen instead.
const HEIGHTS: [f64; 2] = [0.45, 0.7];
/// The least distance of such a place from others, in lengths of the edge.
const APART: f64 = 0.6;
/// How much shorter edges may be at a distance from longer ones of rings, in parts of that.
const DECAY: f64 = 0.35;
/// Of two edges of rings that are in the way, one shorter than this part of the other is left.
const SHORTER: f64 = 0.4;
/// Passes over all triangles, at most.
const PASSES: u32 = 4;
/// The least distance of others, for a triangle that is too large, in parts of the largest radius.
const WIDE: f64 = 0.8;

/// Refines until no triangle is below 0.46, and none has a wider circle than one with edges of the length `longest`, or of those of rings
/// nearby that are longer, where rings allow it; places are no more than `most` with those of rings. Triangles are divided in the order in
/// which they arise, so places go in layer by layer from rings, and each changes few triangles. O(n log n).
///
/// Gives the edges of rings, by their places, that are in the way of triangles below 0.46: a finer division of them would help.
pub(super) fn refine(lifted: &mut Lifted<'_>, longest: f64, most: usize) -> Vec<[u32; 2]> {
    lifted.legalise_all();
    let sizes = sizes(lifted, longest);
    let mut state = State { lifted, sizes, longest, changed: Vec::new(), blocking: Vec::new() };
    state.changed.extend(0..state.lifted.flat.triangles.len() as u32);
    for _ in 0..PASSES {
        // A triangle that could not be divided may be later, when others around it are.
        let before = state.lifted.points.len();
        state.blocking.clear();
        state.pass(most);
        if state.blocking.is_empty() || state.lifted.points.len() == before {
            break;
        }
        state.changed.extend(0..state.lifted.flat.triangles.len() as u32);
    }
    state.blocking.sort_unstable();
    state.blocking.dedup();
    state.blocking
}

/// The length of edges wanted at each place: `longest`, or that of edges of rings there, if these are longer, getting shorter
/// with the distance (H. Borouchaki, F. Hecht, P. J. Frey, *Mesh gradation control*, 1998). O(n log n).
fn sizes(lifted: &Lifted<'_>, longest: f64) -> Vec<f64> {
    let mut sizes = vec![longest; lifted.points.len()];
    let mut around: Vec<(u32, u32, f64)> = Vec::new();
    for edge in 0..3 * lifted.flat.triangles.len() as u32 {
        let [_, a, b] = lifted.around(edge);
        let length = plain_distance(lifted.point(a), lifted.point(b));
        around.extend([(a, b, length), (b, a, length)]);
        if lifted.beyond(edge) == NONE {
            for end in [a, b] {
                sizes.iter_mut().skip(end as usize).take(1).for_each(|size| *size = size.max(length));
            }
        }
    }
    let mut queue: BinaryHeap<(u64, u32)> = BinaryHeap::new();
    // Bits of positive floats are in the order of these.
    let key = |size: f64| size.to_bits();
    queue.extend(sizes.iter().zip(0..).filter(|(size, _)| **size > longest).map(|(size, number)| (key(*size), number)));
    if queue.is_empty() {
        return sizes;
    }
    around.sort_unstable_by_key(|(from, to, _)| (*from, *to));
    while let Some((bits, from)) = queue.pop() {
        let size = f64::from_bits(bits);
        if sizes.get(from as usize) != Some(&size) {
            continue;
        }
        let first = around.partition_point(|(number, ..)| *number < from);
        for (_, to, length) in around.iter().skip(first).take_while(|(number, ..)| *number == from) {
            let least = size - DECAY * length;
            if let Some(known) = sizes.get_mut(*to as usize).filter(|known| **known < least) {
                *known = least;
                queue.push((key(least), *to));
            }
        }
    }
    sizes
}

/// Edges of rings that are in the way of a place.
type Blocking = [Option<u32>; 2];

/// Measures of a triangle in space.
#[derive(Clone, Copy, Debug)]
struct Shape {
    quality: f64,
    radius: f64,
    /// Its shortest edge, as [`Lifted`] calls it, and the length of that.
    edge: u32,
    shortest: f64,
}

impl Shape {
    fn of(lifted: &Lifted<'_>, triangle: u32) -> Self {
        let [a, b, c] = lifted.corners(triangle).each(|corner| lifted.point(corner));
        let (u, v, w) = (sub(c, b), sub(a, c), sub(b, a));
        let lengths = [u, v, w].each(|side| dot(side, side).sqrt());
        let double = plain_norm(cross(v, w));
        let [x, y, z] = lengths;
        let (product, around) = (x * y * z, x + y + z);
        let quality = if product > 0.0 { 4.0 * double * double / (product * around) } else { 0.0 };
        let mut edge = 0;
        for (number, length) in lengths.iter().enumerate() {
            if *length < lengths[edge] {
                edge = number;
            }
        }
        Self { quality, radius: 0.5 * product / double, edge: 3 * triangle + edge as u32, shortest: lengths[edge] }
    }

    fn is_bad(&self, radius: f64) -> bool {
        self.quality < GOOD || self.radius > radius
    }
}

/// The place at a height above the middle of an edge, on the map, as the edge's triangle is laid there.
fn above(lifted: &Lifted<'_>, edge: u32, height: f64) -> Option<[f64; 2]> {
    let corners = lifted.around(edge);
    let [c, a, b] = corners.each(|corner| lifted.point(corner));
    let (along, up) = (sub(b, a), sub(c, a));
    let squared = dot(along, along);
    let foot = dot(up, along) / squared;
    let high = plain_norm(cross(along, up)) / squared.sqrt();
    let third = height / high;
    let second = 0.5 - third * foot;
    let [p, q, r] = corners.each(|corner| lifted.place(corner));
    let place = [0, 1].each(|axis| p[axis] * third + q[axis] * (1.0 - second - third) + r[axis] * second);
    place.iter().all(|x| x.is_finite()).then_some(place)
}

/// Triangles that are refined, the length of edges wanted at each place, and triangles to be looked at again.
struct State<'s, 'a> {
    lifted: &'s mut Lifted<'a>,
    sizes: Vec<f64>,
    longest: f64,
    changed: Vec<u32>,
    /// Edges of rings that are in the way of flat triangles, by their places.
    blocking: Vec<[u32; 2]>,
}

impl State<'_, '_> {
    fn size(&self, corner: u32) -> f64 {
        self.sizes.get(corner as usize).copied().unwrap_or(self.longest)
    }

    /// The radius of the circle around a triangle, at most.
    fn radius(&self, triangle: u32) -> f64 {
        self.lifted.corners(triangle).into_iter().fold(self.longest, |most, corner| most.max(self.size(corner))) / 3.0_f64.sqrt()
    }

    /// Divides triangles until none is left that can be.
    fn pass(&mut self, most: usize) {
        let mut queue: VecDeque<(u32, [u32; 3])> = VecDeque::new();
        loop {
            self.changed.sort_unstable();
            self.changed.dedup();
            for triangle in std::mem::take(&mut self.changed) {
                if Shape::of(self.lifted, triangle).is_bad(self.radius(triangle)) {
                    queue.push_back((triangle, self.lifted.corners(triangle)));
                }
            }
            let Some((triangle, corners)) = queue.pop_front() else { return };
            if self.lifted.points.len() >= most {
                return;
            }
            // It may have changed since.
            if self.lifted.corners(triangle) == corners {
                self.divide(triangle);
            }
        }
    }

    /// Divides a triangle, if a place for that is found.
    fn divide(&mut self, triangle: u32) {
        let shape = Shape::of(self.lifted, triangle);
        let radius = self.radius(triangle);
        let centre = (shape.radius * shape.radius - 0.25 * shape.shortest * shape.shortest).max(0.0).sqrt();
        let is_flat = shape.quality < GOOD;
        let height = if is_flat { centre.min(OFF * shape.shortest) } else { centre };
        // The shortest edge may be longer than what is wanted of all.
        let clear = if is_flat { shape.shortest.min(radius) } else { WIDE * radius };
        let Some(place) = above(self.lifted, shape.edge, height) else { return };
        match settled(self.lifted, triangle, place, clear) {
            Ok((inside, place, point)) => {
                let corners = self.lifted.corners(inside);
                let least = |corner: u32| self.size(corner) - DECAY * plain_distance(self.lifted.point(corner), point);
                let size = corners.into_iter().fold(self.longest, |most, corner| most.max(least(corner)));
                if self.lifted.insert(inside, place, point, &mut self.changed) {
                    self.sizes.push(size);
                } else if is_flat {
                    self.block([None; 2], triangle);
                }
            }
            Err(edges) if is_flat => self.block(edges, triangle),
            Err(_) => {}
        }
    }

    /// Notes the edges of rings that are in the way of a triangle but for one that is much shorter than the other, or if none is known, the
    /// longest one of the triangle or beside it.
    fn block(&mut self, edges: Blocking, triangle: u32) {
        let lifted = &*self.lifted;
        let mut all: Vec<u32> = edges.into_iter().flatten().collect();
        if all.is_empty() {
            let own = |triangle: u32| 3 * triangle..3 * triangle + 3;
            let beside = own(triangle).map(|edge| lifted.beyond(edge)).filter(|other| *other != NONE);
            let near = own(triangle).chain(beside.flat_map(|other| own(other / 3))).filter(|edge| lifted.beyond(*edge) == NONE);
            all.extend(near.max_by(|a, b| length(lifted, *a).total_cmp(&length(lifted, *b))));
        }
        let most = all.iter().map(|edge| length(lifted, *edge)).fold(0.0, f64::max);
        all.retain(|edge| length(lifted, *edge) >= SHORTER * most);
        self.blocking.extend(all.into_iter().map(|edge| lifted.around(edge)).map(|[_, a, b]| [a, b]));
    }
}

fn length(lifted: &Lifted<'_>, edge: u32) -> f64 {
    let [_, a, b] = lifted.around(edge).each(|corner| lifted.point(corner));
    plain_distance(a, b)
}

/// Where a place goes: the triangle, the place, and its point; if others are nearer there than `clear`, the edges of rings that are in
/// the way.
fn settled(lifted: &Lifted<'_>, from: u32, mut place: [f64; 2], mut clear: f64) -> Result<(u32, [f64; 2], Point), Blocking> {
    let mut end = lifted.walk(from, place).ok_or([None; 2])?;
    let mut point = lifted.lift(place);
    let low = |triangle: u32, point: Point, least: f64| {
        (3 * triangle..3 * triangle + 3).find(|edge| {
            let [_, a, b] = lifted.around(*edge).each(|corner| lifted.point(corner));
            lifted.beyond(*edge) == NONE && plain_norm(cross(sub(b, a), sub(point, a))) < least * dot(sub(b, a), sub(b, a))
        })
    };
    let edge = match end {
        End::At(edge) => Some(edge),
        End::In(triangle) => low(triangle, point, HEIGHTS[0]),
    };
    if let Some(edge) = edge {
        let along = length(lifted, edge);
        place = above(lifted, edge, HEIGHTS[1] * along).ok_or([Some(edge), None])?;
        clear = APART * along;
        point = lifted.lift(place);
        end = lifted.walk(edge / 3, place).ok_or([Some(edge), None])?;
    }
    let triangle = match end {
        End::In(triangle) => triangle,
        End::At(other) => return Err([edge, Some(other)]),
    };
    let is_clear = |corner: u32| plain_distance(lifted.point(corner), point) >= clear;
    let across = |edge: u32| Some(lifted.beyond(edge)).filter(|other| *other != NONE).map(|other| lifted.around(other)[0]);
    let is_free =
        lifted.corners(triangle).into_iter().all(is_clear) && (3 * triangle..3 * triangle + 3).filter_map(across).all(is_clear);
    match low(triangle, point, 0.9 * HEIGHTS[0]) {
        Some(other) => Err([edge, Some(other)]),
        None if is_free => Ok((triangle, place, point)),
        None => Err([edge, None]),
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::of_triangle;
    use super::super::triangles::triangles;
    use super::*;

    /// Places around a square of 4, each side with so many edges.
    fn square(edges: usize) -> Vec<[f64; 2]> {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
        let edge = |pair: &[[f64; 2]]| {
            let (a, b) = (pair[0], pair[1]);
            (0..edges).map(move |at| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * at as f64 / edges as f64))
        };
        corners.windows(2).flat_map(edge).collect()
    }

    /// Edges of 0.25: about 2 · 16² · 2/√3 triangles; long edges of rings do not spoil what is beside them. Whatever the edges, no
    /// triangle is below 0.4, all are anticlockwise, and their areas are that of the square.
    #[test]
    fn triangles_are_even_and_as_large_as_asked_for() {
        for (edges, longest) in [(16, 0.25), (16, f64::INFINITY), (4, 0.25)] {
            let mut lifted = Lifted::new(triangles(&[square(edges)]).unwrap());
            refine(&mut lifted, longest, 10_000);
            let count = lifted.flat.triangles.len();
            assert!(edges != 16 || longest > 1.0 || (400..1400).contains(&count), "{count}");
            let worst = lifted.flat.triangles.iter().map(|one| one.map(|corner| lifted.point(corner)));
            assert!(worst.map(|[a, b, c]| of_triangle(a, b, c)).fold(1.0, f64::min) > 0.4);
            assert!(lifted.flat.triangles.iter().all(|one| lifted.area(*one) > 0.0));
            let area: f64 = lifted.flat.triangles.iter().map(|one| 0.5 * lifted.area(*one)).sum();
            assert!((area - 16.0).abs() < 1e-9);
        }
    }

    /// No more places than are allowed.
    #[test]
    fn places_are_bounded() {
        let mut lifted = Lifted::new(triangles(&[square(4)]).unwrap());
        refine(&mut lifted, 0.01, 50);
        assert_eq!(lifted.points.len(), 50);
    }
}
