//! A drilling cycle.

/// A cycle in force, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cycle {
    /// Below the point, along the tool's axis.
    pub(super) depth: f64,
    /// Above the point, where drilling begins.
    pub(super) clear: f64,
    /// Above the point, where the tool returns to.
    pub(super) back: f64,
    /// Whether it goes back at its feed: tapping and boring.
    pub(super) is_slow: bool,
}
