//! Why numbers are no curve.

/// Highest degree that is read; programs for design stay below 26.
pub const HIGHEST_DEGREE: usize = 63;

/// Why numbers are no curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CurveError {
    /// A degree of 0, or one above [`HIGHEST_DEGREE`].
    #[error("degree {0} is not between 1 and {HIGHEST_DEGREE}")]
    Degree(usize),
    /// Knots must be as many as points, the degree and one together; points more than the degree.
    #[error("{points} points of degree {degree} do not go with {knots} knots")]
    Count {
        /// Control points.
        points: usize,
        /// Knots, repeated ones counted.
        knots: usize,
        /// Degree.
        degree: usize,
    },
    /// A knot is less than the one before it, or none lies between the ends of the domain.
    #[error("knots decrease or are all the same")]
    Knots,
    /// As many weights as points are needed, all above 0.
    #[error("weights are not one above 0 for each point")]
    Weights,
    /// The domain is empty, or exceeds the knots.
    #[error("the domain is empty or exceeds the knots")]
    Domain,
    /// Infinite, or no number at all.
    #[error("a number is not finite")]
    NotFinite,
    /// A circle without radius, a conic that is none, a polyline of one point.
    #[error("{0}")]
    Degenerate(&'static str),
}
