//! Segments: pieces of a mesh that lie on one plane, cylinder, cone, sphere or torus.
//!
//! **In:** a closed mesh. **Out:** the segment of each triangle.
//! **Promise:** each vertex of a segment lies on its surface within the chord's end tolerance, 4·10⁻⁶ of the part's size or the
//! rounding of f32. What lies on no round surface is flat, down to single triangles. O(n log n).

mod facets;
mod fit;
mod hope;
mod rounds;
mod start;

use super::mesh::Mesh;
use super::surface::Surface;
use super::vector::{Point, distance, dot};
use facets::Facets;

/// A piece of the mesh.
pub(crate) struct Segment {
    pub(crate) surface: Surface,
    /// Whether the surface's material lies outside of it: walls of holes.
    pub(crate) is_concave: bool,
    pub(crate) triangles: Vec<u32>,
    pub(crate) area: f64,
    /// Largest distance of a vertex from the surface.
    pub(crate) residual: f64,
}

impl Segment {
    /// The direction out of the part at a point.
    pub(crate) fn outward(&self, point: Point) -> Point {
        let gradient = self.surface.gradient(point);
        if self.is_concave { gradient.map(|x| -x) } else { gradient }
    }
}

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
        let search = rounds::Rounds::new(mesh, &facets);
        let hopes = hope::hopes(&search);
        for round in search.find(hopes) {
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

    fn add(&mut self, mesh: &Mesh, (surface, is_concave): (Surface, bool), triangles: Vec<u32>, residual: f64) {
        let number = self.list.len() as u32;
        triangles.iter().for_each(|t| self.of[*t as usize] = number);
        let area = triangles.iter().map(|t| mesh.areas[*t as usize]).sum();
        self.list.push(Segment { surface, is_concave, triangles, area, residual });
    }

    /// The segment of a triangle.
    pub(crate) fn get(&self, triangle: u32) -> (u32, &Segment) {
        let number = self.of[triangle as usize];
        (number, &self.list[number as usize])
    }
}
