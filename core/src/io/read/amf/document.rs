//! The elements of an AMF around its vertices and triangles.

use std::collections::BTreeMap;

use super::super::finding::Rejection;
use super::super::number;
use super::super::rounding::Rounding;
use super::super::spool::Context;
use super::intake::Intake;
use super::placement::Placement;
use super::stretch::{End, Kind, is_colour};
use super::xml::{Tag, Token, Tokens, Trouble};
use crate::contract::error::{Error, Result};
use crate::util::words::Count;

/// Most objects, constellations, instances and meshes, together: a small archive unpacks to very many of them, and each takes some 170 bytes (measured).
const MOST: usize = 1 << 18;
/// Bytes of a name that are kept.
pub(super) const LONGEST_NAME: usize = 1 << 10;
/// Bytes of an id, a unit or a type at most; what is longer counts as absent.
const LONGEST_WORD: usize = 1 << 16;
/// Names of objects that are kept.
pub(super) const NAMES_KEPT: usize = 1 << 10;

/// An id by its hash, so that long ids take no memory.
pub(super) type Id = u128;

/// Whatever can be placed, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    Object(usize),
    Constellation(usize),
}

/// Vertices, and the triangles that refer to them, by their places in the spools.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    pub(super) positions: std::ops::Range<u64>,
    pub(super) indices: std::ops::Range<u64>,
    /// Of its coordinates as they stand in the file.
    pub(super) rounding: Rounding,
}

/// An object; its meshes by their numbers.
#[derive(Debug)]
pub(super) struct Object {
    id: Option<Id>,
    pub(super) meshes: std::ops::Range<usize>,
}

/// A constellation; its instances by their numbers.
#[derive(Debug)]
struct Constellation {
    id: Option<Id>,
    instances: std::ops::Range<usize>,
}

/// An object or a constellation in a constellation.
#[derive(Debug)]
pub(super) struct Instance {
    pub(super) of: Option<Id>,
    shift: [f64; 3],
    angles: [f64; 3],
    scale: [f64; 3],
}

impl Instance {
    /// Where it is placed; angles are in degrees, or in radians.
    pub(super) fn placement(&self, radians: bool) -> Placement {
        let degrees = if radians { self.angles.map(f64::to_degrees) } else { self.angles };
        Placement::of(self.scale, degrees, self.shift)
    }
}

/// An AMF without its vertices and triangles.
#[derive(Debug, Default)]
pub(super) struct Document {
    pub(super) unit: Option<Vec<u8>>,
    pub(super) name: Vec<u8>,
    /// The first that an object has.
    pub(super) name_of_object: Vec<u8>,
    /// Objects and constellations in their order.
    pub(super) items: Vec<Item>,
    pub(super) objects: Vec<Object>,
    /// Names or ids of the first objects, by their numbers, and names alone.
    pub(super) names: Vec<Vec<u8>>,
    pub(super) titles: Vec<Vec<u8>>,
    /// Names of volumes, by the numbers of their meshes; [`NAMES_KEPT`] at most.
    pub(super) volume_names: BTreeMap<usize, Vec<u8>>,
    /// Metadata of the file and of objects, but for names.
    pub(super) metadata: u64,
    pub(super) meshes: Vec<Mesh>,
    constellations: Vec<Constellation>,
    pub(super) instances: Vec<Instance>,
    /// Made by Slic3r or one of its descendants, whose angles are in radians.
    pub(super) radians: bool,
    /// It has colours or materials.
    pub(super) is_coloured: bool,
    /// Volumes of support material.
    pub(super) supports: u64,
    /// Shifts, angles and scales that are no numbers.
    pub(super) odd_placements: u64,
    /// Instances that are scaled or mirrored, which the standard does not know.
    pub(super) scaled: u64,
    /// The text ends before the root does.
    pub(super) cut_off: bool,
    /// The byte behind the root.
    pub(super) end: usize,
}

/// Why the reading of an element ends early.
enum Stop {
    Xml(Trouble),
    Refused(Rejection),
    Failed(Error),
}

impl From<Trouble> for Stop {
    fn from(trouble: Trouble) -> Self {
        Self::Xml(trouble)
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

impl Document {
    /// Reads a document whose root is `amf`; its vertices and triangles go into `intake`. What is complete counts, where the text ends early.
    ///
    /// # Errors
    /// A refusal of what is no XML or too much; those of the intake.
    pub(super) fn read(text: &[u8], context: &Context<'_>, intake: &mut Intake<'_>) -> Result<Self> {
        let mark = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let mut tokens = Tokens::from(text, mark, 0);
        let mut document = Self::default();
        let result = document.elements(text, &mut tokens, context, intake);
        document.end = tokens.at();
        match result {
            Ok(()) => Ok(document),
            Err(Stop::Xml(Trouble::CutOff)) => Ok(Self { cut_off: true, ..document }),
            Err(Stop::Xml(trouble)) => Err(Rejection::from(trouble).at(context.path)),
            Err(Stop::Refused(rejection)) => Err(rejection.at(context.path)),
            Err(Stop::Failed(error)) => Err(error),
        }
    }

    /// The id of an item.
    pub(super) fn id(&self, item: Item) -> Option<Id> {
        match item {
            Item::Object(at) => self.objects.get(at)?.id,
            Item::Constellation(at) => self.constellations.get(at)?.id,
        }
    }

    /// How many constellations there are.
    pub(super) fn constellations(&self) -> usize {
        self.constellations.len()
    }

    /// The instance of this number within a constellation.
    pub(super) fn instance(&self, constellation: usize, number: usize) -> Option<&Instance> {
        let within = self.constellations.get(constellation)?.instances.clone();
        self.instances.get(within)?.get(number)
    }

    /// The meshes of an object.
    pub(super) fn meshes(&self, object: usize) -> &[Mesh] {
        self.objects.get(object).and_then(|object| self.meshes.get(object.meshes.clone())).unwrap_or_default()
    }

    /// The name of a volume, by its number among the meshes of its object.
    pub(super) fn volume_of(&self, object: usize, mesh: usize) -> Option<&[u8]> {
        let first = self.objects.get(object)?.meshes.start;
        self.volume_names.get(&(first + mesh)).map(Vec::as_slice)
    }

    fn elements<'t>(
        &mut self,
        text: &'t [u8],
        tokens: &mut Tokens<'t>,
        context: &Context<'_>,
        intake: &mut Intake<'_>,
    ) -> std::result::Result<(), Stop> {
        loop {
            match tokens.next()?.ok_or(Trouble::CutOff)? {
                Token::Start(tag) => match *tokens.open() {
                    [_, b"object", b"mesh", name @ (b"vertices" | b"volume")] => {
                        let kind = if name == b"volume" { Kind::Triangles } else { Kind::Vertices };
                        self.is_coloured |= word(&tag, b"materialid").is_some();
                        self.supports += u64::from(kind == Kind::Triangles && word(&tag, b"type").as_deref() == Some(b"support"));
                        if kind == Kind::Triangles {
                            self.volume()?;
                        }
                        if !tokens.is_empty() {
                            if kind == Kind::Triangles {
                                self.name_volume(text, tokens);
                            }
                            self.children((text, tokens), kind, context, intake)?;
                        }
                    }
                    [_, b"object", b"mesh"] => self.mesh(intake)?,
                    _ => self.element(tag, tokens)?,
                },
                Token::End if tokens.open().is_empty() => return Ok(()),
                _ => {}
            }
        }
    }

    /// Counts one more object, constellation, instance or mesh.
    fn count(&self) -> std::result::Result<(), Stop> {
        let all = self.objects.len() + self.constellations.len() + self.instances.len() + self.meshes.len();
        if all < MOST {
            return Ok(());
        }
        let reason = format!("more than {} objects, constellations, instances and meshes", Count(MOST));
        Err(Stop::Refused(Rejection::Unreadable(reason)))
    }

    /// Reads the children of an element that holds vertices or triangles.
    fn children<'t>(
        &mut self,
        (text, tokens): (&'t [u8], &mut Tokens<'t>),
        kind: Kind,
        context: &Context<'_>,
        intake: &mut Intake<'_>,
    ) -> std::result::Result<(), Stop> {
        let (at, end) = intake.read(text, tokens.at(), (kind, tokens.open().len()), context)?;
        tokens.go_on_at(at);
        let first = self.meshes.last().map_or(0, |mesh| mesh.positions.start);
        for mesh in self.meshes.iter_mut().rev().take_while(|mesh| mesh.positions.start == first) {
            mesh.positions.end = intake.positions.count();
        }
        if let Some(mesh) = self.meshes.last_mut() {
            mesh.indices.end = intake.indices.count();
            mesh.rounding.append(std::mem::take(&mut intake.rounding));
        }
        match end {
            End::Closed | End::Reached => Ok(()),
            End::CutOff => Err(Trouble::CutOff.into()),
            End::Bad(trouble) => Err(trouble.into()),
        }
    }

    /// Begins a mesh of the last object.
    fn mesh(&mut self, intake: &Intake<'_>) -> std::result::Result<(), Stop> {
        let (position, index) = (intake.positions.count(), intake.indices.count());
        let own = self.objects.last().map_or(0, |object| object.meshes.len());
        if own > 0 && self.meshes.last().is_some_and(|mesh| mesh.indices.is_empty()) {
            // Without triangles: nothing of it is placed, and a million of such meshes in each of a million instances would take for ever.
            self.meshes.pop();
        }
        let mesh = Mesh { positions: position..position, indices: index..index, ..Mesh::default() };
        self.count()?;
        self.meshes.push(mesh);
        if let Some(object) = self.objects.last_mut() {
            object.meshes.end = self.meshes.len();
        }
        Ok(())
    }

    /// Begins a volume of the last mesh: the second one and those behind it are meshes of their own on the same vertices.
    fn volume(&mut self) -> std::result::Result<(), Stop> {
        let Some(mesh) = self.meshes.last().filter(|mesh| !mesh.indices.is_empty()) else { return Ok(()) };
        let (positions, end) = (mesh.positions.clone(), mesh.indices.end);
        if self.count().is_err() {
            // Too many to be told apart.
            return Ok(());
        }
        self.meshes.push(Mesh { positions, indices: end..end, rounding: Rounding::default() });
        if let Some(object) = self.objects.last_mut() {
            object.meshes.end = self.meshes.len();
        }
        Ok(())
    }

    /// Notes the name of the volume that has begun. It stands before the first triangle.
    fn name_volume(&mut self, text: &[u8], tokens: &Tokens<'_>) {
        let Some(mesh) = self.meshes.len().checked_sub(1).filter(|_| self.volume_names.len() < NAMES_KEPT) else { return };
        let name = name_ahead(Tokens::from(text, tokens.at(), tokens.open().len()));
        self.volume_names.extend(name.map(|name| (mesh, name)));
    }

    /// Reads an element that has begun, or its beginning.
    fn element(&mut self, tag: Tag<'_>, tokens: &mut Tokens<'_>) -> std::result::Result<(), Stop> {
        match *tokens.open() {
            // Early drafts called it units.
            [_] => self.unit = word(&tag, b"unit").or_else(|| word(&tag, b"units")),
            [_, b"object"] => {
                let id = word(&tag, b"id");
                if self.names.len() < NAMES_KEPT {
                    let name = id.clone().unwrap_or_default();
                    self.names.push(name.get(..LONGEST_NAME).unwrap_or(&name).to_vec());
                    self.titles.push(Vec::new());
                }
                self.items.push(Item::Object(self.objects.len()));
                let meshes = self.meshes.len()..self.meshes.len();
                self.count()?;
                self.objects.push(Object { id: id.map(hashed), meshes });
            }
            [_, b"constellation"] => {
                self.items.push(Item::Constellation(self.constellations.len()));
                let instances = self.instances.len()..self.instances.len();
                let constellation = Constellation { id: word(&tag, b"id").map(hashed), instances };
                self.count()?;
                self.constellations.push(constellation);
            }
            [_, b"constellation", b"instance"] => self.instance_of(tag, tokens)?,
            [_, b"metadata"] => self.metadata(tag, tokens)?,
            [_, b"object", b"metadata"] if word(&tag, b"type").as_deref() == Some(b"name") => {
                let name = tokens.content(LONGEST_NAME)?;
                if self.name_of_object.is_empty() {
                    self.name_of_object.clone_from(&name);
                }
                let last = self.objects.len().wrapping_sub(1);
                for names in [&mut self.names, &mut self.titles].into_iter().filter(|_| !name.is_empty()) {
                    names.get_mut(last).into_iter().for_each(|known| known.clone_from(&name));
                }
            }
            [_, b"object", b"metadata"] => self.metadata += 1,
            [.., name] => self.is_coloured |= is_colour(name),
            [] => {}
        }
        Ok(())
    }

    /// Reads what is said about the whole file.
    fn metadata(&mut self, tag: Tag<'_>, tokens: &mut Tokens<'_>) -> std::result::Result<(), Stop> {
        let of = word(&tag, b"type").unwrap_or_default();
        self.metadata += u64::from(of != b"name");
        if of.starts_with(b"slic3r") {
            self.radians = true;
        } else if of == b"name" && self.name.is_empty() {
            self.name = tokens.content(LONGEST_NAME)?;
        } else if of == b"cad" {
            let maker = tokens.content(LONGEST_NAME)?;
            self.radians |= [b"Slic3r".as_slice(), b"PrusaSlicer", b"SuperSlicer"].iter().any(|name| maker.starts_with(name));
        }
        Ok(())
    }

    /// Reads an instance that has begun.
    fn instance_of(&mut self, tag: Tag<'_>, tokens: &mut Tokens<'_>) -> std::result::Result<(), Stop> {
        let of = word(&tag, b"objectid").map(hashed);
        let mut instance = Instance { of, shift: [0.0; 3], angles: [0.0; 3], scale: [1.0; 3] };
        loop {
            match tokens.next()?.ok_or(Trouble::CutOff)? {
                Token::Start(tag) => {
                    let Some(places) = instance.places(tag.name) else {
                        tokens.skip()?;
                        continue;
                    };
                    let text = tokens.content(LONGEST_WORD)?;
                    let digits = text.trim_ascii_end();
                    let number = number::number(digits).filter(|number| number.length == digits.len() && number.wide.is_finite());
                    match number {
                        Some(number) if tag.name == b"scale" => places.fill(number.wide),
                        Some(number) if tag.name.starts_with(b"mirror") => {
                            places.iter_mut().for_each(|place| *place *= number.wide)
                        }
                        Some(number) => places.fill(number.wide),
                        None => self.odd_placements += 1,
                    }
                }
                Token::End => break,
                _ => {}
            }
        }
        self.scaled += u64::from(instance.scale != [1.0; 3]);
        self.count()?;
        self.instances.push(instance);
        if let Some(constellation) = self.constellations.last_mut() {
            constellation.instances.end = self.instances.len();
        }
        Ok(())
    }
}

impl Instance {
    /// The numbers that an element of this name sets. Scales and mirrors are Slic3r's.
    fn places(&mut self, name: &[u8]) -> Option<&mut [f64]> {
        let (of, axis): (&mut [f64; 3], _) = match name {
            b"scale" => return Some(&mut self.scale),
            [b'd', b'e', b'l', b't', b'a', axis] => (&mut self.shift, axis),
            [b'r', axis] => (&mut self.angles, axis),
            [b's', b'c', b'a', b'l', b'e', axis] | [b'm', b'i', b'r', b'r', b'o', b'r', axis] => (&mut self.scale, axis),
            _ => return None,
        };
        let axis = usize::from(axis.checked_sub(b'x')?);
        of.get_mut(axis..=axis)
    }
}

fn word(tag: &Tag<'_>, name: &[u8]) -> Option<Vec<u8>> {
    tag.attribute(name, LONGEST_WORD)
}

/// The name among the metadata that come next.
fn name_ahead(mut tokens: Tokens<'_>) -> Option<Vec<u8>> {
    loop {
        match tokens.next().ok()?? {
            Token::Start(tag) if tag.name != b"metadata" => return None,
            Token::Start(tag) if word(&tag, b"type").as_deref() == Some(b"name") => {
                return tokens.content(LONGEST_NAME).ok().filter(|name| !name.is_empty());
            }
            Token::Start(_) => tokens.skip().ok()?,
            Token::End => return None,
            Token::Text(_) | Token::Data(_) | Token::Aside => {}
        }
    }
}

fn hashed(id: Vec<u8>) -> Id {
    let hash = blake3::hash(&id);
    hash.as_bytes().first_chunk().copied().map(u128::from_le_bytes).unwrap_or_default()
}
