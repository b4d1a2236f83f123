//! How a removal is tried.

/// How a removal is tried.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trial {
    /// Flat faces are made anew as a whole.
    pub(crate) is_anew: bool,
    /// Edges that are there already: a point divides them.
    pub(crate) avoided: Vec<(u32, u32)>,
}
