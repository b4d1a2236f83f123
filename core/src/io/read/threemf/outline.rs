//! The outline of one part: all of it but vertices and triangles.

use std::collections::HashMap;

use super::super::finding::Rejection;
use super::super::spool::Items;
use super::super::xml::{Element, Node, Xml};
use super::attributes::Attributes;
use super::budget::{Budget, ITEM};
use super::extensions::{self, is_core};
use super::model::{Item, Part, Unit};
use super::object::{self, reference};
use crate::util::words::Count;

/// Bytes of metadata that are kept of a part.
const METADATA: usize = 1 << 20;

/// Reads a part.
///
/// # Errors
/// A reason that names the part, and the place in it.
pub(super) fn read(name: &str, text: Items<1>, budget: &mut Budget) -> Result<Part, Rejection> {
    let mut part = Part {
        name: name.to_owned(),
        text: Items::default(),
        unit: Unit::Millimeter,
        draft: false,
        metadata: Vec::new(),
        objects: Vec::new(),
        by_id: HashMap::new(),
        items: Vec::new(),
    };
    let mut xml = Xml::of(name, text.all().as_flattened())?;
    let root = xml.child()?.filter(|root| is_core(root, "model"));
    let Some(root) = root else { return Err(xml.refuse("holds no 3MF model")) };
    let attributes = Attributes { xml: &xml, element: &root };
    part.draft = extensions::in_draft(&root);
    part.unit = unit(&attributes)?;
    require(&attributes)?;
    let (mut kept, mut builds) = (0, 0);
    while let Some(child) = xml.child()? {
        if is_core(&child, "resources") {
            resources(&mut xml, &mut part, budget)?;
        } else if is_core(&child, "build") {
            builds += 1;
            build(&mut xml, &mut part, budget)?;
        } else if is_core(&child, "metadata") {
            metadata(&mut xml, &child, &mut part, &mut kept)?;
        } else {
            xml.skip()?;
        }
    }
    if builds > 1 {
        return Err(xml.refuse("has more than one build"));
    }
    if !matches!(xml.next()?, Node::Over) {
        return Err(xml.refuse("has more than one model"));
    }
    drop(xml);
    part.text = text;
    part.text.let_go();
    Ok(part)
}

/// The unit of a model; millimetres if it has none.
fn unit(attributes: &Attributes<'_, '_>) -> Result<Unit, Rejection> {
    Ok(match attributes.plain("unit")?.as_deref().map(str::trim) {
        None | Some("millimeter") => Unit::Millimeter,
        Some("micron") => Unit::Micron,
        Some("centimeter") => Unit::Centimeter,
        Some("inch") => Unit::Inch,
        Some("foot") => Unit::Foot,
        Some("meter") => Unit::Meter,
        Some(other) => {
            return Err(attributes.refuse(format!("has a unit that 3MF does not have, {}", super::super::archive::shown(other))));
        }
    })
}

/// Refuses a model that requires what is not understood.
fn require(attributes: &Attributes<'_, '_>) -> Result<(), Rejection> {
    let required = attributes.plain("requiredextensions")?.unwrap_or_default();
    for prefix in required.split_ascii_whitespace() {
        let namespace = attributes.xml.scopes().namespace(prefix);
        let namespace = namespace.as_deref().unwrap_or(prefix);
        if !extensions::is_understood(namespace) {
            let words = match namespace.contains(':') {
                true => extensions::words(namespace),
                false => super::super::archive::shown(prefix),
            };
            return Err(attributes.xml.refuse(format!("requires an extension of 3MF that is not understood: {words}")));
        }
    }
    Ok(())
}

fn resources(xml: &mut Xml<'_>, part: &mut Part, budget: &mut Budget) -> Result<(), Rejection> {
    while let Some(child) = xml.child()? {
        if !is_core(&child, "object") {
            xml.skip()?;
            continue;
        }
        let object = object::read(xml, &child, budget)?;
        let number = part.objects.len();
        if part.by_id.insert(object.id, number).is_some() {
            return Err(xml.refuse_element(&child, format!("has the id {} as another object has it", Count(object.id))));
        }
        part.objects.push(object);
    }
    Ok(())
}

fn build(xml: &mut Xml<'_>, part: &mut Part, budget: &mut Budget) -> Result<(), Rejection> {
    while let Some(child) = xml.child()? {
        if is_core(&child, "item") {
            let attributes = Attributes { xml, element: &child };
            let printable = attributes.plain("printable")?;
            let item = Item {
                component: reference(&attributes)?,
                printable: !matches!(printable.as_deref().map(str::trim), Some("0" | "false")),
                part_number: attributes.text("partnumber")?,
                uuid: attributes.production("UUID")?,
            };
            let strings = item.part_number.len() + item.uuid.len() + item.component.path.as_ref().map_or(0, String::len);
            budget.spend(xml, ITEM + strings)?;
            part.items.push(item);
        }
        xml.skip()?;
    }
    Ok(())
}

/// Keeps the beginning of metadata, up to a bound for all of them.
fn metadata(xml: &mut Xml<'_>, element: &Element<'_>, part: &mut Part, kept: &mut usize) -> Result<(), Rejection> {
    let name = Attributes { xml, element }.text("name")?;
    let mut value = String::new();
    loop {
        match xml.next()? {
            Node::Text(text) if value.len() + text.len() <= METADATA => value.push_str(&text),
            Node::Text(_) => {}
            Node::Start(_) => {
                xml.skip()?;
            }
            Node::End(_) | Node::Over => break,
        }
    }
    *kept += name.len() + value.len() + size_of::<(String, String)>();
    if *kept <= METADATA {
        part.metadata.push((name, value));
    }
    Ok(())
}
