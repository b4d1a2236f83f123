//! The last rung: what no repair made a solid is replaced by a wrapped surface, which is one by construction ([`crate::algorithms::wrap`]).
//!
//! A **group** is what is replaced together: pieces of surface that are open, hang together in non-manifold edges or vertices, or run into each
//! other, and at least one of which is no solid. Its wrap must keep clear of everything else in the file, exactly and in its vertices;
//! what it meets joins the group, which is wrapped anew. A group stays as it is, and the report says why, if a loop of it was left open on
//! purpose, if it encloses next to nothing (a lone sheet), or if its wrap would go beyond the profile's limits.
//!
//! The wrapped triangles never enter the submesh, but go to the edit as they are: there may be millions of them, and nothing is done to
//! them any more.

mod contacts;
mod groups;
mod outcome;
mod site;

use crate::contract::progress::Progress;
use crate::contract::report::{MOST_LISTED, RepairName};
use crate::contract::settings::{Guarantee, Sheets};
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::pieces;
use contacts::contacts;
use groups::{Groups, Kept};
use outcome::Outcome;
pub(crate) use outcome::Wraps;
use site::Site;
use std::collections::BTreeMap;

use crate::contract::settings::Profile;
use crate::geometry::position::Position;
use crate::repairs::shared::overlay::Which;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{self, Components, Reversed, Through};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Pieces that nothing else made a solid.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Wrap,
    changes: Changes::Surface,
    run: |cx| {
        let is_wanted =
            cx.profile.guarantee == Guarantee::Wrap && (cx.handed.may_cross || is_broken(&mut cx.work, cx.survey.threads()));
        let mut count = 0;
        if is_wanted {
            let pairs = if cx.profile.check_self_intersections { cx.crossing() } else { Some([].into()) };
            // Sheets that the profile keeps are kept whatever they run into.
            let sheets: &[[f32; 3]] = if cx.profile.sheets == Sheets::Keep { &[] } else { &cx.handed.kept_sheets };
            let kept = Kept { open: &cx.handed.kept_open, sheets };
            let means = (cx.limits.threads, cx.progress);
            let wraps = replace(cx.survey, &mut cx.work, &mut cx.reversed, pairs.as_deref(), kept, cx.profile, means);
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

/// Each round wraps anew what met something in the round before.
const ROUNDS: usize = 8;

/// Is anything of the submesh no closed, coherent, manifold surface? O(submesh).
pub(crate) fn is_broken(work: &mut Work<'_>, threads: usize) -> bool {
    work.edges().1.iter().any(|edge| edge.uses.len() != 2 || edge.is_unbalanced())
        || !components::nonmanifold_vertices(work, threads).is_empty()
}

/// Replaces what is no solid, as far as the profile allows. `pairs`: as [`Overlay::crossing_triangles`](crate::repairs::shared::overlay::Overlay::crossing_triangles) finds them (empty if nobody looked for any);
/// Reads the chunks where groups have regular surface, and all for every round of wraps.
pub(crate) fn replace(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    pairs: Option<&[[Which; 2]]>,
    kept: Kept<'_>,
    profile: &Profile,
    (threads, progress): (usize, &dyn Progress),
) -> Wraps {
    let pieces = pieces::pieces(survey, work, reversed);
    let mut groups = Groups::of(survey, work, &pieces, pairs, kept);
    let mut wraps = Wraps::default();
    if !groups.broken.contains(&true) {
        return wraps;
    }
    let is_soup = kept.open.len() == kept.sheets.len() && groups.unite_soup(&pieces);
    let (submesh, edges) = work.edges();
    let sheets = Components::of(survey, submesh, edges, reversed, Through::ManifoldEdges);
    let site = Site { survey, submesh, reversed, pieces: &pieces, sheets: &sheets, profile, is_soup, threads, progress };
    let mut outcomes: BTreeMap<Vec<u32>, Outcome> = BTreeMap::new();
    for round in 0..=ROUNDS {
        if progress.cancelled() {
            return wraps;
        }
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
        let met = contacts(&site, &outcomes);
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
        if wraps.listed.len() < MOST_LISTED {
            wraps.listed.push(outcome.told);
        }
    }
    let goes = |piece: u32| piece != NONE && goes[piece as usize];
    let doomed: Vec<u32> = work.living().filter(|t| goes(pieces.of_triangle[*t as usize])).collect();
    wraps.gone = doomed.iter().flat_map(|t| work.points(*t)).map(Position::of).collect();
    wraps.gone.sort_unstable();
    wraps.gone.dedup();
    doomed.into_iter().for_each(|t| work.kill(t));
    if pieces.of_region.iter().any(|piece| goes(*piece)) {
        reversed.dropped.iter_mut().zip(&pieces.of_region).for_each(|(dropped, piece)| *dropped |= goes(*piece));
    }
}

#[cfg(test)]
mod tests;
