//! The sphere that touches the surface at one point from inside, shrunk until no other surface is in it.
//!
//! It is the largest one there (Inui, Umezu and Kobayashi, "Shrinking sphere: a parallel algorithm for computing the thickness of 3D objects",
//! CAD & Applications 13(2), 2016; the step is that of Ma, Bae and Choi, "3D medial axis point approximation using nearest neighbors and the
//! normal field", The Visual Computer 28, 2012). At a sharp edge it shrinks to nothing, and that is no wall. The two points where it touches tell:
//! seen from its middle, they are apart by 180° less the angle of the edge (the separation angle of Foskey, Lin and Manocha, "Efficient computation
//! of a simplified medial axis", JCISE 3(4), 2003). A wall has them at least 160° apart.

use glam::DVec3;

use crate::geometry::distance::nearest_of_triangle;

/// The square of the cosine of 10°: a way into the material that leaves the normal by no more ends 160° from where it began, seen from the middle of the sphere.
const STRAIGHT: f64 = 0.969_846_310_392_954_1;
/// The tangent of 10°.
const WIDENING: f64 = 0.176_326_980_708_464_98;
/// The sine times the cosine of 10°: no such way of a sphere of diameter 1 leads farther aside.
const WIDEST: f64 = 0.171_010_071_662_834_36;
/// The cosine of 20°: triangles that face each other by this are touched by one sphere 160° apart.
const FACING: f64 = 0.939_692_620_785_908_4;
/// Shrinking ends here; it is nearly always over after a few steps.
const MOST_STEPS: usize = 48;
/// A point that is in the sphere by less than this share of its radius is not in it.
const ROUNDING: f64 = 1e-9;
/// Pieces of the way through the wall, each with a box of its own.
const PIECES: usize = 4;

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) at: DVec3,
    /// Into the material, of length 1.
    pub(super) inward: DVec3,
    /// The record that it lies on.
    pub(super) of: u32,
}

/// One triangle, as far as it is within the largest sphere that is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Touch {
    /// The diameter of the sphere that touches it.
    pub(super) diameter: f64,
    /// It is touched at least 160° from the sample.
    pub(super) is_apart: bool,
    /// It faces the other way than the surface at the sample does, by at least 160°.
    pub(super) is_opposite: bool,
    /// How deep in the material the way straight inward crosses it, if it does.
    pub(super) depth: Option<f64>,
}

/// A box of places.
pub(super) type Places = [DVec3; 2];

impl Sample {
    /// Boxes around all ways that leave the normal by at most 10°, as far as a sphere of diameter `most` reaches; and a little more.
    pub(super) fn ways(&self, most: f64) -> [Places; PIECES] {
        let across = (DVec3::ONE - self.inward * self.inward).max(DVec3::ZERO).map(f64::sqrt);
        std::array::from_fn(|i| {
            let [near, far] = [i, i + 1].map(|i| i as f64 / PIECES as f64);
            let aside = across * (most * (WIDENING * far).min(WIDEST)) + DVec3::splat(most * 1e-6);
            let [near, far] = [near, far].map(|depth| self.at + self.inward * (depth * most));
            [near.min(far) - aside, near.max(far) + aside]
        })
    }

    /// May a triangle, of which this is the box, meet one of these ways? What is beside the sample rather than ahead of it does not.
    #[inline]
    pub(super) fn has_ahead(&self, [a, b, c]: &[DVec3; 3], around: &Places, most: f64) -> bool {
        let depth = |p: &DVec3| (*p - self.at).dot(self.inward);
        let deepest = depth(a).max(depth(b)).max(depth(c));
        let beside = (around[0] - self.at).max(self.at - around[1]).max(DVec3::ZERO);
        // A way to this depth is longer than that by the cosine of 10° at most.
        deepest > 0.0
            && beside.length_squared() * (STRAIGHT * (1.0 - 1e-6)) <= deepest * deepest
            && self.ways(most).iter().any(|[lo, hi]| lo.cmple(around[1]).all() && hi.cmpge(around[0]).all())
    }

    /// The middle of the sphere of this diameter.
    pub(super) fn middle(&self, diameter: f64) -> DVec3 {
        self.at + self.inward * (diameter / 2.0)
    }

    /// Shrinks a sphere of diameter `most` until it touches the triangle; `None` if nothing of it is in there. Always from `most` on, so that the
    /// answer is the same to the last bit whatever else is known.
    pub(super) fn touch(&self, triangle: &[DVec3; 3], most: f64) -> Option<Touch> {
        let mut radius = most / 2.0;
        let mut is_apart = None;
        for _ in 0..MOST_STEPS {
            let middle = self.middle(2.0 * radius);
            let nearest = nearest_of_triangle(triangle, middle);
            if nearest.distance_squared(middle) >= radius * radius * (1.0 - ROUNDING) {
                break;
            }
            let way = nearest - self.at;
            let (square, depth) = (way.length_squared(), way.dot(self.inward));
            let smaller = square / (2.0 * depth);
            // The surface at the sample itself, or nothing that numbers can tell.
            if !(smaller > 0.0 && smaller < radius) {
                break;
            }
            radius = smaller;
            is_apart = Some(depth * depth >= STRAIGHT * square);
        }
        let is_apart = is_apart?;
        let [a, b, c] = *triangle;
        let normal = (b - a).cross(c - a);
        let is_opposite = normal.dot(self.inward) >= FACING * normal.length();
        Some(Touch { diameter: 2.0 * radius, is_apart, is_opposite, depth: self.crossing(triangle, normal) })
    }

    /// Where the way straight inward crosses a triangle, its rim included.
    fn crossing(&self, [a, b, c]: &[DVec3; 3], normal: DVec3) -> Option<f64> {
        let along = normal.dot(self.inward);
        let depth = normal.dot(*a - self.at) / along;
        let p = self.at + self.inward * depth;
        let is_in = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (**v - **u).cross(p - **u).dot(normal) >= 0.0);
        (depth > 0.0 && depth.is_finite() && is_in).then_some(depth)
    }
}

/// All that was found around a sample, in any order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around {
    /// The smallest diameter of a touch that is a wall's.
    pub(super) wall: f64,
    /// The smallest of another triangle, and whether it is touched apart.
    pub(super) other: (f64, bool),
    /// The least depth at which the way inward crosses anything.
    pub(super) depth: f64,
}

impl Around {
    /// The thickness of the wall here, if it is less than what was asked for: what the sphere touches opposite, unless something else stands in
    /// between, as the side of an edge.
    pub(super) fn thickness(&self) -> Option<f64> {
        let (other, is_apart) = self.other;
        let wall = if is_apart { self.wall.min(other) } else { self.wall };
        (wall.is_finite() && wall <= self.depth * (1.0 + 1e-6)).then_some(wall)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::distance::square_distance;

    const SAMPLE: Sample = Sample { at: DVec3::ZERO, inward: DVec3::Z, of: 0 };

    /// The largest sphere without a triangle in it, by halving.
    fn by_halving(triangle: [DVec3; 3], most: f64) -> f64 {
        let is_free = |diameter: f64| {
            let radius = diameter / 2.0;
            square_distance(SAMPLE.middle(diameter), triangle) >= radius * radius
        };
        let (mut free, mut held) = (0.0, most);
        for _ in 0..60 {
            let half = (free + held) / 2.0;
            *(if is_free(half) { &mut free } else { &mut held }) = half;
        }
        held
    }

    proptest! {
        #[test]
        fn a_sphere_shrinks_to_the_one_that_touches(points in prop::array::uniform3(prop::array::uniform3(-2.0f64..2.0))) {
            let triangle = points.map(DVec3::from_array);
            let found = SAMPLE.touch(&triangle, 2.0).map_or(2.0, |touch| touch.diameter);
            let want = by_halving(triangle, 2.0);
            prop_assert!((found - want).abs() < 1e-6, "{found} instead of {want}");
        }

    /// A point that is touched apart lies in a box on the way there.
        #[test]
        fn ways_hold_all_that_is_straight_ahead(
            inward in prop::array::uniform3(-1.0f64..1.0), aside in prop::array::uniform3(-1.0f64..1.0), depth in 0.001f64..1.0, lean in 0.0f64..1.0,
        ) {
            let sample = Sample { at: DVec3::new(3.0, -2.0, 1.0), inward: DVec3::from_array(inward).normalize_or(DVec3::X), of: 0 };
            let aside = (DVec3::from_array(aside) - sample.inward * DVec3::from_array(aside).dot(sample.inward)).normalize_or_zero();
            let way = sample.inward * depth + aside * (depth * WIDENING * lean);
            let is_in_sphere = (sample.at + way).distance(sample.middle(1.0)) < 0.5;
            let p = sample.at + way;
            let is_held = sample.ways(1.0).iter().any(|[lo, hi]| p.cmpge(*lo).all() && p.cmple(*hi).all());
            prop_assert!(is_held || !is_in_sphere);
            prop_assert!(sample.has_ahead(&[p; 3], &[p; 2], 1.0) || !is_in_sphere);
        }
    }

    #[test]
    fn an_edge_is_told_from_a_wall() {
        let wide = |z: f64, tilt: f64| [[-9.0, -9.0], [0.0, 9.0], [9.0, -9.0]].map(|[x, y]| DVec3::new(x, y, z + tilt * x));
        // Their normals look along Z.
        let turned = |[a, b, c]: [DVec3; 3]| [a, c, b];
        let plate = SAMPLE.touch(&turned(wide(0.5, 0.0)), 2.0).unwrap();
        assert!((plate.diameter - 0.5).abs() < 1e-9 && plate.is_apart && plate.is_opposite, "{plate:?}");
        assert_eq!(plate.depth, Some(0.5));
        let facing_here = SAMPLE.touch(&wide(0.5, 0.0), 2.0).unwrap();
        assert!(!facing_here.is_opposite, "the other side of a gap");
        // 45°.
        let wedge = SAMPLE.touch(&turned(wide(0.5, 1.0)), 2.0).unwrap();
        assert!(wedge.diameter < 0.5 && !wedge.is_apart && !wedge.is_opposite, "{wedge:?}");
        assert_eq!(SAMPLE.touch(&wide(0.0, 0.0), 2.0), None, "the surface itself");
        assert_eq!(SAMPLE.touch(&turned(wide(2.5, 0.0)), 2.0), None, "beyond");
    }

    #[test]
    fn what_stands_in_between_hides_a_wall() {
        let nothing = Around { wall: f64::INFINITY, other: (f64::INFINITY, false), depth: f64::INFINITY };
        assert_eq!(nothing.thickness(), None);
        let wall = Around { wall: 0.5, depth: 0.5, ..nothing };
        assert_eq!(wall.thickness(), Some(0.5));
        assert_eq!(Around { depth: 0.3, other: (0.2, false), ..wall }.thickness(), None);
        assert_eq!(
            Around { other: (0.2, true), depth: 0.2, ..wall }.thickness(),
            Some(0.2),
            "an edge straight ahead, as of a groove"
        );
    }
}
