//! Bodies in the material of others that were meant for cavities.
//!
//! A body wholly in the material of another one, which nothing crosses, bounds nothing. It is the inner wall of a hollow print whose program
//! forgot to turn it, or a part that is in the way. The file does not tell which: the profile does (`hollow = "keep"`), and what lies in
//! each other is material and air by turns then. But if much of its surface was turned, since its triangles contradict each other, then the file does
//! not even say that it is a body. Then it is a cavity, whatever the profile says: that bounds something.
//!
//! A vessel whose mouth a patch has closed would swallow what stands in it. So nothing is turned in a body of which patches are much.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::contract::report::RepairName;
use crate::contract::settings::{Bodies, Hollow, Profile};
use crate::detect::bodies;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::place;
use crate::geometry::sums::Bounds;
use crate::repairs::orient::directions::turn;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::pieces::{are_patched, crossing};
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::words::{Short, span};

/// Bodies in the material of others that become cavities.
pub(crate) const REPAIR: Repair = Repair { name: RepairName::Hollow, changes: Changes::Outward, run };

fn run(cx: &mut Context<'_, '_>) -> crate::contract::error::Result<Done> {
    let pieces = cx.pieces();
    let Found { turns, guessed } = meant_for_cavities(cx.survey, &cx.work, &cx.reversed, &pieces, cx.profile);
    turn(&mut cx.work, &mut cx.reversed, &pieces, &turns);
    let volumes =
        pieces.list.iter().zip(&turns).filter(|(_, turns)| **turns).map(|(piece, _)| cx.survey.measure.volume(piece.extent));
    let (cavities, bodies): (Vec<f64>, Vec<f64>) = volumes.partition(|volume| *volume > 0.0);
    let [hollow, filled] = [&cavities, &bodies].map(|volumes| volumes.iter().sum::<f64>());
    let count = cavities.len() as u64;
    // It was counted as material, and is taken off now; or the other way round.
    cx.account.enclose(count, 2.0 * (hollow + filled));
    for bounds in guessed {
        let bounds = bounds.normalised();
        cx.account.doubts.push(format!(
            "most triangles of a body in the material of another one say that it is one, others that it is a cavity, which it was taken for: \
             {}",
            span([bounds.lo, bounds.hi])
        ));
    }
    Ok(Done::count(count, format!("bodies in the material of others turned into cavities, of {} units³ together", Short(hollow))))
}

/// A piece of which more than this share of the triangles was turned, and more than this share was not, says nothing of its direction.
const MIXED: f64 = 0.125;

/// The smaller part of a piece's triangles is a minority, and not chance, if it is smaller than half by so many times the square root of all.
const CHANCE: f64 = 3.0;

struct Found {
    /// By piece.
    turns: Vec<bool>,
    /// Of those that more of their triangles call bodies.
    guessed: Vec<Bounds>,
}

/// How many triangles of a piece are the file's, and how many of those were turned.
#[derive(Clone, Copy, Default)]
struct Said {
    /// Triangles of the file: all, and those that were turned.
    triangles: u64,
    turned: u64,
}

impl Said {
    fn is_mixed(&self) -> bool {
        let least = MIXED * self.triangles as f64;
        self.turned as f64 > least && (self.triangles - self.turned) as f64 > least
    }

    fn share_turned(&self) -> f64 {
        self.turned as f64 / self.triangles.max(1) as f64
    }

    /// Does the file say that this is a body? Most triangles have the direction that it has; unless the piece around, of which it is known
    /// where is out, has as many wrong ones, this share, as this would have as a cavity.
    fn is_a_body(&self, host: Option<f64>) -> bool {
        let (all, own) = (self.triangles as f64, self.share_turned());
        let most = own * all < all / 2.0 - CHANCE * all.sqrt();
        most && host.is_none_or(|host| (own - host).abs() <= (1.0 - own - host).abs())
    }
}

/// Bodies in the material of others, from the outside in. Nothing is known if nobody looked for crossings.
fn meant_for_cavities(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    pieces: &Components,
    profile: &Profile,
) -> Found {
    let list = &pieces.list;
    let mut found = Found { turns: vec![false; list.len()], guessed: Vec::new() };
    let Some(pairs) = survey.crossing_pairs.as_deref().filter(|_| profile.bodies != Bodies::Visible) else { return found };
    let all_around = bodies::surroundings(survey, submesh, pieces, reversed, |piece| !piece.open);
    if all_around.iter().all(|a| a.winding() < 1) {
        return found;
    }
    let crossing = crossing(survey, submesh, pieces, pairs.iter().map(|pair| pair.triangles));
    let (said, patched) = (said(survey, submesh, pieces, reversed), are_patched(survey, submesh, pieces));
    let open: Vec<Bounds> = list.iter().filter(|piece| piece.open).map(|piece| piece.bounds).collect();
    let (open, mut met) = (BoxTree::new(&open), Vec::new());
    let mut order: Vec<usize> = (0..list.len()).filter(|p| !all_around[*p].around.is_empty()).collect();
    order.sort_by_key(|p| all_around[*p].around.len());
    for p in order {
        let (piece, around) = (&list[p], &all_around[p].around);
        let winding: i32 = around.iter().map(|(o, w)| if found.turns[*o as usize] { -w } else { *w }).sum();
        open.meeting(&piece.bounds, &mut met);
        if crossing[p] || !met.is_empty() || around.iter().any(|(o, _)| patched[*o as usize]) {
            continue;
        }
        if piece.extent.volume <= 0 || winding < 1 {
            // What was a cavity is a body if it lies in a new one.
            found.turns[p] = piece.extent.volume < 0 && winding < 1 && around.iter().any(|(o, _)| found.turns[*o as usize]);
            continue;
        }
        found.turns[p] = profile.hollow == Hollow::Keep || said[p].is_mixed();
        let host = around.iter().max_by_key(|(o, _)| all_around[*o as usize].around.len());
        let host = host.map(|(o, _)| match (found.turns[*o as usize], said[*o as usize].share_turned()) {
            (true, share) => 1.0 - share,
            (false, share) => share,
        });
        if found.turns[p] && profile.hollow != Hollow::Keep && said[p].is_a_body(host) {
            found.guessed.push(piece.bounds);
        }
    }
    found
}

/// By piece.
fn said(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components, reversed: &Reversed) -> Vec<Said> {
    let mut said = vec![Said::default(); pieces.list.len()];
    let turned_before = turned_before(survey, pieces);
    for (region, piece) in pieces.of_region.iter().enumerate().filter(|(_, piece)| **piece != NONE) {
        let (said, triangles) = (&mut said[*piece as usize], survey.regions[region].triangles);
        let before = turned_before.get(region).copied().unwrap_or(0);
        said.triangles += triangles;
        said.turned += if reversed.regions[region] { triangles - before } else { before };
    }
    for t in submesh.beside_records(survey).filter(|t| submesh.lives(*t) && pieces.of_triangle[*t as usize] != NONE) {
        let said = &mut said[pieces.of_triangle[t as usize] as usize];
        if let Some(read) = submesh.as_read(survey.records, t) {
            // Its corners may have been welded to others.
            let [now, read] = [submesh.points(t), read].map(normal);
            said.triangles += 1;
            said.turned += u64::from((now.dot(read) < 0.0) != survey.was_turned(submesh.record(t)));
        }
    }
    said
}

/// By region: how many of its triangles had been turned in the stream; nothing if none had.
fn turned_before(survey: &Survey<'_>, pieces: &Components) -> Vec<u64> {
    if survey.turned.is_empty() {
        return Vec::new();
    }
    let per_chunk = survey.visit_regular(
        |region| pieces.of_region[region as usize] != NONE,
        BTreeMap::<u32, u64>::new,
        |counts, triangle, region| *counts.entry(region).or_default() += u64::from(survey.was_turned(triangle)),
    );
    let mut all = vec![0; survey.regions.len()];
    per_chunk.into_iter().flatten().for_each(|(region, count)| all[region as usize] += count);
    all
}

fn normal(corners: [[f32; 3]; 3]) -> DVec3 {
    let [a, b, c] = corners.map(place);
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::orient::directions::make_coherent;
    use crate::repairs::shared::pieces;
    use crate::repairs::shared::work::Work;
    use crate::testing::{After, Corners, after, cuboid, reversed, shifted};

    fn nested(size: f32) -> Vec<Corners> {
        cuboid([-size; 3], [size; 3])
    }

    /// How many became cavities, and how many of them by a guess.
    fn hollowed(mesh: &[Corners], hollow: Hollow) -> After<(usize, usize)> {
        let profile = Profile { hollow, ..Profile::default() };
        after(mesh, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            make_coherent(&d.survey, work, turned, &[]);
            let pieces = pieces::pieces(&d.survey, work, turned);
            let found = meant_for_cavities(&d.survey, work, turned, &pieces, &profile);
            turn(work, turned, &pieces, &found.turns);
            (found.turns.iter().filter(|turns| **turns).count(), found.guessed.len())
        })
    }

    #[test]
    fn bodies_in_each_other_are_material_and_air_by_turns_where_the_profile_says_so() {
        let mesh = [nested(1.0), nested(4.0), nested(2.0), nested(3.0)].concat();
        let got = hollowed(&mesh, Hollow::Keep);
        assert_eq!((got.result, got.untouched), ((2, 0), 24));
        assert!((got.defects.volume - (512.0 - 216.0 + 64.0 - 8.0)).abs() < 1e-9, "{}", got.defects.volume);
        assert_eq!(hollowed(&mesh, Hollow::Fill).result, (0, 0));
        // What was a cavity in material twice over is a body in the new cavity.
        let got = hollowed(&[nested(4.0), nested(3.0), reversed(&nested(2.0))].concat(), Hollow::Keep);
        assert_eq!(got.result, (2, 0));
        assert!((got.defects.volume - (512.0 - 216.0 + 64.0)).abs() < 1e-9, "{}", got.defects.volume);
        // What is hollow already stays so, with what floats in it.
        assert_eq!(hollowed(&[nested(4.0), reversed(&nested(2.0)), nested(1.0)].concat(), Hollow::Keep).result, (0, 0));
    }

    #[test]
    fn what_sticks_out_or_lies_behind_something_open_is_left() {
        assert_eq!(hollowed(&[nested(4.0), shifted(&nested(1.0), [3.5, 0.0, 0.0])].concat(), Hollow::Keep).result, (0, 0));
        let open = &nested(2.0)[1..];
        assert_eq!(hollowed(&[&nested(4.0)[..], open, &nested(1.0)].concat(), Hollow::Keep).result, (0, 0));
    }

    #[test]
    fn what_contradicts_itself_in_material_is_a_cavity() {
        // So many of its twelve triangles are turned.
        let with_turned = |count: usize| {
            let mut torn = nested(2.0);
            (0..count).for_each(|i| torn[i] = reversed(&torn[i..=i])[0]);
            let got = hollowed(&[nested(4.0), torn].concat(), Hollow::Fill);
            (got.result.0, got.defects.cavities)
        };
        assert_eq!([1, 4, 8, 11].map(with_turned), [(0, 0), (1, 1), (0, 1), (0, 1)]);
    }

    #[test]
    fn the_file_calls_it_a_body_unless_the_piece_around_has_as_many_wrong_triangles_as_a_cavity_would() {
        let is_a_body = |turned: u64, host: Option<f64>| Said { triangles: 1000, turned }.is_a_body(host);
        assert!(is_a_body(400, None) && is_a_body(400, Some(0.375)));
        assert!(!is_a_body(400, Some(0.625)));
        assert!(!is_a_body(460, None), "chance");
    }
}
