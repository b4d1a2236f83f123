//! Trimmed and bounded surfaces (144, 143) and faces of solids (510), with the curves around them.

use std::rc::Rc;

use super::build::Builder;
use super::directory::Entry;
use super::parameters::Parameters;
use super::places::Place;
use crate::curves::curve::{Id, Source};
use crate::curves::network::{Face, Use};

/// An entity of a surface, loops that bound it, whether the first one is its outer one, and a natural boundary counts as none.
struct Outline {
    surface: u32,
    loops: Vec<u32>,
    has_outer: bool,
}

impl Builder<'_> {
    /// 186 and 514: shells and faces.
    pub(super) fn faces_of(&mut self, entry: &Entry, around: Place, depth: usize) {
        let Some(parameters) = self.parameters(entry) else { return };
        let place = self.placed(entry, around);
        self.done.insert(entry.number);
        let mut numbers = Vec::new();
        if entry.kind == 186 {
            numbers.extend(parameters.pointer(1));
        }
        let (at, from) = if entry.kind == 186 { (3, 4) } else { (1, 2) };
        match parameters.count(at, from, 2) {
            Ok(count) => numbers.extend((0..count).filter_map(|number| parameters.pointer(from + 2 * number).ok())),
            Err(why) => self.damaged(entry, &why),
        }
        let around = self.is_void;
        for (at, number) in numbers.into_iter().enumerate() {
            // The first shell of a solid is the outer one.
            self.is_void = around || (entry.kind == 186 && at > 0);
            match self.directory.get(number) {
                Some(part) => self.thing(part, place, depth + 1),
                None => self.lost(entry, number),
            }
        }
        self.is_void = around;
    }

    /// A surface with its boundaries.
    pub(super) fn face(&mut self, entry: &Entry, around: Place) {
        let Some(parameters) = self.parameters(entry) else { return };
        let outline = match outline(entry, &parameters) {
            Ok(outline) => outline,
            Err(why) => return self.damaged(entry, &why),
        };
        self.done.insert(entry.number);
        let place = self.placed(entry, around);
        let mut loops: Vec<Vec<Use>> = Vec::with_capacity(outline.loops.len());
        let bound_by = outline.loops.first().copied();
        for number in outline.loops {
            let Some(bound) = self.directory.get(number).copied() else {
                self.lost(entry, number);
                loops.push(Vec::new());
                continue;
            };
            let found = match bound.kind {
                141 => self.boundary(&bound, place),
                142 => self.curve_on_surface(&bound, place),
                508 => self.edge_loop(&bound, place),
                _ => self.curves(number, place, 0).map(|uses| uses.to_vec()),
            };
            if found.is_none() {
                self.lost(entry, number);
            }
            let found = found.unwrap_or_default();
            self.collector.bound(&found);
            loops.push(found);
        }
        let outer = if outline.has_outer && !loops.is_empty() { loops.remove(0) } else { Vec::new() };
        let surface = self.directory.get(outline.surface).map(|surface| surface.kind.to_string()).unwrap_or_default();
        let told = self.told(outline.surface, (entry, bound_by), place);
        let source = Source { id: Id::Directory(entry.number.into()), line: entry.line };
        let is_untrimmed = !outline.has_outer;
        self.faces.push(Face {
            source,
            entity: entry.kind.to_string(),
            surface,
            told,
            outer,
            inner: loops,
            is_untrimmed,
            is_void: self.is_void,
        });
    }

    /// 142: the curve in space, if there is one.
    pub(super) fn curve_on_surface(&mut self, entry: &Entry, around: Place) -> Option<Vec<Use>> {
        let parameters = self.parameters(entry)?;
        let place = self.placed(entry, around);
        let number = match parameters.pointer(4) {
            Ok(number) => number,
            Err(why) => {
                self.damaged(entry, &why);
                return None;
            }
        };
        self.done.insert(entry.number);
        if number == 0 {
            return Some(self.boundary_of_parameters(entry, &parameters, place));
        }
        self.curves(number, place, 0).map(|uses| uses.to_vec())
    }

    /// 141: curves in space, each with its direction.
    pub(super) fn boundary(&mut self, entry: &Entry, around: Place) -> Option<Vec<Use>> {
        let parameters = self.parameters(entry)?;
        let place = self.placed(entry, around);
        let mut at = 5;
        let mut parts = Vec::new();
        let mut read = || -> Result<(), String> {
            for _ in 0..parameters.count(4, 5, 3)? {
                parts.push((parameters.pointer(at)?, parameters.integer(at + 1)? == 2));
                at += 3 + parameters.count(at + 2, at + 3, 1)?;
            }
            Ok(())
        };
        if let Err(why) = read() {
            self.damaged(entry, &why);
        }
        self.done.insert(entry.number);
        let mut uses = Vec::new();
        for (number, is_reversed) in parts {
            match self.curves(number, place, 0) {
                Some(found) => directed(&mut uses, &found, is_reversed),
                None => self.lost(entry, number),
            }
        }
        Some(uses)
    }

    /// 508: edges of lists, each with its direction; poles of surfaces have none.
    fn edge_loop(&mut self, entry: &Entry, place: Place) -> Option<Vec<Use>> {
        let parameters = self.parameters(entry)?;
        let mut at = 2;
        let mut edges = Vec::new();
        let mut read = || -> Result<(), String> {
            for _ in 0..parameters.count(1, 2, 5)? {
                if parameters.integer(at)? == 0 {
                    edges.push((parameters.pointer(at + 1)?, parameters.pointer(at + 2)?, parameters.integer(at + 3)? == 0));
                }
                at += 5 + 2 * parameters.count(at + 4, at + 5, 2)?;
            }
            Ok(())
        };
        if let Err(why) = read() {
            self.damaged(entry, &why);
        }
        let mut uses = Vec::new();
        for (list, number, is_reversed) in edges {
            let edge = self.edge_list(list).and_then(|edges| edges.get((number as usize).checked_sub(1)?).copied());
            let Some([curve, ends @ ..]) = edge else {
                self.lost(entry, list);
                continue;
            };
            match self.curves(curve, place, 0) {
                Some(found) => {
                    self.name_vertices(&found, ends, place);
                    directed(&mut uses, &found, is_reversed);
                }
                None => self.lost(entry, curve),
            }
        }
        Some(uses)
    }

    /// 504: edges, read once.
    fn edge_list(&mut self, number: u32) -> Option<Rc<[[u32; 5]]>> {
        if let Some(known) = self.edges.get(&number) {
            return Some(Rc::clone(known));
        }
        let entry = *self.directory.get(number).filter(|entry| entry.kind == 504)?;
        let parameters = self.parameters(&entry)?;
        let count = parameters.count(1, 2, 5).unwrap_or_else(|why| {
            self.damaged(&entry, &why);
            parameters.len().saturating_sub(2) / 5
        });
        let edge = |number: usize| {
            let at = 2 + 5 * number;
            let pointer = |at| parameters.pointer(at).unwrap_or(0);
            [pointer(at), pointer(at + 1), pointer(at + 2), pointer(at + 3), pointer(at + 4)]
        };
        let edges: Rc<[[u32; 5]]> = (0..count).map(edge).collect();
        self.edges.insert(number, Rc::clone(&edges));
        Some(edges)
    }

    /// Gives the vertices of an edge to its curve, or to the first and last of several.
    fn name_vertices(&mut self, uses: &[Use], [start_list, start, end_list, end]: [u32; 4], place: Place) {
        let &[one] = uses else { return };
        let next = self.vertices.len() as u64;
        let start = *self.vertices.entry((start_list, start, place)).or_insert(next);
        let next = self.vertices.len() as u64;
        let end = *self.vertices.entry((end_list, end, place)).or_insert(next);
        if let Some(curve) = self.collector.curves.get_mut(one.curve) {
            curve.vertices = Some([start, end]);
        }
    }
}

/// Adds curves in their direction or all the other way.
fn directed(uses: &mut Vec<Use>, found: &[Use], is_reversed: bool) {
    if is_reversed {
        uses.extend(found.iter().rev().map(|one| Use { is_reversed: !one.is_reversed, ..*one }));
    } else {
        uses.extend(found);
    }
}

fn outline(entry: &Entry, parameters: &Parameters) -> Result<Outline, String> {
    let list = |from: usize, count: usize| (from..from + count).map(|at| parameters.pointer(at)).collect::<Result<Vec<_>, _>>();
    match entry.kind {
        // The first boundary is taken for the outer one; the standard does not say which is.
        143 => Ok(Outline { surface: parameters.pointer(2)?, loops: list(4, parameters.count(3, 4, 1)?)?, has_outer: true }),
        510 => {
            let loops = list(4, parameters.count(2, 4, 1)?)?;
            // Without a loop that is told to be the outer one, the first is taken for it.
            Ok(Outline { surface: parameters.pointer(1)?, has_outer: !loops.is_empty(), loops })
        }
        _ => {
            let has_outer = parameters.integer(2)? != 0 && parameters.pointer(4)? != 0;
            let mut loops = Vec::new();
            if has_outer {
                loops.push(parameters.pointer(4)?);
            }
            loops.extend(list(5, parameters.count(3, 5, 1)?)?);
            Ok(Outline { surface: parameters.pointer(1)?, loops, has_outer })
        }
    }
}
