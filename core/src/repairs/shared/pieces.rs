//! What stands for itself: the pieces of surface that are turned, removed or kept as a whole.

use crate::repairs::shared::work::Work;
use std::collections::BTreeMap;

use crate::geometry::position;
use crate::submesh::components::{Component, Components, Reversed, Through};
use crate::submesh::{Origin, Submesh};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// The pieces of surface that stand for themselves: bodies that touch along an edge each for itself, what is closed only together, together.
/// O(regions + submesh).
pub(crate) fn pieces(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed) -> Components {
    let (submesh, edges) = work.edges();
    let components = Components::of(survey, submesh, edges, reversed, Through::ManifoldEdges);
    if edges.any_nonmanifold() { components.joined_where_open(edges) } else { components }
}

/// Removes whole pieces. O(regions + submesh).
pub(crate) fn take_away(work: &mut Work<'_>, reversed: &mut Reversed, pieces: &Components, goes: &[bool]) {
    let goes = |piece: &u32| *piece != NONE && goes[*piece as usize];
    reversed.dropped.iter_mut().zip(&pieces.of_region).for_each(|(dropped, piece)| *dropped |= goes(piece));
    let doomed: Vec<u32> = work.living().filter(|t| goes(&pieces.of_triangle[*t as usize])).collect();
    doomed.into_iter().for_each(|t| work.kill(t));
}

/// Is there material on both sides of a closed piece outside of which the others wind so many times?
pub(crate) fn lies_in_material(piece: &Component, outside: i32) -> bool {
    let inside = match piece.extent.volume.signum() {
        _ if piece.open => return false,
        1 => outside + 1,
        -1 => outside - 1,
        _ => return false,
    };
    outside.min(inside) >= 1
}

/// Of a piece that is what the file has, patches may be this share of the area.
const PATCHED: f64 = 0.05;

/// Which pieces are closed by more than small patches, so that what they enclose is a guess.
pub(crate) fn are_patched(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components) -> Vec<bool> {
    let mut patches = vec![0; pieces.list.len()];
    for t in submesh.living() {
        let (piece, origin) = (pieces.of_triangle[t as usize], submesh.triangles[t as usize].origin);
        if piece != NONE && matches!(origin, Origin::Added(_)) {
            patches[piece as usize] += survey.measure.triangle(&submesh.points(t)).area;
        }
    }
    let pieces = pieces.list.iter().zip(patches);
    pieces.map(|(piece, area)| area as f64 > PATCHED * piece.extent.area as f64).collect()
}

/// Which pieces cross another one.
pub(crate) fn crossing(
    survey: &Survey<'_>,
    submesh: &Submesh,
    pieces: &Components,
    pairs: impl Iterator<Item = [u32; 2]> + Clone,
) -> Vec<bool> {
    let mut crossing = vec![false; pieces.list.len()];
    let all = crossing_pieces(survey, submesh, pieces, pairs);
    all.into_iter().flatten().for_each(|piece| crossing[piece as usize] = true);
    crossing
}

/// The pieces that cross each other, by twos, the smaller number first; each once, ascending. A look at the chunks of what crosses.
pub(crate) fn crossing_pieces(
    survey: &Survey<'_>,
    submesh: &Submesh,
    pieces: &Components,
    pairs: impl Iterator<Item = [u32; 2]> + Clone,
) -> Vec<[u32; 2]> {
    let of_record = components_of_records(survey, submesh, pieces, pairs.clone().flatten());
    // What is gone crosses nothing any more.
    let piece = |record: u32| of_record.get(&record).copied().filter(|piece| *piece != NONE);
    let mut all: Vec<[u32; 2]> = pairs
        .filter_map(|[a, b]| Some([piece(a)?, piece(b)?]))
        .filter(|[a, b]| a != b)
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The components of some records that are as they were. Reads the chunks where those are that are not in the submesh.
pub(crate) fn components_of_records(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    records: impl Iterator<Item = u32>,
) -> BTreeMap<u32, u32> {
    let mut wanted: Vec<u32> = records.collect();
    wanted.sort_unstable();
    wanted.dedup();
    let is_wanted = |record: u32| wanted.binary_search(&record).is_ok();
    let mut found = BTreeMap::new();
    for (t, triangle) in submesh.triangles.iter().enumerate() {
        if let Origin::Input(record) = triangle.origin
            && is_wanted(record)
        {
            found.insert(record, components.of_triangle[t]);
        }
    }
    let beyond = wanted.iter().filter(|record| !found.contains_key(record));
    let positions: Vec<[f32; 3]> = survey
        .ahead(beyond, |record| Some(**record))
        .map(|record| position::corners(&survey.records[*record as usize])[0])
        .collect();
    if !positions.is_empty() {
        let around = survey.beyond_the_submesh(&positions);
        let around =
            around.iter().filter(|(irregular_triangle, region)| is_wanted(irregular_triangle.triangle) && *region != NONE);
        found.extend(
            around.map(|(irregular_triangle, region)| (irregular_triangle.triangle, components.of_region[*region as usize])),
        );
    }
    found
}

#[cfg(test)]
mod tests {
    use super::pieces;
    use crate::repairs::shared::work::Work;
    use crate::testing::{Corners, after, cuboid, reversed};

    /// The volumes of the pieces of surface that stand for themselves, and whether they are open.
    fn volumes(mesh: &[Corners]) -> Vec<(f64, bool)> {
        let found = after(mesh, |d, turned| {
            let pieces = pieces(&d.survey, &mut Work::new(&mut d.submesh), turned);
            pieces.list.iter().map(|piece| (d.survey.measure.volume(piece.extent), piece.open)).collect::<Vec<_>>()
        });
        found.result
    }

    /// With the walls at x = 1 triangulated in two ways, or in one.
    fn row(other_way: bool) -> Vec<Vec<Corners>> {
        let left = cuboid([0.0; 3], [1.0, 1.0, 1.0]);
        let mut right = cuboid([1.0, 0.0, 0.0], [3.0, 1.0, 1.0]);
        if other_way {
            right.retain(|t| !t.iter().all(|p| p[0] == 1.0));
            let [a, b, c, d] = [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 0.0]];
            let walls = [vec![[a, b, c], [a, c, d]], vec![[b, c, d], [b, d, a]]];
            let of_left: Vec<Corners> = left.iter().filter(|t| t.iter().all(|p| p[0] == 1.0)).copied().collect();
            let is_in_left = |t: &Corners| of_left.iter().any(|l| t.iter().all(|p| l.contains(p)));
            right.extend(walls.into_iter().find(|wall| !wall.iter().any(is_in_left)).unwrap());
        }
        vec![left, right]
    }

    #[test]
    fn a_body_and_one_inside_out_beside_it_are_two() {
        for other_way in [false, true] {
            let [left, right] = row(other_way).try_into().unwrap();
            let mut got = volumes(&[left, reversed(&right)].concat());
            got.sort_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(got, [(-2.0, false), (1.0, false)], "{other_way}");
        }
    }

    #[test]
    fn bodies_that_face_the_same_way_hang_together_by_their_wall() {
        let together: f64 = volumes(&row(false).concat()).iter().map(|(volume, _)| volume).sum();
        assert_eq!(together, 3.0);
    }
}
