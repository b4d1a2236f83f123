//! The file around the pieces that are replaced: sizes, triangles, wraps, and how far they are from what they replace.

use super::groups::Groups;
use super::outcome::Outcome;
use crate::algorithms::wrap::tree::{Corners, Tree};
use crate::algorithms::wrap::{Wrapping, wrap};
use crate::contract::progress::Progress;
use crate::contract::report::Wrap;
use crate::contract::settings::Profile;
use crate::geometry::distance::place;
use crate::geometry::position;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::gather::visit;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::parallel;
use crate::util::words::Short;
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Triangles of a group, or of several that are wrapped at a time, at most: some 100 bytes each.
const MOST_TRIANGLES: u64 = 1 << 22;

/// Cubes of the lattice that all wraps together take, about; each makes some ten triangles.
const CUBES: f64 = (1 << 18) as f64;

/// The triangles of a soup, no two of which fit, are known no better than to a part of their size: cubes for each.
const SOUP_CUBES: f64 = 32.0;

/// And a single one, at least.
const LEAST_CUBES: f64 = 2048.0;

/// A group encloses next to nothing below this share of its size: the root of half its area, cubed. A sheet that is bent by a five-hundredth of
/// its width.
const NOTHING: f64 = 1e-3;

/// What a soup winds around what is behind its triangles, on average: 1 if nothing is missing, ½ for sheets that bound nothing.
const BEHIND: f64 = 0.75;

/// Triangles that are looked at to tell how far a surface moved, at most, by their corners and middles.
const SAMPLES: usize = 1 << 13;

/// Size of a group.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    pub(crate) triangles: u64,
    pub(crate) bounds: Bounds,
    /// Of all of it, in the file's units, squared.
    pub(crate) area: f64,
}

/// The file around the groups that are wrapped.
pub(crate) struct Site<'s, 'a> {
    pub(crate) survey: &'s Survey<'a>,
    pub(crate) submesh: &'s Submesh,
    pub(crate) reversed: &'s Reversed,
    pub(crate) pieces: &'s Components,
    /// Surface that hangs together through edges of two triangles.
    pub(crate) sheets: &'s Components,
    pub(crate) profile: &'s Profile,
    /// What is wrapped is a soup: it may be the surfaces of nothing.
    pub(crate) is_soup: bool,
    pub(crate) threads: usize,
    pub(crate) progress: &'s dyn Progress,
}

impl Site<'_, '_> {
    pub(crate) fn size(&self, group: &[u32]) -> Size {
        let mut size = Size { triangles: 0, bounds: Bounds::EMPTY, area: 0.0 };
        for piece in group.iter().map(|piece| &self.pieces.list[*piece as usize]) {
            size.triangles += piece.triangles;
            size.bounds.add(&piece.bounds);
            size.area += self.survey.measure.area(piece.extent);
        }
        size
    }

    pub(crate) fn whole_area(&self) -> f64 {
        self.pieces.list.iter().map(|piece| self.survey.measure.area(piece.extent)).sum()
    }

    /// Wraps groups, as many at a time as there is room for.
    pub(crate) fn wrap_all(&self, groups: &Groups, all: Vec<Vec<u32>>, outcomes: &mut BTreeMap<Vec<u32>, Outcome>) {
        let whole = self.whole_area();
        let mut batch: Vec<(Vec<u32>, Outcome)> = Vec::new();
        let mut held = 0;
        for group in all {
            let size = self.size(&group);
            let told = Wrap {
                bounds: [size.bounds.lo, size.bounds.hi].map(position::canonical),
                replaced: size.triangles,
                area: size.area,
                area_share: if whole > 0.0 { size.area / whole } else { 0.0 },
                ..Wrap::default()
            };
            let mut outcome = Outcome { told, triangles: Vec::new() };
            if groups.stay(&group, self.pieces) {
                outcome.give_up("a loop of it, or of what it runs into, was left open on purpose");
            } else if size.triangles > MOST_TRIANGLES {
                outcome.give_up("too many triangles to be wrapped");
            }
            if outcome.told.left.is_some() {
                outcomes.insert(group, outcome);
                continue;
            }
            if held + size.triangles > MOST_TRIANGLES {
                self.wrap_batch(&mut batch);
                outcomes.extend(batch.drain(..));
                held = 0;
            }
            held += size.triangles;
            batch.push((group, outcome));
        }
        self.wrap_batch(&mut batch);
        outcomes.extend(batch);
    }

    pub(crate) fn wrap_batch(&self, batch: &mut [(Vec<u32>, Outcome)]) {
        let gathered = self.gather(&batch.iter().map(|(group, _)| group.as_slice()).collect::<Vec<_>>());
        for ((_, outcome), triangles) in batch.iter_mut().zip(gathered) {
            self.wrap_one(&triangles, outcome);
        }
    }

    /// The triangles of some groups with their sheets, each in the order of the file, as they are turned now.
    pub(crate) fn gather(&self, groups: &[&[u32]]) -> Vec<Vec<(u32, Corners)>> {
        let mut group_of = vec![NONE; self.pieces.list.len()];
        for (group, number) in groups.iter().zip(0..) {
            group.iter().for_each(|piece| group_of[*piece as usize] = number);
        }
        let mut gathered = vec![Vec::new(); groups.len()];
        let is_wanted = |piece: u32| group_of[piece as usize] != NONE;
        visit(self.survey, self.submesh, (self.pieces, self.reversed), is_wanted, |piece, part, corners| {
            gathered[group_of[piece as usize] as usize].push((part.component(self.sheets), corners));
        });
        gathered
    }

    pub(crate) fn wrap_one(&self, gathered: &[(u32, Corners)], outcome: &mut Outcome) {
        let mut triangles: Vec<Corners> = gathered.iter().map(|(_, corners)| *corners).collect();
        let mut tree = Tree::winding(&triangles);
        let turned = self.inside_out(gathered, &tree);
        if !turned.is_empty() {
            let of_turned = gathered.iter().zip(&mut triangles).filter(|((sheet, _), _)| turned.binary_search(sheet).is_ok());
            of_turned.for_each(|(_, corners)| corners.swap(1, 2));
            tree = Tree::winding(&triangles);
        }
        if self.is_soup && !encloses(&triangles, &tree) {
            outcome.give_up("open surfaces that enclose nothing together");
            return;
        }
        let told = &mut outcome.told;
        let most = if self.is_soup { triangles.len() as f64 * SOUP_CUBES } else { CUBES };
        let cubes = (CUBES * told.area_share).min(most).max(LEAST_CUBES) as u32;
        let Some(Wrapping { triangles: new, cell, volume }) = wrap(&triangles, &tree, cubes, self.threads, self.progress) else {
            outcome.give_up("no lattice can hold it: it has no area, or f32 is too coarse where it lies");
            return;
        };
        (told.cell, told.volume) = (cell, volume);
        if new.is_empty() || volume < NOTHING * (told.area / 2.0).powi(3).sqrt() {
            outcome.give_up("it encloses next to nothing");
            return;
        }
        (told.moved, told.new_ground) = self.distances(&triangles, &tree, &new, cell);
        told.added = new.len() as u64;
        outcome.triangles = new;
        let farthest = self.profile.wrap_max_move * self.survey.bounds.diagonal();
        if outcome.told.moved > farthest {
            outcome.give_up(&format!("the surface would move by more than the profile's {}", Short(farthest)));
        }
    }

    /// Open sheets of a group that are inside out: nobody could tell before on which side of them there is material, as they end in the air or
    /// where several meet. On both sides of a sheet that is the right way round the whole winds a whole number of times, and not less than
    /// none; a sheet is turned if that holds better then. Ascending; at most so many are looked at, the largest first.
    pub(crate) fn inside_out(&self, gathered: &[(u32, Corners)], tree: &Tree) -> Vec<u32> {
        const SHEETS: usize = 256;
        const LOOKED_AT: usize = 32;
        let mut open: BTreeMap<u32, Vec<Corners>> = BTreeMap::new();
        for (sheet, corners) in gathered {
            if self.sheets.list[*sheet as usize].open {
                open.entry(*sheet).or_default().push(*corners);
            }
        }
        let mut order: Vec<(u32, Vec<Corners>)> = open.into_iter().collect();
        order.sort_by_key(|(sheet, _)| Reverse(self.sheets.list[*sheet as usize].extent.area));
        order.truncate(SHEETS);
        let mut turned: Vec<(u32, Tree)> = Vec::new();
        for (sheet, corners) in order {
            let own = Tree::winding(&corners);
            let off = self.sheets.list[sheet as usize].bounds.diagonal() * 1e-3;
            // How far winding numbers are from what they may be, as the sheet is and turned, area by area.
            let (mut as_is, mut if_turned) = (0.0, 0.0);
            let looked_at = || corners.iter().step_by(corners.len().div_ceil(LOOKED_AT)).map(|t| t.map(place));
            let vector = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
            let sides = looked_at().flat_map(|t| {
                let (middle, off) = ((t[0] + t[1] + t[2]) / 3.0, vector(t).normalize_or_zero() * off);
                [middle + off, middle - off]
            });
            let points: Vec<DVec3> = sides.collect();
            let [all, alone] = [tree, &own].map(|tree| tree.winding_numbers(&points));
            let others: Vec<Vec<f64>> = turned.iter().map(|(_, other)| other.winding_numbers(&points)).collect();
            for (t, first) in looked_at().zip((0..).step_by(2)) {
                for p in [first, first + 1] {
                    let others: f64 = others.iter().map(|other| 2.0 * other[p]).sum();
                    let now = all[p] - others;
                    as_is += vector(t).length() * from_whole(now);
                    if_turned += vector(t).length() * from_whole(now - 2.0 * alone[p]);
                }
            }
            // What makes hardly a difference stays.
            if if_turned < 0.9 * as_is {
                turned.push((sheet, own));
            }
        }
        let mut turned: Vec<u32> = turned.into_iter().map(|(sheet, _)| sheet).collect();
        turned.sort_unstable();
        turned
    }

    /// The largest distance from the old surface to the new, and back. What had material on both of its sides is left out: it bounded
    /// nothing.
    pub(crate) fn distances(&self, old: &[Corners], old_tree: &Tree, new: &[Corners], cell: f64) -> (f64, f64) {
        let new_tree = Tree::new(new);
        let from_old = sampled(old, self.threads, |triangles| {
            let mut places: Vec<(DVec3, DVec3)> = Vec::with_capacity(4 * triangles.len());
            for [a, b, c] in triangles.iter().map(|t| t.map(place)) {
                let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero());
                let four = [middle, a.lerp(middle, 0.01), b.lerp(middle, 0.01), c.lerp(middle, 0.01)];
                places.extend(four.map(|p| (p, normal * (cell / 2.0))));
            }
            let outside = |sides: Vec<DVec3>| old_tree.windings_or_sides(&sides).into_iter().map(|winding| winding <= 0.5);
            let mut bounds = Vec::with_capacity(places.len());
            let before = outside(places.iter().map(|(p, off)| *p + *off).collect());
            let inner: Vec<_> = before
                .zip(places)
                .filter_map(|(out, place)| {
                    if out {
                        bounds.push(place.0);
                        None
                    } else {
                        Some(place)
                    }
                })
                .collect();
            let behind = outside(inner.iter().map(|(p, off)| *p - *off).collect());
            bounds.extend(behind.zip(inner).filter_map(|(out, (p, _))| out.then_some(p)));
            new_tree.farthest(bounds)
        });
        let from_new = sampled(new, self.threads, |triangles| {
            let two = |[a, b, c]: [DVec3; 3]| [(a + b + c) / 3.0, a];
            old_tree.farthest(triangles.iter().flat_map(|t| two(t.map(place))))
        });
        (from_old, from_new)
    }

    /// Leaves the largest wraps out until what is replaced is no more than the profile's share of the surface.
    pub(crate) fn hold_to_share(&self, outcomes: &mut BTreeMap<Vec<u32>, Outcome>) {
        let most = self.profile.wrap_max_share;
        let mut accepted: Vec<&mut Outcome> = outcomes.values_mut().filter(|o| o.told.left.is_none()).collect();
        accepted.sort_by(|a, b| a.told.area.total_cmp(&b.told.area));
        let mut share = 0.0;
        for outcome in accepted {
            share += outcome.told.area_share;
            // Rounding may make the whole a little more than all.
            if share > most * (1.0 + 1e-9) {
                outcome.give_up(&format!("more than the profile's {:.1} % of the surface would be replaced", most * 100.0));
            }
        }
    }
}

/// Does a soup bound something? On the side that its triangles face there is mostly nothing then, and material behind them. O(n log n) for so many
/// samples at most.
fn encloses(triangles: &[Corners], tree: &Tree) -> bool {
    let mut bounds = Bounds::EMPTY;
    triangles.iter().for_each(|t| bounds.include(t));
    let off = bounds.diagonal() * 1e-3;
    let sampled = || triangles.iter().step_by(triangles.len().div_ceil(SAMPLES).max(1)).map(|t| t.map(place));
    let vector = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let sides = sampled().flat_map(|t| {
        let (middle, normal) = ((t[0] + t[1] + t[2]) / 3.0, vector(t).normalize_or_zero() * off);
        [middle + normal, middle - normal]
    });
    let windings = tree.winding_numbers(&sides.collect::<Vec<_>>());
    let (mut before, mut behind, mut all) = (0.0, 0.0, 0.0);
    for (t, winding) in sampled().zip(windings.chunks(2)) {
        let area = vector(t).length();
        before += area * winding[0];
        behind += area * winding[1];
        all += area;
    }
    behind >= BEHIND * all && before <= (1.0 - BEHIND) * all
}

/// How far a winding number is from 0, 1, 2, …
pub(crate) fn from_whole(winding: f64) -> f64 {
    if winding < 0.0 { -winding } else { (winding - winding.round()).abs() }
}

/// The largest of `measure` over triangles at even steps through a list, of which it gets some at a time.
pub(crate) fn sampled(triangles: &[Corners], threads: usize, measure: impl Fn(&[Corners]) -> f64 + Sync) -> f64 {
    const BLOCK: usize = 256;
    let step = triangles.len().div_ceil(SAMPLES).max(1);
    let count = triangles.len().div_ceil(step);
    let blocks = parallel::map(threads, count.div_ceil(BLOCK), |block| {
        let here = block * BLOCK..count.min((block + 1) * BLOCK);
        measure(&here.map(|i| triangles[i * step]).collect::<Vec<_>>())
    });
    blocks.into_iter().fold(0.0, f64::max)
}
