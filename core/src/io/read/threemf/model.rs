//! The model of a package: parts, objects, build items.

use std::collections::HashMap;
use std::ops::Range;

use super::super::archive::Entry;
use super::super::finding::Finding;
use super::super::spool::Items;
use super::super::xml::Scopes;
use super::transform::Transform;

/// The unit of all coordinates of a part (3MF Core 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Unit {
    Micron,
    Millimeter,
    Centimeter,
    Inch,
    Foot,
    Meter,
}

/// What an object is for (3MF Core 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Purpose {
    Model,
    SolidSupport,
    Support,
    Surface,
    Other,
}

/// A part of the archive that holds a model.
#[derive(Debug)]
pub(in super::super) struct Part {
    /// As the archive has it.
    pub(in super::super) name: String,
    /// The text of the part, all of it.
    pub(in super::super) text: Items<1>,
    pub(in super::super) unit: Unit,
    /// It is of the draft 0.93, whose namespace is another one.
    pub(in super::super) draft: bool,
    /// Names and values of the model's metadata.
    pub(in super::super) metadata: Vec<(String, String)>,
    /// In the order of the part.
    pub(in super::super) objects: Vec<Object>,
    /// The objects by their ids.
    pub(super) by_id: HashMap<u32, usize>,
    /// The items of its build, which count in the first part alone.
    pub(super) items: Vec<Item>,
}

impl Part {
    pub(in super::super) fn text(&self) -> &[u8] {
        self.text.all().as_flattened()
    }
}

/// An object.
#[derive(Clone, Debug)]
pub(in super::super) struct Object {
    pub(in super::super) id: u32,
    pub(in super::super) purpose: Purpose,
    pub(in super::super) name: String,
    pub(in super::super) part_number: String,
    pub(in super::super) uuid: String,
    pub(in super::super) thumbnail: String,
    /// `pid` and `pindex`, as they stand.
    pub(in super::super) property: [Option<u32>; 2],
    /// Where `<object …>…</object>` stands in the part.
    pub(in super::super) whole: Range<usize>,
    pub(in super::super) content: Content,
}

/// What an object is made of.
#[derive(Clone, Debug)]
pub(in super::super) enum Content {
    Mesh(Mesh),
    Components(Vec<Component>),
    /// Something without triangles, in words.
    Foreign(&'static str),
    /// Nothing that is known.
    Nothing,
}

/// A mesh, where it stands.
#[derive(Clone, Debug)]
pub(in super::super) struct Mesh {
    /// `<mesh>…</mesh>` in the part.
    pub(in super::super) whole: Range<usize>,
    pub(in super::super) vertices: Region,
    pub(in super::super) triangles: Region,
    /// It has a beam lattice, so that the triangles are not all of it.
    pub(in super::super) lattice: bool,
}

/// An element that holds vertices or triangles.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Region {
    /// From its start tag to its end tag, both included.
    pub(in super::super) whole: Range<usize>,
    /// What lies between them.
    pub(in super::super) inner: Range<usize>,
    /// Nothing but elements without content lies between them.
    pub(super) plain: bool,
    /// The prefix of its name, with the colon.
    pub(super) prefix: Box<str>,
    /// Namespaces declared within it.
    pub(super) scopes: Scopes,
}

/// Another object as a part of one.
#[derive(Clone, Debug)]
pub(in super::super) struct Component {
    pub(in super::super) object: u32,
    /// The part that holds the object, if it is not this one.
    pub(in super::super) path: Option<String>,
    pub(in super::super) transform: Transform,
}

/// An object that is to be built.
#[derive(Clone, Debug)]
pub(in super::super) struct Item {
    pub(in super::super) component: Component,
    pub(in super::super) printable: bool,
    pub(in super::super) part_number: String,
    pub(in super::super) uuid: String,
    /// Where its tag stands in the first part.
    pub(in super::super) tag: Range<usize>,
}

/// An object of a model: the number of its part, and its number in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(in super::super) struct Place {
    pub(in super::super) part: usize,
    pub(in super::super) object: usize,
}

/// All models of a package.
#[derive(Debug)]
pub(in super::super) struct Model {
    /// The entries of the archive, in its order.
    pub(in super::super) entries: Vec<Entry>,
    /// The start part, then those that it leads to.
    pub(in super::super) parts: Vec<Part>,
    /// Parts by their names in lower case.
    pub(super) by_name: HashMap<String, usize>,
    /// There are digital signatures, which no changed package keeps.
    pub(in super::super) signed: bool,
    /// There is a keystore (3MF Secure Content).
    pub(in super::super) secured: bool,
    pub(in super::super) findings: Vec<Finding>,
}

impl Model {
    /// What is to be built, in order.
    pub(in super::super) fn items(&self) -> &[Item] {
        self.parts.first().map_or(&[], |part| part.items.as_slice())
    }

    /// The unit of the whole.
    pub(in super::super) fn unit(&self) -> Unit {
        self.parts.first().map_or(Unit::Millimeter, |part| part.unit)
    }

    pub(in super::super) fn object(&self, place: Place) -> Option<&Object> {
        self.parts.get(place.part)?.objects.get(place.object)
    }

    /// The object that a component of this part refers to, if it is there.
    pub(in super::super) fn target(&self, part: usize, component: &Component) -> Option<Place> {
        let part = match &component.path {
            None => part,
            Some(path) => *self.by_name.get(&path.to_ascii_lowercase())?,
        };
        let object = *self.parts.get(part)?.by_id.get(&component.object)?;
        Some(Place { part, object })
    }
}
