//! Why a body is not written.

/// Why something is no body. Numbers count from 0, in the order of the body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A body without faces.
    #[error("no face")]
    Empty,
    /// The unit or the tolerance is no length above 0.
    #[error("unit and tolerance must be lengths above 0")]
    Measure,
    /// A vertex that is not finite.
    #[error("vertex {0} is not finite")]
    Vertex(usize),
    /// An edge whose ends are no vertices, or whose curve does not end within the tolerance of them.
    #[error("edge {edge}: {problem}")]
    Edge {
        /// Which.
        edge: usize,
        /// The fault, in words.
        problem: &'static str,
    },
    /// A surface whose degrees, knots, points and weights do not go together.
    #[error("face {face}: {problem}")]
    Surface {
        /// Which.
        face: usize,
        /// The fault, in words.
        problem: &'static str,
    },
    /// A loop that is not closed, or has an edge that is not there.
    #[error("face {face}, loop {ring}: {problem}")]
    Loop {
        /// Which face.
        face: usize,
        /// 0 for the outer loop, then the inner ones.
        ring: usize,
        /// The fault, in words.
        problem: &'static str,
    },
}

/// Why a body is not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// It is no body. Nothing was written.
    #[error("the body cannot be written: {0}")]
    Body(#[from] BodyError),
    /// IGES has inches, miles, and metres with their usual parts, but no others. Nothing was written.
    #[error("IGES has no unit of {0} mm")]
    Unit(f64),
    /// Sections of an IGES file end at line 9 999 999. Nothing was written.
    #[error("the file would have more lines than IGES can count")]
    TooLong,
    /// The sink fails.
    #[error("writing fails")]
    Sink(#[from] std::io::Error),
}
