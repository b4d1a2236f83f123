//! Entities become curves: first those of instances and faces with all that belongs to them, then what is left.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use super::directory::{Directory, Entry};
use super::global::Global;
use super::names::name;
use super::parameters::Parameters;
use super::places::{HERE, Place, Places};
use super::relations::Relations;
use super::shapes;
use crate::curves::collect::Collector;
use crate::curves::curve::{Curve, Id, Role, Source};
use crate::curves::network::{Face, Network, Use};
use crate::curves::vector::Affine;
use crate::util::legible::legible;

/// Composites and instances within each other, at most.
pub(super) const DEEPEST: usize = 32;
/// Instances of subfigures that are followed, at most.
const MOST_INSTANCES: u32 = 1_000_000;

/// What is read so far.
pub(super) struct Builder<'a> {
    pub(super) directory: &'a Directory<'a>,
    pub(super) relations: Relations,
    pub(super) collector: Collector,
    pub(super) places: Places,
    pub(super) faces: Vec<Face>,
    /// Curves that an entity became, by where it is placed.
    known: HashMap<(u32, Place), Rc<[Use]>>,
    /// Entities that are read, or found to be damaged.
    pub(super) done: HashSet<u32>,
    /// Edges of lists (504): curve, and numbers of the lists and places of both vertices.
    pub(super) edges: HashMap<u32, Rc<[[u32; 5]]>>,
    pub(super) vertices: HashMap<(u32, u32, Place), u64>,
    /// Of the file, in its unit.
    pub(super) resolution: Option<f64>,
    /// Composites that are being read.
    open: Vec<u32>,
    /// Bytes of parameters that may still be read: those of an entity that many refer to count each time.
    room: usize,
    instances: u32,
    digits: u32,
    /// Whether it reads a shell around a void now.
    pub(super) is_void: bool,
}

impl<'a> Builder<'a> {
    /// For a file of so many bytes.
    pub(super) fn new(directory: &'a Directory<'a>, collector: Collector, bytes: usize) -> Self {
        Self {
            directory,
            relations: Relations::of(directory, 16 * bytes + (1 << 20)),
            collector,
            places: Places::new(),
            faces: Vec::new(),
            known: HashMap::new(),
            done: HashSet::new(),
            edges: HashMap::new(),
            vertices: HashMap::new(),
            resolution: None,
            open: Vec::new(),
            room: 16 * bytes + (1 << 20),
            instances: 0,
            digits: 0,
            is_void: false,
        }
    }

    /// Reads everything.
    pub(super) fn network(mut self, global: Global) -> Network {
        let directory = self.directory;
        self.resolution = global.resolution;
        let is_top = |builder: &Self, entry: &Entry| {
            let used = builder.relations.get(entry.number);
            !used.as_part && !used.as_member
        };
        for entry in &directory.entries {
            if matches!(entry.kind, 143 | 144 | 186 | 408 | 412 | 414 | 430 | 510 | 514) && is_top(&self, entry) {
                self.thing(entry, HERE, 0);
            }
        }
        // Whatever belongs to a face or a subfigure that is damaged, or placed nowhere, is read where it is defined.
        for kinds in [&[143, 144, 510][..], &[141, 142][..]] {
            for entry in directory.entries.iter().filter(|entry| kinds.contains(&entry.kind)) {
                if !self.done.contains(&entry.number) {
                    self.thing(entry, HERE, 0);
                }
            }
        }
        self.rest(102);
        for kind in [100, 104, 106, 110, 112, 126, 130] {
            self.rest(kind);
        }
        self.unread();
        let Collector { mut curves, mut findings, .. } = self.collector;
        if curves.is_empty() {
            findings.add(0, "the file has no curve in space", "");
        }
        curves.shrink_to_fit();
        let (unit, resolution, digits) = (global.unit, global.resolution, self.digits);
        Network { unit, resolution, digits, curves, faces: self.faces, findings: findings.finish() }
    }

    /// Curves of a type that nothing has led to.
    fn rest(&mut self, kind: u32) {
        let directory = self.directory;
        for entry in directory.entries.iter().filter(|entry| entry.kind == kind) {
            let used = self.relations.get(entry.number);
            if self.done.contains(&entry.number) {
                continue;
            }
            if used.as_parametric || entry.usage == 5 {
                self.done.insert(entry.number);
                if kind != 102 {
                    self.collector.findings.unread(entry.line, "curve in the space of parameters of a surface");
                }
                continue;
            }
            if kind == 102 && used.as_part {
                continue;
            }
            if used.as_member {
                self.flaw(entry, "a subfigure is placed nowhere; its curve is read where it is defined");
            }
            let uses = self.curves(entry.number, HERE, 0);
            let role = if used.as_generator {
                Role::Generator
            } else if matches!(entry.usage, 1 | 4 | 6) {
                Role::Aid
            } else {
                Role::Free
            };
            for one in uses.iter().flat_map(|uses| uses.iter()) {
                if let Some(curve) = self.collector.curves.get_mut(one.curve).filter(|curve| curve.role == Role::Free) {
                    curve.role = role;
                }
            }
        }
    }

    /// Names what is not read.
    fn unread(&mut self) {
        for entry in &self.directory.entries {
            let used = self.relations.get(entry.number);
            if entry.kind == 102 && !used.as_parametric && !self.done.contains(&entry.number) {
                self.flaw(entry, "nothing leads to a composite, or it contains itself; its curves are read one by one");
            }
            let is_surface = matches!(entry.kind, 108 | 114 | 118 | 120 | 122 | 128 | 140 | 190..=198);
            if is_surface && !used.as_surface {
                self.faces.push(Face {
                    source: Source { id: Id::Directory(entry.number.into()), line: entry.line },
                    entity: entry.kind.to_string(),
                    surface: entry.kind.to_string(),
                    told: None,
                    outer: Vec::new(),
                    inner: Vec::new(),
                    is_untrimmed: true,
                    is_void: false,
                });
            }
            let is_read =
                matches!(entry.kind, 102 | 124 | 141..=144 | 186 | 308 | 408 | 412 | 414 | 430 | 502 | 504 | 508 | 510 | 514);
            if !is_read && !self.done.contains(&entry.number) && !shapes::is_curve(entry) {
                self.collector.findings.unread(entry.line, name(entry.kind, entry.form));
            }
        }
    }

    /// Notes what is wrong with an entity.
    pub(super) fn flaw(&mut self, entry: &Entry, kind: &'static str) {
        self.collector.findings.add(entry.line, kind, format!("D{} of type {}", entry.number, entry.kind));
    }

    /// Notes why an entity is not read.
    pub(super) fn damaged(&mut self, entry: &Entry, why: &str) {
        self.done.insert(entry.number);
        let text = format!("D{} of type {}, {}", entry.number, entry.kind, legible(why));
        self.collector.findings.add(entry.line, "damaged and not read", text);
    }

    /// Parameters of an entity; nothing of one that is damaged, which is noted.
    pub(super) fn parameters(&mut self, entry: &Entry) -> Option<Parameters> {
        if self.room == 0 {
            return None;
        }
        match self.directory.parameters(entry) {
            Ok(parameters) => {
                self.room = self.room.saturating_sub(parameters.length);
                if self.room == 0 {
                    self.flaw(entry, "the file refers to the same entities too often; the rest of it is left out");
                }
                Some(parameters)
            }
            Err(why) => {
                if !self.done.contains(&entry.number) {
                    self.damaged(entry, &why);
                }
                None
            }
        }
    }

    /// Where an entity is, by its own matrix within a placement.
    pub(super) fn placed(&mut self, entry: &Entry, around: Place) -> Place {
        if entry.matrix == 0 {
            return around;
        }
        match self.places.matrix(self.directory, entry.matrix) {
            Ok(map) => self.places.within(around, (entry.matrix, 0), || map),
            Err(why) => {
                let text = format!("D{}: {}", entry.number, legible(&why));
                self.collector.findings.add(entry.line, "an entity is read without its matrix", text);
                around
            }
        }
    }

    /// Anything that a subfigure or a solid may have.
    pub(super) fn thing(&mut self, entry: &Entry, around: Place, depth: usize) {
        if depth > DEEPEST {
            return self.flaw(entry, "entities are more than 32 within each other");
        }
        match entry.kind {
            408 => self.instance(entry, around, depth),
            412 | 414 => self.array(entry, around, depth),
            430 => self.solid_instance(entry, around, depth),
            186 | 514 => self.faces_of(entry, around, depth),
            143 | 144 | 510 => self.face(entry, around),
            141 => drop(self.boundary(entry, around)),
            142 => drop(self.curve_on_surface(entry, around)),
            _ if entry.kind == 102 || shapes::is_curve(entry) || entry.kind == 130 => {
                drop(self.curves(entry.number, around, depth))
            }
            _ => {}
        }
    }

    /// 408: a subfigure (308), shifted and scaled.
    fn instance(&mut self, entry: &Entry, around: Place, depth: usize) {
        if !self.count_instance(entry) {
            return;
        }
        let Some(parameters) = self.parameters(entry) else { return };
        let read = || -> Result<_, String> {
            let scale = if parameters.len() > 5 { parameters.real(5)? } else { 1.0 };
            let scale = if scale == 0.0 { 1.0 } else { scale };
            Ok((parameters.pointer(1)?, Affine { shift: parameters.point(2)?, ..Affine::scaling(scale) }))
        };
        let (figure, map) = match read() {
            Ok(read) => read,
            Err(why) => return self.damaged(entry, &why),
        };
        let Some(&figure) = self.directory.get(figure).filter(|figure| figure.kind == 308) else {
            return self.damaged(entry, "its subfigure is none");
        };
        self.done.insert(entry.number);
        let around = self.placed(entry, around);
        let place = self.places.within(around, (entry.number, 0), || map);
        self.figure(&figure, place, depth);
    }

    /// Whether another instance may be read.
    pub(super) fn count_instance(&mut self, entry: &Entry) -> bool {
        self.instances = self.instances.saturating_add(1);
        if self.instances > MOST_INSTANCES {
            self.flaw(entry, "more than a million instances of subfigures");
        }
        self.instances <= MOST_INSTANCES
    }

    /// 308: all that a subfigure has.
    pub(super) fn figure(&mut self, figure: &Entry, place: Place, depth: usize) {
        let Some(parameters) = self.parameters(figure) else { return };
        let place = self.placed(figure, place);
        self.done.insert(figure.number);
        let count = parameters.count(3, 4, 1).unwrap_or_else(|why| {
            self.damaged(figure, &why);
            parameters.len().saturating_sub(4)
        });
        for number in (4..4 + count).filter_map(|at| parameters.pointer(at).ok()) {
            if let Some(member) = self.directory.get(number) {
                self.thing(member, place, depth + 1);
            }
        }
    }

    /// 430: a solid, placed.
    fn solid_instance(&mut self, entry: &Entry, around: Place, depth: usize) {
        let Some(parameters) = self.parameters(entry) else { return };
        let place = self.placed(entry, around);
        if let Some(solid) = parameters.pointer(1).ok().and_then(|number| self.directory.get(number)) {
            self.thing(solid, place, depth + 1);
        }
    }

    /// Curves that an entity is made of, one behind the other; nothing if it is none.
    pub(super) fn curves(&mut self, number: u32, around: Place, depth: usize) -> Option<Rc<[Use]>> {
        let entry = *self.directory.get(number)?;
        let place = self.placed(&entry, around);
        if let Some(known) = self.known.get(&(number, place)) {
            return Some(Rc::clone(known));
        }
        let uses: Vec<Use> = match entry.kind {
            102 if self.open.contains(&number) => {
                self.damaged(&entry, "a composite contains itself");
                return None;
            }
            102 => {
                self.open.push(number);
                let uses = self.composite(&entry, place, depth);
                self.open.pop();
                uses?
            }
            _ => vec![self.curve(&entry, place)?],
        };
        let uses: Rc<[Use]> = uses.into();
        self.known.insert((number, place), Rc::clone(&uses));
        Some(uses)
    }

    fn curve(&mut self, entry: &Entry, place: Place) -> Option<Use> {
        if !shapes::is_curve(entry) && entry.kind != 130 {
            return None;
        }
        let parameters = self.parameters(entry)?;
        if shapes::is_cloud(entry, &parameters) {
            if self.done.insert(entry.number) {
                self.collector.findings.unread(entry.line, name(entry.kind, entry.form));
            }
            return None;
        }
        let read = if entry.kind == 130 { self.offset(&parameters, 0) } else { shapes::shape(entry, &parameters) };
        match read {
            Ok((shape, odd)) => {
                self.done.insert(entry.number);
                self.digits = self.digits.max(parameters.digits);
                if entry.usage == 5 {
                    self.flaw(entry, "a boundary in space is marked as one in the space of parameters; read as it is");
                }
                if let Some(odd) = odd {
                    self.collector.findings.add(entry.line, "an odd curve", format!("D{}: {odd}", entry.number));
                }
                let shape = shape.transformed(&self.places.map(place));
                let source = Source { id: Id::Directory(entry.number.into()), line: entry.line };
                let (name, role, is_blanked) = (entry.name(), Role::Free, entry.is_blanked);
                let curve = self.collector.push(Curve { shape, source, name, role, is_blanked, vertices: None })?;
                Some(Use { curve, is_reversed: false })
            }
            Err(why) => {
                self.damaged(entry, &why);
                None
            }
        }
    }

    /// 102: other curves one behind the other; those that are damaged are left out.
    fn composite(&mut self, entry: &Entry, place: Place, depth: usize) -> Option<Vec<Use>> {
        if depth > DEEPEST {
            self.damaged(entry, "composites are more than 32 within each other");
            return None;
        }
        let parameters = self.parameters(entry)?;
        let count = match parameters.count(1, 2, 1) {
            Ok(count) => count,
            Err(why) => {
                self.damaged(entry, &why);
                parameters.len().saturating_sub(2)
            }
        };
        self.done.insert(entry.number);
        let mut uses = Vec::new();
        for number in (2..2 + count).filter_map(|at| parameters.pointer(at).ok()) {
            match self.directory.get(number) {
                // Points between curves are allowed, and mean nothing here.
                Some(part) if matches!(part.kind, 116 | 132) => {}
                Some(part) => {
                    let part = *part;
                    let found = self.curves(number, place, depth + 1);
                    if found.is_none() {
                        self.lost(entry, part.number);
                    }
                    uses.extend(found.iter().flat_map(|found| found.iter().copied()));
                }
                None => self.lost(entry, number),
            }
        }
        Some(uses)
    }

    /// Notes that an entity refers to a curve that is not there.
    pub(super) fn lost(&mut self, entry: &Entry, number: u32) {
        let text = format!("D{} of type {} needs D{number}", entry.number, entry.kind);
        self.collector.findings.add(entry.line, "a curve is missing", text);
    }
}
