//! Triangles paired through their edges, radially where an edge has more than two: each with the one on the other side of the wedge of
//! material between them, so that every surface goes on as the skin of what it encloses.
//!
//! Around an edge, coherent triangles take turns: one behind which material begins, one behind which it ends. Where bodies lie in each
//! other, several begin before one ends, and the wedges are nested, so that no two of them cross.

use std::cmp::Ordering;

use super::edges::{Edge, Edges, Use};
use super::{Submesh, Vertex};
use crate::geometry::exact::{Point, collinear, orientation_along, side};
use crate::util::ids::NONE;

/// An edge of a triangle: the one that begins at this corner of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Half {
    pub(crate) triangle: u32,
    pub(crate) corner: usize,
}

impl Half {
    /// The edge as its triangle has it.
    pub(crate) fn of(submesh: &Submesh, edge: &Edge<'_>, used: &Use) -> Self {
        let (start, _) = edge.directed(used);
        let corner = submesh.triangles[used.triangle() as usize].v.iter().position(|v| *v == start).unwrap_or(0);
        Self { triangle: used.triangle(), corner }
    }

    fn number(self) -> u32 {
        self.triangle * 3 + self.corner as u32
    }
}

/// The partner of every edge of every triangle.
pub(crate) struct RadialPairs {
    /// By [`Half::number`]; [`NONE`] where there is none.
    mates: Vec<u32>,
}

impl RadialPairs {
    /// An edge whose triangles do not run as often one way as the other, or two of which lie in one direction from it, pairs none of them.
    /// O(submesh), O(n log n) in the triangles around one edge.
    pub(crate) fn of(submesh: &Submesh, edges: &Edges) -> Self {
        let mut mates = vec![NONE; submesh.triangles.len() * 3];
        for edge in edges.iter().filter(|e| !e.is_unbalanced()) {
            for wedge in radial_pairs(submesh, &edge) {
                let [a, b] = wedge.map(|used| Half::of(submesh, &edge, used).number());
                mates[a as usize] = b;
                mates[b as usize] = a;
            }
        }
        Self { mates }
    }

    /// The triangle's edge on the other side of the wedge; it runs the other way.
    pub(crate) fn mate(&self, half: Half) -> Option<Half> {
        let mate = self.mates[half.number() as usize];
        (mate != NONE).then_some(Half { triangle: mate / 3, corner: mate as usize % 3 })
    }

    /// The fans around `v`, each in its order from its first triangle, by first triangle; `None` if one of them is not closed. Each corner
    /// is where its triangle has `v`. O(n log n) in the triangles around it.
    pub(crate) fn fans(&self, submesh: &Submesh, v: Vertex) -> Option<Vec<Vec<Half>>> {
        let mut star: Vec<Half> = submesh.star(v).map(|(triangle, corner)| Half { triangle, corner }).collect();
        star.sort_unstable_by_key(|half| half.number());
        let mut seen = vec![false; star.len()];
        let mut fans = Vec::new();
        for i in 0..star.len() {
            let mut fan = Vec::new();
            let mut at = i;
            while !seen[at] {
                seen[at] = true;
                fan.push(star[at]);
                let mate = self.mate(star[at])?;
                let next = Half { corner: (mate.corner + 1) % 3, ..mate };
                at = star.binary_search_by_key(&next.number(), |half| half.number()).ok()?;
            }
            if !fan.is_empty() {
                fans.push(fan);
            }
        }
        Some(fans)
    }
}

/// The pairs of a balanced edge's triangles that have a wedge of material between them, each with the triangle first behind which it begins,
/// seen from the edge's low end turning left. None if two triangles lie in one direction from the edge.
fn radial_pairs<'e>(submesh: &Submesh, edge: &Edge<'e>) -> Vec<[&'e Use; 2]> {
    if let [a, b] = edge.uses {
        return vec![if a.forward() { [b, a] } else { [a, b] }];
    }
    let ends = [edge.low, edge.high].map(|v| submesh.positions[v as usize]);
    let apexes = edge.uses.iter().map(|u| {
        let apex = submesh.triangles[u.triangle() as usize].v.into_iter().find(|v| *v != edge.low && *v != edge.high);
        submesh.positions[apex.unwrap_or(edge.low) as usize]
    });
    let Some(order) = around(&ends, &apexes.collect::<Vec<Point>>()) else { return Vec::new() };
    // Material begins behind a triangle that runs against the edge's direction, and ends behind the others. The radial sweep starts where the fewest
    // wedges are open.
    let begins = |i: usize| !edge.uses[i].forward();
    let (mut open, mut least, mut first) = (0_i64, 0, 0);
    for (place, i) in order.iter().enumerate() {
        open += if begins(*i) { 1 } else { -1 };
        if open < least {
            (least, first) = (open, place + 1);
        }
    }
    let mut begun = Vec::new();
    let mut pairs = Vec::with_capacity(order.len() / 2);
    for i in (0..order.len()).map(|k| order[(first + k) % order.len()]) {
        if begins(i) {
            begun.push(i);
        } else if let Some(start) = begun.pop() {
            pairs.push([&edge.uses[start], &edge.uses[i]]);
        }
    }
    pairs
}

/// The points by the direction in which each lies from the line through two others, turning left as seen against the line's own
/// direction, from the first point on. Exact. `None` if two of them lie in one direction, or one on the line.
fn around(ends: &[Point; 2], points: &[Point]) -> Option<Vec<usize>> {
    let [p, q] = ends;
    if points.iter().any(|r| collinear(p, q, r)) {
        return None;
    }
    let first = &points[0];
    let axis = (0..3).find(|axis| orientation_along(p, q, first, *axis) != 0)?;
    let quarter = |r: &Point| match side(p, q, first, r) {
        1 => 1,
        -1 => 3,
        _ if orientation_along(p, q, r, axis) == orientation_along(p, q, first, axis) => 0,
        _ => 2,
    };
    let mut order: Vec<(u8, usize)> = points.iter().enumerate().map(|(i, r)| (quarter(r), i)).collect();
    let compare = |a: &(u8, usize), b: &(u8, usize)| {
        a.0.cmp(&b.0).then_with(|| match (a.0, side(p, q, &points[a.1], &points[b.1])) {
            (0 | 2, _) | (_, 0) => Ordering::Equal,
            (_, 1) => Ordering::Less,
            _ => Ordering::Greater,
        })
    };
    order.sort_by(compare);
    let one_direction = order.windows(2).any(|pair| compare(&pair[0], &pair[1]) == Ordering::Equal);
    (!one_direction).then(|| order.into_iter().map(|(_, i)| i).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, cuboid, diagnose, records, reversed};

    #[test]
    fn points_are_sorted_by_direction() {
        let ends = [[0.0; 3], [0.0, 0.0, 1.0]];
        let at = |x: f32, y: f32| [x, y, 0.5];
        let points = [at(1.0, 0.0), at(-1.0, 1.0), at(0.0, -2.0), at(-3.0, 0.0), at(9.0, 1.0), at(1.0, -1.0)];
        assert_eq!(around(&ends, &points), Some(vec![0, 4, 1, 3, 2, 5]));
        assert_eq!(around(&ends, &[at(1.0, 0.0), at(2.0, 0.0)]), None, "one direction");
        assert_eq!(around(&ends, &[at(1.0, 0.0), at(1.0, 1.0), at(3.0, 3.0)]), None, "one direction");
        assert_eq!(around(&ends, &[at(1.0, 0.0), at(0.0, 0.0)]), None, "on the line");
    }

    /// The pairs around the edge from (1, 1, 0) to (1, 1, 1), as the places of the triangles in `mesh`.
    fn paired(mesh: &[Corners]) -> Vec<[u32; 2]> {
        let records = records(mesh);
        let d = diagnose(&records);
        let edges = Edges::of(&d.submesh);
        let number = |p: [f32; 3]| d.submesh.positions.iter().position(|q| *q == p).unwrap() as u32;
        let edge = edges.between(number([1.0, 1.0, 0.0]), number([1.0, 1.0, 1.0])).unwrap();
        let mut pairs: Vec<[u32; 2]> = radial_pairs(&d.submesh, &edge)
            .iter()
            .map(|pair| {
                let mut places = pair.map(|used| d.submesh.record(used.triangle()));
                places.sort_unstable();
                places
            })
            .collect();
        pairs.sort_unstable();
        pairs
    }

    #[test]
    fn the_triangles_of_each_cube_at_a_common_edge_are_a_pair() {
        let mesh = [cuboid([0.0; 3], [1.0; 3]), cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])].concat();
        let pairs = paired(&mesh);
        assert!(pairs.len() == 2 && pairs.iter().all(|[a, b]| a / 12 == b / 12), "{pairs:?}");
        // With air and material exchanged, each pair has one of either cube.
        let pairs = paired(&reversed(&mesh));
        assert!(pairs.len() == 2 && pairs.iter().all(|[a, b]| a / 12 != b / 12), "{pairs:?}");
    }

    #[test]
    fn wedges_in_each_other_are_nested() {
        // A wedge of a quarter turn, and a narrower one in it.
        let (p, q) = ([1.0, 1.0, 0.0], [1.0, 1.0, 1.0]);
        let wedge = |a: [f32; 2], b: [f32; 2]| {
            let [a, b] = [a, b].map(|[x, y]| [x, y, 0.0]);
            [[p, q, a], [q, p, b], [q, a, b], [p, b, a]]
        };
        let mesh = [wedge([1.0, 3.0], [3.0, 1.0]), wedge([2.0, 3.0], [3.0, 2.0])].concat();
        // Whichever of both is the material: seen from the other side, the outer wedge is the narrower one.
        for mesh in [mesh.clone(), reversed(&mesh)] {
            assert_eq!(paired(&mesh), [[0, 1], [4, 5]]);
        }
    }

    /// How many triangles the fans at (1, 1, 1) have.
    fn fans(mesh: &[Corners]) -> Option<Vec<usize>> {
        let records = records(mesh);
        let d = diagnose(&records);
        let v = d.submesh.positions.iter().position(|p| *p == [1.0; 3]).unwrap() as u32;
        let fans = RadialPairs::of(&d.submesh, &Edges::of(&d.submesh)).fans(&d.submesh, v)?;
        Some(fans.iter().map(Vec::len).collect())
    }

    #[test]
    fn each_body_has_a_fan_where_several_meet() {
        // Every two of the four share an edge, too.
        let corners: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
        let mut mesh: Vec<Corners> = corners.iter().flat_map(|lo| cuboid(*lo, lo.map(|x| x + 1.0))).collect();
        let counts = fans(&mesh).unwrap();
        assert!(counts.len() == 4 && counts.iter().all(|n| (3..=6).contains(n)), "{counts:?}");
        // Around a vertex on a boundary, not everything is known.
        let one = mesh.iter().position(|t| t.contains(&[1.0; 3])).unwrap();
        mesh.remove(one);
        assert_eq!(fans(&mesh), None);
    }
}
