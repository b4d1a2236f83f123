//! Closed copies of a shell, next to its inside: they go.
//!
//! Such a copy bounds nothing: there is material on both of its sides, or, of a cavity's wall, there is none on either. Taken for a shell that is inside
//! out, it would fill the cavity.

use crate::contract::report::RepairName;
use crate::contract::settings::{Bodies, Hollow};
use crate::detect::bodies;
use crate::repairs::orient::directions::inside_out;
use crate::repairs::orient::shells;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::pieces::{crossing, take_away};
use crate::submesh::components::{Component, Sample};

/// Shells that are drawn twice, before it is measured what is meant.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Overlap,
    changes: Changes::Pieces,
    run: |cx| {
        let Dropped { shells, bodies, volume, .. } = drop_copies(cx);
        cx.account.enclose(bodies, 0.0);
        cx.account.enclosed.copied += volume;
        Ok(Done::count(shells, WORDS))
    },
};

/// The same, once all is closed. What is meant was measured with them.
pub(crate) const OF_CLOSED: Repair = Repair {
    name: RepairName::Overlap,
    changes: Changes::Pieces,
    run: |cx| {
        let Dropped { shells, bodies, meant, .. } = drop_copies(cx);
        cx.account.enclose(bodies, meant);
        Ok(Done::count(shells, WORDS))
    },
};

const WORDS: &str = "closed copies of a shell, next to its inside";

/// The copies that are gone.
#[derive(Default)]
struct Dropped {
    shells: u64,
    /// Those that face outward.
    bodies: u64,
    /// What they enclose, as they face.
    volume: f64,
    /// The same, as they count in what is meant.
    meant: f64,
}

fn drop_copies(cx: &mut Context<'_, '_>) -> Dropped {
    let pieces = cx.pieces();
    let mut copies = shells::copies(cx.survey, &pieces);
    // Bodies in each other are as they are, or material and air by turns.
    if cx.profile.bodies == Bodies::Keep || cx.profile.hollow == Hollow::Keep {
        copies.retain(|[inner, _]| pieces.list[*inner as usize].extent.volume < 0);
    }
    if copies.is_empty() {
        return Dropped::default();
    }
    let pairs = cx.survey.crossing_pairs.as_deref().unwrap_or_default().iter().map(|pair| pair.triangles);
    let crosses = crossing(cx.survey, &cx.work, &pieces, pairs);
    let mut asked: Vec<Sample> = copies.iter().map(|[inner, _]| pieces.list[*inner as usize].sample).collect();
    asked.sort_unstable();
    let is_asked = |piece: &Component| asked.binary_search(&piece.sample).is_ok();
    let around = bodies::surroundings(cx.survey, &cx.work, &pieces, &cx.reversed, is_asked);
    let lies_in = |[inner, outer]: &[u32; 2]| around[*inner as usize].around.iter().any(|(piece, _)| piece == outer);
    copies.retain(|pair| !crosses[pair[0] as usize] && lies_in(pair));
    let mut goes = vec![false; pieces.list.len()];
    copies.iter().for_each(|[inner, _]| goes[*inner as usize] = true);
    let inverted = inside_out(cx.survey, &cx.work, &cx.reversed, &pieces).pieces;
    let mut dropped = Dropped::default();
    for (p, piece) in pieces.list.iter().enumerate().filter(|(p, _)| goes[*p]) {
        let volume = cx.survey.measure.volume(piece.extent);
        dropped.shells += 1;
        dropped.bodies += u64::from(volume > 0.0);
        dropped.volume += volume;
        dropped.meant += if inverted.get(p) == Some(&true) { -volume } else { volume };
    }
    take_away(&mut cx.work, &mut cx.reversed, &pieces, &goes);
    dropped
}

#[cfg(test)]
mod tests {
    use crate::contract::progress::Quiet;
    use crate::contract::report::Outcome;
    use crate::contract::settings::{Hollow, Limits, Profile};
    use crate::engine::mesh::Mesh;
    use crate::testing::{Corners, cuboid, reversed};

    /// How a box with these walls from its surface comes out, each facing in or out, and what it encloses then.
    fn repaired(shells: &[(f32, bool)], profile: &Profile) -> (Outcome, f64) {
        let shell = |(wall, is_out): &(f32, bool)| {
            let shell = cuboid([*wall; 3], [8.0 - wall; 3]);
            if *is_out { shell } else { reversed(&shell) }
        };
        let triangles: Vec<Corners> = shells.iter().flat_map(shell).collect();
        let limits = Limits { threads: 1, ..Limits::default() };
        let report = crate::repair_mesh(&Mesh::from_triangles(&triangles).unwrap(), profile, &limits, &Quiet).unwrap().report;
        (report.outcome, report.after.unwrap_or(report.before).volume)
    }

    #[test]
    fn a_copy_of_a_cavity_does_not_fill_it() {
        let hollow = 512.0 - 216.0;
        let kept = Profile { hollow: Hollow::Keep, ..Profile::default() };
        for profile in [Profile::default(), kept] {
            assert_eq!(repaired(&[(0.0, true), (1.0, false), (1.0078125, false)], &profile), (Outcome::Repaired, hollow));
        }
    }

    #[test]
    fn a_copy_of_a_body_goes_whichever_way_both_face() {
        for is_out in [true, false] {
            assert_eq!(repaired(&[(0.0, is_out), (0.0078125, is_out)], &Profile::default()), (Outcome::Repaired, 512.0));
        }
    }

    #[test]
    fn a_thin_shell_that_the_file_says_is_one_stays() {
        let inner: f64 = 8.0 - 2.0 * 0.0078125;
        assert_eq!(repaired(&[(0.0, true), (0.0078125, false)], &Profile::default()), (Outcome::Clean, 512.0 - inner.powi(3)));
    }
}
