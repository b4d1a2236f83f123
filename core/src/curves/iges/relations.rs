//! Which entity uses which, before anything is placed.

use std::collections::HashMap;

use super::directory::{Directory, Entry};
use super::parameters::Parameters;

/// What others make of an entity.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Used {
    /// A boundary, a part of another curve, or an edge, that comes to light with its owner.
    pub(super) as_part: bool,
    /// A curve in the space of parameters of a surface.
    pub(super) as_parametric: bool,
    /// An axis or a profile of a surface.
    pub(super) as_generator: bool,
    /// A member of a subfigure, which is placed by instances alone.
    pub(super) as_member: bool,
    /// The surface of a face.
    pub(super) as_surface: bool,
}

impl Used {
    const NOT: Self = Self { as_part: false, as_parametric: false, as_generator: false, as_member: false, as_surface: false };
    const PART: Self = Self { as_part: true, ..Self::NOT };
    const PARAMETRIC: Self = Self { as_parametric: true, ..Self::NOT };
    const GENERATOR: Self = Self { as_generator: true, ..Self::NOT };
    const MEMBER: Self = Self { as_member: true, ..Self::NOT };
    const SURFACE: Self = Self { as_surface: true, ..Self::NOT };

    fn join(&mut self, other: Self) -> bool {
        let before = (self.as_part, self.as_parametric, self.as_generator, self.as_member, self.as_surface);
        self.as_part |= other.as_part;
        self.as_parametric |= other.as_parametric;
        self.as_generator |= other.as_generator;
        self.as_member |= other.as_member;
        self.as_surface |= other.as_surface;
        before != (self.as_part, self.as_parametric, self.as_generator, self.as_member, self.as_surface)
    }
}

/// What entities are used for, by their numbers.
#[derive(Debug, Default)]
pub(super) struct Relations {
    used: HashMap<u32, Used>,
}

impl Relations {
    /// Looks through all entities that refer to others. O(length of their parameters).
    pub(super) fn of(directory: &Directory<'_>, mut room: usize) -> Self {
        let mut relations = Self::default();
        let mut parts: HashMap<u32, Vec<u32>> = HashMap::new();
        for entry in directory.entries.iter().filter(|entry| refers(entry.kind)) {
            let Ok(parameters) = directory.parameters(entry) else { continue };
            let Some(rest) = room.checked_sub(parameters.length) else { break };
            room = rest;
            let mut pass_on = Vec::new();
            let _ = references(entry, &parameters, &mut |number, used| {
                relations.used.entry(number).or_insert(Used::NOT).join(used);
                // What is made of parts passes on what it is used for.
                if used.as_part || used.as_member {
                    pass_on.push(number);
                }
            });
            if !pass_on.is_empty() && entry.kind != 408 {
                parts.insert(entry.number, pass_on);
            }
        }
        relations.spread(&parts);
        relations
    }

    /// Lets parts of parametric curves be parametric, those of generators generators, and what members are made of members.
    fn spread(&mut self, parts: &HashMap<u32, Vec<u32>>) {
        let mut queue: Vec<u32> = parts.keys().copied().collect();
        queue.sort_unstable();
        while let Some(number) = queue.pop() {
            let used = Used { as_part: false, as_surface: false, ..self.get(number) };
            for part in parts.get(&number).into_iter().flatten() {
                let is_new = self.used.entry(*part).or_insert(Used::NOT).join(used);
                if is_new && parts.contains_key(part) {
                    queue.push(*part);
                }
            }
        }
    }

    /// What an entity is used for.
    pub(super) fn get(&self, number: u32) -> Used {
        self.used.get(&number).copied().unwrap_or(Used::NOT)
    }
}

fn refers(kind: u32) -> bool {
    matches!(kind, 102 | 118 | 120 | 122 | 130 | 140..=144 | 186 | 308 | 408 | 412 | 414 | 430 | 504 | 508 | 510 | 514)
}

fn references(entry: &Entry, parameters: &Parameters, note: &mut impl FnMut(u32, Used)) -> Result<(), String> {
    let mut list = |at: usize, from: usize, each: usize, used: Used| -> Result<(), String> {
        for number in 0..parameters.count(at, from, each)? {
            note(parameters.pointer(from + each * number)?, used);
        }
        Ok(())
    };
    match entry.kind {
        102 => list(1, 2, 1, Used::PART),
        308 => list(3, 4, 1, Used::MEMBER),
        504 => list(1, 2, 5, Used::PART),
        514 => list(1, 2, 2, Used::PART),
        143 => {
            note(parameters.pointer(2)?, Used::SURFACE);
            for number in 0..parameters.count(3, 4, 1)? {
                note(parameters.pointer(4 + number)?, Used::PART);
            }
            Ok(())
        }
        510 => {
            note(parameters.pointer(1)?, Used::SURFACE);
            for number in 0..parameters.count(2, 4, 1)? {
                note(parameters.pointer(4 + number)?, Used::PART);
            }
            Ok(())
        }
        144 => {
            note(parameters.pointer(1)?, Used::SURFACE);
            note(parameters.pointer(4)?, Used::PART);
            for number in 0..parameters.count(3, 5, 1)? {
                note(parameters.pointer(5 + number)?, Used::PART);
            }
            Ok(())
        }
        141 => boundary(parameters, note),
        186 => solid(parameters, note),
        508 => loops(parameters, note),
        kind => single(kind).iter().try_for_each(|(at, used)| {
            note(parameters.pointer(*at)?, *used);
            Ok(())
        }),
    }
}

/// Parameters of a type that refer to one other entity each.
fn single(kind: u32) -> &'static [(usize, Used)] {
    match kind {
        118 | 120 => &[(1, Used::GENERATOR), (2, Used::GENERATOR)],
        122 => &[(1, Used::GENERATOR)],
        // The curve beside which it goes, and the one whose coordinate is the distance.
        130 => &[(1, Used::GENERATOR), (3, Used::GENERATOR)],
        140 => &[(5, Used::SURFACE)],
        142 => &[(3, Used::PARAMETRIC), (4, Used::PART)],
        412 | 414 => &[(1, Used::MEMBER)],
        _ => &[],
    }
}

/// 141: curves in space, each with curves in the space of parameters.
fn boundary(parameters: &Parameters, note: &mut impl FnMut(u32, Used)) -> Result<(), String> {
    let mut at = 5;
    for _ in 0..parameters.count(4, 5, 3)? {
        note(parameters.pointer(at)?, Used::PART);
        let count = parameters.count(at + 2, at + 3, 1)?;
        for number in 0..count {
            note(parameters.pointer(at + 3 + number)?, Used::PARAMETRIC);
        }
        at += 3 + count;
    }
    Ok(())
}

/// 186: an outer shell and others.
fn solid(parameters: &Parameters, note: &mut impl FnMut(u32, Used)) -> Result<(), String> {
    note(parameters.pointer(1)?, Used::PART);
    for number in 0..parameters.count(3, 4, 2)? {
        note(parameters.pointer(4 + 2 * number)?, Used::PART);
    }
    Ok(())
}

/// 508: edges, each with curves in the space of parameters.
fn loops(parameters: &Parameters, note: &mut impl FnMut(u32, Used)) -> Result<(), String> {
    let mut at = 2;
    for _ in 0..parameters.count(1, 2, 5)? {
        note(parameters.pointer(at + 1)?, Used::PART);
        let count = parameters.count(at + 4, at + 5, 2)?;
        for number in 0..count {
            note(parameters.pointer(at + 6 + 2 * number)?, Used::PARAMETRIC);
        }
        at += 5 + 2 * count;
    }
    Ok(())
}
