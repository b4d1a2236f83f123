//! An object of a part: its attributes, and where its mesh stands.

use super::super::finding::Rejection;
use super::super::package::resolve;
use super::super::xml::{Element, Xml};
use super::attributes::Attributes;
use super::budget::{Budget, COMPONENT, OBJECT};
use super::extensions::{self, BEAM_LATTICE, is_core};
use super::model::{Component, Content, Mesh, Object, Purpose, Region};
use super::transform::Transform;

/// Reads the object that `element` begins.
pub(super) fn read(xml: &mut Xml<'_>, element: &Element<'_>, budget: &mut Budget) -> Result<Object, Rejection> {
    let attributes = Attributes { xml, element };
    let id = attributes.id("id")?.ok_or_else(|| attributes.refuse("has no id"))?;
    let mut object = Object {
        id,
        purpose: purpose(&attributes)?,
        name: attributes.text("name")?,
        part_number: attributes.text("partnumber")?,
        uuid: attributes.production("UUID")?,
        thumbnail: attributes.text("thumbnail")?,
        whole: element.tag.clone(),
        content: Content::Nothing,
    };
    let strings = [&object.name, &object.part_number, &object.uuid, &object.thumbnail];
    budget.spend(xml, OBJECT + strings.iter().map(|text| text.len()).sum::<usize>())?;
    while let Some(child) = xml.child()? {
        let content = if is_core(&child, "mesh") {
            Content::Mesh(mesh(xml, &child, budget)?)
        } else if is_core(&child, "components") {
            Content::Components(components(xml, budget)?)
        } else {
            xml.skip()?;
            match extensions::content(child.name).filter(|_| !extensions::in_core(&child)) {
                Some(foreign) => Content::Foreign(foreign),
                None => continue,
            }
        };
        if !matches!(object.content, Content::Nothing) {
            return Err(xml.refuse_element(element, "is made of two things"));
        }
        object.content = content;
    }
    object.whole.end = xml.position();
    Ok(object)
}

fn purpose(attributes: &Attributes<'_, '_>) -> Result<Purpose, Rejection> {
    Ok(match attributes.plain("type")?.as_deref().map(str::trim) {
        None | Some("model") => Purpose::Model,
        Some("solidsupport") => Purpose::SolidSupport,
        Some("support") => Purpose::Support,
        Some("surface") => Purpose::Surface,
        Some("other") => Purpose::Other,
        Some(other) => {
            return Err(attributes.refuse(format!("has a type that 3MF does not have, {}", super::super::archive::shown(other))));
        }
    })
}

fn mesh(xml: &mut Xml<'_>, element: &Element<'_>, budget: &mut Budget) -> Result<Mesh, Rejection> {
    let whole = element.tag.clone();
    let mut mesh = Mesh { whole, vertices: Region::default(), triangles: Region::default(), lattice: false };
    while let Some(child) = xml.child()? {
        let region = if is_core(&child, "vertices") {
            &mut mesh.vertices
        } else if is_core(&child, "triangles") {
            &mut mesh.triangles
        } else {
            mesh.lattice |= child.is(BEAM_LATTICE, "beamlattice");
            xml.skip()?;
            continue;
        };
        if !region.whole.is_empty() {
            return Err(xml.refuse_element(&child, "is there twice in a mesh"));
        }
        *region = self::region(xml, &child)?;
        budget.keep(xml, &region.scopes)?;
    }
    mesh.whole.end = xml.position();
    Ok(mesh)
}

/// Passes over an element's content.
fn region(xml: &mut Xml<'_>, element: &Element<'_>) -> Result<Region, Rejection> {
    let scopes = xml.scopes().clone();
    let from = element.tag.end;
    let (plain, end) = match xml.skip_plain() {
        Some(end) => (true, end),
        None => (false, xml.skip()?),
    };
    let prefix = element.raw_name.strip_suffix(element.name).unwrap_or_default().into();
    Ok(Region { whole: element.tag.start..end.end, inner: from..end.start.max(from), plain, prefix, scopes })
}

fn components(xml: &mut Xml<'_>, budget: &mut Budget) -> Result<Vec<Component>, Rejection> {
    let mut components = Vec::new();
    while let Some(child) = xml.child()? {
        if is_core(&child, "component") {
            let component = reference(&Attributes { xml, element: &child })?;
            budget.spend(xml, COMPONENT + component.path.as_ref().map_or(0, String::len))?;
            components.push(component);
        }
        xml.skip()?;
    }
    Ok(components)
}

/// What a component or a build item refers to.
pub(super) fn reference(attributes: &Attributes<'_, '_>) -> Result<Component, Rejection> {
    let object = attributes.id("objectid")?.ok_or_else(|| attributes.refuse("refers to no object"))?;
    let path = match attributes.of(extensions::PRODUCTION, "path")? {
        None => None,
        Some(path) => Some(resolve("", &path).ok_or_else(|| attributes.refuse("has a path that leads nowhere"))?),
    };
    let transform = match attributes.plain("transform")? {
        None => Transform::IDENTITY,
        Some(text) => {
            Transform::parse(&text).ok_or_else(|| attributes.refuse("has a transform that is not of twelve numbers"))?
        }
    };
    Ok(Component { object, path, transform })
}
