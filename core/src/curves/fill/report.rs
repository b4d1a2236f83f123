//! What became of outlines.

use super::coons::Coons;
use super::fit::FitError;
use crate::curves::curve::Spline;
use crate::curves::elementary::Elementary;
use crate::curves::elementary::Frame;
use crate::curves::vector::Point;

/// How an outline was filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Method {
    /// All curves are in one plane.
    Plane,
    /// All curves are on one cylinder, cone, sphere or torus; or circles and straight lines of the outline fix one that the others are near.
    Recognised,
    /// Four sides, bilinearly blended; upon a surface of revolution, if one nearly has them.
    Coons,
    /// Three sides, the fourth one a point.
    Triangle,
    /// Straight from one side to the other.
    Ruled,
    /// Heights over a plane, those of a thin plate through the outline.
    Heights,
    /// Straight from the outline to a point in its middle.
    Centre,
    /// The same with a surface for each curve, where the one over all curves folds.
    Fans,
    /// By none: the outline is left to the filling of mesh holes.
    Fallback,
}

/// The surface of an outline.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Surface {
    /// Trimmed by the outline.
    Carrier(Elementary),
    /// Whole.
    Coons(Box<Coons>),
    /// The mesh alone has it: heights over the x-y-plane of a frame.
    Heights(Frame),
    /// Straight from a closed curve to a point: `centre + v (curve(u) − centre)`.
    Centre {
        /// Closed, cubic, on 0 to 1.
        curve: Box<Spline>,
        /// Where each curve of the outline begins on it, and 1.
        ends: Vec<f64>,
        /// The point at v = 0.
        centre: Point,
    },
    /// Straight from each curve to a point, a surface each: `centre + v (curve(u) − centre)`.
    Fans {
        /// In the order and the direction of the outline, as they were fitted, or exact where that failed.
        curves: Vec<Spline>,
        /// The point at v = 0.
        centre: Point,
    },
    /// No surface: rings of numbers of points of the mesh, the outer one first, for the filling of mesh holes.
    Fallback(Vec<Vec<u32>>),
}

/// Why an outline has no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// A curve of it could not be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// It has less than three points.
    #[error("less than three points")]
    Small,
    /// Ends of curves that follow each other are farther apart than half of the shorter one is long.
    #[error("curves that follow each other do not meet")]
    Open,
    /// All surfaces that were tried fold, and no plane shows the outline without crossings.
    #[error("every surface folds")]
    Folds,
    /// Its curves are in one plane, and cross there.
    #[error("its curves cross each other, or themselves, in their plane")]
    Crosses,
    /// Holes are filled in planes and on cylinders, cones, spheres and tori alone.
    #[error("holes in a surface that is no plane, cylinder, cone, sphere or torus")]
    Holes,
}

/// What became of an outline. Lengths are in the unit of the curves.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// How it was filled.
    pub method: Method,
    /// Sides that its curves form by their corners; 0 if it is smooth all around.
    pub sides: usize,
    /// The diagonal of a box around the outline.
    pub size: f64,
    /// No point of a curve is farther from the surface: fitted curves by their error (above the tolerance where a curve does not
    /// come nearer in 24 rounds), recognised surfaces by points of the outline.
    pub error: f64,
    /// No point of a curve is farther from the edges of the mesh along it, at samples.
    pub chord: f64,
    /// The largest distance between ends of curves that follow each other.
    pub gap: f64,
    /// Curves along which its surface has been given the tangent planes of what is beside it.
    pub tangent: usize,
    /// The largest angle there between its normals and those of what is beside it, radians, at samples. Of two blended surfaces it is
    /// that to the planes halfway.
    pub kink: f64,
    /// Whether a Coons surface of it folds.
    pub is_folded: bool,
    /// Whether its file said its surface.
    pub is_told: bool,
    /// Whether the surface is to the left of its outline as seen from outside; `None` where the file did not say it.
    pub is_left: Option<bool>,
    /// Whether other simple surfaces have the same outline: its curve is a circle, or its curves are two circles around one axis, and the file says no surface; or
    /// that is a sphere or a torus, and the file does not say on which side of the outline.
    pub is_ambiguous: bool,
    /// Whether triangles run against the direction of the outline, or would, so that they agree with those of other outlines.
    pub is_flipped: bool,
    /// Triangles below 0.4 (twice the ratio of the radii of their inner and outer circles) at corners below 15° of the outline, or of one
    /// of the surfaces to a centre that its curves have.
    pub sharp: usize,
    /// Triangles below 0.4 elsewhere: where the outline is narrower than about 1/1000 of its curves, or a surface folds.
    pub poor: usize,
    /// Why there is no surface.
    pub problem: Option<Problem>,
}
