//! Arrays of instances: in rows and columns (412), and around a circle (414).
//!
//! Instances are shifted, and scaled in rows and columns; none of them is turned (IGES 5.3, sections 4.136 and 4.137).

use std::collections::BTreeSet;

use super::build::Builder;
use super::directory::Entry;
use super::parameters::Parameters;
use super::places::Place;
use crate::curves::vector::{Affine, Point, add};

/// Where instances are, and what the list behind says of them.
struct Array {
    base: u32,
    scale: f64,
    kind: Kind,
    /// How many places there are.
    count: u64,
    /// Whether the places of the list are left out; otherwise no other ones are taken, if it has any.
    is_without: bool,
    listed: BTreeSet<u64>,
}

enum Kind {
    /// The first one's place, how many are in a column, steps to the next column and row.
    Rows { corner: Point, rows: u64, steps: [Point; 2] },
    /// Centre and radius, angles of the first one and between two.
    Circle { centre: Point, radius: f64, angles: [f64; 2] },
}

impl Array {
    fn of(entry: &Entry, parameters: &Parameters) -> Result<Self, String> {
        let whole =
            |at: usize| parameters.integer(at).and_then(|n| u64::try_from(n).map_err(|_| format!("parameter {at} is no count")));
        let (base, scale, kind, count, at) = if entry.kind == 412 {
            let scale = parameters.real(2)?;
            let (columns, rows) = (whole(6)?, whole(7)?);
            let [dx, dy, angle] = parameters.point(8)?;
            let (sin, cos) = angle.sin_cos();
            let steps = [[dx * cos, dx * sin, 0.0], [-dy * sin, dy * cos, 0.0]];
            let kind = Kind::Rows { corner: parameters.point(3)?, rows, steps };
            (parameters.pointer(1)?, if scale == 0.0 { 1.0 } else { scale }, kind, columns.saturating_mul(rows), 11)
        } else {
            let angles = [parameters.real(7)?, parameters.real(8)?];
            let kind = Kind::Circle { centre: parameters.point(3)?, radius: parameters.real(6)?, angles };
            (parameters.pointer(1)?, 1.0, kind, whole(2)?, 9)
        };
        let mut listed = BTreeSet::new();
        // A list that is not there is one of nothing.
        let length = if parameters.len() > at { parameters.count(at, at + 2, 1)? } else { 0 };
        for place in at + 2..at + 2 + length {
            listed.insert(whole(place)?);
        }
        let is_without = length > 0 && parameters.integer(at + 1)? == 1;
        Ok(Self { base, scale, kind, count, is_without, listed })
    }

    /// Places in their order, from 1.
    fn places(&self) -> Box<dyn Iterator<Item = u64> + '_> {
        if self.listed.is_empty() {
            Box::new(1..=self.count)
        } else if self.is_without {
            Box::new((1..=self.count).filter(|place| !self.listed.contains(place)))
        } else {
            Box::new(self.listed.iter().copied().filter(|place| (1..=self.count).contains(place)))
        }
    }

    /// Where an instance is put: the first column upwards, then the next one.
    fn map(&self, place: u64) -> Affine {
        let number = place.saturating_sub(1);
        let shift = match &self.kind {
            Kind::Rows { corner, rows, steps: [across, up] } => {
                let (column, row) = (number / (*rows).max(1), number % (*rows).max(1));
                let step = |step: &Point, count: u64| step.map(|x| x * count as f64);
                add(*corner, add(step(across, column), step(up, row)))
            }
            Kind::Circle { centre, radius, angles: [first, between] } => {
                let (sin, cos) = (first + between * number as f64).sin_cos();
                add(*centre, [radius * cos, radius * sin, 0.0])
            }
        };
        Affine { shift, ..Affine::scaling(self.scale) }
    }
}

impl Builder<'_> {
    /// 412 and 414: an entity or a subfigure at each of its places.
    pub(super) fn array(&mut self, entry: &Entry, around: Place, depth: usize) {
        let Some(parameters) = self.parameters(entry) else { return };
        let array = match Array::of(entry, &parameters) {
            Ok(array) => array,
            Err(why) => return self.damaged(entry, &why),
        };
        let Some(&base) = self.directory.get(array.base) else {
            return self.damaged(entry, "what it repeats is not there");
        };
        self.done.insert(entry.number);
        let around = self.placed(entry, around);
        for at in array.places() {
            if !self.count_instance(entry) {
                return;
            }
            let number = u32::try_from(at).unwrap_or(u32::MAX);
            let place = self.places.within(around, (entry.number, number), || array.map(at));
            match base.kind {
                308 => self.figure(&base, place, depth),
                402 => self.group(&base, place, depth),
                _ => self.thing(&base, place, depth + 1),
            }
        }
    }

    /// 402: entities that belong together; other forms of it have nothing that can be placed.
    fn group(&mut self, group: &Entry, place: Place, depth: usize) {
        if !matches!(group.form, 1 | 7 | 14 | 15) {
            return;
        }
        let Some(parameters) = self.parameters(group) else { return };
        let count = parameters.count(1, 2, 1).unwrap_or(0);
        for number in (2..2 + count).filter_map(|at| parameters.pointer(at).ok()) {
            if let Some(member) = self.directory.get(number) {
                self.thing(member, place, depth + 1);
            }
        }
    }
}
