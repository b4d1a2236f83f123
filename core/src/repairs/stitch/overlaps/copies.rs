//! Sheets that lie as a whole on a body, facing the same way: copies of its surface, a little off.
//!
//! Between two surfaces of bodies that face the same way there is one that faces the other way, so that a sheet next to a body bounds nothing else:
//! it is the body's own surface, drawn twice. Closed by a patch, it would become a body of its own, and fill what the body has hollow. It lies farther
//! off than what laps, so more is asked of it: that it is far wider than that, and that what it lies on is nearly closed.

use std::collections::BTreeMap;

use super::pieces::{Pieces, widened};
use super::{Cut, MOST_CUT, MOST_PAIRS, On};
use crate::contract::report::RepairName;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::layer::{Facet, Layer, Reach, RimEdge, around};
use crate::submesh::Submesh;
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;
use crate::util::words::At;

/// Sheets that are copies.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Overlap,
    changes: Changes::Surface,
    run: |cx| {
        let (dropped, doubts) = drop_copies(cx.survey, &mut cx.work, cx.tolerance);
        cx.account.doubts.extend(doubts);
        Ok(Done::count(dropped, "triangles of sheets that lay on a body as a whole, and face the same way"))
    },
};

/// A copy lies within this share of the diagonals of both boxes together.
const OFF: f64 = 5e-4;

/// And within this share of its width: of its area over the length of its rim.
const WIDTH: f64 = 0.05;

/// What is nearly closed has no more than so many times its area on the square of its rims' length: a cube without a side has 3.2.
const CLOSED: f64 = 4.0;

/// A copy is told if between it and its body there is more than this share of the body's volume.
const BETWEEN: f64 = 0.01;

/// Drops sheets that lie as a whole on a body; returns how many triangles went, and lines for a person to look at. O(n log n) in the sheets and the
/// surface near them, which is read if there are sheets in a body's box.
fn drop_copies(survey: &mut Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance) -> (u64, Vec<String>) {
    if tolerance.edge_share <= 0.0 || !work.edges().1.iter().any(|e| e.is_boundary()) {
        return (0, Vec::new());
    }
    let pieces = Pieces::of(survey, work, tolerance);
    let submesh: &Submesh = work;
    let sheets = Sheets::of(survey, &pieces);
    let (mut cuts, mut doubts): (Vec<Cut>, Vec<String>) = (Vec::new(), Vec::new());
    let mut last = None;
    for [sheet, body] in sheets.ending_on(survey, submesh, &pieces).into_iter().take(MOST_PAIRS) {
        if last != Some(sheet)
            && let Some((cut, between)) = sheets.copy(survey, submesh, &pieces, [sheet, body])
        {
            let share = between / survey.measure.volume(pieces.list()[body as usize].extent).abs();
            if share > BETWEEN {
                let (share, at) = (share * 100.0, pieces.list()[sheet as usize].bounds.lo);
                doubts.push(format!(
                    "surface was drawn twice, {share:.1} % of the body's volume apart, from {} on: the drawing that is nearly closed was kept",
                    At(at)
                ));
            }
            cuts.push(cut);
            last = Some(sheet);
        }
    }
    cuts.iter().for_each(|cut| cut.make(survey, work, tolerance));
    (cuts.iter().map(|cut| cut.triangles.len() as u64).sum(), doubts)
}

/// Sheets, and the bodies that they may be copies of. By piece.
struct Sheets {
    areas: Vec<f64>,
    /// The length of all rims.
    rims: Vec<f64>,
}

impl Sheets {
    fn of(survey: &Survey<'_>, pieces: &Pieces) -> Self {
        let areas: Vec<f64> = pieces.list().iter().map(|piece| survey.measure.area(piece.extent)).collect();
        let mut rims = vec![0.0; areas.len()];
        pieces.rims.iter().for_each(|(rim, _)| rims[rim.piece as usize] += rim.ends[0].distance(rim.ends[1]));
        Self { areas, rims }
    }

    /// Is a piece closed, but for mouths that are small against it?
    fn is_body(&self, piece: u32) -> bool {
        self.rims[piece as usize] * self.rims[piece as usize] <= CLOSED * self.areas[piece as usize]
    }

    /// How near a sheet must lie to a body to be a copy of its surface; 0 if it is none.
    fn reach(&self, pieces: &Pieces, [sheet, body]: [u32; 2]) -> f64 {
        let [s, b] = [sheet, body].map(|piece| piece as usize);
        if sheet == body || self.rims[s] == 0.0 || self.areas[s] > self.areas[b] || !self.is_body(body) {
            return 0.0;
        }
        (OFF * (pieces.sizes[s] + pieces.sizes[b])).min(WIDTH * self.areas[s] / self.rims[s])
    }

    /// Sheets with the bodies on which all of their rims lie; the sheets ascending.
    fn ending_on(&self, survey: &Survey<'_>, submesh: &Submesh, pieces: &Pieces) -> Vec<[u32; 2]> {
        let bodies: Vec<u32> = (0..self.areas.len() as u32).filter(|piece| self.is_body(*piece)).collect();
        let (mut is_wanted, mut most) = (vec![false; self.areas.len()], vec![0.0f64; self.areas.len()]);
        if bodies.is_empty() || pieces.rims.is_empty() {
            return Vec::new();
        }
        let bounds = |piece: u32| &pieces.list()[piece as usize].bounds;
        let tree = BoxTree::new(&bodies.iter().map(|body| *bounds(*body)).collect::<Vec<_>>());
        let largest = pieces.sizes.iter().copied().fold(0.0, f64::max);
        let mut met = Vec::new();
        for sheet in (0..self.areas.len() as u32).filter(|piece| self.rims[*piece as usize] > 0.0) {
            tree.meeting(&widened(bounds(sheet), OFF * (pieces.sizes[sheet as usize] + largest)), &mut met);
            for body in met.iter().map(|b| bodies[*b as usize]) {
                let reach = self.reach(pieces, [sheet, body]);
                if reach > 0.0 && widened(bounds(body), reach).contains(bounds(sheet)) {
                    is_wanted[body as usize] = true;
                    most[sheet as usize] = most[sheet as usize].max(reach);
                }
            }
        }
        let ends: Vec<&RimEdge> = pieces.rims.iter().map(|(rim, _)| rim).filter(|r| most[r.piece as usize] > 0.0).collect();
        if ends.is_empty() {
            return Vec::new();
        }
        let boxes: Vec<Bounds> = ends.iter().map(|end| around(&[end.middle()], most[end.piece as usize])).collect();
        let Some(near) = pieces.gather(survey, submesh, |piece| is_wanted[piece as usize], &boxes) else { return Vec::new() };
        let layer = Layer::new(near.iter().map(|m| Facet::of(&m.corners, m.piece)).collect(), Vec::new());
        let mut counts: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        let mut all = vec![0; self.areas.len()];
        for end in ends {
            all[end.piece as usize] += 1;
            let most = most[end.piece as usize];
            let reach = |body: u32| Reach { on: self.reach(pieces, [end.piece, body]), rim: 0.0 };
            for (body, _) in layer.under(end.middle(), end.normal, Reach { on: most, rim: 0.0 }, reach) {
                *counts.entry([end.piece, body]).or_default() += 1;
            }
        }
        counts.into_iter().filter(|([sheet, _], on)| *on == all[*sheet as usize]).map(|(pair, _)| pair).collect()
    }

    /// All of a sheet, if it lies on a body, and about the volume between the two.
    fn copy(&self, survey: &Survey<'_>, submesh: &Submesh, pieces: &Pieces, pair: [u32; 2]) -> Option<(Cut, f64)> {
        let [sheet, body] = pair;
        let reach = self.reach(pieces, pair);
        let near = widened(&pieces.list()[sheet as usize].bounds, reach);
        let members = pieces.gather(survey, submesh, |piece| pair.contains(&piece), &[near])?;
        let (triangles, under): (Vec<_>, Vec<_>) = members.into_iter().partition(|member| member.piece == sheet);
        let layer = Layer::new(under.iter().map(|m| Facet::of(&m.corners, body)).collect(), Vec::new());
        let on = On { layer: &layer, reach, share: f64::INFINITY };
        if triangles.len() > MOST_CUT {
            return None;
        }
        let facets: Vec<Facet> = triangles.iter().map(|m| Facet::of(&m.corners, sheet)).collect();
        if !facets.iter().all(|facet| on.covers(facet)) {
            return None;
        }
        let between = facets.iter().map(|facet| facet.area() * layer.distance(facet.centre(), reach)).sum();
        Some((Cut { triangles, join: None }, between))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, after, cuboid, plate, reversed, shifted};

    /// On a box of 8 by 8 by 8, on which z is up.
    fn dropped(body: &[Corners], sheet: &[Corners]) -> u64 {
        let mesh = [body, sheet].concat();
        after(&mesh, |d, _| drop_copies(&mut d.survey, &mut Work::new(&mut d.submesh), &d.tolerance)).result.0
    }

    fn body() -> Vec<Corners> {
        cuboid([0.0, 0.0, -8.0], [8.0, 8.0, 0.0])
    }

    #[test]
    fn a_sheet_a_little_off_its_body_goes() {
        for off in [0.005, -0.005] {
            let sheet = shifted(&plate(8, |x, y| x < 4 && y > 2), [off; 3]);
            assert_eq!(dropped(&body(), &sheet), 2 * 4 * 5, "above, and below");
            assert_eq!(dropped(&body()[2..], &sheet), 2 * 4 * 5, "what has lost a side of six is a body still");
            assert_eq!(dropped(&body()[4..], &shifted(&body()[4..6], [off; 3])), 0, "what has lost two is none");
        }
    }

    #[test]
    fn around_an_edge_too() {
        let side = plate(8, |_, _| true).iter().map(|t| t.map(|[x, y, _]| [8.0, x, y - 8.0])).collect::<Vec<Corners>>();
        let sheet = shifted(&[plate(8, |_, _| true), side].concat(), [0.005; 3]);
        assert_eq!(dropped(&body(), &sheet), 2 * 128);
    }

    #[test]
    fn what_faces_the_other_way_is_farther_off_or_reaches_beyond_stays() {
        let sheet = plate(8, |x, y| x < 4 && y > 2);
        assert_eq!(dropped(&body(), &reversed(&shifted(&sheet, [0.0, 0.0, 0.01]))), 0, "a thin gap");
        assert_eq!(dropped(&body(), &shifted(&sheet, [0.0, 0.0, 0.03])), 0, "far off");
        assert_eq!(dropped(&body(), &shifted(&sheet, [5.0, 0.0, 0.01])), 0, "over the edge");
        // A strip of a tenth of a unit is not wide against a hundredth.
        let strip: Vec<Corners> = sheet.iter().map(|t| t.map(|[x, y, _]| [x / 40.0, y, 0.01])).collect();
        assert_eq!(dropped(&body(), &strip), 0, "narrow");
    }

    /// A board of 8 by 8 by 0.5 with a copy of its top 0.01 below: one part in fifty of it.
    #[test]
    fn a_copy_far_off_against_its_body_is_told() {
        let told = |low: f32| {
            let mesh = [cuboid([0.0, 0.0, low], [8.0, 8.0, 0.0]), shifted(&plate(8, |_, _| true), [0.0, 0.0, -0.01])].concat();
            after(&mesh, |d, _| drop_copies(&mut d.survey, &mut Work::new(&mut d.submesh), &d.tolerance)).result
        };
        let (dropped, doubts) = told(-0.5);
        assert_eq!((dropped, doubts.len()), (128, 1));
        assert!(doubts[0].contains("2.0 %"), "{doubts:?}");
        assert_eq!(told(-8.0), (128, Vec::new()));
    }

    #[test]
    fn two_sheets_are_layers() {
        assert_eq!(dropped(&plate(8, |_, _| true), &shifted(&plate(8, |x, _| x < 4), [0.0, 0.0, 0.01])), 0);
    }
}
