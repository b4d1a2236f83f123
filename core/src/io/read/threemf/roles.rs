//! Roles of objects in the projects of Bambu Studio and OrcaSlicer.
//!
//! `Metadata/model_settings.config` has an `<object id=>` for each object of the build, and in it a `<part id= subtype=>` for each of its components, by
//! the number of the mesh that it leads to (Bambu Studio's `src/libslic3r/Format/bbs_3mf.cpp`, `_add_model_config_file_to_archive`; the names of
//! the types are in `ModelVolume::type_to_string`). One mesh may be a part of one object and be cut away from another.

use std::collections::HashMap;

use super::super::archive::Archive;
use super::super::finding::Rejection;
use super::super::spool::Context;
use super::super::xml::{Element, Xml};
use crate::contract::error::Result;

const CONFIG: &str = "Metadata/model_settings.config";
/// Most parts of a package.
const MOST_PARTS: usize = 1 << 16;

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
    /// By its name in either family of slicers, which take a name that they do not know for that of a part.
    pub(super) fn of(name: &str) -> Self {
        match name.trim() {
            "negative_part" | "NegativeVolume" => Self::Negative,
            "modifier_part" | "support_blocker" | "support_enforcer" => Self::Modifier,
            "ParameterModifier" | "SupportBlocker" | "SupportEnforcer" => Self::Modifier,
            _ => Self::Part,
        }
    }
}

/// The roles that a package names.
#[derive(Debug, Default)]
pub(crate) struct Roles {
    /// By the number of the object of the build: its parts in order, by the numbers of their meshes. Objects of nothing but parts are left out.
    named: HashMap<u32, Vec<(u32, Role)>>,
}

impl Roles {
    /// Reads them. O(n) in the text.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] for a text that is no XML or has too many parts; those of unpacking.
    pub(super) fn read(archive: &Archive<'_>, context: &Context<'_>) -> Result<Self> {
        let Some(entry) = archive.find(CONFIG) else { return Ok(Self::default()) };
        let text = archive.spooled(entry, context)?;
        Self::parse(text.all().as_flattened()).map_err(|rejection| rejection.at(context.path))
    }

    fn parse(text: &[u8]) -> std::result::Result<Self, Rejection> {
        let mut xml = Xml::of(CONFIG, text)?;
        let (mut named, mut count) = (HashMap::<u32, Vec<(u32, Role)>>::new(), 0);
        if xml.child()?.is_none() {
            return Ok(Self::default());
        }
        while let Some(element) = xml.child()? {
            let id = number(&xml, &element)?;
            let Some(object) = id.filter(|_| element.name == "object") else {
                xml.skip()?;
                continue;
            };
            while let Some(element) = xml.child()? {
                let Some(part) = number(&xml, &element)?.filter(|_| element.name == "part") else {
                    xml.skip()?;
                    continue;
                };
                count += 1;
                if count > MOST_PARTS {
                    return Err(xml.refuse(format!("has more than {MOST_PARTS} parts")));
                }
                let role = role(&mut xml, &element)?;
                named.entry(object).or_default().push((part, role));
            }
        }
        named.retain(|_, parts| parts.iter().any(|(_, role)| *role != Role::Part));
        Ok(Self { named })
    }

    /// Nothing in the package is anything but a part.
    pub(super) fn are_all_parts(&self) -> bool {
        self.named.is_empty()
    }

    /// The role of the mesh `part` that is the one of this place among those of the object `object`: that of the part at the same place if it is of
    /// the mesh, else that of the first part that is (`_generate_volumes_new` in the same file).
    pub(super) fn of(&self, object: u32, part: u32, place: usize) -> Role {
        let Some(parts) = self.named.get(&object) else { return Role::Part };
        let is_own = |own: &&(u32, Role)| own.0 == part;
        let found = parts.get(place).filter(is_own).or_else(|| parts.iter().find(is_own));
        found.map(|(_, role)| *role).unwrap_or_default()
    }
}

/// The role of a part, which a word of its own within it changes.
fn role(xml: &mut Xml<'_>, part: &Element<'_>) -> std::result::Result<Role, Rejection> {
    let value = |xml: &Xml<'_>, element: &Element<'_>, name: &str| {
        let value = element.plain(name).map_err(|reason| xml.refuse_element(element, reason))?;
        Ok::<_, Rejection>(value.unwrap_or_default().into_owned())
    };
    let mut role = Role::of(&value(xml, part, "subtype")?);
    while let Some(element) = xml.child()? {
        if element.name == "metadata" && matches!(value(xml, &element, "key")?.as_str(), "part_type" | "volume_type") {
            role = Role::of(&value(xml, &element, "value")?);
        }
        xml.skip()?;
    }
    Ok(role)
}

fn number(xml: &Xml<'_>, element: &Element<'_>) -> std::result::Result<Option<u32>, Rejection> {
    let id = element.plain("id").map_err(|reason| xml.refuse_element(element, reason))?;
    Ok(id.and_then(|id| id.trim().parse().ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_are_those_of_the_parts_at_the_same_place() {
        let text = "\u{feff}<config><object id=' 9 '><metadata key='name' value='a'/><part id='4' subtype='normal_part'/>\
            <part id='5' subtype='negative&#95;part'><mesh_stat/></part><part id=\"5\" subtype=\"support_blocker\"/>\
            <part id='6' subtype='normal_part'><metadata key='part_type' value='modifier_part'/></part></object>\
            <object id='8'><part id='5'/></object><part id='7' subtype='modifier_part'/></config>";
        let roles = Roles::parse(text.as_bytes()).unwrap();
        let of = |object, part, place| roles.of(object, part, place);
        assert_eq!(
            [of(9, 4, 0), of(9, 5, 1), of(9, 5, 2), of(9, 6, 3)],
            [Role::Part, Role::Negative, Role::Modifier, Role::Modifier]
        );
        // At another place: the first part of the mesh. A part outside of an object says nothing.
        assert_eq!(
            [of(9, 5, 7), of(9, 6, 0), of(8, 5, 0), of(8, 7, 0)],
            [Role::Negative, Role::Modifier, Role::Part, Role::Part]
        );
    }

    #[test]
    fn a_text_that_is_no_xml_is_refused() {
        let deep = "<a>".repeat(100);
        for text in ["<config><object></config>", "<!DOCTYPE a><config/>", "<config>", deep.as_str()] {
            assert!(Roles::parse(text.as_bytes()).is_err(), "{text}");
        }
        assert!(Roles::parse(b"<config/>").unwrap().named.is_empty());
    }
}
