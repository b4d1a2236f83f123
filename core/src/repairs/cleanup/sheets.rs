//! Lone sheets beside bodies: open surface that bounds nothing and can be no part of a solid.
//!
//! A sheet whose rim was not closed, since it would enclose next to nothing ([`crate::repairs::shared::admission`]), keeps a file from being a solid whatever else is
//! in it. One that runs into a body or another sheet could not even be closed: it goes as a whole. (The part of it outside of a body may have
//! been meant for a wall: the report names each with its box and area, and a person is asked to look at more than a small share of the
//! model.) One that crosses nothing may be a wall that only was not joined: if it is more than next to nothing, it goes only where whatever is no
//! solid is replaced by one ([`Guarantee::Wrap`]), and a person is asked to look.
//!
//! What lies in the material of the result as a whole is missed by nobody: the report says so, and no person is asked.
//!
//! A file that holds no body, or in which the sheets have more area than the bodies, keeps them: they are what it is about.

use crate::contract::report::RepairName;
use crate::contract::report::{LoopLeft, MOST_LISTED, SheetDropped};
use crate::contract::settings::{Guarantee, Profile, Sheets};
use crate::detect::bodies;
use crate::repairs::shared::context::SheetRim;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::gather::gather;
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed, Through};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Open sheets that can be no part of a solid.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Sheets,
    changes: Changes::Surface,
    run: |cx| {
        let rims = std::mem::take(&mut cx.handed.sheets);
        let dropped = drop(cx.survey, &mut cx.work, &mut cx.reversed, &rims, &mut cx.account.loops_left, cx.profile);
        let count = dropped.len() as u64;
        let (dropped, points): (Vec<SheetDropped>, Vec<Vec<[f64; 3]>>) = dropped.into_iter().unzip();
        cx.account.open_sheets = rims.iter().filter(|rim| cx.work.lives(rim.triangle)).count() as u64;
        cx.handed.on_sheets = (cx.account.sheets.len(), points);
        cx.account.sheets.extend(dropped);
        Ok(Done::count(count, "open sheets dropped that can be no part of a solid, listed in `sheets_dropped`"))
    },
};

/// Notes which of the dropped sheets lay in the material that there is in the end: every point that was kept of them. Reads the chunks above these.
pub(crate) fn tell_in_material(cx: &mut Context<'_, '_>) {
    let (first, points) = std::mem::take(&mut cx.handed.on_sheets);
    if points.is_empty() {
        return;
    }
    let (pieces, all) = (cx.pieces(), points.concat());
    let mut windings = bodies::windings(cx.survey, &cx.work, &pieces, &cx.reversed, &all);
    windings.iter_mut().zip(bodies::windings_of(&cx.handed.wrapped, &all)).for_each(|(all, more)| *all += more);
    let mut windings = windings.into_iter();
    for (sheet, points) in cx.account.sheets[first..].iter_mut().zip(&points) {
        let outside = windings.by_ref().take(points.len()).filter(|winding| *winding < 1).count();
        sheet.in_material = outside == 0 && !points.is_empty();
    }
}

/// Points of a sheet, at most so many triangles of it: in the middle, and near the corners.
fn points_on(triangles: &[[[f32; 3]; 3]], most: usize) -> Vec<[f64; 3]> {
    let of = |[a, b, c]: &[[f32; 3]; 3]| {
        let near = |p: [f32; 3], middle: [f64; 3]| [0, 1, 2].map(|k| NEAR * middle[k] + (1.0 - NEAR) * f64::from(p[k]));
        let middle = bodies::inner_point(&[*a, *b, *c]);
        [middle, near(*a, middle), near(*b, middle), near(*c, middle)]
    };
    triangles.iter().step_by(triangles.len().div_ceil(most).max(1)).flat_map(of).collect()
}

/// How far from a corner a point near it is, against the middle.
const NEAR: f64 = 0.01;

/// Triangles of all sheets together, and of one, at most and at least, that are asked whether there is material around.
const ASKED: usize = 1 << 15;
const ASKED_OF_ONE: [usize; 2] = [4, 1 << 9];

/// The largest of these sheets, each with its area and component, with points on them.
fn with_points(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    mut gone: Vec<(i128, usize, SheetDropped)>,
) -> Vec<(SheetDropped, Vec<[f64; 3]>)> {
    // Stable: of equal ones the first in the file.
    gone.sort_by_key(|(area, ..)| std::cmp::Reverse(*area));
    gone.truncate(MOST_LISTED);
    let mut listed: Vec<usize> = gone.iter().map(|(_, c, _)| *c).collect();
    listed.sort_unstable();
    let most = (ASKED / listed.len().max(1)).clamp(ASKED_OF_ONE[0], ASKED_OF_ONE[1]);
    let gathered = gather(survey, submesh, components, reversed, &listed);
    let points_of = |c: usize| listed.binary_search(&c).map_or(Vec::new(), |place| points_on(&gathered[place], most));
    gone.into_iter().map(|(_, c, sheet)| (sheet, points_of(c))).collect()
}

/// Drops lone sheets, whose `rims` were left open, and takes their loops off the list of those that are `left`; returns what went, the largest
/// first, with points on it. O(regions + submesh), and a look at the chunks where such a sheet crosses something.
pub(crate) fn drop(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    rims: &[SheetRim],
    left: &mut Vec<LoopLeft>,
    profile: &Profile,
) -> Vec<(SheetDropped, Vec<[f64; 3]>)> {
    if rims.is_empty() || profile.sheets != Sheets::Drop {
        return Vec::new();
    }
    let (submesh, edges) = work.edges();
    let components = Components::of(survey, submesh, edges, reversed, Through::EveryEdge);
    // Nothing else of a lone sheet is open than the rims of sheets.
    let mut open_edges = vec![0usize; components.list.len()];
    for edge in edges.iter().filter(|e| e.is_boundary()) {
        open_edges[components.of_triangle[edge.uses[0].triangle() as usize] as usize] += 1;
    }
    let mut rim_edges = vec![0usize; open_edges.len()];
    for rim in rims {
        rim_edges[components.of_triangle[rim.triangle as usize] as usize] += rim.edges;
    }
    let is_sheet = |c: usize| rim_edges[c] > 0 && rim_edges[c] == open_edges[c];
    let area = |of: &dyn Fn(usize) -> bool| -> i128 {
        components.list.iter().enumerate().filter(|(c, _)| of(*c)).map(|(_, component)| component.extent.area).sum()
    };
    let encloses = |c: usize| !components.list[c].open && components.list[c].extent.volume != 0;
    let of_sheets = area(&is_sheet);
    if of_sheets == 0 || of_sheets > area(&encloses) {
        return Vec::new();
    }
    let pairs = survey.crossing_pairs.as_deref().unwrap_or_default();
    let crossing =
        crate::repairs::shared::pieces::crossing(survey, submesh, &components, pairs.iter().map(|pair| pair.triangles));
    let next_to_nothing = profile.debris_area_share * area(&|_| true) as f64;
    let are_specks = area(&|c| is_sheet(c) && !crossing[c]) as f64 <= next_to_nothing;
    let all_go = are_specks || profile.guarantee == Guarantee::Wrap;
    let goes = |c: u32| c != NONE && is_sheet(c as usize) && (crossing[c as usize] || all_go);
    let gone: Vec<(i128, usize, SheetDropped)> = (0..components.list.len() as u32)
        .filter(|c| goes(*c))
        .map(|c| {
            let (sheet, crosses) = (&components.list[c as usize], crossing[c as usize]);
            let bounds = sheet.bounds.normalised();
            let (bounds, area) = ([bounds.lo, bounds.hi], survey.measure.area(sheet.extent));
            let triangles = sheet.triangles;
            let dropped = SheetDropped { bounds, area, triangles, crosses, hidden: false, in_material: false };
            (sheet.extent.area, c as usize, dropped)
        })
        .collect();
    let gone = with_points(survey, submesh, &components, reversed, gone);
    let closed: Vec<usize> =
        rims.iter().filter(|rim| goes(components.of_triangle[rim.triangle as usize])).filter_map(|rim| rim.listed).collect();
    let mut number = 0..;
    left.retain(|_| number.next().is_none_or(|i| closed.binary_search(&i).is_err()));
    reversed.dropped.iter_mut().zip(&components.of_region).for_each(|(dropped, c)| *dropped |= goes(*c));
    let doomed: Vec<u32> = submesh.living().filter(|t| goes(components.of_triangle[*t as usize])).collect();
    doomed.into_iter().for_each(|t| work.kill(t));
    gone
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::holes::fill;
    use crate::testing::{After, Corners, after, cuboid, plate, reversed, shifted};

    fn dropped(mesh: &[Corners], profile: &Profile) -> After<(Vec<SheetDropped>, usize)> {
        after(mesh, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            let mut closed = fill::fill_loops(&d.survey, work, turned, &d.tolerance, (profile, None), 1);
            let gone = drop(&d.survey, work, turned, &closed.sheets, &mut closed.left, profile);
            (gone.into_iter().map(|(sheet, _)| sheet).collect(), closed.left.len())
        })
    }

    fn body() -> Vec<Corners> {
        cuboid([0.25, 0.25, -4.0], [8.25, 8.25, 4.5])
    }

    /// A sheet of side 4, half of it in the body.
    fn entering() -> Vec<Corners> {
        shifted(&plate(4, |_, _| true), [-2.0, 2.0, 0.0])
    }

    #[test]
    fn a_sheet_that_enters_a_body_goes_and_is_named() {
        let mesh = [body(), entering()].concat();
        let got = dropped(&mesh, &Profile::default());
        let sheet = SheetDropped {
            bounds: [[-2.0, 2.0, 0.0], [2.0, 6.0, 0.0]],
            area: 16.0,
            triangles: 32,
            crosses: true,
            hidden: false,
            in_material: false,
        };
        let (gone, left) = got.result;
        assert_eq!((gone, left, got.untouched), (vec![sheet], 0, 12));
        assert!(got.verdict.good, "{:?}", got.verdict);
        let kept = dropped(&mesh, &Profile { sheets: Sheets::Keep, ..Profile::default() });
        assert_eq!((kept.result.0.len(), kept.result.1, kept.untouched), (0, 1, 44));
    }

    #[test]
    fn sheets_that_cross_each_other_go_and_one_that_crosses_nothing_where_all_is_to_be_a_solid() {
        let upright = plate(4, |_, _| true).into_iter().map(|t| t.map(|[x, y, _]| [x + 10.3, 1.5, y - 1.7]));
        let upright = [shifted(&plate(4, |_, _| true), [10.0, 0.0, 0.0]), upright.collect()].concat();
        let got = dropped(&[body(), upright].concat(), &Profile::default());
        assert_eq!((got.result.0.len(), got.untouched), (2, 12));
        let beside = shifted(&entering(), [-4.0, 0.0, 0.0]);
        let strict = Profile { guarantee: Guarantee::Strict, ..Profile::default() };
        assert_eq!(dropped(&[body(), beside.clone()].concat(), &strict).result.0, []);
        let got = dropped(&[body(), beside.clone()].concat(), &Profile::default());
        assert!(!got.result.0[0].crosses && got.result.1 == 0 && got.verdict.good, "{:?}", got.verdict);
        // Next to nothing: below a thousandth of the area.
        let speck: Vec<Corners> = beside.iter().map(|t| t.map(|p| p.map(|x| x / 16.0))).collect();
        let got = dropped(&[body(), shifted(&speck, [-4.0, 0.0, 0.0])].concat(), &strict);
        assert!(got.result.0.len() == 1 && got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn a_file_of_sheets_and_an_open_vessel_lose_nothing() {
        let upright = plate(4, |_, _| true).into_iter().map(|t| t.map(|[x, y, _]| [x, 1.5, y - 1.7]));
        let sheets = [plate(4, |_, _| true), upright.collect()].concat();
        assert_eq!(dropped(&sheets, &Profile::default()).result.0, [], "there is no body");
        let speck = cuboid([20.0; 3], [21.0; 3]);
        assert_eq!(dropped(&[sheets, speck].concat(), &Profile::default()).result.0, [], "the sheets are what the file is about");
        // A tray without its top, in which a body stands that runs into its floor.
        let mut tray = reversed(&cuboid([0.0; 3], [8.0, 8.0, 4.0]));
        tray.drain(2..4);
        let got = dropped(&[tray, cuboid([3.0, 3.0, -1.0], [5.0, 5.0, 2.0])].concat(), &Profile::default());
        assert_eq!(got.result.0, []);
    }

    /// Found by random soups: a rim and that of an island in it are closed together, but stay open since they enclose next to nothing, so that
    /// what joined them goes, which the rim was named by.
    #[test]
    fn a_rim_that_was_joined_to_an_island_is_named_by_a_triangle_that_is_there() {
        let mesh = [
            [[0.0, 0.0, 0.0], [4.0, 1.0, 5.0], [0.0, 5.0, 5.0]],
            [[2.0, 3.0, 3.0], [4.0, 3.0, 3.0], [0.0, 0.0, 1.0]],
            [[0.0, 0.0, 5.0], [0.0, 1.0, 4.0], [5.0, 1.0, 4.0]],
            [[4.0, 1.0, 5.0], [3.0, 3.0, 2.0], [0.0, 1.0, 0.0]],
            [[0.0, 0.0, 5.0], [5.0, 1.0, 1.0], [0.0, 0.0, 2.0]],
            [[0.0, 0.0, 1.0], [0.0, 5.0, 0.0], [2.0, 0.0, 4.0]],
            [[5.0, 1.0, 4.0], [2.0, 2.0, 0.0], [0.0, 5.0, 0.0]],
            [[0.0, 0.0, 3.0], [2.0, 0.0, 4.0], [2.0, 0.0, 2.0]],
            [[2.0, 1.0, 3.0], [2.0, 2.0, 2.0], [1.0, 0.0, 1.0]],
            [[0.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 2.0, 3.0]],
            [[0.0, 5.0, 5.0], [0.0, 1.0, 1.0], [2.0, 1.0, 3.0]],
            [[0.0, 0.0, 0.0], [5.0, 1.0, 1.0], [1.0, 3.0, 2.0]],
            [[0.0, 0.0, 2.0], [1.0, 3.0, 2.0], [2.0, 3.0, 3.0]],
            [[0.0, 2.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 5.0]],
            [[0.0, 0.0, 5.0], [4.0, 3.0, 3.0], [2.0, 2.0, 1.0]],
        ];
        let lives = after(&mesh, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            let closed = fill::fill_loops(&d.survey, work, turned, &d.tolerance, (&Profile::default(), None), 1);
            let lives: Vec<bool> = closed.sheets.iter().map(|rim| work.lives(rim.triangle)).collect();
            lives
        });
        assert!(!lives.result.is_empty() && lives.result.iter().all(|lives| *lives));
    }
}
