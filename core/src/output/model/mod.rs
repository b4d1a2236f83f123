//! A mesh in a 3MF model part, written as a repair left it.
//!
//! **In:** the text of the part, and what became of the mesh's triangles.
//! **Out:** the text with new vertices behind the old ones, the triangles of the output, and sets of triangles with their new numbers.
//! **Promise:** whatever is not of a triangle or a vertex that changed stays byte for byte. A triangle that is untouched keeps its attributes, one that
//! was cut hands them to its parts, a new one takes those of most of its rim. So it is with the sets that it is in.
//!
//! By the 3MF Core Specification 1.3, sections 4.1 and 5.1.3; paint by [`crate::attributes::paint`].

mod elements;
mod inherit;
mod plan;
mod sets;
mod votes;

use std::collections::BTreeSet;
use std::io::Write;

use crate::contract::error::Result;
use crate::io::record;
use elements::Element;
pub(crate) use elements::Elements;
use inherit::Attribute;
pub(crate) use inherit::weights;
pub(crate) use plan::{Change, Fate, MeshText, Unit};
use plan::{Plan, UnitPlan};
use sets::{IN_NONE, Runs, Sets};

/// Bytes of text that are given on at once.
const BATCH: usize = 256 << 10;

/// What became of attributes, in triangles that have any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Account {
    /// Triangles of the input that say the same of each of their places as before.
    pub(crate) kept: u64,
    /// Triangles of the output that are parts of others and say the same of each place, but for rounding.
    pub(crate) divided: u64,
    /// Those that are parts, or turned, and say it about.
    pub(crate) approximated: u64,
    /// New triangles that took the attributes of their rim.
    pub(crate) inherited: u64,
    /// Triangles of the input that had attributes, and of which nothing is left.
    pub(crate) lost: u64,
}

impl Account {
    /// Joins that of another mesh.
    pub(crate) fn add(&mut self, other: Self) {
        self.kept += other.kept;
        self.divided += other.divided;
        self.approximated += other.approximated;
        self.inherited += other.inherited;
        self.lost += other.lost;
    }
}

/// A mesh that was written.
pub(crate) struct Written {
    /// Up to here, the text of the part is written.
    pub(crate) at: usize,
    pub(crate) account: Account,
    /// The triangles of each unit.
    pub(crate) triangles: Vec<u64>,
    /// Its sets of triangles are left out: there are too many, or they are in a form that is not understood.
    pub(crate) is_without_sets: bool,
}

/// Does each triangle of these units refer to the vertex that [`write()`] would have it refer to?
pub(crate) fn is_numbered_once(mesh: &MeshText<'_>, units: &[Unit<'_>]) -> bool {
    let plan = Plan::of(mesh, units);
    mesh.elements().all(|element| plan.canonical(element.vertices) == element.vertices)
}

/// Writes the text from byte `at` on to the end of the triangles of `mesh`, which are in these units, and of their sets. O(n) in the triangles.
///
/// # Errors
/// Those of `sink`.
pub(crate) fn write(
    mesh: &MeshText<'_>,
    units: &[Unit<'_>],
    at: usize,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<Written> {
    let plan = Plan::of(mesh, units);
    let came = u32::try_from(units.iter().map(|unit| unit.triangles).sum::<usize>()).unwrap_or(u32::MAX);
    let sets = mesh.sets.clone().and_then(|range| Sets::parse(mesh.text, range, came));
    let mut writer = Writer {
        mesh,
        plan: &plan,
        sets: sets.as_ref(),
        at,
        seen: 0,
        batch: Vec::new(),
        result: Ok(()),
        sink,
        account: Account::default(),
        count: 0,
        runs: Runs::default(),
    };
    writer.vertices();
    let mut elements = mesh.elements();
    let mut triangles = Vec::new();
    for (unit, unit_plan) in units.iter().zip(&plan.units) {
        writer.count = 0;
        match &unit.change {
            None => writer.keep(unit.triangles, &mut elements),
            Some(change) => writer.changed(change, unit_plan, &mut elements),
        }
        triangles.push(writer.count);
    }
    writer.copy_to(mesh.triangles.end);
    let is_without_sets = !writer.sets();
    writer.flush();
    writer.result?;
    Ok(Written { at: writer.at, account: writer.account, triangles, is_without_sets })
}

struct Writer<'w, 't> {
    mesh: &'w MeshText<'t>,
    plan: &'w Plan<'t>,
    /// Of the triangles, if they are understood.
    sets: Option<&'w Sets<'t>>,
    /// Up to here, the text is written.
    at: usize,
    /// Up to here, its triangles are dealt with: those that stay are copied when one that does not stay follows.
    seen: usize,
    /// Waits to be given on.
    batch: Vec<u8>,
    /// The first error of `sink`; nothing is written after it.
    result: Result<()>,
    sink: &'w mut dyn FnMut(&[u8]) -> Result<()>,
    account: Account,
    /// Triangles of the unit so far.
    count: u64,
    /// The classes of all triangles so far, by the sets that they are in.
    runs: Runs,
}

impl Writer<'_, '_> {
    fn flush(&mut self) {
        if self.result.is_ok() && !self.batch.is_empty() {
            self.result = (self.sink)(&self.batch);
        }
        self.batch.clear();
    }

    fn put(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(BATCH) {
            self.batch.extend_from_slice(part);
            if self.batch.len() >= BATCH {
                self.flush();
            }
        }
    }

    /// Copies the text up to a place.
    fn copy_to(&mut self, to: usize) {
        if to > self.at {
            self.put(self.mesh.text.get(self.at..to).unwrap_or_default());
            self.at = to;
        }
    }

    fn vertices(&mut self) {
        let within = self.mesh.vertices_within.clone();
        // `</`, and the prefix that the elements around have.
        let tag = self.mesh.text.get(within.end + 2..).unwrap_or_default();
        let name = tag.get(..tag.iter().position(|byte| !is_of_name(*byte)).unwrap_or(0)).unwrap_or_default();
        let prefix = name.strip_suffix(b"vertices").unwrap_or_default();
        let (mut elements, mut number) = (Elements::within(self.mesh.text, within.clone()), 0);
        for insert in &self.plan.inserts {
            let last = self.mesh.vertices.len() as u32;
            let mut to = within.end;
            // The end of the vertex before.
            while insert.at < last && number < insert.at {
                let Some(vertex) = elements.next_called(b"vertex") else { break };
                (number, to) = (number + 1, vertex.whole.end);
            }
            self.copy_to(to);
            let range = insert.fresh.start as usize..insert.fresh.end as usize;
            let mut text = Vec::new();
            for [x, y, z] in self.plan.fresh.get(range).unwrap_or_default() {
                text.extend_from_slice(b"<");
                text.extend_from_slice(prefix);
                // Writing to a vector cannot fail.
                let _ = writeln!(text, "vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>");
            }
            self.put(&text);
        }
        self.copy_to(self.mesh.triangles.start);
    }

    /// Leaves so many triangles as they are.
    fn keep(&mut self, triangles: usize, elements: &mut Elements<'_>) {
        for element in elements.by_ref().take(triangles) {
            self.account.kept += u64::from(!element.attributes.is_empty());
            self.stay(&element, element.vertices);
        }
    }

    fn changed(&mut self, change: &Change<'_>, unit: &UnitPlan<'_>, elements: &mut Elements<'_>) {
        let has_new = || {
            let mut has = false;
            change.each(|fate| has |= matches!(fate, Fate::New(_)));
            has
        };
        let voters = || votes::count((self.mesh, self.sets), self.plan, unit, change, &mut elements.clone());
        let new = if has_new() { voters() } else { Vec::new() };
        let name = elements.clone().next().map_or(b"triangle".to_vec(), |element| element.name.to_vec());
        let mut used = BTreeSet::new();
        let (mut faces, mut k) = (unit.faces.iter(), 0);
        change.each(|fate| {
            // Of faces that stand in the plan.
            let is_planned = matches!(fate, Fate::Moved(_) | Fate::Part(..) | Fate::New(_));
            let face = if is_planned { faces.next().copied().unwrap_or_default() } else { [0; 3] };
            k += usize::from(is_planned);
            match fate {
                Fate::Kept => self.next_kept(elements),
                Fate::Turned => self.next_turned(elements),
                Fate::Moved(_) => {
                    let Some(element) = elements.next() else { return };
                    self.account.kept += u64::from(!element.attributes.is_empty());
                    self.replace(&element, face, &inherit::all(&element));
                }
                Fate::Gone => {
                    let Some(element) = elements.next() else { return };
                    // Whether parts of it are left is known at the end.
                    self.account.lost += u64::from(!element.attributes.is_empty());
                    self.copy_to(element.whole.start);
                    self.pass(&element);
                }
                Fate::Part(of, corners) => {
                    let Some(element) = unit.parted.get(&of) else { return };
                    let came = change.came.get(of as usize).map(record::corners).unwrap_or_default();
                    let inherited = inherit::part(element, corners.map(|corner| weights(came, corner)));
                    if !element.attributes.is_empty() {
                        used.insert(of);
                        let count = if inherited.is_exact { &mut self.account.divided } else { &mut self.account.approximated };
                        *count += 1;
                    }
                    self.add(element.name, face, &inherited.attributes, self.class_of(element));
                }
                Fate::New(_) => {
                    let (attributes, class) = new.get(k - 1).cloned().unwrap_or_default();
                    self.account.inherited += u64::from(!attributes.is_empty());
                    self.add(&name, face, &attributes, class);
                }
            }
        });
        self.account.lost = self.account.lost.saturating_sub(used.len() as u64);
    }

    fn next_kept(&mut self, elements: &mut Elements<'_>) {
        let Some(element) = elements.next() else { return };
        self.account.kept += u64::from(!element.attributes.is_empty());
        self.stay(&element, self.plan.canonical(element.vertices));
    }

    /// Leaves a triangle as it stands, unless its vertices have other numbers now.
    fn stay(&mut self, element: &Element<'_>, vertices: [u32; 3]) {
        if self.plan.placed(vertices) == element.vertices {
            self.seen = element.whole.end;
            self.count_one(self.class_of(element));
        } else {
            self.replace(element, vertices, &inherit::all(element));
        }
    }

    fn next_turned(&mut self, elements: &mut Elements<'_>) {
        let Some(element) = elements.next() else { return };
        let [a, b, c] = self.plan.canonical(element.vertices);
        let turned = inherit::turned(&element);
        if !element.attributes.is_empty() {
            let count = if turned.is_exact { &mut self.account.kept } else { &mut self.account.approximated };
            *count += 1;
        }
        self.replace(&element, [a, c, b], &turned.attributes);
    }

    /// Writes a triangle in the place of that of the text.
    fn replace(&mut self, element: &Element<'_>, vertices: [u32; 3], attributes: &[Attribute]) {
        self.copy_to(element.whole.start);
        self.put_triangle(element.name, vertices, attributes);
        self.count_one(self.class_of(element));
        self.pass(element);
    }

    /// Leaves out a triangle of the text.
    fn pass(&mut self, element: &Element<'_>) {
        (self.at, self.seen) = (element.whole.end, element.whole.end);
    }

    /// Writes a triangle behind those that were dealt with.
    fn add(&mut self, name: &[u8], vertices: [u32; 3], attributes: &[Attribute], class: u32) {
        self.copy_to(self.seen);
        self.put(b"\n");
        self.put_triangle(name, vertices, attributes);
        self.count_one(class);
    }

    /// Counts a triangle that is in the sets of this class.
    fn count_one(&mut self, class: u32) {
        self.count += 1;
        self.runs.push(class);
    }

    /// The class of a triangle of the text.
    fn class_of(&self, element: &Element<'_>) -> u32 {
        self.sets.map_or(IN_NONE, |sets| sets.class_of(element.number))
    }

    /// Writes the sets; `false`: they are left out.
    fn sets(&mut self) -> bool {
        let Some(range) = self.mesh.sets.clone() else { return true };
        self.copy_to(range.start);
        self.at = range.end;
        let (sets, runs) = (self.sets, std::mem::take(&mut self.runs));
        sets.and_then(|sets| sets.write(&runs, &mut |bytes| self.put(bytes))).is_some()
    }

    fn put_triangle(&mut self, name: &[u8], vertices: [u32; 3], attributes: &[Attribute]) {
        let [a, b, c] = self.plan.placed(vertices);
        let mut tag = b"<".to_vec();
        tag.extend_from_slice(name);
        let _ = write!(tag, " v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"");
        for (name, value) in attributes {
            // A value holds at most one of the two marks, that which does not stand around it.
            let quote = if value.contains(&b'"') { b'\'' } else { b'"' };
            tag.push(b' ');
            tag.extend_from_slice(name);
            tag.extend([b'=', quote]);
            tag.extend_from_slice(value);
            tag.push(quote);
        }
        tag.extend_from_slice(b"/>");
        self.put(&tag);
    }
}

fn is_of_name(byte: u8) -> bool {
    !byte.is_ascii_whitespace() && byte != b'>'
}
