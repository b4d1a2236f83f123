//! What is wanted of filled loops.

use crate::curves::loops::Loop;
use crate::curves::{Face, Use};
use crate::util::parallel::in_pool;

/// How near fitted curves are where tangent planes are wanted, in lengths: the error of a cubic B-spline's tangent grows as its own
/// one to the power of 3/4, and 10⁻⁸ makes 10⁻⁶ of it.
const NEAR: f64 = 1e-8;

/// What is wanted. Lengths are in the unit of the curves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// How far fitted curves may be from their own; `None`: 5 · 10⁻⁷ of the length of each, and 10⁻⁸ where tangent planes are wanted,
    /// of which they are off by about 10⁻⁶ then.
    pub tolerance: Option<f64>,
    /// How far curves may be from a plane, cylinder, cone, sphere or torus that is taken for their surface; `None`: 10⁻⁵ of the
    /// outline's size, or the gaps between its curves. Where circles and straight lines are on one, splines may be 2 · 10⁻⁴ of the size from it.
    pub carrier: Option<f64>,
    /// Whether such surfaces are looked for, planes apart, which always are.
    pub recognises: bool,
    /// Whether a plane, cylinder, cone, sphere or torus that a file says for a face is taken for its surface, if its curves are within 2 · 10⁻⁴ of the size of
    /// it. Without, curves alone count, as if the file had no surfaces.
    pub told: bool,
    /// Curves are joined into one side where the cosine between their tangents is above this.
    pub smooth: f64,
    /// How far edges of the mesh may be from curves and surfaces; `None`: 2 · 10⁻³ of the size of each outline.
    pub chord: Option<f64>,
    /// How much curves may turn along an edge of the mesh, radians.
    pub angle: f64,
    /// The longest edge of the mesh; `None`: as the outline's shortest curve is, but no less than 1/32 of each curve.
    pub size: Option<f64>,
    /// Points of the mesh within a surface, at most, or four times those of its outline if that is more.
    pub inner: usize,
    /// How surfaces meet what is beside them.
    pub continuity: Continuity,
    /// Whether an outline that nothing else fits gets a surface for each of its curves, to a centre. Files of surfaces need one; in a mesh, the filling of
    /// holes keeps clear of other faces, and such a cone may not.
    pub fans: bool,
    /// Threads that work, `None`: those of the caller's pool. The result is the same.
    pub threads: Option<usize>,
}

/// How a surface that is blended from its curves meets its neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Continuity {
    /// In the curves that they share.
    #[default]
    Position,
    /// With the same tangent planes, where these are known and where the sides that meet at the ends of a curve lie in them (up to
    /// the angle of [`Options::smooth`], which fades along the curve): those of planes, cylinders, cones, spheres and tori, those
    /// that are given, and between two blended surfaces the planes halfway between both.
    Tangent,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: None,
            carrier: None,
            recognises: true,
            told: true,
            smooth: 0.9,
            chord: None,
            angle: 0.35,
            size: None,
            inner: 100_000,
            continuity: Continuity::Position,
            fans: true,
            threads: None,
        }
    }
}

impl Options {
    /// Does work with as many threads as are wanted.
    pub(super) fn with_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match self.threads {
            Some(threads) => in_pool(threads, work),
            None => work(),
        }
    }

    /// How far the fitted curve of one of a length may be from it; `None` where nothing is said.
    pub(super) fn fit(&self, length: f64) -> Option<f64> {
        let near = (self.continuity == Continuity::Tangent).then_some(NEAR * length);
        self.tolerance.or(near)
    }
}

/// The outline of a surface: a closed loop of curves, and others around its holes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outline {
    /// Curves, each followed by the next, the last one by the first.
    pub outer: Vec<Use>,
    /// Around each hole.
    pub inner: Vec<Vec<Use>>,
}

impl Outline {
    /// Its loops, the outer one first.
    pub fn rings(&self) -> impl Iterator<Item = &Vec<Use>> + Clone {
        std::iter::once(&self.outer).chain(&self.inner)
    }

    /// The same, to be changed.
    pub(super) fn rings_mut(&mut self) -> impl Iterator<Item = &mut Vec<Use>> {
        std::iter::once(&mut self.outer).chain(&mut self.inner)
    }
}

impl From<&Loop> for Outline {
    fn from(from: &Loop) -> Self {
        Self { outer: from.uses.clone(), inner: Vec::new() }
    }
}

impl From<&Face> for Outline {
    fn from(from: &Face) -> Self {
        Self { outer: from.outer.clone(), inner: from.inner.clone() }
    }
}
