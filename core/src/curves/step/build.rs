//! From representations to curves: assemblies first, then whatever nothing has led to.

use std::collections::HashSet;

use super::assembly::Assembly;
use super::builder::{Builder, Context, DEEPEST, Place};
use super::faces::FACES;
use super::index::Index;
use super::record::Name;
use crate::curves::collect::Collector;
use crate::curves::curve::Role;
use crate::curves::network::{Network, ReadError, Unit};
use crate::curves::vector::Affine;

/// Reads a file.
pub(super) fn read(text: &[u8]) -> Result<Network, ReadError> {
    let mut collector = Collector::new(text.len());
    let index = Index::of(text, &mut collector.findings);
    if index.places.is_empty() {
        return Err(ReadError::NoData);
    }
    if !index.is_complete {
        collector.findings.add(0, "the file has no end; it may be cut off", "");
    }
    let builder = Builder::new(&index, collector, text.len());
    Ok(builder.network())
}

fn is_representation(name: Name<'_>) -> bool {
    let end = b"SHAPE_REPRESENTATION";
    let is_shape =
        name.0.len() >= end.len() && name.0.get(name.0.len() - end.len()..).is_some_and(|last| last.eq_ignore_ascii_case(end));
    (is_shape && !name.is("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION")) || name.is("CONSTRUCTIVE_GEOMETRY_REPRESENTATION")
}

impl Builder<'_> {
    fn network(mut self) -> Network {
        let representations = self.ids(is_representation);
        let (unit, resolution) = self.unit_of(&representations);
        self.blank();
        let mut assembly = self.assembly(&representations);
        let is_aspect = |members: &Vec<u64>| members.iter().all(|member| self.aspects.contains(member));
        let aspects: Vec<u64> =
            assembly.members.iter().filter(|(_, members)| is_aspect(members)).map(|(group, _)| *group).collect();
        let is_top = |group: &u64| !assembly.contained.contains(group) && aspects.binary_search(group).is_err();
        let tops: Vec<u64> = assembly.members.keys().copied().filter(is_top).collect();
        let mut reached = HashSet::new();
        for top in tops {
            self.group(top, 0, &mut assembly, &unit, &mut reached);
        }
        // Groups that contain each other in a circle.
        let members: Vec<u64> = assembly.members.keys().copied().collect();
        for group in members {
            let is_mapped = assembly.members.get(&group).into_iter().flatten().any(|member| self.done.contains(member));
            if !reached.contains(&group) && !is_mapped && aspects.binary_search(&group).is_err() {
                self.note(group, "a part of an assembly is contained in nothing, or in itself; read where it is", "");
                self.group(group, 0, &mut assembly, &unit, &mut reached);
            }
        }
        for group in aspects {
            self.rest_of_aspect(group, &assembly);
        }
        self.orphans();
        let Collector { curves, mut findings, .. } = self.collector;
        if curves.is_empty() {
            findings.add(0, "the file has no curve in space", "");
        }
        Network { unit, resolution, digits: self.digits, curves, faces: self.faces, findings: findings.finish() }
    }

    /// The unit of the first representation that has one, and its uncertainty.
    fn unit_of(&mut self, representations: &[u64]) -> (Unit, Option<f64>) {
        for id in representations {
            let context = self.context_of(*id);
            if let Some(unit) = context.unit {
                return (unit, context.uncertainty);
            }
        }
        let line = self.index.places.first().map_or(0, |place| place.line);
        self.collector.findings.add(line, "the unit is unknown; millimetres are taken", "");
        (Unit { name: "mm?".into(), millimetres: 1.0 }, None)
    }

    /// Notes what INVISIBILITY hides.
    fn blank(&mut self) {
        for id in self.ids(|name| name.is("INVISIBILITY")) {
            let hidden = self.record(id, &["INVISIBILITY"]).and_then(|record| record.references(0)).unwrap_or_default();
            for item in hidden {
                let styled = self.record(item, &["STYLED_ITEM"]).and_then(|record| record.reference(2));
                self.blanked.insert(styled.unwrap_or(item));
            }
        }
    }

    /// Reads a group and all that it contains, each as often as it is contained.
    fn group(&mut self, top: u64, place: Place, assembly: &mut Assembly, unit: &Unit, reached: &mut HashSet<u64>) {
        // Representations of a group are the same thing, and so in the same unit.
        let members = assembly.members.get(&top).cloned().unwrap_or_default();
        let own = members.into_iter().find_map(|member| self.millimetres(member));
        let factor = own.unwrap_or(unit.millimetres) / unit.millimetres;
        let place = if factor == 1.0 { place } else { self.within(place, &Affine::scaling(factor)) };
        let mut path: Vec<(u64, usize, Place)> = vec![(top, 0, place)];
        self.members(top, place, assembly);
        reached.insert(top);
        while let Some((group, next, place)) = path.last_mut() {
            let (group, place) = (*group, *place);
            let Some(&(by, part, map)) = assembly.parts.get(&group).and_then(|parts| parts.get(*next)) else {
                path.pop();
                continue;
            };
            *next += 1;
            if path.iter().any(|(open, ..)| *open == part) {
                self.note(by, "an assembly contains itself", "");
            } else if path.len() >= DEEPEST {
                self.note(by, "assemblies are more than 32 within each other", "");
            } else if self.count_instance(by) {
                let place = self.within(place, &map);
                reached.insert(part);
                self.members(part, place, assembly);
                path.push((part, 0, place));
            }
        }
    }

    fn members(&mut self, group: u64, place: Place, assembly: &Assembly) {
        for member in assembly.members.get(&group).cloned().unwrap_or_default() {
            self.representation_items(member, place, 0);
        }
    }

    /// Reads all items of a representation, with the units of its context.
    pub(super) fn representation_items(&mut self, id: u64, place: Place, depth: usize) {
        if depth > DEEPEST {
            return self.note(id, "representations are more than 32 within each other, or one within itself", "");
        }
        let context = self.context_of(id);
        let before = (self.angle, self.uncertainty, self.role);
        (self.angle, self.uncertainty) = (context.angle, context.uncertainty.unwrap_or(0.0));
        let is_aid = self.index.get(id).is_some_and(|place| self.index.name(place).is("CONSTRUCTIVE_GEOMETRY_REPRESENTATION"));
        self.role = if is_aid { Role::Aid } else { before.2 };
        self.done.insert(id);
        for item in self.items_of(id) {
            self.item(item, place, depth);
        }
        (self.angle, self.uncertainty, self.role) = before;
    }

    /// Items of a representation: name, items, context.
    pub(super) fn items_of(&mut self, id: u64) -> Vec<u64> {
        let items = self.records(id).and_then(|records| records.first().ok_or_else(String::new)?.references(1));
        items.unwrap_or_else(|why| {
            self.note(id, "damaged and not read", &why);
            Vec::new()
        })
    }

    fn context_of(&mut self, id: u64) -> Context {
        let context = self.records(id).and_then(|records| records.first().ok_or_else(String::new)?.reference(2));
        let context = context.unwrap_or(0);
        if let Some(known) = self.contexts.get(&context) {
            return known.clone();
        }
        let read = self.context(context);
        self.contexts.insert(context, read.clone());
        read
    }

    /// Millimetres of the unit of a representation, if it has one.
    pub(super) fn millimetres(&mut self, id: u64) -> Option<f64> {
        self.context_of(id).unit.map(|unit| unit.millimetres)
    }

    /// Items of an aspect that no product has.
    fn rest_of_aspect(&mut self, group: u64, assembly: &Assembly) {
        for member in assembly.members.get(&group).cloned().unwrap_or_default() {
            for item in self.items_of(member) {
                if !self.done.contains(&item) {
                    self.item(item, 0, 0);
                }
            }
        }
    }

    /// Faces, edges and sets that no representation has led to: of files that lost some of it.
    fn orphans(&mut self) {
        type Kind = fn(Name<'_>) -> bool;
        let kinds: [Kind; 3] = [
            |name| FACES.iter().any(|face| name.is(face)) || name.is("CURVE_BOUNDED_SURFACE"),
            |name| name.is("GEOMETRIC_SET") || name.is("GEOMETRIC_CURVE_SET"),
            |name| name.is("EDGE_CURVE"),
        ];
        for kind in kinds {
            for id in self.ids(kind) {
                if !self.done.contains(&id) {
                    self.note(id, "nothing leads to it; read where it is", "");
                    self.item(id, 0, 0);
                }
            }
        }
    }
}
