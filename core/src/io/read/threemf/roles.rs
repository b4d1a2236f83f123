//! Roles of objects in the projects of Bambu Studio and OrcaSlicer.
//!
//! `Metadata/model_settings.config` has an `<object id=>` for each object of the build, and in it a `<part id= subtype=>` for each of its components, by
//! the number of the object that the component places (Bambu Studio's `src/libslic3r/Format/bbs_3mf.cpp`, `_add_model_config_file_to_archive`; the names of
//! the types are in `ModelVolume::type_to_string`). One mesh may be a part of one object and be cut away from another.

use std::collections::HashMap;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::super::archive::{Archive, shown};
use super::super::finding::Rejection;
use super::super::spool::Context;
use crate::contract::error::Result;

const CONFIG: &str = "Metadata/model_settings.config";
/// Most parts of a package.
const MOST_PARTS: usize = 1 << 20;

/// The use of a mesh where it is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Role {
    /// It is printed.
    #[default]
    Part,
    /// The slicer cuts it away from the parts.
    Negative,
    /// It says where settings or supports hold.
    Modifier,
}

impl Role {
    /// The slicers take a name that they do not know for that of a part.
    fn of(name: Option<&[u8]>) -> Self {
        match name {
            Some(b"negative_part") => Self::Negative,
            Some(b"modifier_part" | b"support_blocker" | b"support_enforcer") => Self::Modifier,
            _ => Self::Part,
        }
    }
}

/// The roles that a package names.
#[derive(Debug, Default)]
pub(crate) struct Roles {
    /// By the number of the object of the build, and of the one in it: a role for each part of this number, in order. Without those that are all parts.
    named: HashMap<(u32, u32), Vec<Role>>,
}

impl Roles {
    /// Reads them. O(n) in the text.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] for a text that is no XML or has too many parts; those of unpacking.
    pub(super) fn read(archive: &Archive<'_>, context: &Context<'_>) -> Result<Self> {
        let Some(entry) = archive.entries.iter().find(|entry| entry.name == CONFIG) else { return Ok(Self::default()) };
        let text = archive.spooled(entry, context)?;
        Self::parse(text.all().as_flattened()).map_err(|rejection| rejection.at(context.path))
    }

    fn parse(text: &[u8]) -> std::result::Result<Self, Rejection> {
        let refuse = |reason: String| Rejection::Unreadable(format!("{CONFIG}: {reason}"));
        let text = std::str::from_utf8(text).map_err(|_| refuse("is no UTF-8".into()))?;
        let mut reader = Reader::from_str(text);
        let (mut named, mut count, mut object) = (HashMap::<_, Vec<Role>>::new(), 0, None);
        loop {
            match reader.read_event().map_err(|error| refuse(shown(&error.to_string())))? {
                Event::Eof => break,
                Event::DocType(_) => return Err(refuse("has a document type".into())),
                Event::Start(tag) | Event::Empty(tag) => match tag.local_name().as_ref() {
                    b"object" => object = number(&tag),
                    b"part" => {
                        let (Some(object), Some(part)) = (object, number(&tag)) else { continue };
                        count += 1;
                        if count > MOST_PARTS {
                            return Err(refuse(format!("has more than {MOST_PARTS} parts")));
                        }
                        let name = tag.try_get_attribute("subtype").ok().flatten();
                        named.entry((object, part)).or_default().push(Role::of(name.as_ref().map(|name| &*name.value)));
                    }
                    _ => {}
                },
                Event::End(tag) if tag.local_name().as_ref() == b"object" => object = None,
                _ => {}
            }
        }
        named.retain(|_, roles| roles.iter().any(|role| *role != Role::Part));
        Ok(Self { named })
    }

    /// Nothing in the package is anything but a part.
    pub(super) fn are_all_parts(&self) -> bool {
        self.named.is_empty()
    }

    /// The role of the component that is the `nth` of those in `object` that place the object `part`, counted from 0.
    pub(super) fn of(&self, object: u32, part: u32, nth: usize) -> Role {
        let Some(roles) = self.named.get(&(object, part)) else { return Role::Part };
        roles.get(nth).or(roles.last()).copied().unwrap_or_default()
    }
}

fn number(tag: &BytesStart<'_>) -> Option<u32> {
    let attribute = tag.try_get_attribute("id").ok()??;
    std::str::from_utf8(&attribute.value).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_are_read_in_the_order_of_the_parts() {
        let text = "<config><object id='9'><metadata key='name' value='a'/><part id='4' subtype='normal_part'/>\
            <part id='5' subtype='negative_part'><mesh_stat/></part><part id=\"5\" subtype=\"support_blocker\"/></object>\
            <object id='8'><part id='5'/></object><part id='7' subtype='modifier_part'/></config>";
        let roles = Roles::parse(text.as_bytes()).unwrap();
        let of = |object, part, nth| roles.of(object, part, nth);
        assert_eq!([of(9, 4, 0), of(9, 5, 0), of(9, 5, 1)], [Role::Part, Role::Negative, Role::Modifier]);
        // More components than parts: as the last one. A part outside of an object says nothing.
        assert_eq!([of(9, 5, 7), of(8, 5, 0), of(8, 7, 0)], [Role::Modifier, Role::Part, Role::Part]);
    }

    #[test]
    fn a_text_that_is_no_xml_is_refused() {
        for text in [&b"<config><object></config>"[..], b"<!DOCTYPE a><config/>", b"<config>\xFF</config>"] {
            assert!(Roles::parse(text).is_err());
        }
        assert!(Roles::parse(b"").unwrap().named.is_empty());
    }
}
