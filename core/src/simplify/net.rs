//! The whole mesh between rounds: what is there of it, and what is known of its vertices.

use rayon::prelude::*;

use crate::algorithms::fans::{Around, corners_by_vertex};
use crate::geometry::exact::Point;
use crate::simplify::patch::{CREASE, FIXED, FREE, RIM};
use crate::simplify::quadric::Quadric;

/// The weight of a plane across an edge of the rim (Garland & Heckbert, section 6): a vertex has two of them, and six planes of triangles where there is no
/// rim, so that the rim keeps its shape as well as the surface does.
const RIM_WEIGHT: f64 = 3.0;

/// A mesh by flat arrays.
#[derive(Default)]
pub(super) struct Net {
    pub(super) points: Vec<Point>,
    pub(super) quadrics: Vec<Quadric>,
    pub(super) kinds: Vec<u8>,
    /// By which of the limits a vertex is judged.
    pub(super) strict: Vec<u8>,
    pub(super) faces: Vec<[u32; 3]>,
    /// The input's face in whose place a face stands.
    pub(super) origins: Vec<u32>,
    /// The input's vertex that a vertex was.
    pub(super) homes: Vec<u32>,
    /// The input's vertices whose triangles form no closed fan.
    pub(super) open: Vec<u32>,
}

/// Kinds of vertices.
pub(super) struct Constraints<'a> {
    /// Vertices that stay as they are.
    pub(super) fixed: &'a [bool],
    /// By which of the limits they are judged, if not by the first.
    pub(super) strict: &'a [u8],
    /// The cosine of the angle between triangles from which on their edge is a feature.
    pub(super) feature: f64,
}

impl Net {
    /// O(n).
    pub(super) fn new(points: &[Point], faces: &[[u32; 3]], constraints: &Constraints<'_>) -> Self {
        let known = of_vertices((points, faces), |v, around| {
            let Some(around) = around else { return ((FIXED, true), Quadric::default()) };
            let is_fixed = constraints.fixed.get(v).copied().unwrap_or(false);
            let kind = if is_fixed { FIXED } else { kind(around, constraints.feature) };
            ((kind, !around.is_closed()), quadric(around, constraints.feature))
        });
        let strict = |v: usize| constraints.strict.get(v).copied().unwrap_or(0);
        let copies = || (points.to_vec(), faces.to_vec());
        let numbers = || ((0..faces.len() as u32).collect(), (0..points.len() as u32).collect());
        let of_known = || {
            let (known, quadrics): (Vec<(u8, bool)>, Vec<Quadric>) = known.into_par_iter().unzip();
            let open = (0..).zip(&known).filter(|(_, known)| known.1).map(|(v, _)| v).collect();
            (known.into_iter().map(|known| known.0).collect(), quadrics, open)
        };
        let given = || (copies(), numbers(), (0..points.len()).map(strict).collect());
        let (((points, faces), (origins, homes), strict), (kinds, quadrics, open)) = rayon::join(given, of_known);
        Self { points, quadrics, kinds, strict, faces, origins, homes, open }
    }

    /// Gives all vertices the quadrics of the mesh as it is now: what it was before is forgotten. O(n).
    pub(super) fn renew_quadrics(&mut self, feature: f64) {
        let of = |_, around: Option<&Around>| around.map_or_else(Quadric::default, |around| quadric(around, feature));
        self.quadrics = of_vertices((&self.points, &self.faces), of);
    }
}

/// The planes of the triangles around a vertex, and of its rim.
fn quadric(around: &Around, feature: f64) -> Quadric {
    let rim = around.rim(feature);
    let across = rim.iter().flat_map(|rim| rim.across).map(|n| n * RIM_WEIGHT.sqrt());
    Quadric::of_normals(around.normals().chain(across))
}

/// Something of each vertex, by the triangles around it, if they are some in a row. O(n).
fn of_vertices<T: Send>((points, faces): (&[Point], &[[u32; 3]]), of: impl Fn(usize, Option<&Around>) -> T + Sync) -> Vec<T> {
    let (starts, corners) = corners_by_vertex(points.len(), faces);
    let each = (0..points.len()).into_par_iter().with_min_len(1 << 10);
    let of_one = |around: &mut Around, v: usize| {
        let own = corners.get(starts[v] as usize..starts[v + 1] as usize).unwrap_or_default();
        of(v, around.of(points, faces, own))
    };
    each.map_init(Around::default, of_one).collect()
}

fn kind(around: &Around, feature: f64) -> u8 {
    match around.features(feature) {
        Some(0) => FREE,
        Some(2) => CREASE,
        Some(_) => FIXED,
        // A corner of a rim is a feature as an edge is.
        None => match around.rim(feature) {
            Some(rim) if rim.features == 0 && rim.cosine >= feature => RIM,
            _ => FIXED,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_of_a_sheet_are_told_from_its_corners() {
        let points: Vec<Point> = (0..9).map(|i| [(i % 3) as f32, (i / 3) as f32, 0.0]).collect();
        let faces: Vec<[u32; 3]> = [0, 1, 3, 4].into_iter().flat_map(|a| [[a, a + 1, a + 4], [a, a + 4, a + 3]]).collect();
        let net = Net::new(&points, &faces, &Constraints { fixed: &[], strict: &[], feature: 0.8 });
        assert_eq!(net.kinds, [FIXED, RIM, FIXED, RIM, FREE, RIM, FIXED, RIM, FIXED]);
        assert_eq!(net.open, [0, 1, 2, 3, 5, 6, 7, 8]);
    }

    /// A pyramid whose top was moved: its planes are those of the new sides, whatever they were.
    #[test]
    fn new_quadrics_are_those_of_the_mesh_as_it_is() {
        let points = |top: f32| vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 1.0, top]];
        let faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]];
        let constraints = Constraints { fixed: &[], strict: &[], feature: -2.0 };
        let mut net = Net::new(&points(1.0), &faces, &constraints);
        let moved = Net::new(&points(3.0), &faces, &constraints);
        net.points = points(3.0);
        assert_ne!(net.quadrics, moved.quadrics);
        net.renew_quadrics(-2.0);
        assert_eq!(net.quadrics, moved.quadrics);
    }

    #[test]
    fn creases_are_told_from_corners_and_flat_surface() {
        // A cube of side 2 with a vertex in the middle of one edge, and one in a face.
        let points = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        let lift = points.map(|[x, y, _]: Point| [x, y, 2.0]);
        let all: Vec<Point> = points.into_iter().chain(lift).chain([[1.0, 1.0, 2.0], [1.0, 0.0, 0.0]]).collect();
        let faces = [
            [0, 3, 9],
            [3, 2, 9],
            [2, 1, 9],
            [4, 5, 8],
            [5, 6, 8],
            [6, 7, 8],
            [7, 4, 8],
            [0, 9, 4],
            [9, 5, 4],
            [9, 1, 5],
            [1, 2, 6],
            [1, 6, 5],
            [2, 3, 7],
            [2, 7, 6],
            [3, 0, 4],
            [3, 4, 7],
        ];
        let net = Net::new(&all, &faces, &Constraints { fixed: &[], strict: &[], feature: 0.8 });
        assert_eq!(net.kinds, [FIXED, FIXED, FIXED, FIXED, FIXED, FIXED, FIXED, FIXED, FREE, CREASE]);
    }
}
