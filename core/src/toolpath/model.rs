//! Moves of a tool.

use super::vector::{Point, add, cross, dot, length, scale, sub};

/// A plane of arcs, canned cycles and cutter compensation; its normal is the third axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Plane {
    /// `G17`.
    #[default]
    Xy,
    /// `G18`; its first axis is Z, its second is X.
    Zx,
    /// `G19`.
    Yz,
}

impl Plane {
    /// Numbers of its first axis, its second one, and the one along its normal.
    #[must_use]
    pub fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }

    /// Its normal, of length 1.
    #[must_use]
    pub fn normal(self) -> [f64; 3] {
        match self {
            Self::Xy => [0.0, 0.0, 1.0],
            Self::Zx => [0.0, 1.0, 0.0],
            Self::Yz => [1.0, 0.0, 0.0],
        }
    }
}

/// How the tool moves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Kind {
    /// A rapid of which the beginning or the end is not known relative to the part: before all three axes were told, and after
    /// moves to places of the machine (`G28`, `G30`, `G53`). What is not known is taken for 0.
    Reference,
    /// As fast as it can, in a line.
    Rapid,
    /// Cutting, in a line.
    Feed,
    /// Cutting, in an arc or a helix. The radius changes evenly from the one of its beginning to the one of its end, which differ
    /// by what the program rounds.
    Arc {
        /// A point of its axis, in millimetres.
        centre: [f64; 3],
        /// Direction of its axis, of length 1.
        normal: [f64; 3],
        /// The angle that it turns, in radians; positive if it turns counter-clockwise, seen from where the normal points to.
        /// More than 2π if it turns more than once.
        sweep: f64,
    },
}

/// A move of the tool's programmed point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Where it begins, in millimetres.
    pub from: [f64; 3],
    /// Where it ends, in millimetres.
    pub to: [f64; 3],
    /// How it gets there.
    pub kind: Kind,
    /// Direction of the tool's axis at the end of the move, from its tip to its shank, of length 1.
    pub axis: [f64; 3],
    /// Number of the tool; 0 if the program names none.
    pub tool: u32,
    /// Speed, in millimetres a minute (or a revolution, or the inverse of minutes, as the program asks); 0 if it names none.
    pub feed: f64,
    /// Line of the file, from 1.
    pub line: u32,
}

impl Move {
    /// Whether it cuts.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        matches!(self.kind, Kind::Feed | Kind::Arc { .. })
    }

    /// The point at a part of the way, 0 at its beginning and 1 at its end. O(1).
    #[must_use]
    pub fn point(&self, at: f64) -> [f64; 3] {
        let Kind::Arc { centre, normal, sweep } = self.kind else {
            return add(scale(self.from, 1.0 - at), scale(self.to, at));
        };
        if at >= 1.0 {
            return self.to;
        }
        let (spoke, rise) = spoke(self.from, centre, normal);
        let (end, end_rise) = spoke_of(self.to, centre, normal);
        let radius = length(spoke);
        if radius == 0.0 {
            return add(scale(self.from, 1.0 - at), scale(self.to, at));
        }
        let (sin, cos) = (sweep * at).sin_cos();
        let turned = add(scale(spoke, cos), scale(cross(normal, spoke), sin));
        let grown = 1.0 + (end / radius - 1.0) * at;
        add(add(centre, scale(turned, grown)), scale(normal, rise + (end_rise - rise) * at))
    }

    /// Its length in millimetres; that of a helix, of the mean of its radii. O(1).
    #[must_use]
    pub fn length(&self) -> f64 {
        let Kind::Arc { centre, normal, sweep } = self.kind else { return length(sub(self.to, self.from)) };
        let [(start, low), (end, high)] = [self.from, self.to].map(|point| spoke_of(point, centre, normal));
        (0.5 * (start + end) * sweep).hypot(high - low)
    }

    /// Corners of a box around it, bulges of arcs counted in. O(1).
    #[must_use]
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let mut bounds = [self.from, self.from];
        widen(&mut bounds, self.to);
        let Kind::Arc { centre, normal, sweep } = self.kind else { return bounds };
        let (spoke, _) = spoke(self.from, centre, normal);
        let side = cross(normal, spoke);
        let full = std::f64::consts::TAU;
        for axis in 0..3 {
            // Along an axis the arc turns back where its direction is at right angles to it.
            let angle = side[axis].atan2(spoke[axis]);
            for turn in [angle, angle + std::f64::consts::PI] {
                let ahead = (turn * sweep.signum()).rem_euclid(full);
                // The last of several turns, for the radius and the height may change.
                let last = ahead + ((sweep.abs() - ahead) / full).floor() * full;
                for angle in [ahead, last].into_iter().filter(|angle| *angle >= 0.0 && *angle < sweep.abs()) {
                    widen(&mut bounds, self.point(angle / sweep.abs()));
                }
            }
        }
        bounds
    }
}

/// The way from the axis to a point, and how far along the axis it is.
fn spoke(point: Point, centre: Point, normal: Point) -> (Point, f64) {
    let from_centre = sub(point, centre);
    let rise = dot(from_centre, normal);
    (sub(from_centre, scale(normal, rise)), rise)
}

/// Distance from the axis, and how far along it.
fn spoke_of(point: Point, centre: Point, normal: Point) -> (f64, f64) {
    let (spoke, rise) = spoke(point, centre, normal);
    (length(spoke), rise)
}

pub(crate) fn widen(bounds: &mut [[f64; 3]; 2], point: Point) {
    for axis in 0..3 {
        bounds[0][axis] = bounds[0][axis].min(point[axis]);
        bounds[1][axis] = bounds[1][axis].max(point[axis]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    proptest::proptest! {
        /// Points of a helix lie in its box, and chords are no longer than it is.
        #[test]
        fn points_lie_in_the_box(
            angle in -7.0..7.0f64,
            sweep in -15.0..15.0f64,
            radius in 0.1..50.0f64,
            rise in -5.0..5.0f64,
            plane in 0..3usize,
        ) {
            let normal = [Plane::Xy, Plane::Zx, Plane::Yz][plane].normal();
            let [a, b, c] = [Plane::Xy, Plane::Zx, Plane::Yz][plane].axes();
            let at = |angle: f64, height: f64| {
                let mut point = [1.0, 2.0, 3.0];
                point[a] += radius * angle.cos();
                point[b] += radius * angle.sin();
                point[c] += height;
                point
            };
            let one = Move {
                kind: Kind::Arc { centre: [1.0, 2.0, 3.0], normal, sweep },
                ..arc(at(angle, 0.0), at(angle + sweep, rise), [0.0; 3], sweep)
            };
            let [low, high] = one.bounds();
            let mut chords = 0.0;
            for step in 0..200 {
                let [here, next] = [step, step + 1].map(|step| one.point(f64::from(step) / 200.0));
                chords += length(sub(next, here));
                for axis in 0..3 {
                    proptest::prop_assert!(here[axis] >= low[axis] - 1e-9 && here[axis] <= high[axis] + 1e-9);
                }
            }
            proptest::prop_assert!(chords <= one.length() + 1e-9 && chords > one.length() * 0.99);
        }
    }

    fn arc(from: Point, to: Point, centre: Point, sweep: f64) -> Move {
        let kind = Kind::Arc { centre, normal: [0.0, 0.0, 1.0], sweep };
        Move { from, to, kind, axis: [0.0, 0.0, 1.0], tool: 0, feed: 0.0, line: 1 }
    }

    /// A quarter of a circle of radius 2 and one turn and a half of a helix: lengths, middles and boxes by hand.
    #[test]
    fn arcs_have_length_middle_and_box() {
        let quarter = arc([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0; 3], FRAC_PI_2);
        assert!((quarter.length() - PI).abs() < 1e-12);
        assert!((quarter.point(0.5)[0] - 2f64.sqrt()).abs() < 1e-12);
        assert_eq!(quarter.bounds(), [[0.0; 3], [2.0, 2.0, 0.0]]);
        let helix = arc([1.0, 0.0, 0.0], [-1.0, 0.0, 3.0], [0.0; 3], -3.0 * PI);
        assert!((helix.length() - (3.0 * PI).hypot(3.0)).abs() < 1e-12);
        let [low, high] = helix.bounds();
        for (bound, expected) in low.into_iter().chain(high).zip([-1.0, -1.0, 0.0, 1.0, 1.0, 3.0]) {
            assert!((bound - expected).abs() < 1e-12, "{low:?} {high:?}");
        }
        let full = arc([1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3], TAU);
        assert!((full.point(0.5)[0] + 1.0).abs() < 1e-12);
        assert!((full.bounds()[0][1] + 1.0).abs() < 1e-12);
    }
}
