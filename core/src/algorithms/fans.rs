//! The triangles around each vertex, and whether they form one fan, closed or open.

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::distance::place;
use crate::geometry::exact::Point;

/// Vertices of more triangles than this are taken for what is not closed, so that no step costs more than a constant.
pub(crate) const MOST: usize = 48;

/// Fewer vertices make no range of their own.
const LEAST: usize = 1 << 14;

/// Ranges, at most: all corners are looked at for each.
const MOST_RANGES: usize = 8;

/// The corners at each vertex, 3f + k for corner k of face f, ascending, from where to where. O(n), on the threads of the pool that this one belongs to:
/// each has a range of vertices.
pub(crate) fn corners_by_vertex(vertices: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let size = vertices.div_ceil(rayon::current_num_threads().min(MOST_RANGES)).max(LEAST);
    let mut starts = vec![0_u32; vertices + 1];
    starts[1..].par_chunks_mut(size).enumerate().for_each(|(range, counts)| {
        let first = range * size;
        for v in faces.as_flattened() {
            if let Some(count) = counts.get_mut((*v as usize).wrapping_sub(first)) {
                *count += 1;
            }
        }
    });
    let mut sum = 0;
    for start in &mut starts {
        sum += *start;
        *start = sum;
    }
    let mut corners = vec![0_u32; 3 * faces.len()];
    let mut rest = &mut corners[..];
    let mut ranges = Vec::new();
    for first in (0..vertices).step_by(size) {
        let end = (first + size).min(vertices);
        let (own, others) = rest.split_at_mut((starts[end] - starts[first]) as usize);
        ranges.push((first, own));
        rest = others;
    }
    ranges.into_par_iter().for_each(|(first, own)| {
        let before = starts[first];
        let mut ends: Vec<u32> = starts[first..vertices.min(first + size)].iter().map(|start| start - before).collect();
        for (corner, v) in faces.as_flattened().iter().enumerate() {
            if let Some(end) = ends.get_mut((*v as usize).wrapping_sub(first)) {
                own[*end as usize] = corner as u32;
                *end += 1;
            }
        }
    });
    (starts, corners)
}

/// How the triangles around a vertex hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fan {
    /// Each has one before and one behind.
    Closed,
    /// One is the first, and one the last: the vertex lies on a rim.
    Open,
    /// No fan, or several.
    Other,
}

/// The rim at a vertex.
pub(crate) struct Rim {
    /// Unit vectors across its two edges, in their triangles.
    pub(crate) across: [DVec3; 2],
    /// The cosine of the angle between its edges; 1 where it goes straight on.
    pub(crate) cosine: f64,
    /// Other edges of the vertex that are features.
    pub(crate) features: usize,
}

/// The normals of the triangles around a vertex, from one to the next, if they form one fan of triangles with areas. It is lent to one vertex after the
/// other, since it is large.
pub(crate) struct Around {
    count: usize,
    normals: [DVec3; MOST],
    /// The sides beyond the vertex, in order; any order where the fan is not closed.
    rings: [[u32; 2]; MOST],
    fan: Fan,
    /// The edges of the first triangle and of the last one that have no other.
    ends: [DVec3; 2],
}

impl Default for Around {
    fn default() -> Self {
        Self { count: 0, normals: [DVec3::ZERO; MOST], rings: [[0; 2]; MOST], fan: Fan::Other, ends: [DVec3::ZERO; 2] }
    }
}

impl Around {
    /// Looks at the vertex of these corners. None of no triangles, or of too many.
    pub(crate) fn of(&mut self, points: &[Point], faces: &[[u32; 3]], corners: &[u32]) -> Option<&Self> {
        if corners.is_empty() || corners.len() > MOST {
            return None;
        }
        self.count = corners.len();
        let rings = &mut self.rings[..corners.len()];
        for (ring, corner) in rings.iter_mut().zip(corners) {
            let face = faces[*corner as usize / 3];
            let k = *corner as usize % 3;
            *ring = [face[(k + 1) % 3], face[(k + 2) % 3]];
        }
        self.fan = in_order(rings);
        let centre = faces[corners[0] as usize / 3][corners[0] as usize % 3];
        let p = place(points[centre as usize]);
        for (normal, [a, b]) in self.normals.iter_mut().zip(&*rings) {
            *normal = (place(points[*a as usize]) - p).cross(place(points[*b as usize]) - p).normalize_or_zero();
        }
        self.ends = [rings[0][0], rings[rings.len() - 1][1]].map(|w| place(points[w as usize]) - p);
        Some(self)
    }

    /// How many of its edges are features: where the cosine of the angle between normals is below `feature`. None where the fan is not closed.
    pub(crate) fn features(&self, feature: f64) -> Option<usize> {
        let normals = &self.normals[..self.count];
        let before = normals.iter().cycle().skip(self.count - 1);
        (self.fan == Fan::Closed).then(|| normals.iter().zip(before).filter(|(n, m)| is_sharp(n, m, feature)).count())
    }

    /// Do they form one closed fan?
    pub(crate) fn is_closed(&self) -> bool {
        self.fan == Fan::Closed
    }

    /// The rim, where the fan is open and its edges there have a length.
    pub(crate) fn rim(&self, feature: f64) -> Option<Rim> {
        let normals = &self.normals[..self.count];
        let [first, last] = [*normals.first()?, *normals.last()?];
        let ways = self.ends.map(DVec3::normalize_or_zero);
        (self.fan == Fan::Open && ways.iter().all(|way| *way != DVec3::ZERO)).then(|| Rim {
            across: [ways[0].cross(first), ways[1].cross(last)],
            cosine: -ways[0].dot(ways[1]),
            features: normals.windows(2).filter(|two| is_sharp(&two[0], &two[1], feature)).count(),
        })
    }

    /// The unit normals, zero for triangles without an area.
    pub(crate) fn normals(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.normals.iter().copied().take(self.count)
    }

    /// The vertices around, in order; any order where the fan is not closed.
    pub(crate) fn neighbours(&self) -> impl Iterator<Item = u32> + '_ {
        self.rings.iter().map(|ring| ring[0]).take(self.count)
    }
}

fn is_sharp(n: &DVec3, m: &DVec3, feature: f64) -> bool {
    *n != DVec3::ZERO && *m != DVec3::ZERO && n.dot(*m) < feature
}

/// Do the sides of triangles around a vertex follow each other once around, and all the same way? Puts them in order. O(n²).
pub(crate) fn is_closed_fan(rings: &mut [[u32; 2]]) -> bool {
    in_order(rings) == Fan::Closed
}

/// Puts the sides of a fan of different vertices in order, and tells how they hang together.
fn in_order(rings: &mut [[u32; 2]]) -> Fan {
    // Nearly all are closed, and can begin anywhere.
    if rings.len() > 2 && follow_each_other(rings) && rings[rings.len() - 1][1] == rings[0][0] {
        return Fan::Closed;
    }
    let is_first = |i: &usize| rings.iter().all(|ring| ring[1] != rings[*i][0]);
    let mut starts = (0..rings.len()).filter(is_first);
    let start = starts.next();
    if starts.next().is_some() {
        return Fan::Other;
    }
    let Some(start) = start else { return Fan::Other };
    rings.swap(0, start);
    let is_open = follow_each_other(rings) && rings.iter().all(|ring| ring[0] != rings[rings.len() - 1][1]);
    if is_open { Fan::Open } else { Fan::Other }
}

/// Puts sides in order from the first on: each begins where the one before ends, and no other one does, nor does the first one. False if they cannot be.
fn follow_each_other(rings: &mut [[u32; 2]]) -> bool {
    let Some([first, _]) = rings.first().copied() else { return false };
    for i in 0..rings.len() - 1 {
        let wanted = rings[i][1];
        let mut next = (i + 1..rings.len()).filter(|j| rings[*j][0] == wanted);
        let (Some(one), None, false) = (next.next(), next.next(), wanted == first) else { return false };
        rings.swap(i + 1, one);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_is_closed_or_open_if_its_sides_follow_each_other_once() {
        assert_eq!(in_order(&mut [[1, 2], [3, 1], [2, 3]]), Fan::Closed);
        assert_eq!(in_order(&mut [[2, 3], [1, 2], [3, 4]]), Fan::Open);
        assert_eq!(in_order(&mut [[1, 2]]), Fan::Open);
        let others: [&mut [[u32; 2]]; 7] = [
            // Two triangles on each other.
            &mut [[1, 2], [2, 1]],
            // Two fans; with an edge in common; open ones.
            &mut [[1, 2], [2, 1], [3, 4], [4, 3]],
            &mut [[1, 2], [2, 1], [1, 3], [3, 1]],
            &mut [[1, 2], [3, 4]],
            // Not all run the same way.
            &mut [[1, 2], [3, 2], [3, 1]],
            // An edge of three triangles, and one of four.
            &mut [[1, 2], [2, 3], [3, 2]],
            &mut [[1, 2], [2, 3], [3, 2], [2, 4], [4, 1]],
        ];
        assert!(others.into_iter().all(|rings| in_order(rings) == Fan::Other));
    }

    /// The middle of a side of a flat square, seen from the square.
    #[test]
    fn a_rim_that_goes_straight_on_is_told() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
        let faces = [[0, 2, 3], [0, 1, 2]];
        let mut around = Around::default();
        let around = around.of(&points, &faces, &[0, 3]).unwrap();
        let rim = around.rim(0.5).unwrap();
        assert_eq!((rim.cosine, rim.features, around.is_closed()), (1.0, 0, false));
        assert!(rim.across.iter().all(|n| *n == DVec3::Y || *n == DVec3::NEG_Y));
    }
}
