//! The second look at a file by its difference from the input.
//!
//! All but a few of its records are the input's, byte for byte, which is confirmed when it is read back ([`crate::output::readback`]). A
//! vertex none of whose triangles came, went or changed has the star it had; the others are **disturbed**. All triangles around
//! disturbed vertices and around those that were not regular before go to a new submesh, from the records that are written, where
//! they are counted as any file's. What is left of the input's regions is regular as it was.
//!
//! What cannot be shown to hold in this way is looked at anew: [`look`] returns nothing then, and the file is surveyed as if nothing were
//! known of it. What is found is the same.

use glam::DVec3;

use crate::detect::difference::Difference;
use crate::detect::fresh;
use crate::geometry::sums::{Bounds, Measure};
use crate::io::record;
use crate::submesh::edges::Edges;
use crate::submesh::{Gathering, Submesh, has_repeated};
use crate::topology::survey::Survey;
use crate::topology::vertex_table::Weld;
use crate::util::ids::NONE;

/// Is an edit so small against the file that looking at what it disturbs is less work than looking at everything?
pub(crate) fn is_worthwhile(gone: u64, added: u64, input_records: usize) -> bool {
    (gone + added) * 8 <= input_records as u64 && input_records as u64 + added < u64::from(NONE)
}

/// Bytes that a look takes where an edit of so many records was made among so many irregular triangles: measured at defects here and there (200 M triangles,
/// 3 M of them irregular, 2 M changed: 200 bytes each; 20 M: 250), with all that is kept of the input, and what lies around patches, which becomes irregular
/// for the look.
pub(crate) fn bytes(irregular_triangles: u64, changed: u64) -> u64 {
    256 * (irregular_triangles + changed)
}

/// Suspects that need no place in the budget: about 20 MB.
const SUSPECTS_BESIDE: usize = 100_000;

/// What the survey of the input and the `difference` say of the written file; `None` if that is not all there is to know. The survey is
/// in terms of places; its records are still the input's, and none of those that are gone is looked at again.
pub(crate) fn look<'a>(mut survey: Survey<'a>, difference: &Difference) -> Option<(Survey<'a>, Submesh)> {
    let _span = tracing::debug_span!("second look").entered();
    let mut around = Disturbed::of(&survey, difference);
    let new = around.newly();
    let irregular_triangles = survey.irregular_triangles.len();
    if !new.is_empty() {
        survey.promote(&new);
    }
    // So many were not counted with.
    if survey.irregular_triangles.len() > irregular_triangles + irregular_triangles / 2 + SUSPECTS_BESIDE {
        return None;
    }
    let submesh = around.gather(&survey, difference);
    around.settle_regions(&mut survey, &submesh)?;
    // Not needed any more, and the edges take much.
    around.vertices = Weld::default();
    let edges = Edges::of(&submesh);
    if !around.keep_regions_whole(&submesh, &edges) {
        return None;
    }
    around.count(&mut survey, &submesh, difference);
    // The volume of what is not closed depends on the middle of the box, which may be another now.
    survey.volume_beside = survey.measure.volume_seen_from(&Measure::new(&survey.bounds), vector_area(&submesh, &edges));
    drop((around, edges));
    if let Some(pairs) = survey.self_intersections.is_some().then(|| fresh::self_intersections(&survey, difference)) {
        survey.self_intersections = Some(pairs?);
    }
    survey.crossing_pairs = None;
    survey.nonfinite.clear();
    Some((survey, submesh))
}

/// The vertices whose stars are to be looked at again.
struct Disturbed {
    /// Those that were not regular first, then those that were.
    vertices: Weld,
    /// By vertex: it was regular, if it was there; a triangle of the input, or of the written file, has it; such a triangle with three
    /// distinct vertices.
    was_regular: Vec<bool>,
    in_input: Vec<[bool; 2]>,
    in_output: Vec<[bool; 2]>,
    /// How many were known before this look, promoted ones included.
    known: usize,
    /// By irregular triangle of the input, and by triangle of the new submesh: the vertices of this table it has.
    of_irregular_triangles: Vec<[u32; 3]>,
    of_triangles: Vec<[u32; 3]>,
}

impl Disturbed {
    fn of(survey: &Survey<'_>, difference: &Difference) -> Self {
        let mut vertices = Weld::default();
        vertices.reset((survey.irregular_triangles.len() + difference.gone.len() + difference.fresh.len()) / 2);
        for (irregular_triangle, corners) in survey.irregular_corners() {
            for p in (0..3).filter(|k| irregular_triangle.irregular >> k & 1 == 1).map(|k| corners[k]) {
                vertices.vertex(p);
            }
        }
        let known = vertices.positions().len();
        let mut was_regular = vec![false; known];
        survey.promoted.iter().filter_map(|p| vertices.find(*p)).for_each(|v| was_regular[v as usize] = true);
        // Triangles with a repeated vertex are irregular triangles, whatever their vertices are.
        survey.irregular_corners().map(|(_, c)| c).filter(|c| !is_distinct(c)).flatten().for_each(|p| {
            vertices.vertex(p);
        });
        for t in survey.ahead(difference.gone.iter(), |t| Some(**t)) {
            let record = &survey.records[*t as usize];
            if record::all_finite(record) {
                record::corners(record).into_iter().for_each(|p| {
                    vertices.vertex(p);
                });
            }
        }
        for (_, record) in &difference.fresh {
            record::corners(record).into_iter().for_each(|p| {
                vertices.vertex(p);
            });
        }
        let count = vertices.positions().len();
        was_regular.resize(count, true);
        let none = vec![[false; 2]; count];
        Self {
            vertices,
            was_regular,
            in_input: none.clone(),
            in_output: none,
            known,
            of_irregular_triangles: Vec::new(),
            of_triangles: Vec::new(),
        }
    }

    /// The positions of which not all triangles are irregular triangles yet.
    fn newly(&self) -> Vec<[f32; 3]> {
        self.vertices.positions()[self.known..].to_vec()
    }

    fn at(&self, corners: [[f32; 3]; 3]) -> [u32; 3] {
        corners.map(|p| self.vertices.find(p).unwrap_or(NONE))
    }

    /// The triangles of the written file around these vertices, by place.
    fn gather(&mut self, survey: &Survey<'_>, difference: &Difference) -> Submesh {
        let mut gathering = Gathering::of(survey.irregular_triangles.len() + difference.fresh.len());
        let mut fresh = difference.fresh.iter().peekable();
        let mut gone = difference.gone.iter().peekable();
        let mut add = |this: &mut Self, place: u32, corners: [[f32; 3]; 3], region: u32| {
            let at = this.at(corners);
            note(&mut this.in_output, at, &corners);
            // A regular corner that is left holds it to its region.
            let region = if at.contains(&NONE) { region } else { NONE };
            let complete = (0..3).fold(0, |mask, k| mask | u8::from(at[k] != NONE) << k);
            this.of_triangles.push(at);
            gathering.add(place, corners, complete, region);
        };
        for ((irregular_triangle, corners), region) in survey.irregular_corners().zip(&survey.irregular_triangle_regions) {
            let place = irregular_triangle.triangle;
            let at = self.at(corners);
            note(&mut self.in_input, at, &corners);
            self.of_irregular_triangles.push(at);
            while let Some((place, record)) = fresh.next_if(|f| f.0 <= place) {
                add(self, *place, record::corners(record), NONE);
            }
            while gone.next_if(|t| **t < place).is_some() {}
            if gone.next_if_eq(&&place).is_none() {
                add(self, place, corners, *region);
            }
        }
        fresh.for_each(|(place, record)| add(self, *place, record::corners(record), NONE));
        gathering.finish()
    }

    /// Brings the regions up to date, whose disturbed vertices are no part of them any more. Fails if it is not known how far what is
    /// left of a region reaches, or where it begins.
    fn settle_regions(&self, survey: &mut Survey<'_>, submesh: &Submesh) -> Option<()> {
        let mut held = vec![false; self.was_regular.len()];
        let mut is_left: Vec<bool> = survey.regions.iter().map(|p| p.triangles > 0).collect();
        let mut begins = vec![false; survey.regions.len()];
        for (t, corners) in submesh.triangles.iter().zip(&self.of_triangles).filter(|(t, _)| t.region != NONE) {
            is_left[t.region as usize] = true;
            begins[t.region as usize] |= t.record() == survey.regions[t.region as usize].first;
            corners.iter().filter(|v| **v != NONE).for_each(|v| held[*v as usize] = true);
        }
        for (at, region) in
            self.of_irregular_triangles.iter().zip(&survey.irregular_triangle_regions).filter(|(_, region)| **region != NONE)
        {
            for v in at.iter().filter(|v| **v != NONE) {
                let p = self.vertices.positions()[*v as usize];
                let bounds = &survey.regions[*region as usize].bounds;
                let at_the_end = (0..3).any(|k| p[k] == bounds.lo[k] || p[k] == bounds.hi[k]);
                if at_the_end && is_left[*region as usize] && self.was_regular[*v as usize] && !held[*v as usize] {
                    return None;
                }
            }
        }
        for (p, region) in survey.regions.iter_mut().enumerate() {
            if !is_left[p] {
                region.first = NONE;
                region.bounds = Bounds::EMPTY;
            } else if !begins[p] && survey.irregular_triangles.binary_search_by_key(&region.first, |s| s.triangle).is_ok() {
                return None;
            }
        }
        Some(())
    }

    /// Does what is left of every region hang together, be it over the submesh?
    ///
    /// Of the vertices of a region, those that are disturbed are taken out. What leads from one of the others to another through a set
    /// of disturbed ones that hang together enters and leaves it at neighbours of the set. So if all neighbours of each such set hang
    /// together otherwise, everything does.
    fn keep_regions_whole(&self, submesh: &Submesh, edges: &Edges) -> bool {
        if !self.was_regular.contains(&true) {
            return true;
        }
        let mut sets: Vec<u32> = (0..self.was_regular.len() as u32).collect();
        for at in &self.of_irregular_triangles {
            let mut were_regular = at.iter().copied().filter(|v| *v != NONE && self.was_regular[*v as usize]);
            if let Some(first) = were_regular.next() {
                were_regular.for_each(|v| {
                    crate::util::union_find::unite(&mut sets, first, v);
                });
            }
        }
        // Triangles hang together through edges, and around a vertex that is not disturbed.
        let mut parents: Vec<u32> = (0..submesh.triangles.len() as u32).collect();
        for edge in edges.iter() {
            edge.uses[1..].iter().for_each(|u| {
                crate::util::union_find::unite(&mut parents, edge.uses[0].triangle(), u.triangle());
            });
        }
        let mut around = vec![NONE; submesh.positions.len()];
        for (t, triangle) in submesh.triangles.iter().enumerate().filter(|(_, t)| !has_repeated(t.v)) {
            for v in triangle.v.iter().filter(|v| !submesh.complete[**v as usize]) {
                let first = &mut around[*v as usize];
                if *first == NONE {
                    *first = t as u32;
                } else {
                    crate::util::union_find::unite(&mut parents, *first, t as u32);
                }
            }
        }
        let mut neighbours = vec![NONE; self.was_regular.len()];
        for (t, corners) in self.of_triangles.iter().enumerate().filter(|(t, _)| submesh.triangles[*t].region != NONE) {
            let piece = crate::util::union_find::find(&mut parents, t as u32);
            for v in corners.iter().filter(|v| **v != NONE && self.was_regular[**v as usize]) {
                let of_set = &mut neighbours[crate::util::union_find::find(&mut sets, *v) as usize];
                if *of_set == NONE {
                    *of_set = piece;
                } else if *of_set != piece {
                    return false;
                }
            }
        }
        true
    }

    /// Counts triangles and vertices and the box around them.
    fn count(&self, survey: &mut Survey<'_>, submesh: &Submesh, difference: &Difference) {
        let have = |table: &[[bool; 2]], k: usize| table.iter().filter(|had| had[k]).count() as u64;
        survey.triangles = difference.written_records as u64;
        survey.vertices = survey.vertices - have(&self.in_input, 0) + have(&self.in_output, 0);
        survey.vertices_used = survey.vertices_used - have(&self.in_input, 1) + have(&self.in_output, 1);
        let mut bounds = Bounds::EMPTY;
        survey.regions.iter().for_each(|p| bounds.add(&p.bounds));
        bounds.include(&submesh.positions);
        survey.bounds = bounds.normalised();
    }
}

/// The sum of the triangles' normals, each as long as its area: half the sum of a × b over the edges from a to b that bound the surface
/// (Stokes). None for closed surfaces.
fn vector_area(submesh: &Submesh, edges: &Edges) -> [f64; 3] {
    let bounding = edges.iter().filter(|e| e.is_unbalanced()).map(|e| {
        let net: f64 = e.uses.iter().map(|u| if u.forward() { 1.0 } else { -1.0 }).sum();
        net * submesh.place(e.low).cross(submesh.place(e.high)) / 2.0
    });
    bounding.sum::<DVec3>().to_array()
}

/// Notes which vertices a triangle has, and whether it has three.
fn note(table: &mut [[bool; 2]], at: [u32; 3], corners: &[[f32; 3]; 3]) {
    let distinct = is_distinct(corners);
    for v in at.into_iter().filter(|v| *v != NONE) {
        table[v as usize][0] = true;
        table[v as usize][1] |= distinct;
    }
}

fn is_distinct(corners: &[[f32; 3]; 3]) -> bool {
    (0..3).all(|k| corners[k] != corners[(k + 1) % 3])
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use crate::contract::progress::Quiet;
    use crate::contract::settings::{Guarantee, Limits, Profile};
    use crate::output::edit::Edit;
    use crate::repairs;
    use crate::submesh::components::Reversed;
    use crate::testing::{Corners, check_second_look, cube, diagnose, plate, records, reversed, shifted, soup, written};

    /// Does the second look come to anything after all repairs? What it comes to must be what a look at everything finds.
    fn holds_after_repair(triangles: &[Corners]) -> bool {
        let input = records(triangles);
        let mut diagnosis = diagnose(&input);
        let limits = Limits { threads: 1, ..Limits::default() };
        // A wrap takes long, and leaves next to nothing to look at by itself.
        let profile = Profile { guarantee: Guarantee::Off, ..Profile::default() };
        let repaired = repairs::run(&mut diagnosis, repairs::Steps::All, Path::new("test"), &profile, &limits, &Quiet).unwrap();
        let edit = Edit::of(&diagnosis.survey, &diagnosis.submesh, &repaired.reversed, &repaired.wrapped);
        check_second_look(diagnosis.survey, &edit, &diagnose(&written(&edit, &input)).defects)
    }

    /// A closed box of many triangles, a grid of so many squares on each side.
    fn block(side: u8) -> Vec<Corners> {
        let face = plate(side, |_, _| true);
        let end = f32::from(side);
        let turned =
            |turn: fn([f32; 3], f32) -> [f32; 3]| -> Vec<Corners> { face.iter().map(|t| t.map(|p| turn(p, end))).collect() };
        [
            turned(|[x, y, _], _| [y, x, 0.0]),
            turned(|[x, y, _], end| [x, y, end]),
            turned(|[x, y, _], _| [0.0, x, y]),
            turned(|[x, y, _], end| [end, y, x]),
            turned(|[x, y, _], _| [y, 0.0, x]),
            turned(|[x, y, _], end| [x, end, y]),
        ]
        .map(|face| if face[0].iter().map(|p| p[2]).sum::<f32>() >= 0.0 { face } else { reversed(&face) })
        .concat()
    }

    proptest! {
        #[test]
        fn the_difference_tells_what_a_look_at_everything_does(triangles in soup()) {
            holds_after_repair(&triangles);
        }

        /// Triangles of a large body removed, doubled, turned and moved: most of it is as it was.
        #[test]
        fn small_defects_of_a_large_body_are_looked_at_by_themselves(
            fates in prop::collection::vec((0usize..6 * 2 * 81, 0u8..5), 0..6),
            neighbour in any::<bool>(),
        ) {
            let mut triangles = block(9);
            let away = if neighbour { 9.0 } else { 12.0 };
            triangles.extend(shifted(&block(9), [away, 0.0, 0.0]));
            for (t, fate) in fates {
                match fate {
                    0 => triangles[t] = [[3.0; 3]; 3],
                    1 => triangles.push(triangles[t]),
                    2 => triangles[t].swap(0, 1),
                    3 => triangles[t][0] = triangles[t][0].map(|x| x + 1e-4),
                    _ => triangles.push([triangles[t][0], triangles[t][1], [4.5; 3]]),
                }
            }
            holds_after_repair(&triangles);
        }
    }

    /// Without repairs: any edit at all.
    fn holds(triangles: &[Corners], kill: impl Fn(&Corners) -> bool) -> bool {
        let input = records(triangles);
        let mut d = diagnose(&input);
        let all: Vec<[f32; 3]> = triangles.iter().filter(|t| kill(t)).flatten().copied().collect();
        let new = d.survey.promote(&all);
        let completed: Vec<u32> =
            (0..d.submesh.positions.len() as u32).filter(|v| all.contains(&d.submesh.positions[*v as usize])).collect();
        d.submesh.extend(&d.survey, &new, |_| completed);
        for t in 0..d.submesh.triangles.len() as u32 {
            if kill(&d.submesh.points(t)) {
                d.submesh.kill(t);
            }
        }
        let edit = Edit::of(&d.survey, &d.submesh, &Reversed::none(&d.survey), &[]);
        check_second_look(d.survey, &edit, &diagnose(&written(&edit, &input)).defects)
    }

    #[test]
    fn a_hole_in_a_body_is_seen_without_looking_at_the_rest() {
        assert!(holds(&block(9), |t| t.iter().all(|p| p[2] == 9.0 && p[0] > 3.5 && p[0] < 5.5 && p[1] > 3.5 && p[1] < 5.5)));
    }

    #[test]
    fn a_surface_that_falls_apart_is_looked_at_as_a_whole() {
        // All around the middle: two halves are left, each open, which were one region.
        let cut = |t: &Corners| t.iter().all(|p| p[0] >= 4.0 && p[0] <= 5.0);
        assert!(!holds(&block(9), cut));
    }

    #[test]
    fn what_leaves_the_end_of_a_body_is_not_guessed_at() {
        // A corner is cut off: nobody knows how far the rest reaches.
        assert!(!holds(&block(9), |t| t.iter().all(|p| p.iter().all(|x| *x >= 8.0))));
    }

    #[test]
    fn a_body_that_vanishes_leaves_nothing() {
        let far = shifted(&cube(), [3.0; 3]);
        assert!(holds(&[block(9), far.clone()].concat(), |t| far.contains(t)));
    }
}
