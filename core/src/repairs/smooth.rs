//! Patches refined to the density around them, and shaped so that they continue the surface: each with the rings of triangles that it needs
//! from whichever chunks hold them, regions in parallel.
//!
//! A region is a patch, the stars of its rim's vertices, which are in the workshop, and the stars of all vertices next to the rim, most of
//! which are fetched from the file. They are fetched for so many patches at once as fit a bound by count, so that neither memory nor chunks
//! decide anything.

use std::collections::HashMap;

use super::close::Placed;
use super::work::Work;
use crate::chunk::NONE;
use crate::fill::exact::Point;
use crate::parallel;
use crate::record;
use crate::shape::{self, Region, ShapeSettings, Shaped, edges, sorted};
use crate::shop::{Origin, Shop, Vertex};
use crate::survey::Survey;

/// Vertices on the rims of the patches that are worked on at once.
const RIM_VERTICES_AT_ONCE: usize = 1 << 16;

/// A patch has room for vertices of its own if one of its inner edges is so many times as long as the edges at its ends are on average.
const ROOMY: f64 = 1.5;

/// Shapes every patch that has room. One that cannot be shaped stays as it is.
pub(super) fn smooth(survey: &Survey<'_>, work: &mut Work<'_>, placed: &mut [Placed], settings: &ShapeSettings, threads: usize) {
    let roomy: Vec<usize> = (0..placed.len()).filter(|i| has_room(work, &placed[*i])).collect();
    let mut rest = roomy.as_slice();
    while !rest.is_empty() {
        let mut vertices = 0;
        let count = rest
            .iter()
            .take_while(|i| {
                let fits = vertices < RIM_VERTICES_AT_ONCE;
                vertices += placed[**i].count as usize + 2;
                fits
            })
            .count();
        let (batch, later) = rest.split_at(count);
        rest = later;
        let shop: &Shop = work;
        let beyond = Beyond::of(survey, shop, batch.iter().map(|i| &placed[*i]));
        let shaped = parallel::map(threads, batch.len(), |i| {
            let region = Gathered::of(shop, &beyond, &placed[batch[i]]);
            let shaped =
                shape::shape(&Region { positions: &region.positions, patch: &region.patch, around: &region.around }, settings);
            shaped.map(|shaped| (region.vertices, shaped))
        });
        for (i, shaped) in batch.iter().zip(shaped) {
            match shaped {
                Ok((vertices, shaped)) => put_in(work, &mut placed[*i], vertices, &shaped),
                Err(reason) => tracing::debug!(patch = i, %reason, "Patch not shaped."),
            }
        }
    }
}

/// Is one of its inner edges long for what is around?
fn has_room(shop: &Shop, patch: &Placed) -> bool {
    let mut around: HashMap<Vertex, (f64, u32)> = HashMap::new();
    let triangles = || patch.triangles().map(|t| shop.triangles[t as usize].v);
    let mut edges: Vec<[Vertex; 2]> = triangles().flat_map(edges).map(sorted).collect();
    edges.sort_unstable();
    let (inner, rim): (Vec<_>, Vec<_>) = edges.chunk_by(|a, b| a == b).partition(|same| same.len() > 1);
    for [a, b] in rim.iter().map(|same| same[0]) {
        let length = shop.distance(a, b);
        for v in [a, b] {
            let (sum, count) = around.entry(v).or_default();
            *sum += length;
            *count += 1;
        }
    }
    let usual = |v: Vertex| around.get(&v).map_or(f64::INFINITY, |(sum, count)| sum / f64::from(*count));
    inner.iter().map(|same| same[0]).any(|[a, b]| shop.distance(a, b) > ROOMY * 0.5 * (usual(a) + usual(b)))
}

/// Triangles that are not in the workshop, around vertices that are: where each has its corners, by vertex.
struct Beyond {
    /// By vertex of the workshop, then by triangle.
    of_vertex: Vec<(Vertex, u32)>,
    corners: Vec<[Point; 3]>,
}

impl Beyond {
    /// Around the vertices next to the rims of some patches. Reads the chunks where they are at home.
    fn of<'p>(survey: &Survey<'_>, shop: &Shop, patches: impl Iterator<Item = &'p Placed>) -> Self {
        let mut next: Vec<Vertex> = patches
            .flat_map(|patch| patch.triangles().flat_map(|t| shop.triangles[t as usize].v))
            .flat_map(|v| shop.star(v).flat_map(|(t, _)| shop.triangles[t as usize].v))
            .filter(|v| !shop.complete[*v as usize])
            .collect();
        next.sort_unstable();
        next.dedup();
        let positions: Vec<Point> = next.iter().map(|v| shop.positions[*v as usize]).collect();
        let numbers: HashMap<[u32; 3], Vertex> = next.iter().zip(&positions).map(|(v, p)| (p.map(f32::to_bits), *v)).collect();
        let found = survey.beyond_the_workshop(&positions);
        let mut beyond = Self { of_vertex: Vec::new(), corners: Vec::with_capacity(found.len()) };
        for (number, (suspect, _)) in (0..).zip(&found) {
            let corners = record::corners(&survey.records[suspect.triangle as usize]).map(|p| p.map(|x| x + 0.0));
            let at = corners.iter().filter_map(|p| numbers.get(&p.map(f32::to_bits)));
            beyond.of_vertex.extend(at.map(|v| (*v, number)));
            beyond.corners.push(corners);
        }
        beyond.of_vertex.sort_unstable();
        beyond
    }

    fn star(&self, v: Vertex) -> impl Iterator<Item = u32> + '_ {
        let from = self.of_vertex.partition_point(|(w, _)| *w < v);
        self.of_vertex[from..].iter().take_while(move |(w, _)| *w == v).map(|(_, t)| *t)
    }
}

/// A region in a numbering of its own, which begins with the vertices of the patch.
struct Gathered {
    positions: Vec<Point>,
    /// Vertices of the workshop; [`NONE`] for others.
    vertices: Vec<Vertex>,
    patch: Vec<[u32; 3]>,
    around: Vec<[u32; 3]>,
}

impl Gathered {
    fn of(shop: &Shop, beyond: &Beyond, patch: &Placed) -> Self {
        let mut region = Self { positions: Vec::new(), vertices: Vec::new(), patch: Vec::new(), around: Vec::new() };
        let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
        let mut number = |region: &mut Self, position: Point, vertex: Vertex| {
            *numbers.entry(position.map(f32::to_bits)).or_insert_with(|| {
                region.positions.push(position);
                region.vertices.push(vertex);
                region.positions.len() as u32 - 1
            })
        };
        for t in patch.triangles() {
            let v = shop.triangles[t as usize].v.map(|v| number(&mut region, shop.positions[v as usize], v));
            region.patch.push(v);
        }
        let rim = region.vertices.clone();
        let mut near: Vec<u32> = rim.iter().flat_map(|v| shop.star(*v).map(|(t, _)| t)).filter(|t| !patch.holds(*t)).collect();
        near.sort_unstable();
        near.dedup();
        let mut next: Vec<Vertex> = near.iter().flat_map(|t| shop.triangles[*t as usize].v).collect();
        next.sort_unstable();
        next.dedup();
        near.extend(next.iter().flat_map(|v| shop.star(*v).map(|(t, _)| t)).filter(|t| !patch.holds(*t)));
        near.sort_unstable();
        near.dedup();
        for t in near {
            let v = shop.triangles[t as usize].v.map(|v| number(&mut region, shop.positions[v as usize], v));
            region.around.push(v);
        }
        let mut far: Vec<u32> = next.iter().flat_map(|v| beyond.star(*v)).collect();
        far.sort_unstable();
        far.dedup();
        for t in far {
            let v = beyond.corners[t as usize].map(|p| number(&mut region, p, NONE));
            region.around.push(v);
        }
        region
    }
}

/// Replaces the coarse patch, if no edge of the new one is there already.
fn put_in(work: &mut Work<'_>, patch: &mut Placed, mut vertices: Vec<Vertex>, shaped: &Shaped) {
    let coarse: Vec<[Vertex; 3]> = patch.triangles().map(|t| work.triangles[t as usize].v).collect();
    let mut own: Vec<[Vertex; 2]> = coarse.iter().flat_map(|v| edges(*v)).map(sorted).collect();
    own.sort_unstable();
    let of_workshop = |v: u32| vertices.get(v as usize).copied().unwrap_or(NONE);
    let is_there = |[a, b]: [Vertex; 2]| {
        // Of the coarse patch's, the rim's are the surface's as well, and the others go.
        a != NONE && b != NONE && own.binary_search(&[a, b]).is_err() && work.has_edge(a, b)
    };
    if shaped.triangles.iter().flat_map(|t| edges(t.map(of_workshop))).map(sorted).any(is_there) {
        return;
    }
    patch.triangles().for_each(|t| work.kill(t));
    vertices.extend(shaped.added.iter().map(|p| work.add_vertex(*p)));
    patch.first = work.triangles.len() as u32;
    patch.count = shaped.triangles.len() as u32;
    for t in &shaped.triangles {
        work.add(t.map(|v| vertices[v as usize]), Origin::Patch, NONE);
    }
    patch.coarse = coarse;
}
