//! Segments: pieces of a mesh that lie on one plane, cylinder, cone, sphere or torus.
//!
//! **In:** a closed mesh. **Out:** the segment of each triangle.
//! **Promise:** each vertex of a segment lies on its surface within the chord's end tolerance, 4·10⁻⁶ of the part's size or the
//! rounding of f32. What lies on no round surface is flat, down to single triangles. O(n log n).

mod drawn;
mod facets;
mod fit;
mod hope;
mod near;
mod rounds;
mod segment;
mod start;

use super::mesh::Mesh;
use super::sets::Sets;
use super::surface::Surface;
use super::vector::{distance, dot};
use facets::Facets;
pub(crate) use segment::Segment;

/// Segments, and the one of each triangle.
pub(crate) struct Segments {
    pub(crate) of: Vec<u32>,
    pub(crate) list: Vec<Segment>,
}

impl Segments {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let facets = Facets::new(mesh);
        let mut segments = Self { of: vec![u32::MAX; mesh.triangles.len()], list: Vec::new() };
        let mut taken = vec![false; facets.count()];
        for round in rounds::Rounds::new(mesh, &facets).find(hope::hopes) {
            let triangles: Vec<u32> = round.facets.iter().flat_map(|f| facets.triangles(*f)).copied().collect();
            round.facets.iter().for_each(|f| taken[*f as usize] = true);
            segments.add(mesh, (round.surface, round.is_concave), triangles, round.residual);
        }
        segments.absorb(mesh, &facets);
        for facet in (0..facets.count() as u32).filter(|f| !taken[*f as usize]) {
            let normal = facets.normals[facet as usize];
            let offset = dot(normal, facets.centres[facet as usize]);
            let residual = facets.residuals[facet as usize];
            let rest: Vec<u32> =
                facets.triangles(facet).iter().copied().filter(|t| segments.of[*t as usize] == u32::MAX).collect();
            if !rest.is_empty() {
                segments.add(mesh, (Surface::Plane { normal, offset }, false), rest, residual);
            }
        }
        drawn::prove(mesh, &mut segments.list);
        segments
    }

    /// Gives single triangles of small facets to the round segments next to them on whose surface they lie: slivers where two
    /// surfaces meet are flat with either. O(n).
    fn absorb(&mut self, mesh: &Mesh, facets: &Facets) {
        for number in 0..self.list.len() {
            let mut next = 0;
            while let Some(&triangle) = self.list[number].triangles.get(next) {
                next += 1;
                for half in 3 * triangle..3 * triangle + 3 {
                    let other = mesh.across(half);
                    if self.of[other as usize] != u32::MAX || facets.triangles(facets.of[other as usize]).len() > 8 {
                        continue;
                    }
                    let segment = &self.list[number];
                    let limit = (1.5 * segment.residual).max(0.5 * mesh.flatness());
                    let corners = mesh.triangles[other as usize].map(|v| mesh.at(v));
                    let near = corners.iter().all(|p| segment.surface.distance(*p).abs() <= limit);
                    let longest = (0..3).map(|k| distance(corners[k], corners[(k + 1) % 3])).fold(0.0, f64::max);
                    // The normal of a sliver says nothing, and that of a needle by itself little.
                    let least = if mesh.areas[other as usize] <= 10.0 * mesh.flatness() * longest {
                        -1.0
                    } else if facets.triangles(facets.of[other as usize]).len() == 1 {
                        0.5
                    } else {
                        0.91
                    };
                    if near && dot(segment.outward(mesh.centroid(other)), mesh.normals[other as usize]) >= least {
                        self.of[other as usize] = number as u32;
                        self.list[number].area += mesh.areas[other as usize];
                        self.list[number].triangles.push(other);
                    }
                }
            }
        }
    }

    /// Whether all of a segment lies on the surface of another one, within twice the tolerance of both.
    pub(crate) fn continues(&self, mesh: &Mesh, first: u32, other: u32) -> bool {
        let surface = self.list[first as usize].surface;
        let mut vertices = self.list[other as usize].triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
        vertices.all(|v| surface.distance(mesh.at(v)).abs() <= 8.0 * mesh.flatness())
    }

    /// The segments of a mesh behind edits: `kept` are the numbers that its first triangles had, the others belong to `owners`.
    /// Pairs that are `joined` become one. O(n).
    pub(crate) fn carried(&self, mesh: &Mesh, kept: &[u32], owners: &[u32], joined: &[(u32, u32)]) -> Self {
        let mut sets = Sets::new(self.list.len());
        joined.iter().for_each(|(one, other)| sets.join(*one, *other));
        let roots: Vec<u32> = (0..self.list.len() as u32).map(|s| sets.root(s)).collect();
        let empty = |s: &Segment| Segment {
            surface: s.surface,
            is_concave: s.is_concave,
            triangles: Vec::new(),
            area: 0.0,
            residual: 0.0,
            is_proven: s.is_proven,
        };
        let mut list: Vec<Segment> = self.list.iter().map(empty).collect();
        // The largest piece's surface is that of all.
        let mut largest: Vec<f64> = vec![0.0; list.len()];
        for (segment, root) in self.list.iter().zip(&roots) {
            let place = &mut list[*root as usize];
            place.residual = place.residual.max(segment.residual);
            place.is_proven |= segment.is_proven;
            if segment.area > largest[*root as usize] {
                largest[*root as usize] = segment.area;
                place.surface = segment.surface;
            }
        }
        let before = kept.iter().map(|t| self.of[*t as usize]).chain(owners.iter().copied());
        let mut of: Vec<u32> = before.map(|s| roots[s as usize]).collect();
        for (triangle, number) in of.iter().enumerate() {
            let place = &mut list[*number as usize];
            place.triangles.push(triangle as u32);
            place.area += mesh.areas[triangle];
            if triangle >= kept.len() {
                let far = mesh.triangles[triangle].map(|v| place.surface.distance(mesh.at(v)).abs());
                place.residual = far.into_iter().fold(place.residual, f64::max);
            }
        }
        let mut names = vec![0; list.len()];
        let there = names.iter_mut().zip(&list).filter(|(_, segment)| !segment.triangles.is_empty());
        (0_u32..).zip(there).for_each(|(number, (name, _))| *name = number);
        of.iter_mut().for_each(|s| *s = names[*s as usize]);
        list.retain(|segment| !segment.triangles.is_empty());
        Self { of, list }
    }

    fn add(&mut self, mesh: &Mesh, (surface, is_concave): (Surface, bool), triangles: Vec<u32>, residual: f64) {
        let number = self.list.len() as u32;
        triangles.iter().for_each(|t| self.of[*t as usize] = number);
        let area = triangles.iter().map(|t| mesh.areas[*t as usize]).sum();
        self.list.push(Segment { surface, is_concave, triangles, area, residual, is_proven: false });
    }

    /// Whether most of the area of segments lies on surfaces that are proven, and so are all segments along rims.
    pub(crate) fn are_drawn(&self, mesh: &Mesh, numbers: &[u32], rims: &[Vec<u32>]) -> bool {
        self.proven_share(numbers) > 0.5 && rims.iter().flatten().all(|half| self.get(mesh.across(*half)).1.is_proven)
    }

    /// The share of the area of segments that lies on proven surfaces.
    pub(crate) fn proven_share(&self, numbers: &[u32]) -> f64 {
        let parts = || numbers.iter().map(|s| &self.list[*s as usize]);
        let all: f64 = parts().map(|s| s.area).sum();
        let proven: f64 = parts().filter(|s| s.is_proven).map(|s| s.area).sum();
        proven / all.max(1e-300)
    }

    /// The segment of a triangle.
    pub(crate) fn get(&self, triangle: u32) -> (u32, &Segment) {
        let number = self.of[triangle as usize];
        (number, &self.list[number as usize])
    }
}
