//! Coherent orientation over shared edges, then outward by enclosed volume, cavities inward.

use crate::contract::report::RepairName;
use crate::geometry::sums::Bounds;
use crate::repairs::orient::inverted::{Inverted, inverted};
use crate::repairs::orient::shells;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::gather::gather;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::parity::Parity;

/// What the report says of triangles that were turned.
pub(crate) const NOTE: &str = "triangles turned to agree with their neighbours";

/// Neighbours that disagree.
pub(crate) const COHERENT: Repair = Repair {
    name: RepairName::Orient,
    changes: Changes::Directions,
    run: |cx| {
        let turned = make_coherent(cx.survey, &mut cx.work, &mut cx.reversed, &cx.handed.settled);
        if turned.contradictions > 0 {
            tracing::info!(edges = turned.contradictions, "No orientation satisfies all edges: a surface is one-sided.");
        }
        Ok(Done::count(turned.triangles, NOTE))
    },
};

/// Closed pieces that are inside out.
pub(crate) const OUTWARD: Repair = Repair {
    name: RepairName::Outward,
    changes: Changes::Outward,
    run: |cx| {
        let mut turned = 0;
        if !cx.is_outward() {
            let pieces = cx.pieces();
            let outward = make_outward(cx.survey, &mut cx.work, &mut cx.reversed, &pieces);
            turned = outward.pieces;
            let news: Vec<String> = outward.doubts.into_iter().filter(|doubt| !cx.account.doubts.contains(doubt)).collect();
            cx.account.doubts.extend(news);
            cx.account.enclosed.outline = cx.account.enclosed.outline.or(outward.outline);
            cx.handed.cavities.extend(outward.cavities);
            cx.found_outward();
        }
        Ok(Done::count(turned, "components that were inside out"))
    },
};

/// How many triangles were turned, and how many edges contradict each other still.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turned {
    pub(crate) triangles: u64,
    /// Edges that no orientation satisfies (a Möbius strip has one).
    pub(crate) contradictions: u64,
}

/// Makes two-triangle edges agree: in each connected surface the smaller part is turned, of equal parts the one with the later
/// triangle. What is `settled`, by triangle of the submesh, stays as it is. O(regions + submesh).
pub(crate) fn make_coherent(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed, settled: &[bool]) -> Turned {
    let (submesh, edges) = work.edges();
    let regions = survey.regions.len() as u32;
    let mut parity = Parity::new(survey.regions.len() + submesh.triangles.len());
    for t in submesh.living() {
        let region = submesh.triangles[t as usize].region;
        if region != NONE {
            parity.relate(region, regions + t, false);
        }
    }
    let mut turned = Turned::default();
    for edge in edges.iter() {
        if let [a, b] = edge.uses
            && settled.get(a.triangle() as usize) != Some(&true)
            && !parity.relate(regions + a.triangle(), regions + b.triangle(), edge.is_inconsistent())
        {
            turned.contradictions += 1;
        }
    }
    // Triangles on each side of each root, and the smallest record there.
    let nodes: Vec<(u32, u64, u32)> = (0..regions)
        .map(|p| (p, survey.regions[p as usize].triangles, survey.regions[p as usize].first))
        .chain(submesh.living().map(|t| (regions + t, 1, submesh.record(t))))
        .collect();
    let mut sides = vec![[(0u64, NONE); 2]; parity.nodes()];
    for (node, triangles, record) in &nodes {
        let (root, odd) = parity.find(*node);
        let side = &mut sides[root as usize][usize::from(odd)];
        side.0 += triangles;
        side.1 = side.1.min(*record);
    }
    for (node, triangles, _) in nodes {
        let (root, odd) = parity.find(node);
        let [even_side, odd_side] = sides[root as usize];
        let odd_wins = odd_side.0 > even_side.0 || (odd_side.0 == even_side.0 && odd_side.1 < even_side.1);
        if odd != odd_wins {
            turned.triangles += triangles;
            flip_node(survey, work, reversed, node);
        }
    }
    turned
}

/// Turns a node of the parity structure: a region or a triangle of the submesh.
pub(crate) fn flip_node(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed, node: u32) {
    match node.checked_sub(survey.regions.len() as u32) {
        None => reversed.regions[node as usize] ^= true,
        Some(t) => work.flip(t),
    }
}

/// Closed pieces that were turned.
#[derive(Debug, Default)]
pub(crate) struct Outward {
    pub(crate) pieces: u64,
    /// Guesses, each a line for people.
    pub(crate) doubts: Vec<String>,
    /// The box that material is in, if cavities poke out of it.
    pub(crate) outline: Option<Bounds>,
    /// Cavities that poke out, plainly: their triangles.
    pub(crate) cavities: Vec<[[f32; 3]; 3]>,
}

/// More triangles of cavities are not gathered.
const MOST_GATHERED: u64 = 1 << 18;

/// The closed pieces that are inside out. No look at the file if all enclose positive volume.
pub(crate) fn inside_out(survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed, pieces: &Components) -> Inverted {
    if pieces.list.iter().all(|c| c.open || c.extent.volume >= 0) {
        return Inverted::default();
    }
    inverted(survey, submesh, pieces, reversed)
}

/// Turns closed ones of all `pieces` inside out where they enclose negative volume and are no cavity.
pub(crate) fn make_outward(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed, pieces: &Components) -> Outward {
    let mut found = inside_out(survey, work, reversed, pieces);
    found.doubts.extend(shells::thin(survey, pieces, &found.pieces));
    let count = turn(work, reversed, pieces, &found.pieces);
    let outline = outline(pieces, &found.poking_out);
    Outward { pieces: count, doubts: found.doubts, outline, cavities: surface_of(survey, work, reversed, pieces, &found.plainly) }
}

/// The triangles of these pieces, ascending; of none if they are too many.
fn surface_of(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    pieces: &Components,
    wanted: &[u32],
) -> Vec<[[f32; 3]; 3]> {
    let count: u64 = wanted.iter().map(|piece| pieces.list[*piece as usize].triangles).sum();
    let wanted: Vec<usize> = wanted.iter().filter(|_| count <= MOST_GATHERED).map(|piece| *piece as usize).collect();
    gather(survey, submesh, pieces, reversed, &wanted).concat()
}

/// The box of all pieces but these, where it ends sooner than that of all: to the other sides it is endless. `None`: nowhere.
fn outline(pieces: &Components, without: &[u32]) -> Option<Bounds> {
    let (mut all, mut rest) = (Bounds::EMPTY, Bounds::EMPTY);
    for (number, piece) in (0..).zip(&pieces.list) {
        all.add(&piece.bounds);
        if without.binary_search(&number).is_err() {
            rest.add(&piece.bounds);
        }
    }
    let side = |all: f32, rest: f32, end: f32| if all == rest { end } else { rest };
    let lo = std::array::from_fn(|k| side(all.lo[k], rest.lo[k], f32::NEG_INFINITY));
    let hi = std::array::from_fn(|k| side(all.hi[k], rest.hi[k], f32::INFINITY));
    (all != rest).then_some(Bounds { lo, hi })
}

/// Turns these of all pieces inside out; returns how many they are.
pub(crate) fn turn(work: &mut Work<'_>, reversed: &mut Reversed, pieces: &Components, turns: &[bool]) -> u64 {
    for (p, piece) in pieces.of_region.iter().enumerate() {
        reversed.regions[p] ^= turns.get(*piece as usize) == Some(&true);
    }
    for (t, piece) in pieces.of_triangle.iter().enumerate() {
        if turns.get(*piece as usize) == Some(&true) {
            work.flip(t as u32);
        }
    }
    turns.iter().filter(|turns| **turns).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::progress::Quiet;
    use crate::contract::report::Outcome;
    use crate::contract::settings::{Limits, Profile};
    use crate::engine::mesh::Mesh;
    use crate::repairs::shared::pieces;
    use crate::testing::{After, Corners, after, cube, cuboid, plate, reversed};

    fn outward(triangles: &[Corners]) -> After<u64> {
        after(triangles, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            let pieces = pieces::pieces(&d.survey, work, turned);
            make_outward(&d.survey, work, turned, &pieces).pieces
        })
    }

    #[test]
    fn a_flipped_face_is_turned_back() {
        let mut mesh = cube();
        mesh[5] = reversed(&mesh[5..6])[0];
        let got = after(&mesh, |d, turned| make_coherent(&d.survey, &mut Work::new(&mut d.submesh), turned, &[]));
        assert_eq!((got.result.triangles, got.result.contradictions, got.untouched), (1, 0, 11));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn of_everything_inside_out_what_passes_through_a_wall_is_a_body_wherever_it_begins() {
        // The first triangle of the bar, which tells what is around it, is inside of the box, or outside.
        for end in [0, 8] {
            let mut bar = reversed(&cuboid([1.0; 3], [2.0, 2.0, 3.5]));
            bar.rotate_left(end);
            let got = outward(&[reversed(&cuboid([0.0; 3], [3.0; 3])), bar].concat());
            assert_eq!((got.result, got.untouched), (2, 0));
        }
    }

    #[test]
    fn of_everything_inside_out_the_cavity_comes_to_point_inward() {
        // The cavity's surface by itself is the right way round, so that only its surroundings tell.
        let got = outward(&[reversed(&cuboid([0.0; 3], [3.0; 3])), cuboid([1.0; 3], [2.0; 3])].concat());
        assert_eq!((got.result, got.untouched), (2, 0));
        assert_eq!((got.defects.bodies, got.defects.cavities), (1, 1));
        assert!(got.verdict.good && (got.defects.volume - 26.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn an_outer_shell_alone_inside_out_is_turned_alone() {
        let got = outward(&[reversed(&cuboid([0.0; 3], [3.0; 3])), reversed(&cuboid([1.0; 3], [2.0; 3]))].concat());
        assert_eq!((got.result, got.untouched), (1, 12));
        assert!(got.verdict.good && (got.defects.volume - 26.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn a_cavity_in_a_body_that_is_open_is_not_turned() {
        let mut body = cuboid([0.0; 3], [3.0; 3]);
        body.pop();
        let got = outward(&[body, reversed(&cuboid([1.0; 3], [2.0; 3]))].concat());
        assert_eq!((got.result, got.untouched), (0, 23));
        let got = outward(&[plate(3, |_, _| true), reversed(&cuboid([1.0; 3], [2.0; 3]))].concat());
        assert_eq!(got.result, 1, "it is not in the sheet's box");
    }

    #[test]
    fn a_cavity_that_pokes_out_is_not_in_the_box_of_what_is_material() {
        let box_of = |reaches: f32| {
            let cavity = reversed(&cuboid([1.0; 3], [2.0, 2.0, reaches]));
            let mesh = [cuboid([0.0; 3], [3.0; 3]), cavity].concat();
            let all = after(&mesh, |d, turned| {
                let work = &mut Work::new(&mut d.submesh);
                let pieces = pieces::pieces(&d.survey, work, turned);
                outline(&pieces, &inverted(&d.survey, work, &pieces, turned).poking_out)
            });
            all.result
        };
        let (least, most) = (f32::NEG_INFINITY, f32::INFINITY);
        assert_eq!(box_of(3.25), Some(Bounds { lo: [least; 3], hi: [most, most, 3.0] }));
        assert_eq!(box_of(2.5), None);
    }

    #[test]
    fn sheets_between_balanced_seams_are_left_as_they_are() {
        // Two cubes that share a wall: each sheet ends at the wall's rim and is open by itself, so its own volume says nothing.
        for at in [0.0, -100.0] {
            let right = cuboid([at + 1.0, 0.0, 0.0], [at + 2.0, 1.0, 1.0]);
            let got = outward(&[cuboid([at, 0.0, 0.0], [at + 1.0, 1.0, 1.0]), right].concat());
            assert_eq!((got.result, got.untouched), (0, 24));
        }
    }

    /// A cavity that reaches through the floor opens it: the file says so itself, and the floor that is gone is no loss.
    #[test]
    fn the_mouth_of_a_cavity_that_pokes_out_is_no_loss() {
        let lost = |reaches: f32| {
            let cavity = reversed(&cuboid([2.0, 2.0, -reaches], [4.0, 4.0, 5.0]));
            let mesh = Mesh::from_triangles(&[cuboid([0.0; 3], [8.0; 3]), cavity].concat()).unwrap();
            let limits = Limits { threads: 1, ..Limits::default() };
            let report = crate::repair_mesh(&mesh, &Profile::default(), &limits, &Quiet).unwrap().report;
            assert_eq!(report.after.map(|after| after.volume), Some(512.0 - 20.0));
            (report.outcome, report.skin.unwrap().lost.share)
        };
        let (outcome, share) = lost(0.25);
        assert!(outcome == Outcome::Repaired && share < 1e-4, "{outcome:?} {share}");
        // As much of it is outside as inside: somebody must look.
        assert_eq!(lost(4.0).0, Outcome::NeedsReview);
    }
}
