//! Facets beside facets that belong to no region yet, and the regions beside them.

use super::super::vector::{Point, distance, dot};
use super::rounds::{COS_SMOOTH, FREE, Rounds};

impl Rounds<'_> {
    /// Untaken facets across smooth edges, those with the longest common edge first.
    pub(super) fn neighbours(&self, facet: u32) -> Vec<u32> {
        let mut near: Vec<(f64, u32)> = Vec::new();
        for triangle in self.facets.triangles(facet) {
            for half in 3 * triangle..3 * triangle + 3 {
                let other = self.facets.of[self.mesh.across(half) as usize];
                let cosine = dot(self.ray(facet).1, self.ray(other).1);
                if other == facet || self.taken[other as usize] != FREE || cosine < COS_SMOOTH {
                    continue;
                }
                let length = distance(self.mesh.at(self.mesh.from(half)), self.mesh.at(self.mesh.to(half)));
                match near.iter_mut().find(|(_, known)| *known == other) {
                    Some(entry) => entry.0 += length,
                    None => near.push((length, other)),
                }
            }
        }
        near.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        near.into_iter().map(|(_, other)| other).collect()
    }

    /// A facet and those nearest to it, about `count` of them, over so many longest sides of each; flat faces beside a round one
    /// are none of it.
    pub(super) fn around(&self, seed: u32, count: usize, sides: usize) -> Vec<u32> {
        let mut found = vec![seed];
        let mut next = 0;
        let most = 8.0 * self.facets.areas[seed as usize];
        while found.len() < count && next < found.len() {
            for other in self.neighbours(found[next]).into_iter().take(sides) {
                if !found.contains(&other) && self.facets.areas[other as usize] <= most {
                    found.push(other);
                }
            }
            next += 1;
        }
        found
    }

    /// Axes of regions next to facets, three at most.
    pub(super) fn axes_beside(&self, facets: &[u32]) -> Vec<(Point, Point)> {
        let mut found: Vec<u32> = Vec::new();
        for triangle in facets.iter().flat_map(|facet| self.facets.triangles(*facet)) {
            for half in 3 * triangle..3 * triangle + 3 {
                let region = self.taken[self.facets.of[self.mesh.across(half) as usize] as usize];
                if region != FREE && found.len() < 3 && !found.contains(&region) {
                    found.push(region);
                }
            }
        }
        found.iter().filter_map(|region| self.axes.get(*region as usize).copied().flatten()).collect()
    }

    /// The vertices of facets, each once, in the order of their numbers.
    pub(super) fn points(&self, facets: &[u32]) -> Vec<Point> {
        let corners = facets.iter().flat_map(|f| self.facets.triangles(*f)).flat_map(|t| self.mesh.triangles[*t as usize]);
        let mut vertices: Vec<u32> = corners.collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.into_iter().map(|v| self.mesh.at(v)).collect()
    }
}
