//! All outlines of a network of curves: the faces that its file says, or the loops that its curves form.

use super::entry::{FillError, Filled, fill, fill_told};
use super::faces;
use super::nest;
use super::options::{Options, Outline};
use crate::curves::Network;
use crate::curves::curve::Shape;
use crate::curves::loops::{self, Loops};

/// The outlines of a network, filled.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FilledNetwork {
    /// The loops of its curves; of faces that the file says, none are looked for.
    pub loops: Option<Loops>,
    /// Circles by which whole spheres and tori are divided, of which the file has none.
    pub added: Vec<Shape>,
    /// Outlines that were filled; numbers of curves are those of the network, and go on with those that close gaps or divide.
    pub outlines: Vec<Outline>,
    /// The number of the face of each; none of loops.
    pub faces: Vec<usize>,
    /// Surfaces, triangles and a report of each.
    pub filled: Filled,
    /// Numbers of the faces of which nothing is known that could be filled: no curve bounds them, and they are no whole sphere or torus.
    pub bare: Vec<usize>,
}

impl FilledNetwork {
    /// The shapes of all curves by their numbers.
    #[must_use]
    pub fn shapes<'n>(&'n self, network: &'n Network) -> Vec<&'n Shape> {
        let closing = self.loops.iter().flat_map(|loops| &loops.added);
        network.curves.iter().chain(closing).map(|curve| &curve.shape).chain(&self.added).collect()
    }
}

/// Fills the faces that a file says, where it says any and `from_faces` asks for them; else the closed loops of its curves, of which those within others of
/// their plane bound holes. As [`fill`].
///
/// # Errors
/// As [`fill`].
pub fn fill_network(
    network: &Network,
    (from_faces, how): (bool, &loops::Options),
    options: &Options,
) -> Result<FilledNetwork, FillError> {
    options.with_threads(|| all(network, (from_faces, how), options))
}

/// As [`fill_network`], with the threads that there are.
fn all(network: &Network, (from_faces, how): (bool, &loops::Options), options: &Options) -> Result<FilledNetwork, FillError> {
    if from_faces && !network.faces.is_empty() {
        let faces::Faces { outlines, origins, added, bare } = faces::outlines(network, how, options.told);
        // Of a file whose faces no curve bounds, the loops of its other curves are all that there is.
        if !outlines.is_empty() {
            let shapes: Vec<&Shape> = network.curves.iter().map(|curve| &curve.shape).chain(&added).collect();
            let filled = fill_told(&shapes, (&outlines, &origins), options)?;
            drop(shapes);
            let faces = origins.iter().map(|origin| origin.face).collect();
            return Ok(FilledNetwork { loops: None, added, outlines, faces, filled, bare });
        }
    }
    let found = loops::find(network, how);
    let shapes: Vec<&Shape> = network.curves.iter().chain(&found.added).map(|curve| &curve.shape).collect();
    let uses: Vec<_> = found.loops.iter().map(|own| own.uses.clone()).collect();
    let outlines = nest::outlines(&shapes, &uses);
    let filled = fill(&shapes, &outlines, options)?;
    drop(shapes);
    Ok(FilledNetwork { loops: Some(found), added: Vec::new(), outlines, faces: Vec::new(), filled, bare: Vec::new() })
}
