//! Walls that were drawn twice, each time with other triangles: two flat pieces of surface with one rim, back to back.
//!
//! A quad that two bodies have in common is divided by one diagonal in one body, and often by the other one in the other. The two sides have no
//! triangle in common, but enclose nothing all the same.

use super::back_to_back::Pair;
use crate::geometry::flatness;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::{Submesh, Vertex};
use crate::util::ids::NONE;
use crate::util::steps;
use glam::DVec3;
use std::collections::BTreeMap;

/// A wall is flat if its vertices lie within this share of the model's diagonal: a hundredth of a millimetre, where that is a hundred.
const FLAT: f64 = 1.0 / 8192.0;
/// The triangles of a wall face one way: together they have this share of their areas' sum.
const UNFOLDED: f64 = 0.99;
/// Edges with more triangles are hubs, and no rims of walls.
const MOST_USES: usize = 8;

/// A piece of surface between non-manifold edges.
struct Side {
    /// Ascending.
    triangles: Vec<u32>,
    /// The edges of the rim as the triangles use them, ascending.
    rim: Vec<[Vertex; 2]>,
}

/// Sides as they are found, each once.
struct Sides<'s> {
    submesh: &'s Submesh,
    edges: &'s Edges,
    /// By triangle: number of what was found there, if anything was.
    number: Vec<u32>,
    found: Vec<Option<Side>>,
}

/// The walls that triangles are part of: all, or only those of triangles that have `changed`. `diagonal`: the model's. O(triangles between
/// non-manifold edges × log).
pub(crate) fn between(submesh: &Submesh, edges: &Edges, changed: Option<&[u32]>, diagonal: f64) -> Vec<Pair> {
    let mut starts: Vec<u32> = match changed {
        Some(changed) => changed.iter().copied().filter(|t| submesh.lives(*t)).collect(),
        None => edges.iter().filter(is_of_rim).flat_map(|edge| edge.uses.iter().map(|u| u.triangle())).collect(),
    };
    starts.sort_unstable();
    starts.dedup();
    let mut sides = Sides { submesh, edges, number: vec![NONE; submesh.triangles.len()], found: Vec::new() };
    let mut walls: BTreeMap<u32, Pair> = BTreeMap::new();
    for t in starts {
        let one = sides.at(t);
        let Some(other) = sides.opposite(one) else { continue };
        if let (Some(a), Some(b)) = (&sides.found[one.min(other) as usize], &sides.found[one.max(other) as usize])
            && a.triangles.len() + b.triangles.len() > 2
            && [a, b].into_iter().all(|side| is_flat(submesh, side, FLAT * diagonal))
        {
            let wall = || Pair { forward: a.triangles.clone(), backward: b.triangles.clone(), rim: a.rim.clone().into() };
            walls.entry(one.min(other)).or_insert_with(wall);
        }
    }
    walls.into_values().collect()
}

/// May an edge be one of a wall's rim?
fn is_of_rim(edge: &Edge<'_>) -> bool {
    (3..=MOST_USES).contains(&edge.uses.len())
}

impl Sides<'_> {
    /// What a triangle is part of.
    fn at(&mut self, t: u32) -> u32 {
        if self.number[t as usize] != NONE {
            return self.number[t as usize];
        }
        let number = self.found.len() as u32;
        self.number[t as usize] = number;
        let (mut triangles, mut rim, mut next) = (vec![t], Vec::new(), 0);
        let mut is_side = true;
        // What is no side need not be followed to its end.
        while let (true, Some(t)) = (is_side, triangles.get(next).copied()) {
            steps::count(1);
            next += 1;
            let v = self.submesh.triangles[t as usize].v;
            for (a, b) in [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])] {
                // Regular surface begins at an edge that is not in the table.
                let Some(edge) = self.edges.number(a, b).map(|edge| self.edges.get(edge as usize)) else {
                    is_side = false;
                    continue;
                };
                match edge.uses {
                    [x, y] => {
                        is_side &= x.forward() != y.forward();
                        let beyond = if x.triangle() == t { y.triangle() } else { x.triangle() };
                        match std::mem::replace(&mut self.number[beyond as usize], number) {
                            NONE => triangles.push(beyond),
                            // Of what was found to be none.
                            other => is_side &= other == number,
                        }
                    }
                    _ => {
                        is_side &= is_of_rim(&edge);
                        rim.push([a, b]);
                    }
                }
            }
        }
        triangles.sort_unstable();
        rim.sort_unstable();
        self.found.push(is_side.then_some(Side { triangles, rim }));
        number
    }

    /// The only other side that has the same rim, the other way round.
    fn opposite(&mut self, one: u32) -> Option<u32> {
        let rim = self.found[one as usize].as_ref()?.rim.clone();
        let [a, b] = *rim.first()?;
        let forward = a < b;
        let edge = self.edges.get(self.edges.number(a, b)? as usize);
        let (mut others, mut same) = (Vec::new(), 0);
        for u in edge.uses {
            let number = self.at(u.triangle());
            let Some(side) = &self.found[number as usize] else { continue };
            if u.forward() == forward {
                same += u32::from(side.rim == rim);
            } else {
                let mut turned: Vec<[Vertex; 2]> = side.rim.iter().map(|[a, b]| [*b, *a]).collect();
                turned.sort_unstable();
                others.extend((turned == rim).then_some(number));
            }
        }
        match (&others[..], same) {
            ([other], 1) => Some(*other),
            _ => None,
        }
    }
}

/// Do the vertices of a side lie in a plane, but for so much, and its triangles side by side?
fn is_flat(submesh: &Submesh, side: &Side, tolerance: f64) -> bool {
    let normal = |t: &u32| {
        let [a, b, c] = submesh.triangles[*t as usize].v.map(|v| submesh.place(v));
        (b - a).cross(c - a)
    };
    let (whole, area) = side.triangles.iter().map(normal).fold((DVec3::ZERO, 0.0), |(sum, area), n| (sum + n, area + n.length()));
    let vertices = side.triangles.iter().flat_map(|t| submesh.triangles[*t as usize].v);
    whole.length() >= area * UNFOLDED && flatness::height(vertices.map(|v| submesh.place(v)), whole) <= tolerance
}

#[cfg(test)]
mod tests {
    use crate::contract::settings::Bodies;
    use crate::repairs::cleanup::duplicates::{Dropped, drop_duplicates};
    use crate::repairs::shared::work::Work;
    use crate::submesh::edges::Edges;
    use crate::testing::{After, Corners, after, cube, cuboid, diagnose, plate, records, reversed};
    use crate::util::steps;

    fn dropped(mesh: &[Corners]) -> After<Dropped> {
        after(mesh, |d, _| drop_duplicates(&d.survey, &mut Work::new(&mut d.submesh), Bodies::Union))
    }

    /// The square sides of a box with the other diagonals.
    fn other_diagonals(of: &[Corners]) -> Vec<Corners> {
        let side = |pair: &[Corners]| {
            // Both have the diagonal: the corners that are not on it, and those that are.
            let [one, other] = [0, 1].map(|i| pair[i].iter().position(|p| !pair[1 - i].contains(p)).unwrap_or(0));
            let (p, q) = (pair[0][one], pair[1][other]);
            let (a, b) = (pair[0][(one + 1) % 3], pair[0][(one + 2) % 3]);
            [[p, a, q], [p, q, b]]
        };
        of.chunks(2).flat_map(side).collect()
    }

    /// Two cubes with a face in common, which each divides by a diagonal of its own; `lift`: how far two corners of it are out of its plane.
    fn two(lift: f32) -> Vec<Corners> {
        let right = cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]);
        let is_wall = |pair: &&[Corners]| pair.as_flattened().iter().all(|p| p[0] == 1.0);
        let right: Vec<Corners> =
            right.chunks(2).flat_map(|pair| if is_wall(&pair) { other_diagonals(pair) } else { pair.to_vec() }).collect();
        let moved = |p: [f32; 3]| if p == [1.0, 0.0, 0.0] || p == [1.0, 1.0, 1.0] { [1.0 + lift, p[1], p[2]] } else { p };
        [cube(), right].concat().into_iter().map(|t| t.map(moved)).collect()
    }

    #[test]
    fn a_wall_with_two_diagonals_goes() {
        let got = dropped(&two(0.0));
        assert_eq!(got.result, Dropped { all: 4, walls: 4, unsure: 0 });
        assert!(got.verdict.good && (got.defects.volume - 2.0).abs() < 1e-9, "{:?}", got.defects);
    }

    /// The same, with a vertex in the middle of one side.
    #[test]
    fn a_wall_with_a_vertex_on_one_side_goes() {
        let mut mesh = two(0.0);
        let at = mesh.iter().rposition(|t| t.iter().all(|p| p[0] == 1.0)).unwrap();
        let [a, b, c] = mesh[at];
        // Between a corner and the middle of the others: a place that f32 holds.
        let middle = [0, 1, 2].map(|k| a[k] / 2.0 + (b[k] + c[k]) / 4.0);
        mesh.splice(at..=at, [[a, b, middle], [b, c, middle], [c, a, middle]]);
        let got = dropped(&mesh);
        assert_eq!(got.result, Dropped { all: 6, walls: 6, unsure: 0 });
        assert!(got.verdict.good && (got.defects.volume - 2.0).abs() < 1e-6, "{:?}", got.defects);
    }

    #[test]
    fn what_is_no_side_is_not_followed_to_its_end() {
        let mut mesh = plate(60, |_, _| true);
        // A fin on an edge near the rim, where the surface ends.
        let fin = mesh.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let on = |e: &[[f32; 3]; 2]| e.iter().all(|p| p[1] == 1.0 && (30.0..=31.0).contains(&p[0]));
        let [a, b] = fin.into_iter().find(on).unwrap();
        mesh.push([a, b, [30.5, 1.0, 1.0]]);
        let input = records(&mesh);
        let d = diagnose(&input);
        let edges = Edges::of(&d.submesh);
        let (steps, found) = steps::of(|| super::between(&d.submesh, &edges, None, 60.0));
        assert!(found.is_empty() && (1..100).contains(&steps), "{steps}");
    }

    #[test]
    fn what_is_no_wall_stays() {
        assert_eq!(dropped(&two(0.25)).result, Dropped::default(), "there is room between its sides");
        let far_apart = [cube(), cuboid([1.5, 0.0, 0.0], [2.5, 1.0, 1.0])].concat();
        assert_eq!(dropped(&far_apart).result, Dropped::default());
    }

    /// All of its surface is a wall between nothing and nothing: it stays once.
    #[test]
    fn a_body_with_both_sides_stays_with_one() {
        let got = dropped(&[cube(), other_diagonals(&reversed(&cube()))].concat());
        assert_eq!(got.result, Dropped { all: 12, walls: 0, unsure: 0 });
        assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.defects);
    }
}
