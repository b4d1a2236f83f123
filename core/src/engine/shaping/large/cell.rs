//! The triangles of one cell, and all that reach into it, as a mesh that is simplified by itself.
//!
//! A cell is a half-open box. Triangles with all corners in it are its own, and stay within it, so that those of different cells have nothing in
//! common: not even a point. All others stay as they are; own ones do not cross them.

use crate::engine::mesh::Mesh;
use crate::io::record::Record;
use crate::simplify::{self, Ended, Input, Options};
use crate::stream::plan::{ChunkId, Plan};
use crate::stream::source::{Seen, Source, Triangle};

use super::super::change::encoded;

/// A cell before it is simplified.
pub(super) struct Cell {
    within: [[f32; 3]; 2],
    numbers: Vec<u32>,
    corners: Vec<[[f32; 3]; 3]>,
    /// Which of them are its own.
    is_own: Vec<bool>,
}

/// A cell after that.
#[derive(Default)]
pub(super) struct Made {
    /// Numbers of triangles that are gone.
    pub(super) gone: Vec<u32>,
    pub(super) added: Vec<Record>,
    /// Bounds of the distance both ways.
    pub(super) proved: [f64; 2],
    /// The change of the volume.
    pub(super) volume: f64,
    pub(super) ended: Ended,
}

impl Cell {
    /// Of the triangles that a chunk of a plan sees.
    pub(super) fn new(plan: &Plan, chunk: ChunkId, seen: [&Seen<'_>; 2]) -> Self {
        let mut cell =
            Self { within: plan.home_box(chunk).half_open(), numbers: Vec::new(), corners: Vec::new(), is_own: Vec::new() };
        for source in seen {
            source.for_each(|number, triangle| {
                let corners = triangle.corners();
                cell.numbers.push(number);
                cell.is_own.push(corners.iter().all(|p| plan.home(*p) == chunk));
                cell.corners.push(corners);
            });
        }
        cell
    }

    /// With so many of its own triangles left, if a count is wanted. What cannot be simplified stays.
    pub(super) fn simplified(self, left: Option<usize>, options: &Options) -> Made {
        let own = self.is_own.iter().filter(|is_own| **is_own).count();
        if own == 0 || left.is_some_and(|left| left >= own) {
            return Made { ended: Ended::Count, ..Made::default() };
        }
        let Ok(mesh) = Mesh::from_triangles(&self.corners) else { return Made::default() };
        let others = self.corners.len() - own;
        let input = Input {
            points: mesh.vertices(),
            faces: mesh.faces(),
            region: Some(&self.is_own),
            fixed: None,
            within: Some(self.within),
        };
        let options = Options { triangles: left.map(|left| left + others), ..*options };
        let Ok(outcome) = simplify::simplify(&input, &options) else { return Made::default() };
        let mut stays = vec![false; self.numbers.len()];
        outcome.origins.iter().for_each(|f| stays.iter_mut().skip(*f as usize).take(1).for_each(|stays| *stays = true));
        let gone = self.numbers.iter().zip(stays).filter(|(_, stays)| !stays).map(|(number, _)| *number).collect();
        let place = |vertex: u32| outcome.points.get(vertex as usize).copied().unwrap_or_default();
        let new = outcome.faces.iter().zip(&outcome.origins).filter(|(_, origin)| **origin == u32::MAX);
        let proved = outcome.proved.unwrap_or_default();
        Made {
            gone,
            added: encoded(new.map(|(face, _)| face.map(place))),
            proved: [proved.forward, proved.backward],
            volume: outcome.volume[1] - outcome.volume[0],
            ended: outcome.ended,
        }
    }
}
