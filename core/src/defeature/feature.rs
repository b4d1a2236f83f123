//! Features as they are reported.

use super::reason::Reason;
use super::vector::Point;

/// What a feature is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Kind {
    /// A hole that leads from one face to another.
    ThroughHole,
    /// A round hole with a bottom.
    BlindHole,
    /// A hole that widens in a step.
    CounterboredHole,
    /// A hole that widens in a cone.
    CountersunkHole,
    /// A hole with a round bottom.
    Dimple,
    /// A depression of any outline: engraved letters, too.
    Pocket,
    /// A depression, or an opening, of parallel sides.
    Slot,
    /// A channel that is open at its ends.
    Groove,
    /// A channel around a shaft, or around a bore.
    RingGroove,
    /// A rounded edge.
    Fillet,
    /// A bevelled edge.
    Chamfer,
    /// A protrusion of any outline: embossed letters, too.
    Boss,
}

impl Kind {
    /// Whether it is a round hole.
    pub(crate) fn is_hole(self) -> bool {
        use Kind::{BlindHole, CounterboredHole, CountersunkHole, Dimple, ThroughHole};
        matches!(self, ThroughHole | BlindHole | CounterboredHole | CountersunkHole | Dimple)
    }
}

/// Whether a feature was removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It was.
    Removed,
    /// It was not.
    Left(Reason),
}

/// A feature of a part.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Feature {
    /// What it is.
    pub(crate) kind: Kind,
    /// Its middle: of its rims, of its extents for grooves, of its edge for fillets and chamfers.
    pub(crate) centre: Point,
    /// The direction out of the part: of a hole's axis, of a boss; the edge's direction for fillets and chamfers.
    pub(crate) axis: Point,
    /// What its limit is compared with, mm: the largest diameter of holes and dimples, the width of pockets, slots, grooves and
    /// chamfers, the radius of fillets, the height of bosses.
    pub(crate) size: f64,
    /// The largest extent of its rim, mm; of grooves along their walls, of the edge for fillets and chamfers.
    pub(crate) length: f64,
    /// How far it goes down from its face, mm; of grooves from their mouth to their floor; 0 for fillets and chamfers.
    pub(crate) depth: f64,
    /// 1 where all its vertices lie on the surfaces of its kind, falling to 0 at the tolerance; times the share of its area that is
    /// no free form.
    pub(crate) confidence: f64,
    /// Numbers of its triangles in the input, rising.
    pub(crate) triangles: Vec<u32>,
    /// What was done.
    pub(crate) outcome: Outcome,
}

/// Features smaller than these are removed; `None` keeps all of that kind. Lengths in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Limits {
    /// Diameter of round holes, through or blind, and of dimples.
    pub(crate) holes_below: Option<f64>,
    /// Radius of fillets, width of chamfers.
    pub(crate) fillets_below: Option<f64>,
    /// Width of grooves, slots and pockets.
    pub(crate) grooves_below: Option<f64>,
    /// Height of bosses.
    pub(crate) bosses_below: Option<f64>,
}

impl Limits {
    /// Whether a size of a kind is below its limit.
    pub(crate) fn takes(&self, kind: Kind, size: f64) -> bool {
        let limit = match kind {
            _ if kind.is_hole() => self.holes_below,
            Kind::Pocket | Kind::Slot | Kind::Groove | Kind::RingGroove => self.grooves_below,
            Kind::Fillet | Kind::Chamfer => self.fillets_below,
            _ => self.bosses_below,
        };
        limit.is_some_and(|limit| size < limit)
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::ThroughHole => "through-hole",
            Self::BlindHole => "blind-hole",
            Self::CounterboredHole => "counterbored-hole",
            Self::CountersunkHole => "countersunk-hole",
            Self::Dimple => "dimple",
            Self::Pocket => "pocket",
            Self::Slot => "slot",
            Self::Groove => "groove",
            Self::RingGroove => "ring-groove",
            Self::Fillet => "fillet",
            Self::Chamfer => "chamfer",
            Self::Boss => "boss",
        })
    }
}
