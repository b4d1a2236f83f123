//! Memory of motions from block to block: cycles, splines, cutter compensation.

use super::offset_curve::Piece;
use crate::toolpath::model::Kind;
use crate::toolpath::vector::Point;

/// Heights that later lines of a cycle need not repeat, in millimetres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sticky {
    /// The initial level.
    pub(super) initial: Option<f64>,
    pub(super) depth: Option<f64>,
    pub(super) r: Option<f64>,
    pub(super) q: Option<f64>,
}

/// A curve that is being told.
#[derive(Debug, Default)]
pub(super) struct Spline {
    pub(super) points: Vec<(Point, f64)>,
    pub(super) knots: Vec<f64>,
    pub(super) order: usize,
    pub(super) is_knotted: bool,
    /// How the last `G5` ended: from its end to its second control point.
    pub(super) last: Option<Point>,
}

impl Spline {
    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty() && self.last.is_none()
    }
}

/// A programmed move that waits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    /// `None` if it goes along the normal of the plane alone.
    pub(super) piece: Option<Piece>,
    pub(super) height: f64,
    pub(super) kind: Kind,
    pub(super) line: u64,
    pub(super) feed: f64,
}

/// Compensation in force.
#[derive(Clone, Debug)]
pub(super) struct Compensation {
    /// Distance to the left, in millimetres.
    pub(super) side: f64,
    pub(super) waiting: Vec<Waiting>,
}
