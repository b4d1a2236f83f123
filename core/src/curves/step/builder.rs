//! What is read of a file so far, and how its instances are asked for.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use super::index::Index;
use super::record::{Name, Record, records};
use super::text::decoded;
use crate::curves::collect::Collector;
use crate::curves::curve::Role;
use crate::curves::network::{Face, Unit, Use};
use crate::curves::vector::Affine;

/// What a context of representations says.
#[derive(Clone, Debug)]
pub(super) struct Context {
    pub(super) unit: Option<Unit>,
    /// Radians of its unit of angles.
    pub(super) angle: f64,
    /// In its unit of length.
    pub(super) uncertainty: Option<f64>,
}

/// Things within each other, at most.
pub(super) const DEEPEST: usize = 32;
/// Bytes of an instance, at most; its values take some 16 times as much memory.
const LONGEST: usize = 1 << 26;
/// Instances of assemblies, at most.
const MOST_INSTANCES: u32 = 1_000_000;

/// The number of a placement; 0 is that of nothing moved.
pub(super) type Place = usize;

/// The parts of a network that are read so far.
pub(super) struct Builder<'a> {
    pub(super) index: &'a Index<'a>,
    pub(super) collector: Collector,
    pub(super) faces: Vec<Face>,
    /// Curves that an instance became, by where it is placed.
    pub(super) known: HashMap<(u64, Place), Rc<[Use]>>,
    /// Faces and sets that were read, by where they are placed.
    pub(super) visited: HashSet<(u64, Place)>,
    /// Instances that were read anywhere.
    pub(super) done: HashSet<u64>,
    pub(super) vertices: HashMap<(u64, Place), u64>,
    /// Instances that are invisible.
    pub(super) blanked: HashSet<u64>,
    pub(super) digits: u32,
    /// Radians of the unit of angles, and the uncertainty, where it reads now.
    pub(super) angle: f64,
    pub(super) uncertainty: f64,
    /// Whether it reads a curve of two dimensions now.
    pub(super) is_flat: bool,
    /// Whether it reads a shell around a void now.
    pub(super) is_void: bool,
    /// What curves are for that it reads now.
    pub(super) role: Role,
    pub(super) shape_items: Option<HashSet<u64>>,
    /// Representations of aspects of shapes.
    pub(super) aspects: HashSet<u64>,
    /// Composites that are being read.
    pub(super) open: Vec<u64>,
    pub(super) maps: Vec<Affine>,
    pub(super) contexts: HashMap<u64, Context>,
    /// Bytes of instances that may still be read: those that many refer to count each time.
    pub(super) room: usize,
    pub(super) instances: u32,
}

impl<'a> Builder<'a> {
    /// Of a file of so many bytes, of which nothing is read yet.
    pub(super) fn new(index: &'a Index<'a>, collector: Collector, bytes: usize) -> Self {
        Self {
            index,
            collector,
            faces: Vec::new(),
            known: HashMap::new(),
            visited: HashSet::new(),
            done: HashSet::new(),
            vertices: HashMap::new(),
            blanked: HashSet::new(),
            digits: 0,
            angle: 1.0,
            uncertainty: 0.0,
            is_flat: false,
            is_void: false,
            role: Role::Free,
            shape_items: None,
            aspects: HashSet::new(),
            open: Vec::new(),
            maps: vec![Affine::IDENTITY],
            contexts: HashMap::new(),
            room: 32 * bytes + (1 << 20),
            instances: 0,
        }
    }

    /// Instances by the name of their entity, in the order of the file; complex ones have none.
    pub(super) fn ids(&self, is_one: impl Fn(Name<'_>) -> bool) -> Vec<u64> {
        let places = self.index.places.iter();
        places.filter(|place| is_one(self.index.name(**place))).map(|place| place.id).collect()
    }

    /// Records of an instance.
    pub(super) fn records(&mut self, id: u64) -> Result<Vec<Record<'a>>, String> {
        let place = self.index.get(id).ok_or_else(|| format!("#{id} is not in the file"))?;
        let text = self.index.text(place);
        let Some(room) = self.room.checked_sub(text.len()) else {
            return Err("the file refers to the same instances too often".into());
        };
        if text.len() > LONGEST {
            return Err(format!("#{id} is longer than 64 MiB"));
        }
        self.room = room;
        records(text).map_err(|why| format!("#{id} in line {}: {why}", place.line))
    }

    /// The record of an instance that has one of some names.
    pub(super) fn record(&mut self, id: u64, names: &[&str]) -> Result<Record<'a>, String> {
        let records = self.records(id)?;
        let found = records.into_iter().find(|record| names.iter().any(|name| record.name.is(name)));
        found.ok_or_else(|| format!("#{id} is no {}", names.first().copied().unwrap_or_default()))
    }

    /// The line of an instance.
    pub(super) fn line(&self, id: u64) -> u64 {
        self.index.get(id).map_or(0, |place| place.line)
    }

    /// Its name for people, if it is one.
    pub(super) fn name(&mut self, id: u64) -> Option<String> {
        let records = self.records(id).ok()?;
        let named = records.iter().find(|record| record.name.is("REPRESENTATION_ITEM"));
        let name = named.or(records.first())?.text(0).map(decoded)?;
        Some(name).filter(|name| !name.trim().is_empty() && name != "NONE")
    }

    /// Notes a finding about an instance.
    pub(super) fn note(&mut self, id: u64, kind: &'static str, why: &str) {
        let text = if why.is_empty() { format!("#{id}") } else { format!("#{id}: {why}") };
        let line = self.line(id);
        self.collector.findings.add(line, kind, text);
    }

    /// Counts what is not read, each instance once.
    pub(super) fn note_unread(&mut self, id: u64, name: &str) {
        if self.done.insert(id) {
            let line = self.line(id);
            self.collector.findings.unread(line, name);
        }
    }

    /// Whether another instance of an assembly may be read.
    pub(super) fn count_instance(&mut self, by: u64) -> bool {
        self.instances += 1;
        if self.instances > MOST_INSTANCES {
            self.note(by, "more than a million instances", "");
        }
        self.instances <= MOST_INSTANCES
    }

    /// A placement within another one.
    pub(super) fn within(&mut self, around: Place, map: &Affine) -> Place {
        self.maps.push(self.map_of(around).after(map));
        self.maps.len() - 1
    }

    /// The map of a placement.
    pub(super) fn map_of(&self, place: Place) -> Affine {
        self.maps.get(place).copied().unwrap_or(Affine::IDENTITY)
    }
}
