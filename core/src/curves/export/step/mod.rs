//! STEP: instances, each behind those that it refers to.

mod geometry;
mod product;
mod text;
mod topology;

use std::io::Write;

use self::text::Instances;
use super::error::ExportError;
use super::model::{Body, Header};
use super::natural::Whole;
use super::parametric;
use super::shells;

/// Writes a body.
pub(super) fn write(body: &Body, header: &Header<'_>, sink: &mut impl Write) -> Result<(), ExportError> {
    let whole = Whole::of(body, parametric::rings(body))?;
    let shells = shells::shells(&whole);
    product::header(header, sink)?;
    let mut instances = Instances::new(sink);
    let part = product::part(header, &mut instances)?;
    let context = product::context(&body.unit, body.tolerance, &mut instances)?;
    let (solids, surfaces) = topology::shells(&whole, &shells, body.tolerance, &mut instances)?;
    product::shape(part, context, &solids, &surfaces, &mut instances)?;
    writeln!(sink, "ENDSEC;\nEND-ISO-10303-21;")?;
    Ok(())
}
