//! The tree itself.

use super::split::{Share, Way};

/// The paint of a triangle. All numbers of it are relative to that triangle, whose corners have an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Paint {
    /// All of it has this state; 0 is unpainted.
    Uniform(u32),
    /// It is split.
    Split(Box<Split>),
}

/// A triangle that is split at the middles of its sides.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Split {
    pub(super) way: Way,
    /// The corner from which the others are counted: 0 to 2.
    pub(super) first: u8,
    /// As many as `way` makes, in its order.
    pub(super) children: Vec<Paint>,
}

impl Paint {
    /// A triangle of one state.
    pub(crate) fn uniform(state: u32) -> Self {
        Self::Uniform(state)
    }

    pub(super) fn split(way: Way, first: u8, children: Vec<Paint>) -> Self {
        Self::Split(Box::new(Split { way, first, children }))
    }
}

impl Split {
    /// Children with their corners and their shares, in a triangle of these corners and this share.
    pub(super) fn parts<const N: usize>(
        &self,
        corners: [[f64; N]; 3],
        share: Share,
    ) -> impl Iterator<Item = (&Paint, [[f64; N]; 3], Share)> {
        let corners = self.way.corners(self.first, corners);
        self.children.iter().zip(corners).zip(self.way.halvings()).map(move |((child, at), n)| (child, at, share.halved(*n)))
    }
}
