//! The last rung: what no repair made a solid is replaced by a wrapped surface, which is one by construction ([`crate::algorithms::wrap`]).
//!
//! A **group** is what is replaced together: pieces of surface that are open, hang together in non-manifold edges or vertices, or run into each
//! other, and at least one of which is no solid. Its wrap must keep clear of everything else in the file, exactly and in its vertices;
//! what it meets joins the group, which is wrapped anew. A group stays as it is, and the report says why, if a loop of it was left open on
//! purpose, if it encloses next to nothing (a lone sheet), or if its wrap would go beyond the profile's limits.
//!
//! The wrapped triangles never enter the workshop, but go to the edit as they are: there may be millions of them, and nothing is done to
//! them any more.

use crate::contract::settings::Guarantee;
use crate::repairs::shared::account::RepairName;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::pieces;
use crate::repairs::shared::pieces::components_of_records;
use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::algorithms::wrap::tree::{Corners, Tree};
use crate::algorithms::wrap::{Wrapping, wrap};
use crate::contract::report::Wrap;
use crate::contract::settings::Profile;
use crate::detect::fresh;
use crate::geometry::position::{self, Position};
use crate::geometry::sums::Bounds;
use crate::io::record;
use crate::repairs::shared::overlay::Overlay;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{self, Components, Reversed, Through};
use crate::submesh::{Shop, place};
use crate::topology::survey::Survey;
use crate::util::parallel;
use crate::util::union_find::NONE;

/// What nothing else made a solid.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Wrap,
    changes: Changes::Surface,
    run: |cx| {
        let is_wanted = cx.profile.guarantee == Guarantee::Wrap && (cx.handed.may_cross || is_broken(&mut cx.work));
        let mut count = 0;
        if is_wanted {
            let pairs = if cx.profile.check_self_intersections {
                let overlay = Overlay::of(cx.survey, &cx.work, &cx.reversed);
                overlay.and_then(|overlay| overlay.crossing_pairs(cx.survey, &cx.work))
            } else {
                Some(Vec::new())
            };
            let (kept_open, threads) = (&cx.handed.kept_open, cx.limits.threads);
            let wraps = replace(cx.survey, &mut cx.work, &mut cx.reversed, pairs.as_deref(), kept_open, cx.profile, threads);
            count = wraps.regions;
            cx.account.wraps = wraps.listed;
            (cx.handed.wrapped, cx.handed.replaced) = (wraps.triangles, wraps.gone);
            let Context { account, handed, .. } = cx;
            account.loops_left.retain(|left| !handed.is_replaced(left.at));
        }
        let note = "regions that nothing else made a solid, replaced by a surface around what they enclose";
        Ok(Done::count(count, note))
    },
};

/// Triangles of a group, or of several that are wrapped at a time, at most: some 100 bytes each.
const MOST_TRIANGLES: u64 = 1 << 22;
/// Cubes of the lattice that all wraps together take, about; each makes some ten triangles.
const CUBES: f64 = (1 << 18) as f64;
/// And a single one, at least.
const LEAST_CUBES: f64 = 2048.0;
/// A group encloses next to nothing below this share of its size: the root of half its area, cubed. A sheet that is bent by a five-hundredth of
/// its width.
const NOTHING: f64 = 1e-3;
/// Each round wraps anew what met something in the round before.
const ROUNDS: usize = 8;
/// Triangles that are looked at to tell how far a surface moved, at most, by their corners and middles.
const SAMPLES: usize = 1 << 13;
/// Regions that are listed.
const LISTED: usize = 1000;

/// What was wrapped.
#[derive(Default)]
pub(crate) struct Wraps {
    /// Regions that were replaced, and those that would have been but for a reason.
    pub(crate) listed: Vec<Wrap>,
    /// The new triangles.
    pub(crate) triangles: Vec<Corners>,
    pub(crate) regions: u64,
    /// Positions of all vertices of the workshop that are gone, ascending.
    gone: Vec<Position>,
}

/// Is anything of the workshop no closed, coherent, manifold surface? O(workshop).
pub(crate) fn is_broken(work: &mut Work<'_>) -> bool {
    let (shop, edges) = work.edges();
    edges.iter().any(|edge| edge.uses.len() != 2 || edge.is_unbalanced())
        || !components::nonmanifold_vertices(shop, edges).is_empty()
}

/// Replaces what is no solid, as far as the profile allows. `pairs`: as [`Overlay::crossing_pairs`] finds them (empty if nobody looked for any);
/// `kept_open`: a vertex of each loop that was left open on purpose. Reads the chunks where groups have sound surface, and all for every round
/// of wraps.
pub(crate) fn replace(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    pairs: Option<&[[u32; 2]]>,
    kept_open: &[[f32; 3]],
    profile: &Profile,
    threads: usize,
) -> Wraps {
    let pieces = pieces::pieces(survey, work, reversed);
    let mut groups = Groups::of(survey, work, &pieces, pairs, kept_open);
    let mut wraps = Wraps::default();
    if !groups.broken.contains(&true) {
        return wraps;
    }
    let (shop, edges) = work.edges();
    let sheets = Components::of(survey, shop, edges, reversed, Through::ManifoldEdges);
    let site = Site { survey, shop, reversed, pieces: &pieces, sheets: &sheets, profile, threads };
    let mut outcomes: BTreeMap<Vec<u32>, Outcome> = BTreeMap::new();
    for round in 0..=ROUNDS {
        let all = groups.list();
        let mut before = std::mem::take(&mut outcomes);
        let (known, new): (Vec<_>, Vec<_>) = all.into_iter().partition(|group| before.contains_key(group));
        for group in known {
            if let Some(outcome) = before.remove(&group) {
                outcomes.insert(group, outcome);
            }
        }
        drop(before);
        site.wrap_all(&groups, new, &mut outcomes);
        site.hold_to_share(&mut outcomes);
        let met = site.meetings(&outcomes);
        if met.as_ref().is_some_and(Vec::is_empty) {
            break;
        }
        if round == ROUNDS || met.is_none() {
            for outcome in outcomes.values_mut() {
                outcome.give_up("wraps keep running into what is around them");
            }
            break;
        }
        met.into_iter().flatten().for_each(|[a, b]| groups.unite(a, b));
    }
    apply(work, reversed, &pieces, outcomes, &mut wraps);
    wraps
}

/// Takes what was replaced away, and lists what was done.
fn apply(
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    pieces: &Components,
    outcomes: BTreeMap<Vec<u32>, Outcome>,
    wraps: &mut Wraps,
) {
    let mut goes = vec![false; pieces.list.len()];
    let mut outcomes: Vec<(Vec<u32>, Outcome)> = outcomes.into_iter().collect();
    // The largest first, of equal ones the one with the first piece.
    outcomes.sort_by(|a, b| b.1.told.area.total_cmp(&a.1.told.area));
    for (group, outcome) in outcomes {
        if outcome.told.left.is_none() {
            group.iter().for_each(|piece| goes[*piece as usize] = true);
            wraps.regions += 1;
            wraps.triangles.extend(outcome.triangles);
        }
        if wraps.listed.len() < LISTED {
            wraps.listed.push(outcome.told);
        }
    }
    let goes = |piece: u32| piece != NONE && goes[piece as usize];
    let doomed: Vec<u32> = work.living().filter(|t| goes(pieces.of_triangle[*t as usize])).collect();
    wraps.gone = doomed.iter().flat_map(|t| work.points(*t)).map(Position::of).collect();
    wraps.gone.sort_unstable();
    wraps.gone.dedup();
    doomed.into_iter().for_each(|t| work.kill(t));
    if pieces.of_patch.iter().any(|piece| goes(*piece)) {
        reversed.dropped.iter_mut().zip(&pieces.of_patch).for_each(|(dropped, piece)| *dropped |= goes(*piece));
    }
}

/// What came of a group.
struct Outcome {
    told: Wrap,
    triangles: Vec<Corners>,
}

impl Outcome {
    fn give_up(&mut self, reason: &str) {
        if self.told.left.is_none() {
            self.told.left = Some(reason.into());
            self.told.added = 0;
            self.triangles = Vec::new();
        }
    }
}

/// Which pieces are to be replaced together.
struct Groups {
    parents: Vec<u32>,
    /// Pieces that are no solid, or run into one.
    broken: Vec<bool>,
    /// Pieces with a loop that was left open on purpose.
    kept: Vec<bool>,
}

impl Groups {
    fn of(
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        pieces: &Components,
        pairs: Option<&[[u32; 2]]>,
        kept_open: &[[f32; 3]],
    ) -> Self {
        let (shop, edges) = work.edges();
        let count = pieces.list.len();
        let mut groups = Self {
            parents: (0..count as u32).collect(),
            broken: pieces.list.iter().map(|piece| piece.open).collect(),
            kept: vec![false; count],
        };
        let of = |t: u32| pieces.of_triangle[t as usize];
        for edge in edges.iter().filter(|e| e.uses.len() != 2 || e.is_inconsistent()) {
            edge.uses.windows(2).for_each(|pair| groups.unite(of(pair[0].triangle), of(pair[1].triangle)));
            edge.uses.iter().for_each(|u| groups.broken[of(u.triangle) as usize] = true);
        }
        for v in components::nonmanifold_vertices(shop, edges) {
            let around: Vec<u32> = shop.star(v).map(|(t, _)| of(t)).collect();
            around.iter().for_each(|piece| groups.broken[*piece as usize] = true);
            around.windows(2).for_each(|pair| groups.unite(pair[0], pair[1]));
        }
        for t in shop.living().filter(|t| shop.is_collinear(*t)) {
            groups.broken[of(t) as usize] = true;
        }
        match pairs {
            Some(pairs) => {
                let records = survey.records.len() as u32;
                let old = pairs.iter().flatten().copied().filter(|number| *number < records);
                let of_record = components_of_records(survey, shop, pieces, old);
                let piece = |number: u32| match number.checked_sub(records) {
                    Some(t) => Some(of(t)),
                    None => of_record.get(&number).copied(),
                };
                for pair in pairs {
                    if let [Some(a), Some(b)] = pair.map(|number| piece(number).filter(|piece| *piece != NONE)) {
                        groups.unite(a, b);
                        groups.broken[a as usize] = true;
                        groups.broken[b as usize] = true;
                    }
                }
            }
            // Anything may run into anything.
            None => {
                (1..count as u32).for_each(|piece| groups.unite(0, piece));
                groups.broken.fill(true);
            }
        }
        let mut kept: Vec<Position> = kept_open.iter().copied().map(Position::of).collect();
        kept.sort_unstable();
        for t in shop.living() {
            if !kept.is_empty() && shop.points(t).iter().any(|p| kept.binary_search(&Position::of(*p)).is_ok()) {
                groups.kept[of(t) as usize] = true;
            }
        }
        groups
    }

    fn unite(&mut self, a: u32, b: u32) {
        if a != NONE && b != NONE {
            crate::util::union_find::unite(&mut self.parents, a, b);
        }
    }

    /// The groups that are to be replaced, each by its pieces, ascending.
    fn list(&mut self) -> Vec<Vec<u32>> {
        let mut all: BTreeMap<u32, (Vec<u32>, bool)> = BTreeMap::new();
        for piece in 0..self.parents.len() as u32 {
            let (list, is_broken) = all.entry(crate::util::union_find::find(&mut self.parents, piece)).or_default();
            list.push(piece);
            *is_broken |= self.broken[piece as usize];
        }
        all.into_values().filter(|(_, is_broken)| *is_broken).map(|(list, _)| list).collect()
    }
}

/// What a group is told by.
#[derive(Clone, Copy)]
struct Size {
    triangles: u64,
    bounds: Bounds,
    /// Of all of it, in the file's units, squared.
    area: f64,
}

/// What there is to look at.
struct Site<'s, 'a> {
    survey: &'s Survey<'a>,
    shop: &'s Shop,
    reversed: &'s Reversed,
    pieces: &'s Components,
    /// What hangs together through edges of two triangles.
    sheets: &'s Components,
    profile: &'s Profile,
    threads: usize,
}

impl Site<'_, '_> {
    fn size(&self, group: &[u32]) -> Size {
        let mut size = Size { triangles: 0, bounds: Bounds::EMPTY, area: 0.0 };
        for piece in group.iter().map(|piece| &self.pieces.list[*piece as usize]) {
            size.triangles += piece.triangles;
            size.bounds.add(&piece.bounds);
            size.area += self.survey.measure.area(piece.extent);
        }
        size
    }

    fn whole_area(&self) -> f64 {
        self.pieces.list.iter().map(|piece| self.survey.measure.area(piece.extent)).sum()
    }

    /// Wraps groups, as many at a time as there is room for.
    fn wrap_all(&self, groups: &Groups, all: Vec<Vec<u32>>, outcomes: &mut BTreeMap<Vec<u32>, Outcome>) {
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
            if group.iter().any(|piece| groups.kept[*piece as usize]) {
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

    fn wrap_batch(&self, batch: &mut [(Vec<u32>, Outcome)]) {
        let gathered = self.gather(&batch.iter().map(|(group, _)| group.as_slice()).collect::<Vec<_>>());
        for ((_, outcome), triangles) in batch.iter_mut().zip(gathered) {
            self.wrap_one(&triangles, outcome);
        }
    }

    /// The triangles of some groups with their sheets, each in the order of the file, as they are turned now.
    fn gather(&self, groups: &[&[u32]]) -> Vec<Vec<(u32, Corners)>> {
        let mut group_of = vec![NONE; self.pieces.list.len()];
        for (group, number) in groups.iter().zip(0..) {
            group.iter().for_each(|piece| group_of[*piece as usize] = number);
        }
        let of_piece = |piece: u32| if piece == NONE { NONE } else { group_of[piece as usize] };
        let of_patch = |patch: u32| of_piece(self.pieces.of_patch[patch as usize]);
        let found = self.survey.visit_sound(
            |patch| of_patch(patch) != NONE,
            |_| Some(Vec::new()),
            |_, _| true,
            |list: &mut Vec<(u32, u32, u32, u32)>, record, patch| list.push((of_patch(patch), record, patch, NONE)),
        );
        let mut all: Vec<(u32, u32, u32, u32)> = found.into_iter().flatten().collect();
        let of_triangle = |t: u32| of_piece(self.pieces.of_triangle[t as usize]);
        let in_shop = self.shop.living().filter(|t| of_triangle(*t) != NONE);
        all.extend(in_shop.map(|t| (of_triangle(t), self.shop.record(t), NONE, t)));
        all.sort_unstable();
        let mut gathered = vec![Vec::new(); groups.len()];
        for (group, record, patch, t) in all {
            let with_sheet = if t == NONE {
                let [a, b, c] = position::corners(&self.survey.records[record as usize]);
                let is_turned = self.reversed.patches[patch as usize];
                (self.sheets.of_patch[patch as usize], if is_turned { [a, c, b] } else { [a, b, c] })
            } else {
                (self.sheets.of_triangle[t as usize], self.shop.points(t))
            };
            gathered[group as usize].push(with_sheet);
        }
        gathered
    }

    fn wrap_one(&self, gathered: &[(u32, Corners)], outcome: &mut Outcome) {
        let mut triangles: Vec<Corners> = gathered.iter().map(|(_, corners)| *corners).collect();
        let mut tree = Tree::winding(&triangles);
        let turned = self.inside_out(gathered, &tree);
        if !turned.is_empty() {
            let of_turned = gathered.iter().zip(&mut triangles).filter(|((sheet, _), _)| turned.binary_search(sheet).is_ok());
            of_turned.for_each(|(_, corners)| corners.swap(1, 2));
            tree = Tree::winding(&triangles);
        }
        let told = &mut outcome.told;
        let cubes = (CUBES * told.area_share).max(LEAST_CUBES) as u32;
        let Some(Wrapping { triangles: new, cell, volume }) = wrap(&triangles, &tree, cubes, self.threads) else {
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
            outcome.give_up(&format!("the surface would move by more than the profile's {farthest:.4}"));
        }
    }

    /// Open sheets of a group that are inside out: nobody could tell before on which side of them there is material, as they end in the air or
    /// where several meet. On both sides of a sheet that is the right way round the whole winds a whole number of times, and not less than
    /// none; a sheet is turned if that holds better then. Ascending; at most so many are looked at, the largest first.
    fn inside_out(&self, gathered: &[(u32, Corners)], tree: &Tree) -> Vec<u32> {
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
            for t in corners.iter().step_by(corners.len().div_ceil(LOOKED_AT)) {
                let [a, b, c] = t.map(place);
                let vector = (b - a).cross(c - a);
                let normal = vector.normalize_or_zero();
                for p in [(a + b + c) / 3.0 + normal * off, (a + b + c) / 3.0 - normal * off] {
                    let others: f64 = turned.iter().map(|(_, other)| 2.0 * other.winding_number(p)).sum();
                    let now = tree.winding_number(p) - others;
                    as_is += vector.length() * from_whole(now);
                    if_turned += vector.length() * from_whole(now - 2.0 * own.winding_number(p));
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
    fn distances(&self, old: &[Corners], old_tree: &Tree, new: &[Corners], cell: f64) -> (f64, f64) {
        let new_tree = Tree::new(new);
        let from_old = sampled(old, self.threads, |t| {
            let [a, b, c] = t.map(place);
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero());
            let off = normal * (cell / 2.0);
            [middle, a.lerp(middle, 0.01), b.lerp(middle, 0.01), c.lerp(middle, 0.01)]
                .into_iter()
                .filter(|p| old_tree.winding_number(*p + off) <= 0.5 || old_tree.winding_number(*p - off) <= 0.5)
                .map(|p| new_tree.distance(p))
                .fold(0.0, f64::max)
        });
        let from_new = sampled(new, self.threads, |t| {
            let [a, b, c] = t.map(place);
            old_tree.distance((a + b + c) / 3.0).max(old_tree.distance(a))
        });
        (from_old, from_new)
    }

    /// Leaves the largest wraps out until what is replaced is no more than the profile's share of the surface.
    fn hold_to_share(&self, outcomes: &mut BTreeMap<Vec<u32>, Outcome>) {
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

    /// Which pieces an accepted wrap meets, with one of its own; or which two wraps' pieces meet. `None` if that is too much work to tell.
    fn meetings(&self, outcomes: &BTreeMap<Vec<u32>, Outcome>) -> Option<Vec<[u32; 2]>> {
        let accepted: Vec<(&Vec<u32>, &Outcome)> = outcomes.iter().filter(|(_, o)| o.told.left.is_none()).collect();
        if accepted.is_empty() {
            return Some(Vec::new());
        }
        let records = self.survey.records.len() as u32;
        let first_new = records.checked_add(self.shop.triangles.len() as u32)?;
        let mut goes = vec![false; self.pieces.list.len()];
        accepted.iter().flat_map(|(group, _)| group.iter()).for_each(|piece| goes[*piece as usize] = true);
        let goes = |piece: u32| piece != NONE && goes[piece as usize];
        let overlay = Overlay::of(self.survey, self.shop, self.reversed)?;
        let of_shop = self.shop.living().filter(|t| goes(self.pieces.of_triangle[*t as usize])).map(|t| self.shop.record(t));
        let mut gone: Vec<u32> = of_shop.collect();
        let sound = self.survey.visit_sound(
            |patch| goes(self.pieces.of_patch[patch as usize]),
            |_| Some(Vec::new()),
            |_, _| true,
            |list: &mut Vec<u32>, record, _| list.push(record),
        );
        gone.extend(sound.into_iter().flatten());
        gone.sort_unstable();
        // A wrapped triangle's number tells its group.
        let mut starts = Vec::new();
        let mut all: Vec<(u32, Corners)> = Vec::new();
        for (_, outcome) in &accepted {
            starts.push(all.len() as u32);
            let from = first_new.checked_add(all.len() as u32)?;
            from.checked_add(outcome.triangles.len() as u32)?;
            all.extend((from..).zip(outcome.triangles.iter().copied()));
        }
        let piece_of_new = |number: u32| accepted[starts.partition_point(|s| *s <= number) - 1].0[0];
        let beside = overlay.changed().iter().filter(|t| !goes(self.pieces.of_triangle[**t as usize]));
        let pairs = fresh::met_by(
            self.survey,
            all.iter().copied(),
            beside.map(|t| (records + t, self.shop.points(*t))),
            |record| overlay.is_gone(record) || gone.binary_search(&record).is_ok(),
            u64::from(first_new) + all.len() as u64,
            fresh::self_intersection,
        )?;
        let old = pairs.iter().flat_map(|pair| pair.triangles).filter(|number| *number < records);
        let of_record = components_of_records(self.survey, self.shop, self.pieces, old);
        let piece = |number: u32| {
            if let Some(new) = number.checked_sub(first_new) {
                return piece_of_new(new);
            }
            match number.checked_sub(records) {
                Some(t) => self.pieces.of_triangle[t as usize],
                None => of_record.get(&number).copied().unwrap_or(NONE),
            }
        };
        let mut met: Vec<[u32; 2]> = pairs.iter().map(|pair| pair.triangles.map(piece)).collect();
        // Vertices of two surfaces in one place would be one when the file is read.
        let mut corners: Vec<(Position, u32)> = Vec::with_capacity(all.len());
        for (number, triangle) in &all {
            corners.extend(triangle.map(|p| (Position::of(p), piece_of_new(number - first_new))));
        }
        drop(all);
        corners.sort_unstable();
        corners.dedup();
        met.extend(corners.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| [pair[0].1, pair[1].1]));
        let at = |p: [f32; 3]| {
            let found = corners.partition_point(|(q, _)| *q < Position::of(p));
            corners.get(found).filter(|(q, _)| *q == Position::of(p)).map(|(_, piece)| *piece)
        };
        for t in self.shop.living() {
            let own = self.pieces.of_triangle[t as usize];
            if !goes(own) {
                met.extend(self.shop.points(t).into_iter().filter_map(at).map(|piece| [piece, own]));
            }
        }
        let mut bounds = Bounds::EMPTY;
        accepted.iter().flat_map(|(_, outcome)| &outcome.triangles).for_each(|t| bounds.include(t));
        let touched = self.survey.visit_sound(
            |patch| !self.reversed.dropped[patch as usize] && !goes(self.pieces.of_patch[patch as usize]),
            |reach| reach.overlap(&bounds).map(|_| Vec::new()),
            |_, corners| corners.iter().any(|p| at(*p).is_some()),
            |list: &mut Vec<(u32, u32)>, record, patch| list.push((record, patch)),
        );
        for (record, patch) in touched.into_iter().flatten() {
            let corners = record::corners(&self.survey.records[record as usize]);
            met.extend(corners.into_iter().filter_map(at).map(|piece| [piece, self.pieces.of_patch[patch as usize]]));
        }
        met.retain(|[a, b]| a != b && *a != NONE && *b != NONE);
        met.sort_unstable();
        met.dedup();
        Some(met)
    }
}

/// How far a winding number is from 0, 1, 2, …
fn from_whole(winding: f64) -> f64 {
    if winding < 0.0 { -winding } else { (winding - winding.round()).abs() }
}

/// The largest of `measure` over triangles at even steps through a list.
fn sampled(triangles: &[Corners], threads: usize, measure: impl Fn(&Corners) -> f64 + Sync) -> f64 {
    const BLOCK: usize = 256;
    let step = triangles.len().div_ceil(SAMPLES).max(1);
    let count = triangles.len().div_ceil(step);
    let blocks = parallel::map(threads, count.div_ceil(BLOCK), |block| {
        (block * BLOCK..count.min((block + 1) * BLOCK)).map(|i| measure(&triangles[i * step])).fold(0.0, f64::max)
    });
    blocks.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
