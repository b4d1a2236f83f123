//! SlitSides of a slit that run on past each other into the model and cross there, as simulated milling leaves them.
//!
//! What lies behind the other side is surplus: the triangles around every vertex of the loop that does so go, if they cross nothing else than
//! the other side of the same loop, and the loop, wider by them, is closed like any other. (Moving the ends of
//! the two sides onto their intersection line would be another way; that line lies in the groove that they make, so a patch continues the surface
//! that stood there before more truly.) SlitSides that cross outside of the model are left alone, and so is a loop that would become much longer.

use crate::contract::report::RepairName;
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::collections::BTreeMap;

use robust::Coord3D;

use crate::detect::holes::loops::{self, Loop};
use crate::geometry::tri_tri::{Triangle as Corners, common, self_intersection};
use crate::repairs::shared::work::Work;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Slits whose sides overlap.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::SlitSides,
    changes: Changes::Surface,
    run: |cx| {
        let cut = cut_back(cx.survey, &mut cx.work);
        Ok(Done::count(cut, "triangles of slits whose sides run past each other into the model, cut back"))
    },
};

/// A loop may become so many times as long.
const LONGER: f64 = 2.0;

/// A vertex where several loops meet.
const SEVERAL: u32 = NONE - 1;

/// Removes what runs past the other side of its loop; returns how many triangles. O(submesh), if triangles at a boundary cross others.
pub(crate) fn cut_back(survey: &mut Survey<'_>, work: &mut Work<'_>) -> u64 {
    let pairs = match survey.crossing_pairs.as_deref() {
        Some(pairs) if !pairs.is_empty() => pairs.iter().map(|pair| pair.triangles),
        _ => return 0,
    };
    let (submesh, edges) = work.edges();
    let rims = loops::find(submesh, edges);
    if rims.is_empty() {
        return 0;
    }
    let slits = Slits::of(submesh, &rims, pairs);
    let mut doomed: Vec<u32> = rims.iter().zip(&slits.sides).flat_map(|(rim, sides)| surplus(submesh, rim, sides)).collect();
    doomed.sort_unstable();
    doomed.dedup();
    let mut wanted: Vec<Vertex> =
        doomed.iter().flat_map(|t| submesh.triangles[*t as usize].v).filter(|v| !submesh.complete[*v as usize]).collect();
    wanted.sort_unstable();
    wanted.dedup();
    if !wanted.is_empty() {
        let positions: Vec<[f32; 3]> = wanted.iter().map(|v| submesh.positions[*v as usize]).collect();
        let new = survey.promote(&positions);
        work.extend(survey, &new, &wanted);
    }
    doomed.iter().for_each(|t| work.kill(*t));
    doomed.len() as u64
}

/// Crossings at a loop.
#[derive(Default)]
struct SlitSides {
    /// Triangles along it that cross each other.
    crossing: Vec<u32>,
    /// Its vertices at these: behind how many of the triangles that theirs cross, and in front of how many.
    seen: BTreeMap<Vertex, [u32; 2]>,
    /// A triangle along it crosses something else.
    meets_others: bool,
}

struct Slits {
    /// As the loops are numbered.
    sides: Vec<SlitSides>,
}

impl Slits {
    fn of(submesh: &Submesh, rims: &[Loop], pairs: impl Iterator<Item = [u32; 2]> + Clone) -> Self {
        let along = Along::of(submesh, rims, pairs.clone());
        let mut sides: Vec<SlitSides> = rims.iter().map(|_| SlitSides::default()).collect();
        for pair in pairs {
            let there = pair.map(|record| along.triangles.get(&record).copied());
            let of = there.map(|t| t.and_then(|t| along.loop_of(submesh, t)));
            if of == [None, None] {
                continue;
            }
            if let [Some(a), Some(b)] = there {
                let [p, q] = [submesh.points(a), submesh.points(b)];
                // Some may have been moved apart since.
                if self_intersection(&p, &q, common(&p, &q)).is_none() {
                    continue;
                }
                if let ([Some(i), Some(j)], true) = (of, of[0] == of[1])
                    && i == j
                    && let Some(sides) = sides.get_mut(i as usize)
                {
                    sides.cross(submesh, [a, b], |v| along.of_vertex[v as usize] == i);
                    continue;
                }
            }
            for i in of.into_iter().flatten() {
                if let Some(sides) = sides.get_mut(i as usize) {
                    sides.meets_others = true;
                }
            }
        }
        Self { sides }
    }
}

impl SlitSides {
    /// Takes in two triangles along the loop that cross each other.
    fn cross(&mut self, submesh: &Submesh, [a, b]: [u32; 2], is_of_loop: impl Fn(Vertex) -> bool) {
        self.crossing.extend([a, b]);
        for (t, other) in [(a, b), (b, a)] {
            let of_other = submesh.triangles[other as usize].v;
            let of_loop = submesh.triangles[t as usize].v.into_iter().filter(|v| is_of_loop(*v));
            for v in of_loop.filter(|v| !of_other.contains(v)) {
                let behind = side(&submesh.points(other), submesh.positions[v as usize]);
                let [behind_of, before] = self.seen.entry(v).or_default();
                *behind_of += u32::from(behind > 0.0);
                *before += u32::from(behind < 0.0);
            }
        }
    }
}

/// The triangles that lie along each loop.
struct Along {
    /// By vertex: its loop, [`NONE`] or [`SEVERAL`].
    of_vertex: Vec<u32>,
    /// By record of the file, of those that cross something: its triangle in the submesh.
    triangles: BTreeMap<u32, u32>,
}

impl Along {
    fn of(submesh: &Submesh, rims: &[Loop], pairs: impl Iterator<Item = [u32; 2]>) -> Self {
        let mut of_vertex = vec![NONE; submesh.positions.len()];
        for (i, rim) in (0..).zip(rims) {
            for v in &rim.vertices {
                let of = &mut of_vertex[*v as usize];
                *of = if *of == NONE { i } else { SEVERAL };
            }
        }
        let mut records: Vec<u32> = pairs.flatten().collect();
        records.sort_unstable();
        records.dedup();
        let crossing = |t: u32| match submesh.triangles[t as usize].origin {
            Origin::Input(record) => records.binary_search(&record).is_ok().then_some((record, t)),
            Origin::Part(_) | Origin::Added(_) => None,
        };
        Self { of_vertex, triangles: submesh.living().filter_map(crossing).collect() }
    }

    /// The loop of a triangle, if it is along one; [`SEVERAL`] if along two.
    fn loop_of(&self, submesh: &Submesh, t: u32) -> Option<u32> {
        let corners = submesh.triangles[t as usize].v.into_iter();
        let mut all = corners.map(|v| self.of_vertex[v as usize]).filter(|of| *of != NONE);
        let first = all.next()?;
        Some(if all.all(|of| of == first) { first } else { SEVERAL })
    }
}

/// Positive if a point lies behind a triangle, exactly.
fn side(triangle: &Corners, p: [f32; 3]) -> f64 {
    let coord = |p: [f32; 3]| Coord3D { x: p[0], y: p[1], z: p[2] };
    let [a, b, c] = triangle.map(coord);
    robust::orient3d(a, b, c, coord(p))
}

/// The triangles around all vertices of a loop that lie behind its other side, if that is all that is wrong with it.
fn surplus(submesh: &Submesh, rim: &Loop, sides: &SlitSides) -> Vec<u32> {
    // Of the triangles of a curved side, one may look away from what lies behind all others.
    let is_astray = |v: &Vertex| sides.seen.get(v).is_some_and(|[behind, in_front]| behind > in_front);
    if sides.meets_others || !sides.crossing.iter().all(|t| submesh.triangles[*t as usize].v.iter().any(is_astray)) {
        return Vec::new();
    }
    let mut doomed: Vec<u32> =
        sides.seen.keys().filter(|v| is_astray(v)).flat_map(|v| submesh.star(*v).map(|(t, _)| t)).collect();
    doomed.sort_unstable();
    doomed.dedup();
    if perimeter_without(submesh, rim, &doomed) > LONGER * rim.perimeter(submesh) { Vec::new() } else { doomed }
}

/// How long the loop is once some triangles along it, ascending, are gone.
fn perimeter_without(submesh: &Submesh, rim: &Loop, doomed: &[u32]) -> f64 {
    let n = rim.vertices.len();
    let own = (0..n).map(|i| {
        let ends = [rim.vertices[i], rim.vertices[(i + 1) % n]];
        (ends[0].min(ends[1]), ends[0].max(ends[1]))
    });
    let of_doomed = doomed.iter().flat_map(|t| {
        let v = submesh.triangles[*t as usize].v;
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (v[i].min(v[j]), v[i].max(v[j])))
    });
    // An edge of the loop is one once it has one doomed triangle; an inner one that has one becomes part of the loop.
    let mut edges: Vec<(Vertex, Vertex)> = own.chain(of_doomed).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| submesh.distance(same[0].0, same[0].1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{After, after, plate, shifted};

    /// A plate of 8 × 8 squares with a slit at x = 4 from y = 2 to y = 6, whose sides run on past each other by half a square, up by so much.
    fn slit(up: f32) -> Vec<Corners> {
        let side = |left: bool| {
            let on = move |[x, y, z]: [f32; 3]| {
                let by = if left { 0.5 } else { -0.5 };
                if x == 4.0 && (3.0..=5.0).contains(&y) { [x + by, y, z + up] } else { [x, y, z] }
            };
            plate(8, move |x, _| (x < 4) == left).into_iter().map(move |t| t.map(on))
        };
        side(true).chain(side(false)).collect()
    }

    fn cut(mesh: &[Corners]) -> After<u64> {
        after(mesh, |d, _| cut_back(&mut d.survey, &mut Work::new(&mut d.submesh)))
    }

    #[test]
    fn sides_that_run_past_each_other_into_the_model_are_cut_back() {
        let got = cut(&slit(-0.5));
        // Around three vertices of either side, each with one square more: four squares less a triangle.
        assert_eq!(got.result, 14);
        assert_eq!(got.defects.self_intersections.map(|found| found.crossing_pairs), Some(0));
        assert_eq!((got.defects.boundary_loops, got.defects.nonmanifold_vertices), (2, 0));
        assert_eq!(cut(&slit(0.5)).result, 0, "they cross above the surface");
    }

    #[test]
    fn what_crosses_other_surface_as_well_stays() {
        let below = plate(2, |_, _| true).into_iter().map(|t| t.map(|[x, y, _]| [x + 3.3, 3.5, y * 0.5 - 0.9]));
        let mesh: Vec<Corners> = slit(-0.5).into_iter().chain(below).collect();
        assert_eq!(cut(&mesh).result, 0);
        assert_eq!(cut(&shifted(&slit(-0.5), [1.0, 2.0, 3.0])).result, 14);
    }
}
