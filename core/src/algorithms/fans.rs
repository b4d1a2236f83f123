//! The triangles around each vertex, and whether they form one closed fan.

use glam::DVec3;

use crate::geometry::distance::place;
use crate::geometry::exact::Point;

/// Vertices of more triangles than this are taken for what is not closed, so that no step costs more than a constant.
pub(crate) const MOST: usize = 48;

/// The corners at each vertex, 3f + k for corner k of face f, from where to where.
pub(crate) fn corners_by_vertex(vertices: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; vertices + 1];
    faces.as_flattened().iter().for_each(|v| starts[*v as usize] += 1);
    let mut sum = 0;
    for start in &mut starts {
        sum += *start;
        *start = sum;
    }
    let mut corners = vec![0_u32; 3 * faces.len()];
    for (corner, v) in faces.as_flattened().iter().enumerate().rev() {
        let at = &mut starts[*v as usize];
        *at -= 1;
        corners[*at as usize] = corner as u32;
    }
    (starts, corners)
}

/// The normals of the triangles around a vertex, from one to the next, if they form one closed fan of triangles with areas.
pub(crate) struct Around {
    count: usize,
    normals: [DVec3; MOST],
    neighbours: [u32; MOST],
    is_closed: bool,
}

impl Around {
    /// None of no triangles, or of too many.
    pub(crate) fn new(points: &[Point], faces: &[[u32; 3]], corners: &[u32]) -> Option<Self> {
        if corners.is_empty() || corners.len() > MOST {
            return None;
        }
        let mut rings = [[0_u32; 2]; MOST];
        for (ring, corner) in rings.iter_mut().zip(corners) {
            let face = faces[*corner as usize / 3];
            let k = *corner as usize % 3;
            *ring = [face[(k + 1) % 3], face[(k + 2) % 3]];
        }
        let count = corners.len();
        let is_closed = count > 2 && in_order(&mut rings[..count]);
        let centre = faces[corners[0] as usize / 3][corners[0] as usize % 3];
        let p = place(points[centre as usize]);
        let mut normals = [DVec3::ZERO; MOST];
        for (normal, [a, b]) in normals.iter_mut().zip(rings).take(count) {
            *normal = (place(points[a as usize]) - p).cross(place(points[b as usize]) - p).normalize_or_zero();
        }
        Some(Self { count, normals, neighbours: rings.map(|ring| ring[0]), is_closed })
    }

    /// How many of its edges are features: where the cosine of the angle between normals is below `feature`. None where the fan is not closed.
    pub(crate) fn features(&self, feature: f64) -> Option<usize> {
        let normals = &self.normals[..self.count];
        let before = normals.iter().cycle().skip(self.count - 1);
        let is_sharp = |n: &DVec3, m: &DVec3| *n != DVec3::ZERO && *m != DVec3::ZERO && n.dot(*m) < feature;
        self.is_closed.then(|| normals.iter().zip(before).filter(|(n, m)| is_sharp(n, m)).count())
    }

    /// The unit normals, zero for triangles without an area.
    pub(crate) fn normals(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.normals.iter().copied().take(self.count)
    }

    /// The vertices around, in order; any order where the fan is not closed.
    pub(crate) fn neighbours(&self) -> impl Iterator<Item = u32> + '_ {
        self.neighbours.iter().copied().take(self.count)
    }
}

/// Puts the sides of a fan in order; false if they are no closed fan of different vertices.
fn in_order(rings: &mut [[u32; 2]]) -> bool {
    let first = rings[0][0];
    for i in 0..rings.len() - 1 {
        let wanted = rings[i][1];
        if wanted == first {
            return false;
        }
        let Some(next) = (i + 1..rings.len()).find(|j| rings[*j][0] == wanted) else { return false };
        rings.swap(i + 1, next);
    }
    rings[rings.len() - 1][1] == first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_is_closed_if_its_sides_follow_each_other_once() {
        assert!(in_order(&mut [[1, 2], [3, 1], [2, 3]]));
        assert!(!in_order(&mut [[1, 2], [2, 3], [3, 4]]), "open");
        assert!(!in_order(&mut [[1, 2], [2, 1], [3, 4], [4, 3]]), "two fans");
        assert!(!in_order(&mut [[1, 2], [2, 1], [1, 3], [3, 1]]), "two fans with an edge in common");
        assert!(!in_order(&mut [[1, 2], [3, 2], [3, 1]]), "not all run the same way");
    }
}
