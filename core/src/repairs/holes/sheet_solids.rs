//! Lone sheets made solids, where the profile asks for it: what their owners want for printing.
//!
//! Where the profile asks, reliefs count as well, which would be closed flat else, and run out to no thickness at their rims. **Thickened**, a sheet is replaced by a wall around it, half of the thickness on either side ([`thicken`]). With a **base**, its rim is let down along −Z to
//! a plane below the lowest point of all sheets, and closed flat there, so that terrain becomes a block; tiles of one terrain stand on one plane.
//! The surface itself stays as it is. Small rims are holes in it, and are closed as such. Where the rim crosses itself as
//! seen from above, or the sheet has several long rims or one side only, there is no base, and the sheet stays open.
//!
//! Either may cross itself, or bodies: it is cut along that later.

use std::collections::BTreeMap;

use crate::algorithms::thicken::thicken;
use crate::algorithms::triangulate::{self, FillSettings, Rim};
use crate::contract::report::RepairName;
use crate::contract::settings::Sheets;
use crate::detect::holes::Shapes;
use crate::detect::holes::loops::{self, Loop};
use crate::detect::review::Asked;
use crate::geometry::exact::Point;
use crate::geometry::position::Position;
use crate::geometry::sums::step_at;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::gather::gather;
use crate::repairs::shared::lone_sheets::{self, LoneSheets, Which};
use crate::repairs::shared::pieces::take_away;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Through};
use crate::submesh::{Origin, Vertex};
use crate::util::ids::NONE;

/// Lone sheets, by profile.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::SheetSolids,
    changes: Changes::Surface,
    run: |cx| {
        let thickness = cx.profile.sheet_thickness(cx.survey.bounds.diagonal());
        // Single precision must hold the wall.
        let is_told_apart = thickness > STEPS * step_at(cx.survey.bounds.largest_coordinate());
        let (count, what) = match cx.profile.sheets {
            Sheets::Thicken if is_told_apart => (thicken_all(cx, thickness), "thickened to"),
            Sheets::Base if is_told_apart => (base_all(cx, thickness), "given a base, below the lowest point of all by"),
            _ => (0, ""),
        };
        cx.handed.has_skirts |= count > 0;
        Ok(Done::count(count, format!("lone sheets {what} {thickness}")))
    },
};

/// Steps of single precision, at the largest coordinate, that a wall must have.
const STEPS: f64 = 64.0;

/// The sheets, their loops, and the components.
fn recognised(cx: &mut Context<'_, '_>) -> (LoneSheets, Vec<Loop>, Components) {
    let (submesh, edges) = cx.work.edges();
    let loops = loops::find(submesh, edges);
    let shapes = Shapes::of(submesh, &loops, cx.limits.threads);
    let sheets = lone_sheets::recognise(cx.survey, submesh, edges, &loops, &shapes, &cx.reversed, Which::Reliefs);
    let components = Components::of(cx.survey, submesh, edges, &cx.reversed, Through::EveryEdge);
    (sheets, loops, components)
}

/// Replaces sheets by walls; how many.
fn thicken_all(cx: &mut Context<'_, '_>, thickness: f64) -> u64 {
    let (sheets, loops, components) = recognised(cx);
    let mut goes = vec![false; components.list.len()];
    let rims = loops.iter().filter(|rim| sheets.rims.binary_search(&rim.vertices[0]).is_ok()).map(|rim| rim.triangles[0]);
    let one_sided = (0..).zip(&sheets.one_sided).filter(|(_, is_one_sided)| **is_one_sided).map(|(t, _)| t);
    for component in rims.chain(one_sided).map(|t| components.of_triangle[t as usize]).filter(|c| *c != NONE) {
        goes[component as usize] = true;
    }
    let wanted: Vec<usize> = (0..goes.len()).filter(|c| goes[*c]).collect();
    let gathered = gather(cx.survey, &cx.work, &components, &cx.reversed, &wanted);
    let mut walls = Vec::new();
    for (component, sheet) in wanted.into_iter().zip(gathered) {
        match thicken(&sheet, thickness) {
            Some(wall) => walls.push(wall),
            None => goes[component] = false,
        }
    }
    take_away(&mut cx.work, &mut cx.reversed, &components, &goes);
    for wall in &walls {
        let mut vertices: BTreeMap<Position, Vertex> = BTreeMap::new();
        for corners in wall {
            let v = corners.map(|p| {
                let position = Position::of(p);
                *vertices.entry(position).or_insert_with(|| cx.work.add_vertex(position))
            });
            cx.work.add(v, Origin::Added(RepairName::SheetSolids), NONE);
            ask_for(&mut cx.account.asked, corners);
        }
    }
    walls.len() as u64
}

/// Gives sheets a base; how many.
fn base_all(cx: &mut Context<'_, '_>, thickness: f64) -> u64 {
    let (sheets, loops, components) = recognised(cx);
    let mut only: BTreeMap<u32, Option<usize>> = BTreeMap::new();
    for (i, rim) in loops.iter().enumerate().filter(|(_, rim)| sheets.rims.binary_search(&rim.vertices[0]).is_ok()) {
        let triangle = rim.triangles[0] as usize;
        let component = components.of_triangle[triangle];
        if component == NONE || sheets.one_sided.get(triangle) == Some(&true) {
            continue;
        }
        only.entry(component).and_modify(|rim| *rim = None).or_insert(Some(i));
    }
    only.retain(|_, rim| rim.is_some());
    let lowest = only.keys().map(|c| components.list[*c as usize].bounds.lo[2]).fold(f32::INFINITY, f32::min);
    let floor = (f64::from(lowest) - thickness) as f32;
    let mut count = 0;
    for i in only.into_values().flatten() {
        let before = cx.work.triangles.len();
        count += u64::from(let_down(&mut cx.work, &loops[i], floor));
        for t in before as u32..cx.work.triangles.len() as u32 {
            ask_for(&mut cx.account.asked, &cx.work.points(t));
        }
    }
    count
}

/// Adds walls below a rim down to a floor, and closes them there, unless the rim crosses itself as seen from above.
fn let_down(work: &mut Work<'_>, rim: &Loop, floor: f32) -> bool {
    let below: Vec<Position> = rim
        .vertices
        .iter()
        .map(|v| {
            let [x, y, _] = work.positions[*v as usize];
            Position::of([x, y, floor])
        })
        .collect();
    // Parts of the rim may rise straight up.
    let mut corners = below.clone();
    corners.dedup();
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let points: Vec<Point> = corners.iter().map(|p| p.coordinates()).collect();
    let of_base = Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &|_, _| false };
    let Ok(patch) = triangulate::triangulate(&of_base, &FillSettings { max_vertices: usize::MAX, ..FillSettings::default() })
    else {
        return false;
    };
    let vertices: BTreeMap<Position, Vertex> = corners.iter().map(|p| (*p, work.add_vertex(*p))).collect();
    let ends: Vec<Vertex> = below.iter().filter_map(|p| vertices.get(p).copied()).collect();
    let origin = Origin::Added(RepairName::SheetSolids);
    let n = rim.vertices.len();
    for i in 0..n {
        let next = (i + 1) % n;
        let ([a, b], [c, d]) = ([i, next].map(|k| rim.vertices[k]), [i, next].map(|k| ends[k]));
        work.add([a, b, d], origin, NONE);
        if c != d {
            work.add([a, d, c], origin, NONE);
        }
    }
    for triangle in patch.triangles {
        let v = triangle.map(|i| corners[i as usize]);
        if let [Some(a), Some(b), Some(c)] = v.map(|p| vertices.get(&p).copied()) {
            work.add([a, b, c], origin, NONE);
        }
    }
    true
}

/// The profile asked for this triangle.
fn ask_for(asked: &mut Asked, corners: &[[f32; 3]; 3]) {
    asked.bounds.include(corners);
    let [a, b, c] = corners.map(crate::geometry::distance::place);
    asked.area += (b - a).cross(c - a).length() / 2.0;
}

#[cfg(test)]
mod tests {
    use crate::contract::progress::Quiet;
    use crate::contract::report::Outcome;
    use crate::contract::settings::{Limits, Profile, Sheets};
    use crate::engine::mesh::Mesh;
    use crate::testing::{Corners, cuboid, plate, shifted};

    fn outcome(mesh: &[Corners], sheets: Sheets) -> (Outcome, f64, String) {
        let profile = Profile { sheets, sheet_thickness_mm: 0.5, ..Profile::default() };
        let limits = Limits { threads: 1, ..Limits::default() };
        let repaired = crate::repair_mesh(&Mesh::from_triangles(mesh).unwrap(), &profile, &limits, &Quiet).unwrap();
        let report = repaired.report;
        let volume = report.after.as_ref().map_or(0.0, |after| after.volume);
        (report.outcome, volume, report.verdict.reasons.join("; "))
    }

    /// A roof, 4 by 4, whose ridge is 1 above its eaves.
    fn roof() -> Vec<Corners> {
        plate(4, |_, _| true).into_iter().map(|t| t.map(|[x, y, _]| [x, y, 1.0 - (x - 2.0).abs() / 2.0])).collect()
    }

    #[test]
    fn a_lone_sheet_stays_open_and_is_told_what_to_ask_for() {
        let (outcome, _, why) = outcome(&plate(4, |_, _| true), Sheets::Drop);
        assert!(outcome == Outcome::NotGood && why.contains("thicken") && why.contains("base"), "{why}");
    }

    #[test]
    fn a_base_is_exact_and_lies_below_the_lowest_point() {
        // The roof's prism, and half a unit of height below it.
        let got = outcome(&roof(), Sheets::Base);
        assert_eq!((got.0, got.1), (Outcome::Repaired, 8.0 + 8.0), "{}", got.2);
        // A hole in it is closed as one.
        let holed: Vec<Corners> = roof().into_iter().enumerate().filter(|(i, _)| *i != 10).map(|(_, t)| t).collect();
        let got = outcome(&holed, Sheets::Base);
        assert_eq!((got.0, got.1), (Outcome::Repaired, 16.0), "{}", got.2);
        // Tiles that lie at different heights stand on one plane.
        let tiles = [plate(4, |_, _| true), shifted(&plate(4, |_, _| true), [9.0, 0.0, 1.0])].concat();
        let got = outcome(&tiles, Sheets::Base);
        assert_eq!((got.0, got.1), (Outcome::Repaired, 8.0 + 24.0), "{}", got.2);
    }

    #[test]
    fn a_sheet_that_stands_upright_gets_no_base() {
        let upright: Vec<Corners> = plate(4, |_, _| true).into_iter().map(|t| t.map(|[x, y, _]| [x, 0.0, y])).collect();
        assert_eq!(outcome(&upright, Sheets::Base).0, Outcome::NotGood);
        let got = outcome(&upright, Sheets::Thicken);
        assert!(got.0 == Outcome::Repaired && (got.1 - 8.0).abs() < 1e-5, "{} {}", got.1, got.2);
    }

    #[test]
    fn a_thickened_sheet_that_enters_a_body_becomes_one_with_it() {
        let mesh = [cuboid([0.25, 0.25, -4.0], [8.25, 8.25, 4.5]), shifted(&plate(4, |_, _| true), [-2.0, 2.0, 0.0])].concat();
        let got = outcome(&mesh, Sheets::Thicken);
        // Beside the body it is 2.25 long, 4 wide and 0.5 thick.
        assert!(got.0 == Outcome::Repaired && (got.1 - 544.0 - 4.5).abs() < 1e-4, "{} {}", got.1, got.2);
    }
}
