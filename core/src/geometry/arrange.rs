//! Exact arrangements: triangles cut along everything they meet, and the cells of space between them.
//!
//! After Zhou, Grinspun, Zorin & Jacobson, "Mesh arrangements for solid geometry", ACM TOG 35(4), 2016. The cutting is bought: points are
//! exact rationals there, so that nothing is decided by a tolerance. What is done here is what a part of a surface needs, whose rim is
//! joined to a surface that nobody cut: pieces on top of each other are made one, each knows the input it comes from, and cells are only
//! told apart as far as the triangles tell.

use std::panic::{AssertUnwindSafe, catch_unwind};

use manifold_rust::linalg::Vec3;
use manifold_rust::robust::cells::{self, VertTables};
use manifold_rust::robust::exact::rational::{R3, r3_eq};
use manifold_rust::robust::intersection_graph::{self, EdgeKey, IntersectionGraph};

use crate::geometry::exact;
use crate::util::parallel;

/// A part of a triangle, or all of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// The first of the triangles that it is part of.
    pub(crate) source: u32,
    /// Points of the arrangement, the way round that the source runs.
    pub(crate) v: [u32; 3],
    /// Triangles that it is part of and that run as it does, less those that run the other way: by so much the winding number behind it
    /// is larger than the one in front.
    pub(crate) step: i32,
    /// The cells in front of it and behind.
    pub(crate) cells: [u32; 2],
}

/// Triangles cut along all their intersections.
#[derive(Clone, Debug, Default)]
pub(crate) struct Arrangement {
    /// Rounded to the nearest f64; where a corner of a triangle is, exactly that.
    pub(crate) points: Vec<[f64; 3]>,
    /// Which of the points are exactly where they are said to be, in f32; others there are only very near.
    pub(crate) exact: Vec<bool>,
    /// By triangle: part of it is a piece of an earlier one, too.
    pub(crate) covered: Vec<bool>,
    /// By source. No two of them lie on top of each other, and they meet along whole edges.
    pub(crate) pieces: Vec<Piece>,
    /// Numbers of cells are below this. What is one cell of space may have several, if only triangles that are not here show it.
    pub(crate) cells: u32,
}

/// An engine that arranges triangles.
pub(crate) trait Arrange {
    /// The arrangement of triangles that have an area; `None` if it fails. The same for any number of threads.
    fn arrange(&self, triangles: &[[[f32; 3]; 3]], threads: usize) -> Option<Arrangement>;
}

/// Rational arithmetic by `manifold-rust`, whose self-union this is the first half of. O(n log n) boxes, then by what intersects: 30 to 100
/// thousand triangles a second.
pub(crate) struct Rational;

impl Arrange for Rational {
    fn arrange(&self, triangles: &[[[f32; 3]; 3]], threads: usize) -> Option<Arrangement> {
        let soup: Vec<[Vec3; 3]> =
            triangles.iter().map(|t| t.map(|p| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])))).collect();
        // A file that the engine cannot do keeps its crossings; it does not cost the others their worker.
        let cut = || parallel::in_pool(threads, || intersection_graph::build_graph(&soup, &[]));
        let graph = catch_unwind(AssertUnwindSafe(cut)).ok()?;
        catch_unwind(AssertUnwindSafe(|| collect(&graph, triangles))).ok()
    }
}

fn collect(graph: &IntersectionGraph, triangles: &[[[f32; 3]; 3]]) -> Arrangement {
    let (mut pieces, covered) = flatten(graph, triangles);
    let cells = number_cells(graph, &mut pieces);
    let points: Vec<[f64; 3]> = graph.verts_f64.iter().map(|p| [p.x, p.y, p.z]).collect();
    let is_exact = |(i, p): (usize, &[f64; 3])| {
        p.iter().all(|x| f64::from(*x as f32) == *x) && r3_eq(&graph.verts[i], &R3::from_vec3(graph.verts_f64[i]))
    };
    let exact = points.iter().enumerate().map(is_exact).collect();
    Arrangement { points, exact, covered, pieces, cells }
}

/// The pieces with those on top of each other made one, of the first source; and which sources have lost any by that.
///
/// Two sources that lie in one plane and overlap have the same points and constraints where they do, but perhaps not the same triangles. A
/// piece lies in another source if all its corners are points of that one, since it is convex and in its plane then.
fn flatten(graph: &IntersectionGraph, triangles: &[[[f32; 3]; 3]]) -> (Vec<Piece>, Vec<bool>) {
    let mut sources: Vec<Vec<u32>> = vec![Vec::new(); graph.verts.len()];
    for piece in &graph.pieces {
        let source = piece.tri as u32;
        for v in piece.vi {
            // By source, as the pieces are.
            if sources[v as usize].last() != Some(&source) {
                sources[v as usize].push(source);
            }
        }
    }
    let mut covered = vec![false; triangles.len()];
    let mut pieces = Vec::with_capacity(graph.pieces.len());
    for piece in &graph.pieces {
        let source = piece.tri as u32;
        let [a, b, c] = piece.vi.map(|v| &sources[v as usize]);
        let others = || a.iter().filter(|s| **s != source && b.binary_search(s).is_ok() && c.binary_search(s).is_ok());
        if others().next().is_some_and(|first| *first < source) {
            covered[piece.tri] = true;
            continue;
        }
        let agrees = |other: &u32| agree(&triangles[piece.tri], &triangles[*other as usize]);
        let step = 1 + others().map(|other| if agrees(other) { 1 } else { -1 }).sum::<i32>();
        pieces.push(Piece { source, v: piece.vi, step, cells: [0; 2] });
    }
    (pieces, covered)
}

/// Do two triangles of one plane face the same way? Exact: that of their shadows, along an axis in which they have any.
fn agree(a: &[[f32; 3]; 3], b: &[[f32; 3]; 3]) -> bool {
    let turn = |t: &[[f32; 3]; 3], axis: usize| exact::orientation_along(&t[0], &t[1], &t[2], axis);
    (0..3).any(|axis| turn(a, axis) * turn(b, axis) > 0)
}

/// Numbers the cells in front of and behind each piece. Around an edge, the space between two neighbouring pieces is one cell.
fn number_cells(graph: &IntersectionGraph, pieces: &mut [Piece]) -> u32 {
    // As the engine calls the sides: two numbers a piece, in front of it and behind.
    let side = |piece: usize, behind: bool| 2 * piece as u32 + u32::from(behind);
    // A piece that runs with the edge has its front on the side of larger angles.
    let next_side = |piece: usize, forward: bool| side(piece, !forward);
    let last_side = |piece: usize, forward: bool| side(piece, forward);
    let mut parents: Vec<u32> = (0..2 * pieces.len() as u32).collect();
    let mut uses: Vec<(EdgeKey, usize, bool, u32)> = Vec::with_capacity(3 * pieces.len());
    for (i, piece) in pieces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (piece.v[k], piece.v[(k + 1) % 3]);
            uses.push((intersection_graph::edge_key(a, b), i, a < b, piece.v[(k + 2) % 3]));
        }
    }
    uses.sort_unstable();
    for around in uses.chunk_by(|a, b| a.0 == b.0).filter(|around| around.len() > 1) {
        let (low, high) = around[0].0;
        let Some((fan, groups)) = cells::radial_fan(low, high, around, VertTables::of(graph)) else { continue };
        for (at, (first, end)) in groups.iter().enumerate() {
            let one = &fan[*first];
            for other in &fan[*first..*end] {
                crate::util::union_find::unite(&mut parents, next_side(one.id, one.forward), next_side(other.id, other.forward));
                crate::util::union_find::unite(&mut parents, last_side(one.id, one.forward), last_side(other.id, other.forward));
            }
            if groups.len() > 1 {
                let next = &fan[groups[(at + 1) % groups.len()].0];
                crate::util::union_find::unite(&mut parents, next_side(one.id, one.forward), last_side(next.id, next.forward));
            }
        }
    }
    let mut numbers = vec![crate::util::ids::NONE; parents.len()];
    let mut count = 0;
    for (i, piece) in pieces.iter_mut().enumerate() {
        for behind in [false, true] {
            let root = crate::util::union_find::find(&mut parents, side(i, behind)) as usize;
            if numbers[root] == crate::util::ids::NONE {
                numbers[root] = count;
                count += 1;
            }
            piece.cells[usize::from(behind)] = numbers[root];
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, cuboid, shifted};

    fn arranged(triangles: &[Corners]) -> Arrangement {
        Rational.arrange(triangles, 1).unwrap()
    }

    /// Winding numbers of all cells, cell by cell from one of which it is known.
    fn windings(arrangement: &Arrangement, first: u32, winding: i32) -> Vec<i32> {
        let mut known = vec![None; arrangement.cells as usize];
        known[first as usize] = Some(winding);
        for _ in 0..arrangement.cells {
            for piece in &arrangement.pieces {
                let [front, behind] = piece.cells.map(|c| c as usize);
                match (known[front], known[behind]) {
                    (Some(w), None) => known[behind] = Some(w + piece.step),
                    (None, Some(w)) => known[front] = Some(w - piece.step),
                    (Some(a), Some(b)) => assert_eq!(a + piece.step, b),
                    (None, None) => {}
                }
            }
        }
        known.into_iter().map(|w| w.unwrap()).collect()
    }

    fn area(arrangement: &Arrangement, kept: impl Fn(&Piece) -> bool) -> f64 {
        let corners = |piece: &Piece| piece.v.map(|v| glam::DVec3::from_array(arrangement.points[v as usize]));
        let twice = |[a, b, c]: [glam::DVec3; 3]| (b - a).cross(c - a).length();
        arrangement.pieces.iter().filter(|p| kept(p)).map(|p| twice(corners(p)) / 2.0).sum()
    }

    /// The faces between material and air, by area, of bodies the first piece of which looks out into the open.
    fn union_area(triangles: &[Corners]) -> f64 {
        let arrangement = arranged(triangles);
        let w = windings(&arrangement, arrangement.pieces[0].cells[0], 0);
        area(&arrangement, |p| (w[p.cells[0] as usize] > 0) != (w[p.cells[1] as usize] > 0))
    }

    #[test]
    fn a_cube_alone_has_an_inside_and_an_outside() {
        let cube = arranged(&cuboid([0.0; 3], [1.0; 3]));
        assert_eq!((cube.pieces.len(), cube.cells, cube.points.len()), (12, 2, 8));
        assert!(cube.pieces.iter().all(|p| p.step == 1 && p.cells == cube.pieces[0].cells));
    }

    #[test]
    fn crossing_cubes_have_four_cells() {
        let one = cuboid([0.0; 3], [2.0; 3]);
        let both = [one.clone(), shifted(&one, [0.875, 0.75, 1.25])].concat();
        let arrangement = arranged(&both);
        assert_eq!(arrangement.cells, 4);
        assert!((area(&arrangement, |_| true) - 48.0).abs() < 1e-9);
        // Both surfaces less what lies in the other: the box that both share has half of its surface from each.
        let [x, y, z] = [1.125, 1.25, 0.75];
        assert!((union_area(&both) - (48.0 - 2.0 * (x * y + y * z + z * x))).abs() < 1e-9);
    }

    #[test]
    fn triangles_back_to_back_are_told_by_all_of_them() {
        // Their difference is narrower than f64 can tell where they are.
        let (one, other) = (
            [[-0.5, 64.0, 0.0], [-0.25, 64.0, 9.0], [3e-16, 64.0, 0.0]],
            [[-8e-16, 64.0, 0.0], [-0.25, 64.0, 9.0], [-0.5, 64.0, 0.0]],
        );
        let arrangement = arranged(&[one, other]);
        let common = area(&arrangement, |piece| piece.step == 0);
        assert!(arrangement.pieces.len() > 1 && (common - 2.25).abs() < 1e-9, "{common}: {:?}", arrangement.pieces);
    }

    #[test]
    fn faces_on_top_of_each_other_are_one() {
        // On a grid, so that the same squares are triangulated in different ways.
        let one = cuboid([0.0; 3], [2.0; 3]);
        for by in [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 1.0], [0.0; 3], [0.5, 0.0, 1.0]] {
            let other = shifted(&one, by);
            let both = [one.clone(), other].concat();
            let [x, y, z] = by.map(|d| 2.0 - f64::from(d));
            let shared = 2.0 * (x * y + y * z + z * x);
            assert!((union_area(&both) - (48.0 - shared)).abs() < 1e-9, "{by:?}: {}", union_area(&both));
        }
    }
}
