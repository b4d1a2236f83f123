//! Surfaces of an outline that are made once, however often its curves are divided.

use std::sync::OnceLock;

use super::coons::Coons;
use crate::curves::elementary::{Elementary, Told};

/// A Coons surface.
#[derive(Debug)]
pub(super) struct Sided {
    pub(super) coons: Coons,
    /// The lengths of its sides.
    pub(super) lengths: Vec<f64>,
    /// The longest edge that it allows.
    pub(super) longest: f64,
}

/// Coons surfaces of an outline that do not fold.
#[derive(Debug, Default)]
pub(super) struct Unfolded {
    pub(super) all: Vec<Sided>,
    /// Whether one of those that were made folds.
    pub(super) is_folded: bool,
}

/// Surfaces of an outline that do not depend on how its curves are divided, made when they are first asked for.
#[derive(Debug, Default)]
pub(super) struct Tried {
    /// The one that the outline's file says.
    pub(super) told: Option<Told>,
    pub(super) plane: OnceLock<Option<Elementary>>,
    pub(super) carriers: OnceLock<Vec<Elementary>>,
    /// Carriers that circles and straight lines of the outline fix.
    pub(super) implied: OnceLock<Vec<Elementary>>,
    pub(super) coons: OnceLock<Unfolded>,
}
