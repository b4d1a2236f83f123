//! The second look: which rows the corners of made triangles name, and the rows that are new.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::made::{From, Made, Parent};
use super::spread::{Spread, spread};
use super::wanted::Wanted;
use crate::geometry::position;
use crate::io::rows::{CHANNELS, Corner, NONE, Rows, TEXTURE, VERTICES, WHOLE, mixed, set_position};
use crate::output::model::weights;

/// Weights below this are those of rounding.
const SMALL: f64 = 1e-6;

/// A new row, by rows of its channel: of the file, and new ones before it, whose numbers go on behind those of the file.
pub(super) struct Recipe {
    pub(super) parts: Vec<(u32, f64)>,
    /// The number of its position, for vertices.
    pub(super) position: Option<u32>,
}

/// The rows of made triangles.
pub(super) struct Plan {
    /// By triangle that is made.
    pub(super) corners: Vec<[Corner; 3]>,
    /// By triangle that is made: its corners by their weights in its parent.
    pub(super) weights: Vec<[[f64; 3]; 3]>,
    /// New rows by channel.
    pub(super) fresh: [Vec<Vec<f64>>; CHANNELS],
}

/// A new row: its channel, the number of its position, and rows whose place it is between, where that matters.
type Key = (usize, u32, Corner);

struct Planner<'p> {
    rows: &'p dyn Rows,
    wanted: &'p Wanted,
    counts: Corner,
    numbers: HashMap<Key, u32>,
    recipes: [Vec<Recipe>; CHANNELS],
    /// By position: the rows of the first made corner there.
    first: BTreeMap<u32, Corner>,
}

impl Plan {
    /// `None` if the file is not as it seemed. O(bytes of the file), and O(n) in made triangles.
    pub(super) fn of(rows: &dyn Rows, wanted: &Wanted) -> Option<Self> {
        let mut planner = Planner {
            rows,
            wanted,
            counts: rows.counts(),
            numbers: HashMap::new(),
            recipes: Default::default(),
            first: BTreeMap::new(),
        };
        let mut corners = vec![[[NONE; CHANNELS]; 3]; wanted.made.len()];
        let mut weights = vec![WHOLE; wanted.made.len()];
        for ((made, corners), weights) in wanted.made.iter().zip(&mut corners).zip(&mut weights) {
            let Some(parent) = made.from.triangle().and_then(|of| wanted.parents.get(&of)) else { continue };
            (*corners, *weights) = planner.of_parent(made, parent);
        }
        planner.new_triangles(&mut corners);
        let fresh = planner.values()?;
        Some(Self { corners, weights, fresh })
    }
}

impl Planner<'_> {
    /// Those of a triangle that takes the values of another.
    fn of_parent(&mut self, made: &Made, parent: &Parent) -> ([Corner; 3], [[f64; 3]; 3]) {
        let (mut corners, mut all) = ([[NONE; CHANNELS]; 3], WHOLE);
        for (k, number) in made.corners.into_iter().enumerate() {
            let point = self.wanted.points.get(number as usize).copied().unwrap_or_default();
            let own = (0..3).find(|j| position::bits(parent.points[*j]) == position::bits(point));
            let own_weights = match (own, made.from) {
                (Some(own), _) => WHOLE[own],
                // It was moved: it keeps what it says, at another place.
                (None, From::Moved(_)) => WHOLE[k],
                (None, _) => positive(weights(parent.points, point)),
            };
            all[k] = own_weights;
            corners[k] = match (own, made.from) {
                (Some(own), _) => parent.corners[own],
                (None, From::Moved(_)) => {
                    let [_, texture, normal] = parent.corners[k];
                    [self.vertex(number, parent, own_weights), texture, normal]
                }
                (None, _) => {
                    let vertex = self.vertex(number, parent, own_weights);
                    let [texture, normal] = [1, 2].map(|channel| self.between(channel, number, parent, own_weights));
                    [vertex, texture, normal]
                }
            };
            self.first.entry(number).or_insert(corners[k]);
        }
        // All corners of a face have a row of a channel, or none has.
        for channel in 1..CHANNELS {
            if corners.iter().any(|corner| corner[channel] == NONE) {
                corners.iter_mut().for_each(|corner| corner[channel] = NONE);
            }
        }
        (corners, all)
    }

    /// The vertex at a position that its parent does not have.
    fn vertex(&mut self, number: u32, parent: &Parent, weights: [f64; 3]) -> u32 {
        let is_split = self.rows.is_split();
        if let Some(there) = self.wanted.there(number).filter(|_| !is_split) {
            return there[VERTICES];
        }
        let parts = parts(parent, VERTICES, weights);
        let between = if is_split { key_of(&parts) } else { [NONE; CHANNELS] };
        self.fresh((VERTICES, number, between), parts)
    }

    /// The row of another channel there.
    fn between(&mut self, channel: usize, number: u32, parent: &Parent, weights: [f64; 3]) -> u32 {
        if !self.rows.may_grow(channel) || parent.corners.iter().any(|corner| corner[channel] == NONE) {
            return NONE;
        }
        let parts = parts(parent, channel, weights);
        self.fresh((channel, number, key_of(&parts)), parts)
    }

    fn fresh(&mut self, key: Key, parts: Vec<(u32, f64)>) -> u32 {
        let (channel, position, _) = key;
        let recipes = &mut self.recipes[channel];
        let next = self.counts[channel] + recipes.len() as u32;
        *self.numbers.entry(key).or_insert_with(|| {
            recipes.push(Recipe { parts, position: (channel == VERTICES).then_some(position) });
            next
        })
    }

    /// The rows of triangles that have no parent: those around them, and between.
    fn new_triangles(&mut self, corners: &mut [[Corner; 3]]) {
        let new: Vec<(usize, [u32; 3])> =
            (0..).zip(&self.wanted.made).filter(|(_, made)| made.from == From::Rim).map(|(k, made)| (k, made.corners)).collect();
        let faces: Vec<[u32; 3]> = new.iter().map(|(_, corners)| *corners).collect();
        for channel in [VERTICES, TEXTURE].into_iter().filter(|channel| self.rows.may_grow(*channel)).collect::<Vec<_>>() {
            let known = |number: u32| {
                let there = self.wanted.there(number).or(self.first.get(&number).copied());
                there.map(|corner| corner[channel]).filter(|row| *row != NONE)
            };
            let Spread { order, mut rows } = spread(&faces, known);
            for (number, around) in order {
                let share = 1.0 / around.len().max(1) as f64;
                let parts = around.iter().filter_map(|other| rows.get(other)).map(|row| (*row, share)).collect();
                let is_vertex = channel == VERTICES;
                if is_vertex || !around.is_empty() {
                    rows.insert(number, self.fresh((channel, number, [NONE; CHANNELS]), parts));
                }
            }
            for (k, numbers) in &new {
                let all = numbers.map(|number| rows.get(&number).copied().unwrap_or(NONE));
                let Some(own) = corners.get_mut(*k).filter(|_| !all.contains(&NONE)) else { continue };
                own.iter_mut().zip(all).for_each(|(corner, row)| corner[channel] = row);
            }
        }
    }

    /// The numbers of all new rows.
    fn values(&self) -> Option<[Vec<Vec<f64>>; CHANNELS]> {
        let mut all: [Vec<Vec<f64>>; CHANNELS] = Default::default();
        for (channel, (fresh, recipes)) in all.iter_mut().zip(&self.recipes).enumerate() {
            let count = self.counts[channel];
            let named: BTreeSet<u32> =
                recipes.iter().flat_map(|recipe| &recipe.parts).map(|part| part.0).filter(|row| *row < count).collect();
            let there = self.rows.values(channel, &named)?;
            self.fits(channel, &there)?;
            let mixes = self.rows.mixes(channel);
            for recipe in recipes {
                let of = |row: u32| there.get(&row).or_else(|| fresh.get(row.checked_sub(count)? as usize)).map(Vec::as_slice);
                let parts: Vec<_> = recipe.parts.iter().filter_map(|(row, weight)| Some((of(*row)?, *weight))).collect();
                let mut values = mixed(mixes, &parts);
                if let Some(number) = recipe.position {
                    set_position(mixes, &mut values, *self.wanted.points.get(number as usize)?);
                }
                fresh.push(values);
            }
        }
        Some(all)
    }

    /// Rows of vertices are those of the positions that were read.
    fn fits(&self, channel: usize, there: &BTreeMap<u32, Vec<f64>>) -> Option<()> {
        let mut there = there.iter().filter(|_| channel == VERTICES);
        let fits = there.all(|(row, values)| {
            let mut own = values.clone();
            let Some(point) = self.rows.position(*row) else { return false };
            set_position(self.rows.mixes(channel), &mut own, point);
            own.iter().zip(values).all(|(own, value)| *own as f32 == *value as f32 || value.is_nan())
        });
        fits.then_some(())
    }
}

/// The rows of a parent's corners in a channel, with weights that are not small.
fn parts(parent: &Parent, channel: usize, weights: [f64; 3]) -> Vec<(u32, f64)> {
    let all = parent.corners.iter().map(|corner| corner[channel]).zip(weights).filter(|(_, weight)| *weight > SMALL);
    let parts: Vec<_> = all.collect();
    let sum: f64 = parts.iter().map(|part| part.1).sum();
    parts.into_iter().map(|(row, weight)| (row, weight / sum)).collect()
}

/// Their rows, in order.
fn key_of(parts: &[(u32, f64)]) -> Corner {
    let mut key = [NONE; CHANNELS];
    key.iter_mut().zip(parts).for_each(|(own, part)| *own = part.0);
    key.sort_unstable();
    key
}

/// Weights within the triangle.
fn positive(weights: [f64; 3]) -> [f64; 3] {
    let bounded = weights.map(|weight| weight.max(0.0));
    let sum: f64 = bounded.iter().sum();
    if sum > 0.0 && sum.is_finite() { bounded.map(|weight| weight / sum) } else { WHOLE[0] }
}
