//! Vertices go where they are wanted, as far as no triangle crosses another one, turns over or loses its area for it.
//!
//! All go at first. Around what is wrong then, vertices go half as far, and half as far again, and in the end not at all, until nothing is wrong. Where
//! nothing has moved, nothing new is wrong; so this ends. What crossed before is not looked at as long as it does not move.

use rayon::prelude::*;

use crate::geometry::boxes::BoxTree;
use crate::geometry::collinear::is_collinear;
use crate::geometry::distance::{distance, place};
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::{Triangle, do_cross};

/// How often a way is halved before it is not gone at all.
const HALVES: u8 = 4;

/// Rounds of halving; after these, all vertices stay.
const ROUNDS: usize = 64;

/// Where vertices have come.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Settled {
    /// Positions of all vertices.
    pub points: Vec<Point>,
    /// Vertices that did not come all the way.
    pub held: usize,
    /// The largest way that was gone: each place of the old surface is as near to the new one, and the other way round, since both are linear on each triangle.
    pub largest: f64,
}

/// Moves vertices to `wanted` positions, or on the way there. `faces` refer to `points`, and `wanted` has as many; positions that are not finite are not
/// wanted. O(n log n) for each round, of which there are few.
pub(crate) fn settle(points: &[Point], faces: &[[u32; 3]], wanted: &[Point]) -> Settled {
    let is_finite = |p: &Point| p.iter().all(|x| x.is_finite());
    let moves = |v: usize| wanted.get(v).is_some_and(|to| is_finite(to) && *to != points[v]);
    let mut halves: Vec<u8> = (0..points.len()).map(|v| if moves(v) { 0 } else { HALVES + 1 }).collect();
    let mut now: Vec<Point> = (0..points.len()).map(|v| at(points, wanted, v, halves[v])).collect();
    let mut rounds = 0;
    loop {
        let bad = wrong(points, &now, faces);
        if bad.is_empty() {
            break;
        }
        rounds += 1;
        let mut vertices: Vec<u32> = bad.into_iter().flat_map(|f| faces[f as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        for v in vertices.into_iter().map(|v| v as usize) {
            if now[v] == points[v] {
                continue;
            }
            halves[v] = if rounds < ROUNDS { halves[v] + 1 } else { HALVES + 1 };
            now[v] = at(points, wanted, v, halves[v]);
        }
        if rounds > ROUNDS + usize::from(HALVES) {
            now.copy_from_slice(points);
            break;
        }
    }
    let held = (0..points.len()).filter(|v| moves(*v) && now[*v] != wanted[*v]).count();
    let largest = points.iter().zip(&now).map(|(p, q)| distance(*p, *q)).fold(0.0, f64::max);
    Settled { points: now, held, largest }
}

fn at(points: &[Point], wanted: &[Point], v: usize, halves: u8) -> Point {
    if halves > HALVES {
        return points[v];
    }
    if halves == 0 {
        return wanted[v].map(|x| x + 0.0);
    }
    let share = 0.5_f64.powi(i32::from(halves));
    let (from, to) = (place(points[v]), place(wanted[v]));
    (from + (to - from) * share).to_array().map(|x| x as f32 + 0.0)
}

/// Triangles that have moved, and turned over, lost their area, come upon another vertex, or cross another triangle; and what they cross.
fn wrong(before: &[Point], now: &[Point], faces: &[[u32; 3]]) -> Vec<u32> {
    let triangle = |f: usize| -> Triangle { faces[f].map(|v| now[v as usize]) };
    let has_moved = |v: u32| before[v as usize] != now[v as usize];
    let moved: Vec<u32> = (0..faces.len()).filter(|f| faces[*f].iter().any(|v| has_moved(*v))).map(|f| f as u32).collect();
    if moved.is_empty() {
        return Vec::new();
    }
    let boxes: Vec<Bounds> = (0..faces.len()).into_par_iter().map(|f| Bounds::of(&triangle(f))).collect();
    let tree = BoxTree::new(&boxes);
    let look = |f: &u32| {
        let own = triangle(*f as usize);
        let old: Triangle = faces[*f as usize].map(|v| before[v as usize]);
        let mut bad = Vec::new();
        if turns(&old, &own) {
            bad.push(*f);
        }
        tree.each_meeting(&boxes[*f as usize], |other| {
            if other != *f {
                let face = faces[other as usize];
                let at = triangle(other as usize);
                let comes_upon = faces[*f as usize]
                    .iter()
                    .zip(own)
                    .any(|(v, p)| has_moved(*v) && at.iter().zip(face).any(|(q, w)| p == *q && w != *v));
                if comes_upon || do_cross(&own, &at) {
                    bad.extend([*f, other]);
                }
            }
        });
        bad
    };
    let found: Vec<Vec<u32>> = moved.par_iter().with_min_len(256).map(look).collect();
    let mut all: Vec<u32> = found.into_iter().flatten().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Does a triangle turn by a right angle or more, or lose its area? One without an area may do as it likes, but get another one.
fn turns(old: &Triangle, new: &Triangle) -> bool {
    let normal = |[a, b, c]: [Point; 3]| (place(b) - place(a)).cross(place(c) - place(a));
    !is_collinear(&old[0], &old[1], &old[2]) && (is_collinear(&new[0], &new[1], &new[2]) || normal(*old).dot(normal(*new)) <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::self_crossing::{SelfCrossing, self_crossing};
    use proptest::prelude::*;

    /// A flat grid of 4 × 4 squares, at a height.
    fn grid(z: f32, first: u32) -> (Vec<Point>, Vec<[u32; 3]>) {
        let points = (0..25).map(|i| [(i % 5) as f32, (i / 5) as f32, z]).collect();
        let faces = (0..16).map(|i| first + i % 4 + i / 4 * 5).flat_map(|a| [[a, a + 1, a + 6], [a, a + 6, a + 5]]).collect();
        (points, faces)
    }

    #[test]
    fn a_vertex_stops_before_the_sheet_above_it() {
        let (mut points, mut faces) = grid(0.0, 0);
        let (above, more) = grid(1.0, 25);
        points.extend(above);
        faces.extend(more);
        let mut wanted = points.clone();
        wanted[12][2] = 1.5;
        let settled = settle(&points, &faces, &wanted);
        // Half of the way is below the sheet; all of it is beyond.
        assert_eq!((settled.points[12][2], settled.held, settled.largest), (0.75, 1, 0.75));
    }

    #[test]
    fn a_vertex_does_not_come_upon_another_one() {
        let (mut points, mut faces) = grid(0.0, 0);
        let (above, more) = grid(1.0, 25);
        points.extend(above);
        faces.extend(more);
        let mut wanted = points.clone();
        wanted[12][2] = 1.0;
        assert_eq!(settle(&points, &faces, &wanted).points[12][2], 0.5, "it would touch a vertex of the sheet");
    }

    proptest! {
        #[test]
        fn nothing_crosses_and_nothing_turns(ways in prop::collection::vec((0usize..50, prop::array::uniform3(-20i8..21)), 0..20)) {
            let (mut points, mut faces) = grid(0.0, 0);
            let (above, more) = grid(0.75, 25);
            points.extend(above);
            faces.extend(more);
            let mut wanted = points.clone();
            for (v, way) in ways {
                wanted[v] = std::array::from_fn(|k| points[v][k] + f32::from(way[k]) / 8.0);
            }
            let settled = settle(&points, &faces, &wanted);
            let all: Vec<Triangle> = faces.iter().map(|f| f.map(|v| settled.points[v as usize])).collect();
            prop_assert_eq!(self_crossing(&all, u64::MAX), SelfCrossing::None);
            for (face, new) in faces.iter().zip(&all) {
                prop_assert!(!turns(&face.map(|v| points[v as usize]), new));
            }
            for v in 0..points.len() {
                prop_assert!(distance(points[v], settled.points[v]) <= distance(points[v], wanted[v]) + 1e-6);
            }
        }
    }
}
