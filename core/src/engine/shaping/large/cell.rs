//! The triangles of one cell, and all that reach into it, as a mesh that is simplified by itself.
//!
//! A cell is a half-open box. Triangles with all corners in it are its own, and stay within it, so that those of different cells have nothing in
//! common: not even a point. All others stay as they are; own ones do not cross them.

use crate::engine::mesh::Mesh;
use crate::io::record::Record;
use crate::simplify::{self, Ended, Input, Options};
use crate::stream::plan::Plan;

use super::super::change::encoded;

/// A cell before it is simplified.
pub(super) struct Cell<'a> {
    within: [[f32; 3]; 2],
    /// The earlier pass of which this cell is along a seam. Only corners of triangles that go across one of its planes may move then: of all others that pass
    /// left as few as are wanted, and the surface that they stand for is not known any more.
    along: Option<&'a Plan>,
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
    /// How many more triangles are left than were wanted.
    pub(super) missed: usize,
}

impl<'a> Cell<'a> {
    /// A half-open box in which nothing is yet, along a seam of an earlier pass if it is one, with room for so many triangles.
    pub(super) fn new(within: [[f32; 3]; 2], along: Option<&'a Plan>, room: usize) -> Self {
        Self {
            within,
            along,
            numbers: Vec::with_capacity(room),
            corners: Vec::with_capacity(room),
            is_own: Vec::with_capacity(room),
        }
    }

    /// Adds a triangle that reaches into it.
    #[inline]
    pub(super) fn add(&mut self, number: u32, corners: [[f32; 3]; 3]) {
        let [lo, hi] = self.within;
        self.numbers.push(number);
        self.corners.push(corners);
        self.is_own.push(corners.iter().all(|p| (0..3).all(|k| lo[k] <= p[k] && p[k] < hi[k])));
    }

    /// With so many of its own triangles left, if a count is wanted. What cannot be simplified stays.
    pub(super) fn simplified(self, left: Option<usize>, options: &Options) -> Made {
        let own = self.is_own.iter().filter(|is_own| **is_own).count();
        if own == 0 || left.is_some_and(|left| left >= own) {
            return Made { ended: Ended::Count, ..Made::default() };
        }
        let unchanged = Made { missed: left.map_or(0, |left| own - left), ..Made::default() };
        let Ok(mesh) = Mesh::from_triangles(&self.corners) else { return unchanged };
        let others = self.corners.len() - own;
        let fixed = self.along.map(|plan| {
            let mut fixed = vec![true; mesh.vertices().len()];
            let across = mesh.faces().iter().zip(&self.corners).filter(|(_, corners)| plan.home_of_all(**corners).is_none());
            across.flat_map(|(face, _)| face).for_each(|v| fixed[*v as usize] = false);
            fixed
        });
        let input = Input {
            points: mesh.vertices(),
            faces: mesh.faces(),
            region: Some(&self.is_own),
            fixed: fixed.as_deref(),
            within: Some(self.within),
        };
        let options = Options { triangles: left.map(|left| left + others), ..*options };
        let Ok(outcome) = simplify::simplify(&input, &options) else { return unchanged };
        let mut stays = vec![false; self.numbers.len()];
        outcome.origins.iter().for_each(|f| stays.iter_mut().skip(*f as usize).take(1).for_each(|stays| *stays = true));
        let gone = self.numbers.iter().zip(stays).filter(|(_, stays)| !stays).map(|(number, _)| *number).collect();
        let place = |vertex: u32| outcome.points.get(vertex as usize).copied().unwrap_or_default();
        let new = outcome.faces.iter().zip(&outcome.origins).filter(|(_, origin)| **origin == u32::MAX);
        let proved = outcome.proved.unwrap_or_default();
        Made {
            gone,
            missed: left.map_or(0, |left| outcome.faces.len().saturating_sub(left + others)),
            added: encoded(new.map(|(face, _)| face.map(place))),
            proved: [proved.forward, proved.backward],
            volume: outcome.volume[1] - outcome.volume[0],
            ended: outcome.ended,
        }
    }
}
