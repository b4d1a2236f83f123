//! Patches that make one body of two, for a person to look at.

use super::closing::Closing;
use crate::detect::holes::loops::Loop;
use crate::repairs::shared::collisions;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::Reversed;
use crate::topology::survey::Survey;

/// What is said of two bodies that a strip was put in between.
pub(crate) fn bridged(submesh: &Submesh, rims: [&Loop; 2]) -> String {
    let first = |rim: &Loop| submesh.place(rim.vertices[0]);
    let (from, others) = (first(rims[0]), &rims[1].vertices);
    let apart = others.iter().map(|v| submesh.place(*v).distance(from)).fold(f64::INFINITY, f64::min);
    let [x, y, z] = submesh.positions[rims[0].vertices[0] as usize];
    format!(
        "two bodies were joined by a strip at ({x}, {y}, {z}), over {apart:.4}: each could also be closed by itself; see whether they were one"
    )
}

impl Closing<'_> {
    /// Says of each patch that is to be cut along another body, which its own one did not meet before, that it makes one of both.
    pub(crate) fn doubt_across(&mut self, survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed) {
        if !self.placed.iter().any(|patch| patch.to_be_cut) {
            return;
        }
        let mut patch_of = vec![None; work.triangles.len()];
        for (i, patch) in (0..).zip(&self.placed) {
            patch.triangles().for_each(|t| patch_of[t as usize] = Some(i));
        }
        let is_cut = |patch: u32| self.placed[patch as usize].to_be_cut;
        let crossed = collisions::crossed(survey, work, reversed, &patch_of, is_cut).unwrap_or_default();
        for (patch, obstacles) in crossed {
            if !is_cut(patch) || !obstacles.iter().any(|obstacle| obstacle.of_other && !obstacle.met_already) {
                continue;
            }
            let rim = self.rim(self.placed[patch as usize].rims[0]);
            let [x, y, z] = work.positions[rim.vertices[0] as usize];
            let length = rim.perimeter(work);
            self.doubts.push(format!(
                "the patch over a hole at ({x}, {y}, {z}), {length:.4} around, runs into another body, which becomes one with its own: see whether it should"
            ));
        }
    }
}
