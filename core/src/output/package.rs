//! A new 3MF package around the text of one model.
//!
//! **In:** the unit, and the text of vertices and triangles, piece by piece.
//! **Out:** a package of three parts: content types, relationships, the model, each object of which is built once where it is.
//! **Promise:** the same bytes for any memory, any threads, any time and any name of the file.
//!
//! By the 3MF Core Specification 1.3, chapters 2 to 4, and the Open Packaging Conventions (ECMA-376, part 2). A single object has no name: slicers call it by
//! the name of the file then, which the engine does not know (a hot folder's result may be renamed, and used for another file of the same content).

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::output::archive::{self, Part, Sink};

const CONTENT_TYPES: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\n\
    <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\n\
    <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\n</Types>\n";
const RELATIONSHIPS: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\n\
    <Relationship Id=\"rel0\" Target=\"/3D/3dmodel.model\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\n\
    </Relationships>\n";
const NAMESPACE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";

/// Between vertices and triangles.
pub(super) const BETWEEN: &str = "</vertices>\n<triangles>\n";
/// Behind the triangles of an object.
pub(super) const OBJECT_END: &str = "</triangles>\n</mesh>\n</object>\n";

/// Before the first object. `application`: the program that wrote it.
pub(super) fn head(unit: &str, application: &str, title: &str) -> String {
    let title = if title.is_empty() { String::new() } else { format!("<metadata name=\"Title\">{title}</metadata>\n") };
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{unit}\" xml:lang=\"en-US\" xmlns=\"{NAMESPACE}\">\n\
         {title}<metadata name=\"Application\">{application}</metadata>\n<resources>\n"
    )
}

/// Before the vertices of the object of this number, from 0; it may have no name.
pub(super) fn object(number: usize, name: &str) -> String {
    let name = if name.is_empty() { String::new() } else { format!(" name=\"{name}\"") };
    format!("<object id=\"{}\" type=\"model\"{name}>\n<mesh>\n<vertices>\n", number + 1)
}

/// Behind the last of so many objects.
pub(super) fn tail(objects: usize) -> String {
    let items: String = (1..=objects).map(|id| format!("<item objectid=\"{id}\"/>\n")).collect();
    format!("</resources>\n<build>\n{items}</build>\n</model>\n")
}

/// Writes a package to the new file `output`, and syncs it unless that is deferred. `fill` gives the text of the model, of so many bytes at most. Call it
/// within a pool of threads.
///
/// # Errors
/// [`crate::Error::Io`], cancellation among them, and those of `fill`.
pub(super) fn write(
    output: &Path,
    most: u64,
    fill: impl FnOnce(&mut Sink<'_>) -> Result<()> + Send,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let small = |name, text: &'static str| Part {
        name,
        most: text.len() as u64,
        fill: Box::new(move |sink: &mut Sink<'_>| sink(text.as_bytes())),
    };
    let model = Part { name: "3D/3dmodel.model", most, fill: Box::new(fill) };
    let parts = vec![small("[Content_Types].xml", CONTENT_TYPES), small("_rels/.rels", RELATIONSHIPS), model];
    archive::write_new(parts, output, limits, progress)
}
