//! Suture's engine: it reads a triangle soup, builds its topology in star-complete chunks, repairs what is broken as a sparse
//! edit against the original, writes the result once and judges the written bytes.
//!
//! It knows no daemon and no store. For files there are [`inspect`] and [`repair`], out of core; for meshes in memory [`inspect_mesh`] and
//! [`repair_mesh`], and the single steps in [`operations`].
//!
//! - [`Profile`] says what a repair may do, [`Limits`] what it may spend. The result depends on the profile alone.
//! - A [`Progress`] is told where the work stands, and can end it ([`Error::is_cancellation`]).
//! - **Panics:** no function of this crate panics, whatever the bytes of a file, the numbers of a mesh, or the settings. Where a library
//!   below panics for want of memory, the error is [`Error::Starved`]. Property tests and ten minutes of random inputs for each function
//!   hold this; a panic is a defect to be reported. A panic of the caller's [`Progress`] goes through.

#![deny(missing_docs)]
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod algorithms;
mod attributes;
mod contract;
pub mod curves;
mod defeature;
mod detect;
mod diagnosis;
mod engine;
#[cfg(test)]
mod extremes;
mod geometry;
#[cfg(any(test, feature = "internals"))]
#[doc(hidden)]
pub mod internals;
mod io;
mod output;
mod proof;
mod repairs;
pub mod residue;
mod simplify;
mod smooth;
mod stream;
mod submesh;
#[cfg(test)]
mod testing;
pub mod toolpath;
mod topology;
mod util;

pub use contract::access::Access;
pub use contract::builder::ProfileBuilder;
pub use contract::error::{Error, ErrorClass};
pub use contract::progress::{Progress, Quiet};
pub use contract::ranges::ProfileError;
pub use contract::report::{FaceOrigin, RepairName, Report};
pub use contract::residue_settings::ResidueSettings;
pub use contract::settings::{
    Bodies, Guarantee, Hollow, KeepAttributes, Limits, OutputFormat, PatchShape, Profile, Sheets, Spill,
};
pub use contract::{error, report, settings};
pub use detect::fidelity::{FIDELITY_RULES, FidelityRule};
pub use detect::rules::{RULES, Rule};
pub use engine::curve_mesh::CurveMesh;
pub use engine::memory::RepairedMesh;
pub use engine::mesh::{Mesh, MeshError, MeshView};
pub use engine::operations;
pub use io::read::ends_in_zeros;
pub use io::{read, record};
pub use util::words;

use std::path::Path;

/// Diagnoses the file `input` and writes nothing.
///
/// O(n log n) in its triangles, within the memory of `limits` whatever the file's size.
///
/// # Errors
/// [`Error`]; nothing was written in any case.
pub fn inspect(input: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> error::Result<Report> {
    engine::entry::inspect(input, profile, limits, progress).map_err(|error| error.of_work_on(input))
}

/// Repairs the file `input` into `output`, which must not exist: the caller owns a temporary name and publishes it. (Or it is an empty file
/// without a name, which the caller holds open and knows by its path below `/proc`; then [`Limits::spool`] says where there is room.)
/// The output is synced to disk before this returns, unless [`Limits::defer_sync`] says otherwise. A file that is good as it comes is
/// copied byte for byte. Where the report has no [`Report::output`], nothing is to be published: no triangle was left, or the file is not good and
/// the profile repairs nothing ([`Profile::repair`]; then nothing was written).
///
/// # Errors
/// [`Error`]; what then stands at `output` is incomplete and to be removed.
pub fn repair(input: &Path, output: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> error::Result<Report> {
    engine::entry::repair(input, output, profile, limits, progress).map_err(|error| error.of_work_on(input))
}

/// Writes the mesh of outlines of curves that were filled (`curves::fill`) to the new file `output`, in this format and in millimetres, of which there are so many in
/// the unit of the curves; `name` is what errors call it. An outline that no surface fits is closed as a hole of a mesh is, where that is possible. The file is
/// read back and judged.
///
/// O(n log n) in its triangles, which are in memory.
///
/// # Errors
/// [`Error`]; what then stands at `output` is incomplete and to be removed.
pub fn write_curve_mesh(
    (name, filled, millimetres): (&Path, &curves::fill::Filled, f64),
    (output, format): (&Path, OutputFormat),
    limits: &Limits,
    progress: &dyn Progress,
) -> error::Result<CurveMesh> {
    engine::curve_mesh::write((name, filled, millimetres), (output, format), limits, progress)
}

/// Writes the triangles of the file `input` to the new file `output` in this format, and changes nothing of them; the written file is read back and
/// compared. A file that has the format already is copied byte for byte.
///
/// O(n) in its triangles, within the memory of `limits`.
///
/// # Errors
/// [`Error`]; what then stands at `output` is incomplete and to be removed.
pub fn convert(
    input: &Path,
    output: &Path,
    format: OutputFormat,
    limits: &Limits,
    progress: &dyn Progress,
) -> error::Result<report::Converted> {
    engine::formats::convert(input, output, format, limits, progress)
}

/// Diagnoses a mesh in memory.
///
/// ```
/// use suture_core::{Limits, Mesh, Profile, Quiet, inspect_mesh};
///
/// let mesh = Mesh::from_triangles(&[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])?;
/// let report = inspect_mesh(&mesh, &Profile::default(), &Limits::default(), &Quiet)?;
/// assert!(!report.verdict.good);
/// assert_eq!(report.before.boundary_edges, 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error`], but for those of reading and writing files. A mesh without faces is [`Error::Unreadable`].
pub fn inspect_mesh<'m>(
    mesh: impl Into<MeshView<'m>>,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> error::Result<Report> {
    engine::memory::inspect(mesh.into(), profile, limits, progress)
}

/// Repairs a mesh in memory. Its faces become those that [`repair`] writes for a file of the same triangles, in the same order; each has an
/// origin.
///
/// The memory of `limits` is what the engine needs beside the mesh, 50 bytes a face, and the result.
///
/// ```
/// use suture_core::{FaceOrigin, Limits, Mesh, Profile, Quiet, RepairName, repair_mesh};
///
/// // A tetrahedron without its last face.
/// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let open = Mesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2]])?;
/// let repaired = repair_mesh(&open, &Profile::default(), &Limits::default(), &Quiet)?;
/// assert!(repaired.report.verdict.good);
/// assert_eq!(repaired.mesh.faces().len(), 4);
/// assert_eq!(repaired.origins[2], FaceOrigin::Input(2));
/// assert_eq!(repaired.origins[3], FaceOrigin::Repair(RepairName::Fill));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error`], but for those of reading and writing files. A mesh without faces is [`Error::Unreadable`].
pub fn repair_mesh<'m>(
    mesh: impl Into<MeshView<'m>>,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> error::Result<RepairedMesh> {
    engine::memory_making::repair(mesh.into(), profile, limits, progress)
}
