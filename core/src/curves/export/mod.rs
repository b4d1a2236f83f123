//! Surfaces to files of IGES and STEP.
//!
//! **In:** a [`Body`]: B-spline surfaces, the edges between them, and the loops that trim them. **Out:** the bytes of a file, as
//! a stream.
//! **Promise:** each number reads back as the same `f64`; the same bytes for the same body and header, as no clock is asked;
//! memory linear in the number of faces and edges, not in that of control points.
//!
//! Based on: *Initial Graphics Exchange Specification 5.3*, U.S. Product Data Association 1996; ISO 10303-21 (the text), ISO
//! 10303-42 (geometry and topology), ISO 10303-214 (the schema).

mod canonical;
mod check;
mod error;
mod iges;
mod model;
mod natural;
mod number;
mod parametric;
mod shells;
mod step;
#[cfg(test)]
mod tests;

use std::io::Write;

pub use error::{BodyError, ExportError};
pub use model::{Body, Edge, EdgeUse, Face, Header, Surface};

/// Writes a body as IGES 5.3: lines of 80 columns. Each face is a trimmed surface (144) of a B-spline surface (128); one without
/// an outer loop has the surface's own boundary. IGES says nothing of shells. O(control points); the parameters of each entity
/// are laid out twice.
///
/// # Errors
/// [`ExportError`] of a body that is none, of a unit or a length that the format does not have, and of the sink.
pub fn write_iges(body: &Body, header: &Header<'_>, sink: &mut impl Write) -> Result<(), ExportError> {
    check::check(body)?;
    iges::write(body, header, sink)
}

/// Writes a body as STEP, schema AP214: faces that hang together by their edges are a shell; one that is closed is a solid,
/// others are surface models. O(control points).
///
/// A shell within another one is a solid of its own; cavities are not told apart.
///
/// # Errors
/// [`ExportError`] of a body that is none, and of the sink.
pub fn write_step(body: &Body, header: &Header<'_>, sink: &mut impl Write) -> Result<(), ExportError> {
    check::check(body)?;
    step::write(body, header, sink)
}
