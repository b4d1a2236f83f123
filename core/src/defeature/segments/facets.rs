//! Maximal flat pieces of a mesh.

use super::super::mesh::Mesh;
use super::super::vector::{Point, dot, mean, norm, scale, sub, unit};
use crate::util::linear::eigen;

/// Normals of triangles of one facet differ by 1.5° at most, those of slivers excepted.
const COS_FLAT: f64 = 0.999_657;

/// Flat pieces: triangles in a row, and where each piece begins.
pub(super) struct Facets {
    /// The facet of each triangle.
    pub(super) of: Vec<u32>,
    pub(super) triangles: Vec<u32>,
    starts: Vec<u32>,
    pub(super) normals: Vec<Point>,
    pub(super) centres: Vec<Point>,
    pub(super) areas: Vec<f64>,
    /// Largest distance of a vertex from the facet's plane.
    pub(super) residuals: Vec<f64>,
}

impl Facets {
    /// Grown from the largest triangles first, each with its plane fitted twice. O(n log n).
    pub(super) fn new(mesh: &Mesh) -> Self {
        let count = mesh.triangles.len();
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by(|a, b| mesh.areas[*b as usize].total_cmp(&mesh.areas[*a as usize]).then(a.cmp(b)));
        let mut facets = Self {
            of: vec![u32::MAX; count],
            triangles: Vec::with_capacity(count),
            starts: vec![0],
            normals: Vec::new(),
            centres: Vec::new(),
            areas: Vec::new(),
            residuals: Vec::new(),
        };
        let mut stamps = vec![u32::MAX; count];
        for seed in order {
            if facets.of[seed as usize] == u32::MAX {
                facets.grow(mesh, seed, &mut stamps);
            }
        }
        facets
    }

    pub(super) fn count(&self) -> usize {
        self.normals.len()
    }

    pub(super) fn triangles(&self, facet: u32) -> &[u32] {
        &self.triangles[self.starts[facet as usize] as usize..self.starts[facet as usize + 1] as usize]
    }

    fn grow(&mut self, mesh: &Mesh, seed: u32, stamps: &mut [u32]) {
        let mut normal = mesh.normals[seed as usize];
        let mut offset = dot(normal, mesh.centroid(seed));
        let mut found = Vec::new();
        for round in 0..3 {
            let stamp = (self.count() as u32) * 4 + round;
            let before = found.len();
            found = self.flood(mesh, seed, (normal, offset), stamps, stamp);
            if found.len() < 3 || found.len() == before {
                break;
            }
            (normal, offset) = fit(mesh, &found, normal);
        }
        self.add(mesh, &found, normal, offset);
    }

    fn flood(&self, mesh: &Mesh, seed: u32, (normal, offset): (Point, f64), stamps: &mut [u32], stamp: u32) -> Vec<u32> {
        let tolerance = mesh.flatness();
        let mut found = vec![seed];
        stamps[seed as usize] = stamp;
        let mut next = 0;
        while let Some(&triangle) = found.get(next) {
            next += 1;
            for half in 3 * triangle..3 * triangle + 3 {
                let other = mesh.across(half) as usize;
                if self.of[other] != u32::MAX || stamps[other] == stamp {
                    continue;
                }
                let corners = mesh.triangles[other].map(|v| mesh.at(v));
                let near = corners.iter().all(|p| (dot(normal, *p) - offset).abs() <= tolerance);
                let longest = (0..3).map(|k| norm(sub(corners[k], corners[(k + 1) % 3]))).fold(0.0, f64::max);
                let is_sliver = mesh.areas[other] <= 10.0 * tolerance * longest;
                if near
                    && (dot(normal, mesh.normals[other]) >= COS_FLAT || (is_sliver && dot(normal, mesh.normals[other]) > -0.5))
                {
                    stamps[other] = stamp;
                    found.push(other as u32);
                }
            }
        }
        found
    }

    fn add(&mut self, mesh: &Mesh, found: &[u32], normal: Point, offset: f64) {
        let number = self.count() as u32;
        let (mut area, mut moment, mut residual) = (0.0, [0.0; 3], 0.0_f64);
        for triangle in found {
            self.of[*triangle as usize] = number;
            let share = mesh.areas[*triangle as usize];
            let centre = mesh.centroid(*triangle);
            area += share;
            (0..3).for_each(|k| moment[k] += share * centre[k]);
            for vertex in mesh.triangles[*triangle as usize] {
                residual = residual.max((dot(normal, mesh.at(vertex)) - offset).abs());
            }
        }
        self.triangles.extend(found);
        self.starts.push(self.triangles.len() as u32);
        self.normals.push(normal);
        let first = found.first().map_or([0.0; 3], |t| mesh.centroid(*t));
        self.centres.push(if area > 0.0 { scale(moment, 1.0 / area) } else { first });
        self.areas.push(area);
        self.residuals.push(residual);
    }
}

/// The plane of least squares through the vertices of triangles, with its normal on the side of `normal`.
pub(crate) fn fit(mesh: &Mesh, triangles: &[u32], normal: Point) -> (Point, f64) {
    let points: Vec<Point> = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).map(|v| mesh.at(v)).collect();
    let centre = mean(&points);
    let mut scatter = [[0.0; 3]; 3];
    for point in &points {
        let d = sub(*point, centre);
        for (row, x) in scatter.iter_mut().zip(d) {
            row.iter_mut().zip(d).for_each(|(entry, y)| *entry += x * y);
        }
    }
    let [(_, least), ..] = eigen(scatter);
    let fitted = unit(least).unwrap_or(normal);
    let fitted = if dot(fitted, normal) < 0.0 { scale(fitted, -1.0) } else { fitted };
    // A strip of no width has no plane of its own.
    if dot(fitted, normal) < 0.999 {
        return (normal, dot(normal, centre));
    }
    (fitted, dot(fitted, centre))
}
