//! Surplus surface at non-manifold edges.
//!
//! The surface is cut at its non-manifold edges into sheets. A sheet is surplus when the rest is balanced at all its non-manifold
//! edges without it: a fin that hangs from a regular surface by one side, or a wall across a body. (At most of them, for a sheet that also ends
//! where two triangles disagree: a wall across a body beside a hole.) A sheet that uses a non-manifold edge an even number
//! of times, or that is open but encloses volume, is a touching body: it stays. The smallest area goes first, and the rest is judged
//! anew. Where as many triangles run one way as the other (bodies that touch along an edge) nothing is surplus.

use std::collections::BTreeSet;

use crate::contract::report::RepairName;
use crate::repairs::shared::context::{Changes, Done, Repair};
use glam::DVec3;

use crate::repairs::shared::admission;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Sheets that are no part of a surface.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Surplus,
    changes: Changes::Surface,
    run: |cx| {
        let removed = remove(cx.survey, &mut cx.work);
        Ok(Done::count(removed, "triangles of sheets that hang from a closed surface or cross a body"))
    },
};

/// Fetches the stars that the removal of surplus surface may need. Duplicates are gone by then: they make non-manifold edges of no
/// interest.
pub(crate) fn complete_at_seams(survey: &mut Survey<'_>, work: &mut Work<'_>) {
    let (submesh, edges) = work.edges();
    let wanted = wanted_stars(survey, submesh, edges);
    if !wanted.is_empty() {
        let positions: Vec<[f32; 3]> = wanted.iter().map(|v| submesh.positions[*v as usize]).collect();
        let new = survey.promote(&positions);
        work.extend(survey, &new, &wanted);
    }
}

/// A sheet that ends at non-manifold edges.
struct Sheet {
    /// Twice its area, in the survey's units.
    area: i128,
    triangles: Vec<u32>,
    /// Its non-manifold edges, each as often as it is used and in which direction.
    seams: Vec<(u32, bool)>,
    /// Ends of its boundary edges, added up, and how many.
    rim: (DVec3, f64),
    /// It reaches beyond what the submesh may change.
    anchored: bool,
}

/// Removes surplus sheets; returns how many triangles.
pub(crate) fn remove(survey: &Survey<'_>, work: &mut Work<'_>) -> u64 {
    let removed = remove_of(survey, work, Through::ManifoldEdges);
    let (_, edges) = work.edges();
    if edges.any_nonmanifold() && !beside_holes(edges).is_empty() {
        return removed + remove_of(survey, work, Through::CoherentEdges);
    }
    removed
}

/// Removes surplus sheets that reach through these edges.
fn remove_of(survey: &Survey<'_>, work: &mut Work<'_>, through: Through) -> u64 {
    let (submesh, edges) = work.edges();
    if !edges.any_nonmanifold() {
        return 0;
    }
    let mut sheets = sheets(survey, submesh, edges, through);
    let mut order: Vec<usize> = (0..sheets.len()).filter(|s| !sheets[*s].anchored && !sheets[*s].seams.is_empty()).collect();
    order.sort_by_key(|s| (sheets[*s].area, sheets[*s].triangles.first().copied()));
    // Uses of each edge that are left, in either direction.
    let mut uses: Vec<[u32; 2]> = edges
        .iter()
        .map(|e| {
            let forward = e.uses.iter().filter(|u| u.forward()).count() as u32;
            [forward, e.uses.len() as u32 - forward]
        })
        .collect();
    let beside_holes = beside_holes(edges);
    let mut removed = 0;
    for s in order {
        let sheet = &mut sheets[s];
        sheet.seams.sort_unstable();
        let free = sheet.rim.1 > 0.0;
        if is_surplus(free, &uses, &sheet.seams, &beside_holes)
            && !(free && encloses(work, survey.measure.area_of(sheet.area), sheet))
        {
            sheet.seams.iter().for_each(|(e, forward)| uses[*e as usize][usize::from(!forward)] -= 1);
            // Without a rim of its own it is a wall between parts of a body.
            work.is_changed_by(if free { RepairName::Surplus } else { RepairName::CommonWall });
            sheet.triangles.iter().for_each(|t| work.kill(*t));
            removed += sheet.triangles.len() as u64;
        }
    }
    removed
}

/// The edges of two triangles that disagree, with a boundary edge at either end.
fn beside_holes(edges: &Edges) -> BTreeSet<u32> {
    let on_rim: BTreeSet<Vertex> = edges.iter().filter(|e| e.is_boundary()).flat_map(|e| [e.low, e.high]).collect();
    let is_beside = |e: &Edge<'_>| e.is_inconsistent() && on_rim.contains(&e.low) && on_rim.contains(&e.high);
    edges.iter().zip(0..).filter(|(e, _)| is_beside(e)).map(|(_, number)| number).collect()
}

/// Is the surface closed at the sheet's seams without it, and is something wrong with it there? `own`: its uses of them, sorted. Beside a hole
/// the surface may stay open, if it is closed at more of the others.
fn is_surplus(free: bool, uses: &[[u32; 2]], own: &[(u32, bool)], beside_holes: &BTreeSet<u32>) -> bool {
    let (mut wrong, mut closed, mut open) = (free, 0, 0);
    for seam in own.chunk_by(|a, b| a.0 == b.0) {
        let [forward, backward] = uses[seam[0].0 as usize];
        let own_forward = seam.iter().filter(|s| s.1).count() as u32;
        let (left_forward, left_backward) = (forward - own_forward, backward - (seam.len() as u32 - own_forward));
        if left_forward + left_backward == 1 && beside_holes.contains(&seam[0].0) {
            open += 1;
            continue;
        }
        if left_forward != left_backward || left_forward == 0 || seam.len() % 2 == 0 {
            return false;
        }
        closed += 1;
        wrong |= forward != backward;
    }
    wrong && closed > open
}

/// Would the sheet enclose more than next to nothing, if its hole were closed to its middle? By the same measure as for rims ([`admission::THIN`]).
fn encloses(submesh: &Submesh, area: f64, sheet: &Sheet) -> bool {
    let middle = sheet.rim.0 / sheet.rim.1;
    let cones = sheet.triangles.iter().map(|t| {
        let [a, b, c] = submesh.triangles[*t as usize].v.map(|v| submesh.place(v) - middle);
        a.dot(b.cross(c)) / 6.0
    });
    cones.sum::<f64>().abs() > admission::THIN * (area / 2.0).powf(1.5)
}

fn sheets(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, through: Through) -> Vec<Sheet> {
    let parts = Components::of(survey, submesh, edges, &Reversed::none(survey), through);
    let mut sheets: Vec<Sheet> = parts
        .list
        .iter()
        .map(|c| Sheet {
            area: c.extent.area,
            triangles: Vec::new(),
            seams: Vec::new(),
            rim: (DVec3::ZERO, 0.0),
            anchored: false,
        })
        .collect();
    for (p, component) in parts.of_region.iter().enumerate() {
        sheets[*component as usize].anchored |= survey.regions[p].triangles > 0;
    }
    for t in submesh.living() {
        let component = parts.of_triangle[t as usize];
        if component != NONE {
            let sheet = &mut sheets[component as usize];
            sheet.triangles.push(t);
            // Beyond an incomplete vertex the surface goes on outside the submesh.
            sheet.anchored |= submesh.triangles[t as usize].v.iter().filter(|v| !submesh.complete[**v as usize]).count() > 1;
        }
    }
    for (edge, number) in edges.iter().zip(0..).filter(|(e, _)| !through.reaches(e)) {
        for used in edge.uses {
            sheets[parts.of_triangle[used.triangle() as usize] as usize].seams.push((number, used.forward()));
        }
    }
    for edge in edges.iter().filter(|e| e.is_boundary()) {
        let rim = &mut sheets[parts.of_triangle[edge.uses[0].triangle() as usize] as usize].rim;
        rim.0 += submesh.place(edge.low) + submesh.place(edge.high);
        rim.1 += 2.0;
    }
    sheets
}

/// Incomplete vertices of sheets that might be removed: their stars are needed before. A sheet that goes on into regular surface stays.
pub(crate) fn wanted_stars(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges) -> Vec<Vertex> {
    if !edges.any_nonmanifold() {
        return Vec::new();
    }
    let sheets = Components::of(survey, submesh, edges, &Reversed::none(survey), Through::ManifoldEdges);
    let mut goes_on = vec![false; sheets.list.len()];
    for (p, component) in sheets.of_region.iter().enumerate() {
        goes_on[*component as usize] |= survey.regions[p].triangles > 0;
    }
    let mut wanted: Vec<Vertex> = edges
        .iter()
        .filter(|e| e.is_nonmanifold())
        .flat_map(|e| e.uses)
        .filter(|u| !goes_on[sheets.of_triangle[u.triangle() as usize] as usize])
        .flat_map(|u| submesh.triangles[u.triangle() as usize].v)
        .filter(|v| !submesh.complete[*v as usize])
        .collect();
    wanted.sort_unstable();
    wanted.dedup();
    wanted
}

#[cfg(test)]
mod tests {
    use super::Work;
    use super::complete_at_seams;
    use crate::testing::{After, Corners, after, cube, cuboid, reversed, shifted};

    fn removed(triangles: &[Corners]) -> After<u64> {
        after(triangles, |d, _| {
            let work = &mut Work::new(&mut d.submesh);
            complete_at_seams(&mut d.survey, work);
            super::remove(&d.survey, work)
        })
    }

    #[test]
    fn a_fin_on_a_cube_goes() {
        let mut mesh = cube();
        mesh.insert(0, [[0.0; 3], [1.0, 0.0, 0.0], [0.5, -1.0, -1.0]]);
        let got = removed(&mesh);
        assert_eq!(got.result, 1);
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn a_cube_between_two_others_stays_whatever_is_wrong_with_it() {
        let cubes: Vec<Corners> = (0..3).flat_map(|k| shifted(&cube(), [k as f32, k as f32, 0.0])).collect();
        for t in 12..24 {
            let mut turned = cubes.clone();
            turned[t] = reversed(&turned[t..=t])[0];
            assert_eq!(removed(&turned).result, 0, "turned: {t}");
            let mut open = cubes.clone();
            open.remove(t);
            assert_eq!(removed(&open).result, 0, "without {t}");
        }
    }

    #[test]
    fn two_cubes_that_share_an_edge_stay() {
        // As many triangles run one way as the other: either could be kept, so neither goes.
        let got = removed(&[cube(), cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])].concat());
        assert_eq!((got.result, got.untouched), (0, 24));
    }

    /// Without one of the faces that the wall ends at, it looks like a part of the other half, turned.
    #[test]
    fn a_wall_across_a_box_beside_a_hole_goes() {
        let (left, right) = (cube(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]));
        let wall = |t: &&Corners| t.iter().all(|p| p[0] == 1.0);
        let bottom = |t: &&Corners| t.iter().all(|p| p[2] == 0.0);
        let open: Vec<Corners> = left.iter().filter(|t| !bottom(t)).chain(right.iter().filter(|t| !wall(t))).copied().collect();
        assert_eq!(open.len(), 20);
        let got = removed(&open);
        assert_eq!((got.result, got.defects.boundary_edges, got.defects.nonmanifold_edges), (2, 4, 0));
    }

    /// It is turned, and not surplus.
    #[test]
    fn a_turned_triangle_beside_a_fin_stays() {
        for t in 0..12 {
            let mut mesh = cube();
            mesh[t].swap(0, 1);
            mesh.push([[0.0; 3], [1.0, 0.0, 0.0], [0.5, -1.0, -1.0]]);
            let got = removed(&mesh);
            // At the fin's own edge, nobody knows which of three is wrong.
            let at_the_fin = mesh[t].iter().filter(|p| p[1] == 0.0 && p[2] == 0.0).count() == 2;
            assert_eq!(got.result, u64::from(!at_the_fin), "turned: {t}");
        }
    }

    #[test]
    fn a_wall_across_a_box_goes() {
        // The two halves of the box would be closed with the wall, too, but only one of them the right way round.
        let (left, right) = (cube(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]));
        let got = removed(&[&left[..], &right[..8], &right[10..]].concat());
        assert_eq!(got.result, 2);
        assert!(got.verdict.good && (got.defects.volume - 2.0).abs() < 1e-9, "{:?}", got.verdict);
    }
}
