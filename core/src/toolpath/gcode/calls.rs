//! Place and calls of a running program.

use super::labels::{Label, Labels};
use crate::toolpath::lines::Place;
use std::collections::BTreeMap;

/// A call of a subprogram.
#[derive(Clone, Debug)]
pub(super) struct Call {
    pub(super) back: Place,
    /// Repetitions of `REPEAT` outside of it.
    pub(super) repeats: usize,
    /// Of `M98`: where it begins, and how often it is to be called again.
    pub(super) again: Option<(Place, u64)>,
}

/// Where the program is, and how it got there.
#[derive(Debug)]
pub(super) struct Flow {
    pub(super) labels: Labels,
    /// The line to be executed next.
    pub(super) next: Place,
    pub(super) calls: Vec<Call>,
    pub(super) repeats: Vec<(Label, u64)>,
    /// Block numbers, where they are asked for.
    pub(super) numbers: Option<BTreeMap<u64, Place>>,
}

impl Flow {
    pub(super) fn new(labels: Labels) -> Self {
        Self { labels, next: Place::START, calls: Vec::new(), repeats: Vec::new(), numbers: None }
    }
}
