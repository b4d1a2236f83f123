//! Which representation is part of which other one, and where.
//!
//! Representations that are related without a transformation are the same thing in the same place: a group. A group that no other one
//! contains is placed where it is; others wherever they are contained.

use std::collections::{BTreeMap, HashMap};

use super::builder::Builder;
use crate::curves::vector::Affine;

/// A representation within another one.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// The instance that says so.
    by: u64,
    part: u64,
    whole: u64,
    map: Affine,
}

/// Groups of representations and how they contain each other.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    /// The first of its group, for each that has a group.
    group: HashMap<u64, u64>,
    /// Representations of each group.
    pub(super) members: BTreeMap<u64, Vec<u64>>,
    /// Groups that a group contains, by the instance that says so, and where.
    pub(super) parts: HashMap<u64, Vec<(u64, u64, Affine)>>,
    /// Groups that others contain.
    pub(super) contained: std::collections::HashSet<u64>,
}

/// The last of a chain of groups; shortens it.
fn root(group: &mut HashMap<u64, u64>, mut of: u64) -> u64 {
    while let Some(&next) = group.get(&of).filter(|next| **next != of) {
        let after = group.get(&next).copied().unwrap_or(next);
        group.insert(of, after);
        of = after;
    }
    of
}

impl Assembly {
    /// The group of a representation.
    pub(super) fn group(&mut self, of: u64) -> u64 {
        root(&mut self.group, of)
    }
}

impl Builder<'_> {
    /// Sorts representations into groups; those that are mapped by another one count as contained.
    pub(super) fn assembly(&mut self, representations: &[u64]) -> Assembly {
        let mut assembly = Assembly::default();
        let parts = self.parts_of_assemblies();
        for id in self.ids(|name| name.is("SHAPE_REPRESENTATION_RELATIONSHIP")) {
            let Ok(record) = self.record(id, &["SHAPE_REPRESENTATION_RELATIONSHIP"]) else { continue };
            if let (Ok(one), Ok(other)) = (record.reference(2), record.reference(3)) {
                let [one, other] = [one, other].map(|id| root(&mut assembly.group, id));
                // The lower number is the root, whatever the order of the file.
                assembly.group.insert(one.max(other), one.min(other));
            }
        }
        for id in representations {
            let group = assembly.group(*id);
            assembly.members.entry(group).or_default().push(*id);
        }
        for part in parts {
            let [whole, inner] = [part.whole, part.part].map(|id| assembly.group(id));
            if whole != inner {
                assembly.contained.insert(inner);
                assembly.parts.entry(whole).or_default().push((part.by, inner, part.map));
            }
        }
        for id in self.ids(|name| name.is("MAPPED_ITEM")) {
            let mapped = self.record(id, &["MAPPED_ITEM"]).and_then(|record| record.reference(1));
            let mapped = mapped.and_then(|map| self.record(map, &["REPRESENTATION_MAP"])?.reference(1));
            // Only where a representation of a shape maps it; drawings map what stands there already.
            if let (Ok(mapped), true) = (mapped, self.is_shape_item(id, representations)) {
                let group = assembly.group(mapped);
                assembly.contained.insert(group);
            }
        }
        assembly
    }

    fn is_shape_item(&mut self, id: u64, representations: &[u64]) -> bool {
        if self.shape_items.is_none() {
            let mut items = std::collections::HashSet::new();
            for representation in representations {
                items.extend(self.items_of(*representation));
            }
            self.shape_items = Some(items);
        }
        self.shape_items.as_ref().is_some_and(|items| items.contains(&id))
    }

    /// Relationships with a transformation.
    fn parts_of_assemblies(&mut self) -> Vec<Part> {
        let products = self.products();
        let mut parts = Vec::new();
        // A relationship of shapes may be used by an occurrence, which knows what contains what.
        let mut occurrences: HashMap<u64, u64> = HashMap::new();
        for id in self.ids(|name| name.is("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION")) {
            let Ok(record) = self.record(id, &["CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"]) else { continue };
            if let (Ok(relation), Ok(shape)) = (record.reference(0), record.reference(1)) {
                occurrences.insert(relation, shape);
            }
        }
        for id in self.ids(|name| name.0.is_empty() || name.is("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION")) {
            if self.record(id, &["REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"]).is_err() {
                continue;
            }
            match self.part_of_assembly(id, occurrences.get(&id).copied(), &products) {
                Ok(part) => parts.push(part),
                Err(why) => self.note(id, "a part of an assembly is not placed", &why),
            }
        }
        parts
    }

    /// The definition of a product that a representation is the shape of.
    fn products(&mut self) -> HashMap<u64, u64> {
        let mut products = HashMap::new();
        for id in self.ids(|name| name.is("SHAPE_DEFINITION_REPRESENTATION")) {
            let Ok(record) = self.record(id, &["SHAPE_DEFINITION_REPRESENTATION"]) else { continue };
            let (Ok(shape), Ok(representation)) = (record.reference(0), record.reference(1)) else { continue };
            let product = self.record(shape, &["PRODUCT_DEFINITION_SHAPE"]).and_then(|record| record.reference(2));
            match product {
                Ok(product) => drop(products.insert(representation, product)),
                // Of an aspect of a shape: its items are those of a product, once more.
                Err(_) => drop(self.aspects.insert(representation)),
            }
        }
        products
    }

    fn part_of_assembly(&mut self, id: u64, occurrence: Option<u64>, products: &HashMap<u64, u64>) -> Result<Part, String> {
        let relation = self.record(id, &["REPRESENTATION_RELATIONSHIP"])?;
        let (first, second) = (relation.reference(2)?, relation.reference(3)?);
        let operator = self.record(id, &["REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"])?;
        let operator = operator.reference(operator.values.len().saturating_sub(1))?;
        let operator = self.record(operator, &["ITEM_DEFINED_TRANSFORMATION"])?;
        let items = [operator.reference(2)?, operator.reference(3)?];
        // Usually the first is the part; the occurrence knows if it is not.
        let related = occurrence.and_then(|shape| {
            let usage = self.record(shape, &["PRODUCT_DEFINITION_SHAPE"]).and_then(|record| record.reference(2)).ok()?;
            let usage = self.record(usage, &["NEXT_ASSEMBLY_USAGE_OCCURRENCE"]).ok()?;
            Some((usage.reference(3).ok()?, usage.reference(4).ok()?))
        });
        let is_turned = related.is_some_and(|(whole, part)| {
            products.get(&first) == Some(&whole) && products.get(&second) == Some(&part) && whole != part
        });
        let (part, whole, items) = if is_turned { (second, first, [items[1], items[0]]) } else { (first, second, items) };
        let [from, to] = [self.map(items[0])?, self.map(items[1])?];
        let from = from.inverse().ok_or("axes that are flat")?;
        let factor = self.millimetres(part).zip(self.millimetres(whole)).map_or(1.0, |(part, whole)| part / whole);
        let map = to.after(&Affine::scaling(factor)).after(&from);
        Ok(Part { by: id, part, whole, map })
    }
}
