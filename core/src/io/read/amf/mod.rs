//! AMF: a mesh in XML.
//!
//! **In:** the text of an AMF, wherever it lies.
//! **Out:** the triangles of all objects as one mesh, in the document's order.
//! **Promise:** positions are the nearest `f32` of the decimals, or of their place in a constellation; the same records for any number of threads.
//!
//! Form: ISO/ASTM 52915:2020, "Specification for additive manufacturing file format (AMF) Version 1.2". XML is read as in `xml`, in UTF-8.
//!
//! * **Placed** (section 11, "Constellations"): the objects and constellations of the top level are to be printed, that is, those that no
//!   constellation names; an object that one names is there as its instances only. An instance is turned around x, then y, then z, then shifted, as it
//!   was defined; constellations hold constellations, but none itself.
//! * Angles are degrees. Slic3r and its descendants write radians, and scale or mirror instances besides: their files are read as they are meant.
//! * Normals and edges, which bend triangles, are not read: triangles are flat, as all common readers take them. Colours, materials, textures and metadata are passed over.
//! * The unit scales nothing.
//!
//! Vertices and triangles are read once, into spools (`intake`, in stretches of children, plain ones fast); where they are placed is known at the
//! document's end, and then they become records (`placed`).

mod constellation;
mod document;
mod intake;
mod placed;
mod placement;
mod plain;
mod stretch;
#[cfg(test)]
mod tests;
mod xml;

use super::binary;
use super::finding::{Finding, Loss, Rejection};
use super::limits::most_copies;
use super::number::COMMA;
use super::parsed::{Besides, Parsed, Part};
use super::spool::Context;
use crate::contract::error::Result;
use crate::util::legible::in_one_line;
use crate::util::words::{Count, Counted};
use constellation::Names;
use document::{Document, LONGEST_NAME};
use intake::Intake;
use placed::{PartOf, Placed};
use stretch::Notes;
use xml::{Token, Tokens};

/// Names of objects that are told.
const SHOWN: usize = 5;

/// Is this a text whose root is `amf`, after a byte order mark, blanks, comments and declarations?
pub(super) fn is_amf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if !text.starts_with(b"<") {
        return false;
    }
    let mut tokens = Tokens::from(text, 0, 0);
    loop {
        match tokens.next() {
            Ok(Some(Token::Start(tag))) => return tag.name == b"amf",
            Ok(Some(Token::Aside)) => {}
            Ok(Some(Token::Text(blank))) if blank.trim_ascii().is_empty() => {}
            // A document type is named after the root; it is refused in its own words.
            _ => {
                let rest = text.get(tokens.at()..).unwrap_or_default();
                return rest.strip_prefix(b"<!DOCTYPE").is_some_and(|rest| rest.trim_ascii_start().starts_with(b"amf"));
            }
        }
    }
}

/// Reads the text of an AMF, which stands in a file of so many bytes.
///
/// # Errors
/// [`crate::contract::error::Error::Unreadable`] for what is no XML, holds no triangle, or places objects without end; those of the context.
pub(super) fn read(text: &[u8], bytes: usize, context: &Context<'_>) -> Result<Parsed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    let encoding = encoding(text).map_err(reject)?;
    context.make_room(text.len() as u64, "the triangles of the text")?;
    let mut intake = Intake::new(context)?;
    let document = Document::read(text, context, &mut intake)?;
    let Intake { positions, indices, notes, .. } = intake;
    notes.judge().map_err(reject)?;
    let (positions, indices) = (positions.map()?, indices.map()?);
    let names = Names::of(&document);
    let steps = (text.len() as u64, intake::expected_steps(text));
    let placed = placed::place((&document, &names), (&positions, &indices), (steps, most_copies(bytes)), context)?;
    placed.tally.judge().map_err(reject)?;
    if placed.records.all().is_empty() {
        let cut_off = || Rejection::Unreadable("cut off before its first triangle".into());
        return Err(reject(if document.cut_off { cut_off() } else { binary::no_triangles() }));
    }
    let behind = text.get(document.end..).unwrap_or_default();
    let mut findings: Vec<Finding> = encoding.into_iter().collect();
    findings.extend(of_text(&document, &notes, behind));
    findings.extend(placed.tally.findings());
    findings.extend(of_placement(&document, &names, &placed));
    let name = if document.name.is_empty() { &document.name_of_object } else { &document.name };
    let header = binary::header_of(name);
    // What is left of a file may be half a mesh: then nobody knows what belongs together.
    let is_whole = findings.iter().all(|finding| finding.loss == Loss::None);
    let parts = if is_whole || !placed.several { parts(&document, &placed.parts) } else { Vec::new() };
    let united = parts.is_empty() && placed.several;
    let parts = if parts.iter().all(|part| part.name.is_empty()) && !placed.several { Vec::new() } else { parts };
    findings.extend(of_objects(&document, &placed, united));
    let (records, rounding) = (placed.records, placed.rounding.if_any());
    // Colours of the file, of objects, volumes, vertices and triangles count for one another: nobody knows whose they are.
    let is_coloured = document.is_coloured || notes.colours > 0;
    let coloured = if is_coloured { records.all().len() as u64 } else { 0 };
    let (unit, title, doubt) =
        (unit_of(&document), title(&document.name), doubt(united, notes.roles + document.supports, unit_of(&document)));
    let besides = Besides { unit, title, coloured, parts, doubt, ..Besides::default() };
    Ok(Parsed { records, findings, header, rounding, besides })
}

/// Why somebody should look at a repair of such a file.
fn doubt(united: bool, roles: u64, unit: Option<&str>) -> Option<&'static str> {
    if unit.is_none() {
        return Some("its unit is none that AMF has: the result says millimetres");
    }
    match (united, roles) {
        (_, 1..) => Some("modifiers, negative volumes or supports become parts of the model: no result keeps their roles"),
        (true, 0) => Some("its objects could not be repaired one by one: two that touch may be one body now"),
        (false, 0) => None,
    }
}

/// The meshes of a file by their names.
fn parts(document: &Document, parts: &[PartOf]) -> Vec<Part> {
    let named = |part: &PartOf| {
        let own = document.titles.get(part.object).map(|name| title(name)).unwrap_or_default();
        let volumes = document.meshes(part.object).iter().filter(|mesh| !mesh.indices.is_empty()).count();
        let of_volume = document.volume_of(part.object, part.mesh).map(title);
        let name = match of_volume {
            Some(name) if volumes > 1 => format!("{own} {name}"),
            Some(name) if own.is_empty() => name,
            None if volumes > 1 => format!("{own} volume {}", part.mesh + 1),
            _ => own,
        };
        // No longer than what is read of a name, so that a result is read back as it is written.
        let name = name.get(..name.floor_char_boundary(LONGEST_NAME)).unwrap_or_default();
        Part { name: name.trim().into(), triangles: part.triangles.clone() }
    };
    parts.iter().map(named).collect()
}

/// The name of the unit, if it is one of AMF's.
fn unit_of(document: &Document) -> Option<&'static str> {
    let unit = document.unit.as_deref().unwrap_or(b"millimeter").trim_ascii();
    let known = [
        ("millimeter", "millimeter"),
        ("inch", "inch"),
        ("feet", "feet"),
        ("foot", "feet"),
        ("meter", "meter"),
        ("micron", "micron"),
    ];
    known.into_iter().find(|(name, _)| name.as_bytes().eq_ignore_ascii_case(unit)).map(|(_, unit)| unit)
}

/// What is odd about the declared encoding; a refusal of one that does not hold ASCII as it is.
fn encoding(text: &[u8]) -> std::result::Result<Option<Finding>, Rejection> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text).trim_ascii_start();
    let end = memchr::memmem::find(text.get(..1024).unwrap_or(text), b"?>").filter(|_| text.starts_with(b"<?xml"));
    let declaration = end.and_then(|end| text.get(..end)).unwrap_or_default();
    let Some(at) = memchr::memmem::find(declaration, b"encoding") else { return Ok(None) };
    let is_part = |byte: &&u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.' | b':');
    let behind = declaration.get(at + b"encoding".len()..).unwrap_or_default().iter();
    let name: String =
        behind.skip_while(|byte| !is_part(byte)).take_while(is_part).take(40).map(|&byte| char::from(byte)).collect();
    let known = name.to_ascii_lowercase();
    match known.as_str() {
        "utf-8" | "utf8" | "us-ascii" | "ascii" => Ok(None),
        // Whatever they make of other letters, numbers and tags are the same.
        _ if ["iso-8859-", "windows-125", "latin"].iter().any(|begin| known.starts_with(begin)) => {
            Ok(Some(Finding::flaw(format!("in the encoding {name}, not UTF-8"))))
        }
        _ => Err(Rejection::Unreadable(format!("XML in the encoding {name}, not UTF-8"))),
    }
}

/// What is odd about the text.
fn of_text(document: &Document, notes: &Notes, behind: &[u8]) -> Vec<Finding> {
    let mut found = Vec::new();
    if document.cut_off {
        found.push(Finding { loss: Loss::Certain, ..Finding::flaw("cut off before </amf>; what is complete was read") });
    }
    let behind = behind.trim_ascii();
    if !document.cut_off && !behind.is_empty() && !behind.starts_with(b"<!--") {
        found.push(Finding::flaw(format!("{} behind </amf>, ignored", Counted(behind.len() as u64, "byte", "bytes"))));
    }
    match (document.unit.as_deref(), unit_of(document)) {
        (None, _) | (_, Some("millimeter")) => {}
        (_, Some(unit)) => found.push(harmless(format!("unit {unit}"))),
        (Some(unit), None) => found.push(Finding::flaw(format!("a unit that AMF does not have: {}", shown(unit)))),
    }
    if notes.separators == COMMA {
        found.push(Finding::flaw("decimal commas, read as points"));
    }
    if notes.damaged > 0 {
        let vertices = Counted(notes.damaged, "vertex", "vertices");
        let first = Count(notes.first_damage.unwrap_or_default());
        found.push(Finding::flaw(format!(
            "{vertices} with a coordinate that is no number, read as NaN; the first at byte {first}"
        )));
    }
    if notes.normals + notes.edges > 0 {
        let (normals, edges) = (Counted(notes.normals, "normal", "normals"), Counted(notes.edges, "edge", "edges"));
        found.push(harmless(format!("triangles curved by {normals} and {edges}, read flat")));
    }
    if notes.roles > 0 {
        let volumes = Counted(notes.roles, "volume is a modifier", "volumes are modifiers");
        found.push(harmless(format!("{volumes}, negative or support to a slicer, read as mesh")));
    }
    if document.metadata + notes.metadata > 0 {
        let entries = Counted(document.metadata + notes.metadata, "entry", "entries");
        found.push(harmless(format!("{entries} of metadata besides names, which stay in a copy alone")));
    }
    if document.supports > 0 {
        let volumes = Counted(document.supports, "volume", "volumes");
        found.push(harmless(format!("{volumes} of support material, read as mesh")));
    }
    found
}

/// What is told of objects and where they are placed.
fn of_placement(document: &Document, names: &Names, placed: &Placed) -> Vec<Finding> {
    let mut found = Vec::new();
    if names.lost > 0 {
        let instances = Counted(names.lost, "instance", "instances");
        found.push(Finding::loss(format!("{instances} of objects that are not there, left out")));
    }
    if names.taken > 0 {
        let objects = Counted(names.taken, "object or constellation", "objects or constellations");
        found.push(Finding::flaw(format!("{objects} with the id of an earlier one, which instances mean")));
    }
    if document.odd_placements > 0 {
        let numbers = Counted(document.odd_placements, "shift, angle or scale", "shifts, angles or scales");
        found.push(Finding::flaw(format!("{numbers} of instances that are no numbers, left out")));
    }
    if document.scaled > 0 {
        let instances = Counted(document.scaled, "instance", "instances");
        found.push(harmless(format!("{instances} scaled or mirrored, in Slic3r's way")));
    }
    if document.constellations() > 0 {
        let (instances, objects) =
            (Counted(document.instances.len() as u64, "instance", "instances"), Counted(placed.objects, "object", "objects"));
        let constellations = Counted(document.constellations() as u64, "constellation", "constellations");
        let angles = if document.radians { ", angles in radians" } else { "" };
        found.push(harmless(format!("{constellations} of {instances}: {objects} placed{angles}")));
    }
    found
}

/// The objects of a file of several meshes. `united`: they are read as one.
fn of_objects(document: &Document, placed: &Placed, united: bool) -> Option<Finding> {
    let holding = |object: &usize| document.meshes(*object).iter().any(|mesh| !mesh.indices.is_empty());
    let all = (0..document.objects.len()).filter(holding).count();
    let names: Vec<_> = document.names.iter().take(SHOWN).map(|name| shown(name)).collect();
    let more = if document.objects.len() > SHOWN { ", …" } else { "" };
    let end = if united { ": their meshes are read as one" } else { "" };
    let objects = Counted(all as u64, "object", "objects");
    (united || all > 1 && placed.several).then(|| harmless(format!("{objects} ({}{more}){end}", names.join(", "))))
}

fn harmless(text: String) -> Finding {
    Finding { harmless: true, ..Finding::flaw(text) }
}

/// A name as a result has it, without control characters. Bytes that are no UTF-8 are of Latin-1, as old programs write.
fn title(text: &[u8]) -> String {
    let text = String::from_utf8(text.to_vec()).unwrap_or_else(|_| text.iter().map(|byte| char::from(*byte)).collect());
    in_one_line(&text)
}

/// Text of a file for people: short, and without control characters.
fn shown(text: &[u8]) -> String {
    String::from_utf8_lossy(text).chars().take(40).map(|c| if c.is_control() { '?' } else { c }).collect()
}
