//! Exact arrangements: triangles cut along everything they meet, and the cells of space between them.
//!
//! After Zhou, Grinspun, Zorin & Jacobson, "Mesh arrangements for solid geometry", ACM TOG 35(4), 2016. Signs are
//! exact, so that nothing is decided by a tolerance. A part of a surface needs more, whose rim is
//! joined to a surface that nobody cut: pieces on top of each other are made one, each knows the input it comes from, and cells are only
//! told apart as far as the triangles tell.

mod cells;
mod contact;
mod coplanar;
mod cuts;
mod delaunay;
mod flat;
mod network;
mod piece;
mod plane;
mod point;
mod quotient;
mod rational;
mod raw;
mod recover;
mod small;
mod soup;
mod table;
mod triangulate;
mod wide;

use crate::geometry::arrange::network::{Network, position};
use crate::geometry::arrange::rational::Rational;
use crate::geometry::arrange::raw::Raw;
use crate::util::parallel;

pub(crate) use crate::geometry::arrange::piece::{Arrange, Arrangement, Piece};

/// By planes ([`network`]): points are never made from points, signs come from floating point where it decides. Where coordinates have too many
/// bits for that, by [`Rational`]: the same pieces, in another order.
pub(crate) struct Exact;

impl Arrange for Exact {
    fn arrange(&self, triangles: &[[[f32; 3]; 3]], threads: usize) -> Option<Arrangement> {
        let Some(network) = Network::build(triangles, threads) else { return Rational.arrange(triangles, threads) };
        tracing::debug!(triangles = triangles.len(), points = network.count(), pieces = network.pieces.len(), "Arranged.");
        let points = parallel::map(threads, network.count(), |p| {
            let point = network.point(p as u32);
            (position(point, network.soup.power), point.exact)
        });
        let (points, exact) = points.into_iter().unzip();
        let side = |source: u32, point: u32| network.soup.plane(source as usize).side(network.point(point));
        let raw = Raw { points, exact, pieces: &network.pieces };
        Some(raw.finish(triangles, &side, threads))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::exact;
    use crate::testing::{Corners, cuboid, shifted};
    use proptest::prelude::*;

    fn arranged(triangles: &[Corners]) -> Arrangement {
        Exact.arrange(triangles, 1).unwrap()
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

    /// Soups on grids (flat pieces on each other, corners on edges, points on circles), in general places, and of thin triangles that all but lie
    /// in one plane.
    fn soups() -> impl Strategy<Value = Vec<Corners>> {
        let corner = |size: i32| prop::array::uniform3(-size..=size);
        let soup = |size: i32, count: usize| prop::collection::vec(prop::array::uniform3(corner(size)), 2..count);
        let scaled = |t: Vec<[[i32; 3]; 3]>, by: [f32; 3]| -> Vec<Corners> {
            t.into_iter().map(|t| t.map(|p| std::array::from_fn(|k| p[k] as f32 * by[k]))).collect()
        };
        prop_oneof![
            soup(2, 12).prop_map(move |t| scaled(t, [1.0; 3])),
            soup(3, 20).prop_map(move |t| scaled(t, [1.0, 1.0, 0.0])),
            soup(5, 14).prop_map(move |t| scaled(t, [1.0, 0.5, 0.25])),
            soup(1 << 23, 24).prop_map(move |t| scaled(t, [1e-3, 3e-5, 0.1])),
            soup(3000, 16).prop_map(move |t| scaled(t, [1.0, 1.0, 1e-9])),
        ]
    }

    /// The same with points by where they are, pieces by their points, and cells as the pieces come by them: an engine may find them in any order.
    fn in_order(a: Arrangement) -> Arrangement {
        let mut order: Vec<usize> = (0..a.points.len()).collect();
        order.sort_by_key(|p| a.points[*p].map(|x| (x + 0.0).to_bits()));
        let mut place = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(point, at)| place[*point] = at);
        let turned = |v: [u32; 3]| (0..3).map(|k| [v[k], v[(k + 1) % 3], v[(k + 2) % 3]]).min().unwrap();
        let placed = a.pieces.iter().map(|piece| Piece { v: turned(piece.v.map(|v| place[v as usize])), ..*piece });
        let mut pieces: Vec<Piece> = placed.collect();
        pieces.sort_by_key(|piece| (piece.source, piece.v));
        let mut cells: Vec<u32> = Vec::new();
        for cell in pieces.iter_mut().flat_map(|piece| &mut piece.cells) {
            let known = cells.iter().position(|known| known == cell);
            let number = known.unwrap_or(cells.len());
            if known.is_none() {
                cells.push(*cell);
            }
            *cell = number as u32;
        }
        let points = order.iter().map(|p| a.points[*p]).collect();
        Arrangement { points, exact: order.iter().map(|p| a.exact[*p]).collect(), pieces, ..a }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn is_what_rational_arithmetic_says(soup in soups()) {
            let soup: Vec<Corners> = soup.into_iter().filter(|[a, b, c]| !exact::collinear(a, b, c)).collect();
            prop_assert!(Network::build(&soup, 1).is_some());
            let (ours, theirs) = (arranged(&soup), Rational.arrange(&soup, 1).unwrap());
            let (ours, theirs) = (in_order(ours), in_order(theirs));
            prop_assert_eq!(&ours.points, &theirs.points);
            prop_assert_eq!(&ours.exact, &theirs.exact);
            prop_assert_eq!(&ours.covered, &theirs.covered);
            prop_assert_eq!(&ours.pieces, &theirs.pieces);
            prop_assert_eq!(ours.cells, theirs.cells);
        }
    }

    #[test]
    fn coordinates_of_too_many_bits_are_rational() {
        let soup =
            [[[1e-30, 0.0, 0.0], [1e30, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.5, 0.25, -1.0], [0.5, 0.25, 1.0], [3.0, 0.25, 1.0]]];
        assert!(Network::build(&soup, 1).is_none());
        assert!(arranged(&soup).pieces.len() > 2);
    }
}
