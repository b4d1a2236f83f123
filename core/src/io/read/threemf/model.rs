//! The model of a package: parts, objects, build items.

use std::collections::HashMap;
use std::ops::Range;

use super::super::archive::Entry;
use super::super::finding::Finding;
use super::super::spool::Items;
use super::super::xml::Scopes;
use super::roles::Roles;
use super::transform::Transform;
use crate::util::legible::in_one_line;

/// The unit of all coordinates of a part (3MF Core 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    Micron,
    Millimeter,
    Centimeter,
    Inch,
    Foot,
    Meter,
}

impl Unit {
    /// As 3MF writes it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Micron => "micron",
            Self::Millimeter => "millimeter",
            Self::Centimeter => "centimeter",
            Self::Inch => "inch",
            Self::Foot => "foot",
            Self::Meter => "meter",
        }
    }
}

/// What an object is for (3MF Core 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Model,
    SolidSupport,
    Support,
    Surface,
    Other,
}

/// A part of the archive that holds a model.
#[derive(Debug)]
pub(crate) struct Part {
    /// As the archive has it.
    pub(crate) name: String,
    /// The text of the part, all of it.
    pub(crate) text: Items<1>,
    pub(crate) unit: Unit,
    /// It is of the draft 0.93, whose namespace is another one.
    pub(crate) draft: bool,
    /// Names and values of the model's metadata.
    pub(crate) metadata: Vec<(String, String)>,
    /// In the order of the part.
    pub(crate) objects: Vec<Object>,
    /// The objects by their ids.
    pub(super) by_id: HashMap<u32, usize>,
    /// The items of its build, which count in the first part alone.
    pub(super) items: Vec<Item>,
}

impl Part {
    pub(crate) fn text(&self) -> &[u8] {
        self.text.all().as_flattened()
    }
}

/// An object.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    pub(crate) id: u32,
    pub(crate) purpose: Purpose,
    pub(crate) name: String,
    pub(crate) part_number: String,
    pub(crate) uuid: String,
    pub(crate) thumbnail: String,
    /// Where `<object …>…</object>` stands in the part.
    pub(crate) whole: Range<usize>,
    pub(crate) content: Content,
}

/// What an object is made of.
#[derive(Clone, Debug)]
pub(crate) enum Content {
    Mesh(Mesh),
    Components(Vec<Component>),
    /// Something without triangles, in words.
    Foreign(&'static str),
    /// Nothing that is known.
    Nothing,
}

/// A mesh, where it stands.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    /// `<mesh>…</mesh>` in the part.
    pub(crate) whole: Range<usize>,
    pub(crate) vertices: Region,
    pub(crate) triangles: Region,
    /// It has a beam lattice, so that the triangles are not all of it.
    pub(crate) lattice: bool,
}

/// An element that holds vertices or triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Region {
    /// From its start tag to its end tag, both included.
    pub(crate) whole: Range<usize>,
    /// What lies between them.
    pub(crate) inner: Range<usize>,
    /// Nothing but elements without content lies between them.
    pub(super) plain: bool,
    /// The prefix of its name, with the colon.
    pub(super) prefix: Box<str>,
    /// Namespaces declared within it.
    pub(super) scopes: Scopes,
}

/// Another object as a part of one.
#[derive(Clone, Debug)]
pub(crate) struct Component {
    pub(crate) object: u32,
    /// The part that holds the object, if it is not this one.
    pub(crate) path: Option<String>,
    pub(crate) transform: Transform,
}

/// An object that is to be built.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) component: Component,
    pub(crate) printable: bool,
    pub(crate) part_number: String,
    pub(crate) uuid: String,
}

/// An object of a model: the number of its part, and its number in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) part: usize,
    pub(crate) object: usize,
}

/// All models of a package.
#[derive(Debug)]
pub(crate) struct Model {
    /// The entries of the archive, in its order.
    pub(crate) entries: Vec<Entry>,
    /// The start part, then those that it leads to.
    pub(crate) parts: Vec<Part>,
    /// Parts by their names in lower case.
    pub(super) by_name: HashMap<String, usize>,
    /// There are digital signatures, which no changed package keeps.
    pub(crate) signed: bool,
    pub(crate) findings: Vec<Finding>,
    /// The uses of objects, as far as a slicer's project names them.
    pub(super) roles: Roles,
}

impl Model {
    /// What is to be built, in order.
    pub(crate) fn items(&self) -> &[Item] {
        self.parts.first().map_or(&[], |part| part.items.as_slice())
    }

    /// The title of the whole in its metadata (3MF Core 1.3, section 3.4.1), or nothing; without control characters.
    pub(crate) fn title(&self) -> String {
        let all = self.parts.first().map_or(&[][..], |part| &part.metadata);
        in_one_line(all.iter().find(|(name, _)| name == "Title").map_or("", |(_, value)| value.trim()))
    }

    /// The unit of the whole.
    pub(crate) fn unit(&self) -> Unit {
        self.parts.first().map_or(Unit::Millimeter, |part| part.unit)
    }

    pub(crate) fn object(&self, place: Place) -> Option<&Object> {
        self.parts.get(place.part)?.objects.get(place.object)
    }

    /// The object that a component of this part refers to, if it is there.
    pub(crate) fn target(&self, part: usize, component: &Component) -> Option<Place> {
        let part = match &component.path {
            None => part,
            Some(path) => *self.by_name.get(&path.to_ascii_lowercase())?,
        };
        let object = *self.parts.get(part)?.by_id.get(&component.object)?;
        Some(Place { part, object })
    }
}
