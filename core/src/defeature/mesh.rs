//! A closed mesh with its half-edges.
//!
//! Half-edge `3 t + k` runs from corner `k` of triangle `t` to the next one.

use super::vector::{Point, add, cross, norm, scale, sub, unit};
use rayon::prelude::*;

/// Why features of a mesh are not looked for: it is to be repaired first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DefeatureError {
    /// A triangle names a point that is not there.
    #[error("triangle {0} names a point that is not there")]
    Index(u32),
    /// A coordinate is infinite, or no number.
    #[error("point {0} is not finite")]
    NotFinite(u32),
    /// Triangles, or points, are more than 2³⁰.
    #[error("the mesh is too large")]
    Size,
    /// The mesh has a rim: a triangle has no neighbour there, or one with the opposite sense.
    #[error("the mesh is not closed and coherently oriented: edge {1} of triangle {0} has no opposite")]
    Open(u32, u32),
    /// More than two triangles meet in an edge, or a triangle has the same point twice.
    #[error("the mesh is not manifold at edge {1} of triangle {0}")]
    NotManifold(u32, u32),
}

/// Triangles, the opposite of each half-edge, and normals.
pub(crate) struct Mesh {
    pub(crate) points: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The half-edge that runs the other way.
    pub(crate) twin: Vec<u32>,
    /// Unit normals; 0 of triangles without area.
    pub(crate) normals: Vec<Point>,
    pub(crate) areas: Vec<f64>,
    /// The largest coordinate's absolute value.
    pub(crate) reach: f64,
    /// The diagonal of the box around all points.
    pub(crate) size: f64,
}

impl Mesh {
    /// O(n log n).
    pub(crate) fn new(points: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<Self, DefeatureError> {
        if points.len() >= 1 << 30 || triangles.len() >= 1 << 30 {
            return Err(DefeatureError::Size);
        }
        if let Some(bad) = points.iter().position(|point| point.iter().any(|x| !x.is_finite())) {
            return Err(DefeatureError::NotFinite(bad as u32));
        }
        if let Some(bad) = triangles.iter().position(|t| t.iter().any(|v| *v as usize >= points.len())) {
            return Err(DefeatureError::Index(bad as u32));
        }
        let twin = twins(&triangles)?;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for triangle in &triangles {
            for point in triangle.map(|v| points[v as usize]) {
                for k in 0..3 {
                    low[k] = low[k].min(point[k]);
                    high[k] = high[k].max(point[k]);
                }
            }
        }
        let reach = low.iter().chain(&high).fold(0.0_f64, |most, x| most.max(x.abs()));
        let size = if triangles.is_empty() { 0.0 } else { norm(sub(high, low)) };
        let directed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            scale(cross(sub(b, a), sub(c, a)), 0.5)
        };
        let areas2: Vec<Point> = triangles.par_iter().map(directed).collect();
        let normals = areas2.iter().map(|a| unit(*a).unwrap_or([0.0; 3])).collect();
        let areas = areas2.iter().map(|a| norm(*a)).collect();
        Ok(Self { points, triangles, twin, normals, areas, reach, size })
    }

    /// The point of a vertex.
    pub(crate) fn at(&self, vertex: u32) -> Point {
        self.points[vertex as usize]
    }

    /// Where a half-edge begins.
    pub(crate) fn from(&self, half: u32) -> u32 {
        self.triangles[(half / 3) as usize][(half % 3) as usize]
    }

    /// Where a half-edge ends.
    pub(crate) fn to(&self, half: u32) -> u32 {
        self.from(next(half))
    }

    /// The triangle across a half-edge.
    pub(crate) fn across(&self, half: u32) -> u32 {
        self.twin[half as usize] / 3
    }

    /// The centroid of a triangle.
    pub(crate) fn centroid(&self, triangle: u32) -> Point {
        let [a, b, c] = self.triangles[triangle as usize].map(|v| self.at(v));
        scale(add(add(a, b), c), 1.0 / 3.0)
    }

    /// The distance that rounding to f32 and a modeller's own tolerance leave between a point and its plane: 4 units in the
    /// last place of the largest coordinate, or 10⁻⁶ of the size.
    pub(crate) fn flatness(&self) -> f64 {
        (self.reach * 4.8e-7).max(1e-6 * self.size)
    }
}

/// The next half-edge of the same triangle.
pub(crate) fn next(half: u32) -> u32 {
    if half % 3 == 2 { half - 2 } else { half + 1 }
}

fn twins(triangles: &[[u32; 3]]) -> Result<Vec<u32>, DefeatureError> {
    // Both half-edges of an edge have the same key, and become neighbours.
    let mut edges: Vec<(u32, u32, u32)> = triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(t, &[a, b, c])| {
            [(a, b), (b, c), (c, a)].into_iter().enumerate().map(move |(k, (p, q))| (p.min(q), p.max(q), (3 * t + k) as u32))
        })
        .collect();
    edges.par_sort_unstable();
    let from = |half: u32| triangles[(half / 3) as usize][(half % 3) as usize];
    let mut twin = vec![u32::MAX; triangles.len() * 3];
    for pair in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match *pair {
            [(low, high, h), (_, _, g)] if low != high && from(h) != from(g) => {
                twin[h as usize] = g;
                twin[g as usize] = h;
            }
            [(_, _, h)] => return Err(DefeatureError::Open(h / 3, h % 3)),
            [(low, high, h), (_, _, _)] if low != high => return Err(DefeatureError::Open(h / 3, h % 3)),
            [(_, _, h), ..] => return Err(DefeatureError::NotManifold(h / 3, h % 3)),
            [] => {}
        }
    }
    Ok(twin)
}
