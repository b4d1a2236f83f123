//! Rational arithmetic by `manifold-rust`, for coordinates of any size.

use std::panic::{AssertUnwindSafe, catch_unwind};

use manifold_rust::linalg::Vec3;
use manifold_rust::robust::exact::Sign;
use manifold_rust::robust::exact::predicates::orient3d_r;
use manifold_rust::robust::exact::rational::{R3, r3_eq};
use manifold_rust::robust::intersection_graph::{self, IntersectionGraph};

use crate::geometry::arrange::piece::{Arrange, Arrangement};
use crate::geometry::arrange::raw::Raw;
use crate::util::parallel;

/// The first half of a self-union there.
pub(crate) struct Rational;

impl Arrange for Rational {
    fn arrange(&self, triangles: &[[[f32; 3]; 3]], threads: usize) -> Option<Arrangement> {
        let vector = |p: [f32; 3]| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        let soup: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.map(vector)).collect();
        // A file that the engine cannot do keeps its crossings; it does not cost the others their worker.
        let cut = || parallel::in_pool(threads, || intersection_graph::build_graph(&soup, &[]));
        let graph = catch_unwind(AssertUnwindSafe(cut)).ok()?;
        catch_unwind(AssertUnwindSafe(|| collect(&graph, &soup, triangles, threads))).ok()
    }
}

fn collect(graph: &IntersectionGraph, soup: &[[Vec3; 3]], triangles: &[[[f32; 3]; 3]], threads: usize) -> Arrangement {
    let pieces: Vec<(u32, [u32; 3])> = graph.pieces.iter().map(|piece| (piece.tri as u32, piece.vi)).collect();
    let exact = graph.verts.iter().zip(&graph.verts_f64).map(|(p, rounded)| r3_eq(p, &R3::from_vec3(*rounded)));
    let raw = Raw { points: graph.verts_f64.iter().map(|p| [p.x, p.y, p.z]).collect(), exact: exact.collect(), pieces: &pieces };
    let side = |source: u32, point: u32| {
        let [a, b, c] = soup[source as usize].map(R3::from_vec3);
        match orient3d_r(&a, &b, &c, &graph.verts[point as usize]) {
            Sign::Pos => 1,
            Sign::Zero => 0,
            Sign::Neg => -1,
        }
    };
    raw.finish(triangles, &side, threads)
}
