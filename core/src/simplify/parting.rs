//! A simplified mesh in which some vertices are parted again into those of the input that became them, so that only there something is done anew.
//!
//! A simplified mesh is the input with vertices united; to unite fewer of them is to split vertices in any order (Hoppe, "View-dependent refinement of
//! progressive meshes", SIGGRAPH 1997). Triangles between what is parted and what is not are new: where they would fold, cross another one, or
//! let a vertex have no fan, more is parted. In the end that is the input.

use rayon::prelude::*;

use crate::algorithms::fans::{Around, corners_by_vertex};
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::place;
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::{Triangle, do_cross};
use crate::simplify::net::Net;
use crate::simplify::patch::{FIXED, RIM};
use crate::simplify::task::Input;
use crate::util::ids::NONE;

/// A triangle flatter than this share of an equilateral one, squared, is none.
const LEAST_SHAPE: f64 = 1e-12;

/// At most this share of the faces that were simplified away may come back. Where vertices have become others that are far away, the faces between parted
/// ones and them fold, so that more and more is parted. To do all anew with a lower aim then takes less time, and keeps fewer triangles: a bumpy torus of a
/// million, within four millionths of its diagonal, takes an eighth of the time and keeps 27 % fewer (measured; with 0.66, some parts keep 10 % more).
const MOST_BACK: f64 = 0.85;

/// Faces that a thread looks at, at least.
const BLOCK: usize = 1 << 10;

/// A simplified mesh, and which of its vertices are parted.
pub(super) struct Parting<'a> {
    pub(super) input: &'a Input<'a>,
    /// The input as a net.
    pub(super) first: &'a Net,
    pub(super) net: &'a Net,
    /// The vertex of the net that each of the input has become.
    pub(super) became: &'a [u32],
    /// By vertices of the net.
    pub(super) is_parted: Vec<bool>,
}

/// The mesh with parted vertices.
struct Mesh {
    /// The vertex of the mesh that each of the input has become.
    became: Vec<u32>,
    /// The input's vertex that a vertex was.
    homes: Vec<u32>,
    points: Vec<Point>,
    faces: Vec<[u32; 3]>,
    origins: Vec<u32>,
}

impl Mesh {
    fn triangle(&self, face: u32) -> Triangle {
        self.faces[face as usize].map(|v| self.points[v as usize])
    }
}

impl Parting<'_> {
    /// The net with parted vertices, and the vertex of it that each of the input has become; nothing where too much would come back. Where it `freezes`,
    /// vertices stay that are neither parted nor beside such. `fixed`, `strict`: of the input's vertices. O(n), times the few steps until no new
    /// triangle is wrong.
    pub(super) fn net(mut self, fixed: &[bool], strict: &[u8], freezes: bool) -> Option<(Net, Vec<u32>)> {
        let now = self.net.faces.len();
        let most = now + (MOST_BACK * (self.input.faces.len() - now) as f64) as usize;
        let mesh = loop {
            let mesh = self.mesh();
            if mesh.faces.len() > most {
                return None;
            }
            let fresh: Vec<u32> = self.select(&mesh, |corners| corners.contains(&true));
            let mut wrong = self.bent(&mesh);
            if wrong.is_empty() {
                wrong = self.crossing(&mesh, &fresh);
            }
            let was = self.is_parted.iter().filter(|is| **is).count();
            for v in wrong.into_iter().flat_map(|f| mesh.faces[f as usize]) {
                let w = self.became[mesh.homes[v as usize] as usize];
                self.is_parted[w as usize] = true;
            }
            if self.is_parted.iter().filter(|is| **is).count() == was {
                break mesh;
            }
        };
        let mut is_beside = vec![!freezes; mesh.points.len()];
        self.select(&mesh, |corners| corners.contains(&true))
            .into_iter()
            .flat_map(|f| mesh.faces[f as usize])
            .for_each(|v| is_beside[v as usize] = true);
        let (mut quadrics, mut kinds, mut limits) = (Vec::new(), Vec::new(), Vec::new());
        for (home, is_beside) in mesh.homes.iter().map(|v| *v as usize).zip(is_beside) {
            let w = self.became[home] as usize;
            let (net, at) = if self.is_parted[w] { (self.first, home) } else { (self.net, w) };
            quadrics.push(net.quadrics[at]);
            kinds.push(if fixed[home] || !is_beside { FIXED } else { net.kinds[at] });
            limits.push(strict[home].max(net.strict[at]));
        }
        let Mesh { became, homes, points, faces, origins } = mesh;
        Some((Net { points, quadrics, kinds, strict: limits, faces, origins, homes, open: self.first.open.clone() }, became))
    }

    /// Is a vertex of the mesh one of those that are parted?
    fn is_part(&self, mesh: &Mesh, v: u32) -> bool {
        self.is_parted[self.became[mesh.homes[v as usize] as usize] as usize]
    }

    /// Faces of which this is so: which of their corners are parted.
    fn select(&self, mesh: &Mesh, is_so: impl Fn([bool; 3]) -> bool + Sync) -> Vec<u32> {
        let of = |f: &u32| is_so(mesh.faces[*f as usize].map(|v| self.is_part(mesh, v)));
        (0..mesh.faces.len() as u32).into_par_iter().with_min_len(BLOCK).filter(of).collect()
    }

    fn mesh(&self) -> Mesh {
        let is_parted = |v: u32| self.is_parted[self.became[v as usize] as usize];
        let home = |v: u32| if is_parted(v) { v } else { self.net.homes[self.became[v as usize] as usize] };
        let homes: Vec<u32> = (0..self.became.len() as u32).filter(|v| home(*v) == *v).collect();
        let mut numbers = vec![NONE; self.became.len()];
        (0..).zip(&homes).for_each(|(number, v)| numbers[*v as usize] = number);
        let became: Vec<u32> = (0..self.became.len() as u32).map(|v| numbers[home(v) as usize]).collect();
        let place_of = |v: &u32| {
            let w = self.became[*v as usize] as usize;
            if self.is_parted[w] { self.input.points[*v as usize] } else { self.net.points[w] }
        };
        let points = homes.iter().map(place_of).collect();
        // A triangle goes where two of its vertices are united.
        let image = |f: usize| {
            let was = self.input.faces[f];
            let now = was.map(|v| became[v as usize]);
            let is_there = (0..3).all(|k| now[k] != now[(k + 1) % 3] || was[k] == was[(k + 1) % 3]);
            is_there.then_some((f as u32, now))
        };
        let (origins, faces) = (0..self.input.faces.len()).into_par_iter().with_min_len(BLOCK).filter_map(image).unzip();
        Mesh { became, homes, points, faces, origins }
    }

    /// Faces between what is parted and what is not that turn over, have no area, or lie at a vertex without the fan that it had; the latter with all faces
    /// at the vertex.
    fn bent(&self, mesh: &Mesh) -> Vec<u32> {
        let mixed = self.select(mesh, |corners| corners.contains(&true) && corners.contains(&false));
        let mut wrong: Vec<u32> = mixed.iter().copied().filter(|f| self.turns_over(mesh, *f)).collect();
        let (starts, corners) = corners_by_vertex(mesh.points.len(), &mesh.faces);
        let mut vertices: Vec<u32> = mixed.iter().flat_map(|f| mesh.faces[*f as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut around = Around::default();
        for v in vertices {
            let own = &corners[starts[v as usize] as usize..starts[v as usize + 1] as usize];
            let home = mesh.homes[v as usize];
            let around = around.of(&mesh.points, &mesh.faces, own);
            let has_fan = match self.first.open.binary_search(&home) {
                Err(_) => around.is_some_and(|around| around.is_closed()),
                Ok(_) => self.first.kinds[home as usize] == RIM && around.is_some_and(|around| around.rim(-2.0).is_some()),
            };
            if !has_fan {
                wrong.extend(own.iter().map(|corner| corner / 3));
            }
        }
        wrong
    }

    /// Has a face no area, or does it face away both from what it was in the input and from what it is in the net?
    fn turns_over(&self, mesh: &Mesh, face: u32) -> bool {
        let normal = |t: Triangle| {
            let [a, b, c] = t.map(place);
            (b - a).cross(c - a)
        };
        let now = mesh.triangle(face);
        let [a, b, c] = now.map(place);
        let sides = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
        let was = self.input.faces[mesh.origins[face as usize] as usize];
        let before = normal(was.map(|v| self.input.points[v as usize]));
        let simple = normal(was.map(|v| self.net.points[self.became[v as usize] as usize]));
        let normal = normal(now);
        normal.length_squared() <= LEAST_SHAPE * sides * sides || (normal.dot(before) <= 0.0 && normal.dot(simple) <= 0.0)
    }

    /// Is a vertex where it was in the input?
    fn is_at_home(&self, mesh: &Mesh, v: u32) -> bool {
        mesh.points[v as usize] == self.input.points[mesh.homes[v as usize] as usize]
    }

    /// Is a face one of the input?
    fn is_old(&self, mesh: &Mesh, face: u32) -> bool {
        let was = self.input.faces[mesh.origins[face as usize] as usize];
        mesh.faces[face as usize].iter().zip(was).all(|(v, home)| mesh.homes[*v as usize] == home && self.is_at_home(mesh, *v))
    }

    /// Faces, one of them `fresh`, that cross, or of which one has a vertex upon one of the other, but did not in the input.
    fn crossing(&self, mesh: &Mesh, fresh: &[u32]) -> Vec<u32> {
        let boxes: Vec<Bounds> = fresh.iter().map(|f| Bounds::of(&mesh.triangle(*f))).collect();
        let tree = BoxTree::new(&boxes);
        let comes_upon = |f: u32, other: u32| {
            mesh.faces[f as usize].iter().any(|v| {
                let is_upon = |w: &u32| {
                    v != w
                        && mesh.points[*v as usize] == mesh.points[*w as usize]
                        && !(self.is_at_home(mesh, *v) && self.is_at_home(mesh, *w))
                };
                mesh.faces[other as usize].iter().any(is_upon)
            })
        };
        let of_face = |f: u32| {
            let own = mesh.triangle(f);
            let mut wrong = Vec::new();
            tree.each_meeting(&Bounds::of(&own), |i| {
                let other = fresh[i as usize];
                let is_new = other != f && !(self.is_old(mesh, f) && self.is_old(mesh, other));
                if is_new && (comes_upon(f, other) || do_cross(&own, &mesh.triangle(other))) {
                    wrong.extend([f, other]);
                }
            });
            wrong
        };
        (0..mesh.faces.len() as u32).into_par_iter().with_min_len(BLOCK).flat_map_iter(of_face).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::self_crossing::{SelfCrossing, self_crossing};
    use crate::simplify::net::Constraints;

    /// A grid of 5 × 5 squares. Its middle vertex has become its neighbour, and is parted again: only the triangles of both are new.
    #[test]
    fn a_vertex_is_parted_from_what_it_became() {
        let m = 6_u32;
        let points: Vec<Point> = (0..m * m).map(|i| [(i % m) as f32, (i / m) as f32, 0.0]).collect();
        let squares = (0..m * m).filter(|i| i % m < 5 && i / m < 5);
        let faces: Vec<[u32; 3]> = squares.flat_map(|a| [[a, a + 1, a + m + 1], [a, a + m + 1, a + m]]).collect();
        let none = [false; 36];
        let constraints = Constraints { fixed: &none, strict: &[0; 36], feature: -2.0 };
        let first = Net::new(&points, &faces, &constraints);
        // 14 becomes 15, and 20 becomes 21; the numbers above each of them sink.
        let root = |v: u32| if v == 14 || v == 20 { v + 1 } else { v };
        let sunk = |v: u32| v - u32::from(v > 14) - u32::from(v > 20);
        let became: Vec<u32> = (0..m * m).map(|v| sunk(root(v))).collect();
        let homes: Vec<u32> = (0..m * m).filter(|v| root(*v) == *v).collect();
        let at = |v: &u32| points[*v as usize];
        let kept = |f: &u32| {
            let [a, b, c] = faces[*f as usize].map(|v| became[v as usize]);
            a != b && b != c && c != a
        };
        let origins: Vec<u32> = (0..faces.len() as u32).filter(kept).collect();
        assert_eq!(origins.len(), faces.len() - 4);
        let net = Net {
            points: homes.iter().map(at).collect(),
            quadrics: homes.iter().map(|v| first.quadrics[*v as usize]).collect(),
            kinds: homes.iter().map(|v| first.kinds[*v as usize]).collect(),
            strict: vec![0; homes.len()],
            faces: origins.iter().map(|f| faces[*f as usize].map(|v| became[v as usize])).collect(),
            homes,
            origins,
            open: first.open.clone(),
        };
        let input = Input { points: &points, faces: &faces, region: None, fixed: None, within: None };
        let is_parted = (0..net.points.len()).map(|w| w == sunk(15) as usize).collect();
        let parting = Parting { input: &input, first: &first, net: &net, became: &became, is_parted };
        let (parted, became) = parting.net(&none, &[0; 36], true).unwrap();
        assert_eq!(parted.points.len(), 35, "one of both is parted");
        assert_eq!(parted.faces.len(), faces.len() - 2);
        let is_same = |v: usize| parted.points[became[v] as usize] == points[v];
        assert!((0..36).all(|v| is_same(v) != (v == 20)));
        let triangles: Vec<Triangle> = parted.faces.iter().map(|f| f.map(|v| parted.points[v as usize])).collect();
        assert_eq!(self_crossing(&triangles, u64::MAX), SelfCrossing::None);
        // What is neither parted nor beside it stays as it is.
        let kind = |v: u32| parted.kinds[became[v as usize] as usize];
        assert_eq!([kind(14), kind(15), kind(21), kind(9), kind(28)], [0, 0, 0, 0, FIXED]);
    }
}
