//! Volumes of slicers' projects: stretches of an object's triangles that are bodies of their own.
//!
//! PrusaSlicer's stand in `Metadata/Slic3r_PE_model.config`, or a part of another name: a `<volume firstid= lastid=>` for each, within the `<object id=>` (PrusaSlicer's
//! `src/libslic3r/Format/3mf.cpp`, `_add_model_config_file_to_archive`). A volume is a part of the model or something that only tells the slicer
//! where settings hold (`volume_type`, in old files `modifier`). Slic3r 1.3 writes them behind the triangles of the mesh: `<slic3r:volume ts= te= modifier=>`
//! (its `xs/src/libslic3r/IO/TMF.cpp`, `TMFEditor::write_object`).

use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::super::archive::{Archive, shown};
use super::super::finding::Rejection;
use super::super::spool::Context;
use super::roles::Role;
use super::{Content, Model};
use crate::contract::error::Result;

/// The names of such parts, as PrusaSlicer, SuperSlicer and Slic3r write them; SuperSlicer writes all three.
const CONFIGS: [&str; 3] =
    ["Metadata/Slic3r_PE_model.config", "Metadata/SuperSlicer_model.config", "Metadata/Slic3r_model.config"];
/// Most volumes of a package.
const MOST_VOLUMES: usize = 1 << 16;

/// A stretch of an object's triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Volume {
    /// The part of the model that the object is in, by number.
    pub(crate) part: usize,
    /// The object's number.
    pub(crate) object: u32,
    /// Its triangles, by number.
    pub(crate) triangles: Range<u64>,
    /// It is printed; otherwise it says where settings hold.
    pub(crate) is_part: bool,
    /// The slicer cuts it away from the parts.
    pub(crate) is_negative: bool,
    /// Where the numbers of the first and of the last triangle stand in the text.
    pub(crate) places: [Range<usize>; 2],
}

impl Volume {
    /// It is of the object with this number in a part of the model.
    pub(crate) fn is_of(&self, part: usize, object: u32) -> bool {
        (self.part, self.object) == (part, object)
    }
}

/// A part that says which triangles are volumes.
pub(crate) struct Config {
    /// The number of its entry in the archive.
    pub(crate) entry: usize,
    pub(crate) text: Vec<u8>,
    pub(crate) volumes: Vec<Volume>,
}

/// All volumes of a package, and where they stand.
pub(crate) struct Volumes {
    /// The parts that hold volumes; all hold the same ones, and meshes hold none then.
    pub(crate) configs: Vec<Config>,
    /// Volumes that stand in the text of their mesh.
    in_meshes: Vec<Volume>,
}

impl Volumes {
    /// Looks for them in a package.
    ///
    /// # Errors
    /// Those of reading, of [`volumes`], and a refusal of volumes that stand at two places and differ, or in meshes and elsewhere.
    pub(crate) fn of(model: &Model, archive: &Archive<'_>, context: &Context<'_>) -> Result<Self> {
        let configs = configs(archive, context)?;
        let in_meshes = in_meshes(model).map_err(|rejection| rejection.at(context.path))?;
        let of_configs = configs.first().is_some_and(|config| !config.volumes.is_empty());
        if of_configs && !in_meshes.is_empty() {
            let reason = "has volumes in its meshes and others in a slicer's part".into();
            return Err(Rejection::Unreadable(reason).at(context.path));
        }
        Ok(Self { configs, in_meshes })
    }

    /// All of them, in the order of the text that they stand in.
    pub(crate) fn all(&self) -> &[Volume] {
        if self.stand_in_meshes() { &self.in_meshes } else { self.configs.first().map_or(&[], |config| &config.volumes) }
    }

    /// Their numbers stand in the text of the mesh.
    pub(crate) fn stand_in_meshes(&self) -> bool {
        !self.in_meshes.is_empty()
    }
}

/// All parts with volumes; they have the same ones.
fn configs(archive: &Archive<'_>, context: &Context<'_>) -> Result<Vec<Config>> {
    let mut all: Vec<Config> = Vec::new();
    for name in CONFIGS {
        let found = archive.entries.iter().enumerate().find(|(_, entry)| entry.name.eq_ignore_ascii_case(name));
        let Some((number, entry)) = found else { continue };
        let text = archive.small(entry, context)?;
        let volumes = volumes(name, &text).map_err(|rejection| rejection.at(context.path))?;
        let triangles = |volumes: &[Volume]| volumes.iter().map(|of| (of.object, of.triangles.clone())).collect::<Vec<_>>();
        if all.first().is_some_and(|first| triangles(&first.volumes) != triangles(&volumes)) {
            let reason = format!("{name}: has other volumes than another part of the package");
            return Err(Rejection::Unreadable(reason).at(context.path));
        }
        all.push(Config { entry: number, text, volumes });
    }
    Ok(all)
}

/// The volumes in the meshes of all parts. O(n) in what stands behind the triangles of each mesh.
fn in_meshes(model: &Model) -> std::result::Result<Vec<Volume>, Rejection> {
    let mut all = Vec::new();
    for (number, part) in model.parts.iter().enumerate() {
        for object in &part.objects {
            let Content::Mesh(mesh) = &object.content else { continue };
            let Some(behind) = part.text().get(mesh.triangles.whole.end..mesh.whole.end) else { continue };
            if memchr::memmem::find(behind, b"volume").is_some() {
                let mut own = within(behind, object.id, &part.name)?;
                for volume in &mut own {
                    volume.part = number;
                    for place in &mut volume.places {
                        *place = mesh.triangles.whole.end + place.start..mesh.triangles.whole.end + place.end;
                    }
                }
                all.append(&mut own);
            }
            if all.len() > MOST_VOLUMES {
                return Err(Rejection::Unreadable(format!("{}: has more than {MOST_VOLUMES} volumes", part.name)));
            }
        }
    }
    Ok(all)
}

/// The volumes in the end of a mesh's text; places count from its beginning.
fn within(text: &[u8], object: u32, part: &str) -> std::result::Result<Vec<Volume>, Rejection> {
    let refuse = |reason: String| Rejection::Unreadable(format!("{part}: {reason}"));
    let text = std::str::from_utf8(text).map_err(|_| refuse("is no UTF-8".into()))?;
    let mut reader = Reader::from_str(text);
    // The element that it ends is another's.
    reader.config_mut().allow_unmatched_ends = true;
    let mut all = Vec::new();
    loop {
        match reader.read_event().map_err(|error| refuse(shown(&error.to_string())))? {
            Event::Eof => return Ok(all),
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == b"volume" => {
                let volume = volume(text, &tag, ["ts", "te"], object)
                    .ok_or_else(|| refuse(format!("object {object} has a volume of no triangles")))?;
                let is_part = value(&tag, b"modifier").is_none_or(|is| is.trim() != "1");
                all.push(Volume { is_part, ..volume });
            }
            _ => {}
        }
    }
}

/// The volumes of all objects in the part of this name, in the order of the text. O(n) in it.
///
/// # Errors
/// What is wrong with the text, or a stretch that ends before it begins.
pub(crate) fn volumes(name: &str, text: &[u8]) -> std::result::Result<Vec<Volume>, Rejection> {
    let refuse = |reason: String| Rejection::Unreadable(format!("{name}: {reason}"));
    let text = std::str::from_utf8(text).map_err(|_| refuse("is no UTF-8".into()))?;
    let mut reader = Reader::from_str(text);
    let (mut all, mut object): (Vec<Volume>, Option<u32>) = (Vec::new(), None);
    let mut is_within = false;
    loop {
        let event = reader.read_event().map_err(|error| refuse(shown(&error.to_string())))?;
        match event {
            Event::Eof => return Ok(all),
            Event::DocType(_) => return Err(refuse("has a document type".into())),
            Event::Start(tag) | Event::Empty(tag) => match tag.local_name().as_ref() {
                b"object" => object = value(&tag, b"id").and_then(|id| id.trim().parse().ok()),
                b"volume" => {
                    let Some(object) = object else { continue };
                    all.push(
                        volume(text, &tag, ["firstid", "lastid"], object)
                            .ok_or_else(|| refuse(format!("object {object} has a volume of no triangles")))?,
                    );
                    is_within = true;
                    if all.len() > MOST_VOLUMES {
                        return Err(refuse(format!("has more than {MOST_VOLUMES} volumes")));
                    }
                }
                b"metadata" if is_within => {
                    if let Some(last) = all.last_mut() {
                        let role = role(&tag);
                        last.is_part &= role == Role::Part;
                        last.is_negative |= role == Role::Negative;
                    }
                }
                _ => {}
            },
            Event::End(tag) if tag.local_name().as_ref() == b"volume" => is_within = false,
            _ => {}
        }
    }
}

fn value(tag: &BytesStart<'_>, name: &[u8]) -> Option<String> {
    let attribute = tag.try_get_attribute(name).ok()??;
    let text = std::str::from_utf8(&attribute.value).ok()?;
    Some(quick_xml::escape::unescape(text).ok()?.into_owned())
}

/// The role that a volume's metadata gives it.
fn role(tag: &BytesStart<'_>) -> Role {
    match (value(tag, b"key").as_deref(), value(tag, b"value").as_deref()) {
        (Some("volume_type"), Some(kind)) => Role::of(kind),
        (Some("modifier"), Some(is)) if is.trim() == "1" => Role::Modifier,
        _ => Role::Part,
    }
}

fn volume(text: &str, tag: &BytesStart<'_>, [first, last]: [&str; 2], object: u32) -> Option<Volume> {
    let place = |name: &str| {
        let attribute = tag.try_get_attribute(name).ok()??;
        let bytes: &[u8] = &attribute.value;
        // The tag lies in the text.
        let from = (bytes.as_ptr() as usize).checked_sub(text.as_ptr() as usize)?;
        let number: u64 = text.get(from..from + bytes.len())?.parse().ok()?;
        Some((number, from..from + bytes.len()))
    };
    let ((first, from), (last, to)) = (place(first)?, place(last)?);
    (first <= last && last < u64::from(u32::MAX)).then(|| Volume {
        part: 0,
        object,
        triangles: first..last + 1,
        is_part: true,
        is_negative: false,
        places: [from, to],
    })
}

/// A stretch of the text with the numbers that volumes have now: `ranges` has all of them. A volume without triangles has no place in such a text: the
/// caller keeps it from that.
pub(crate) fn renumbered<'v>(
    text: &[u8],
    stretch: Range<usize>,
    volumes: impl Iterator<Item = (&'v Volume, &'v Range<u64>)>,
) -> Vec<u8> {
    let mut changes: Vec<(&Range<usize>, u64)> = volumes
        .flat_map(|(volume, range)| {
            let [first, last] = &volume.places;
            [(first, range.start), (last, range.end.saturating_sub(1))]
        })
        .collect();
    changes.sort_by_key(|(place, _)| place.start);
    let (mut all, mut at) = (Vec::with_capacity(stretch.len()), stretch.start);
    for (place, number) in changes {
        all.extend_from_slice(text.get(at..place.start).unwrap_or_default());
        all.extend_from_slice(number.to_string().as_bytes());
        at = place.end;
    }
    all.extend_from_slice(text.get(at..stretch.end).unwrap_or_default());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "<?xml version=\"1.0\"?>\n<config>\n <object id=\"4\" instances_count=\"1\">\n  <metadata type=\"object\" key=\"name\" value=\"a\"/>\n\
        <volume lastid=\"11\" firstid=\"0\">\n <metadata type=\"volume\" key=\"volume_type\" value=\"ModelPart\"/></volume>\n\
        <volume firstid=\"12\" lastid=\"99\"><metadata type=\"volume\" key=\"volume_type\" value=\"ParameterModifier\"/></volume>\n </object>\n</config>";

    #[test]
    fn stretches_of_triangles_are_read_and_written() {
        let all = volumes("a", TEXT.as_bytes()).unwrap();
        let said: Vec<_> = all.iter().map(|volume| (volume.object, volume.triangles.clone(), volume.is_part)).collect();
        assert_eq!(said, [(4, 0..12, true), (4, 12..100, false)]);
        let text = renumbered(TEXT.as_bytes(), 0..TEXT.len(), all.iter().zip(&[0..9, 9..97]));
        let expected =
            TEXT.replace("lastid=\"11\"", "lastid=\"8\"").replace("firstid=\"12\" lastid=\"99\"", "firstid=\"9\" lastid=\"96\"");
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[test]
    fn what_is_wrong_is_refused() {
        for text in [
            "<config><object id='1'><volume firstid='5' lastid='4'/></object></config>",
            "<!DOCTYPE a><config/>",
            "<config><a></b>",
        ] {
            assert!(volumes("a", text.as_bytes()).is_err(), "{text}");
        }
        assert_eq!(volumes("a", b"<config><object id='1'/></config>").unwrap(), []);
    }
}
