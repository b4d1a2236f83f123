use proptest::prelude::*;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::settings::Spill;
use crate::testing::{cuboid, records, soup};

/// What a survey says that must not depend on its chunks.
fn surveyed(records: &[Record], chunk_triangles: u32, spill: Spill) -> impl PartialEq + std::fmt::Debug {
    let limits = Limits { threads: 1, chunk_triangles, spill, ..Limits::default() };
    let survey = Survey::new(Path::new("test"), records, true, &limits, &Quiet).unwrap();
    let regions: Vec<_> = survey.regions.iter().map(|p| (p.first, p.triangles, p.extent, p.bounds)).collect();
    let found =
        (survey.irregular_triangles, survey.irregular_triangle_regions, regions, survey.nonfinite, survey.self_intersections);
    (found, survey.vertices, survey.vertices_used)
}

proptest! {
    /// Chunks and spools only divide the work: however small, they find what one chunk of everything finds.
    #[test]
    fn chunks_do_not_show_in_the_result(triangles in soup()) {
        let records = records(&triangles);
        let whole = surveyed(&records, u32::MAX, Spill::Never);
        for chunk_triangles in [1, 2, 7] {
            for spill in [Spill::Never, Spill::Always] {
                prop_assert_eq!(&surveyed(&records, chunk_triangles, spill), &whole);
            }
        }
    }
}

/// What is known after the surface was divided at some corners, some others were promoted, and it was divided at others again.
fn divided(records: &[Record], chunk_triangles: u32, corners: &[Vec<usize>; 3]) -> impl PartialEq + std::fmt::Debug + use<> {
    let limits = Limits { threads: 1, chunk_triangles, ..Limits::default() };
    let path = Path::new("test");
    let mut survey = Survey::new(path, records, true, &limits, &Quiet).unwrap();
    let all: Vec<[f32; 3]> =
        records.iter().map(record::corners).filter(|t| t.as_flattened().iter().all(|x| x.is_finite())).flatten().collect();
    let [first, promoted, second] = corners.each_ref().map(|some| -> Vec<[f32; 3]> {
        let mut some: Vec<[f32; 3]> = some.iter().map(|k| position::canonical(all[k % all.len()])).collect();
        some.sort_by(|a, b| a.partial_cmp(b).unwrap());
        some.dedup();
        some
    });
    let mut divisions = Vec::new();
    let mut divide = |survey: &mut Survey<'_>, positions: &[[f32; 3]]| {
        let division = survey.divide(path, positions, &limits, &Quiet).unwrap();
        divisions.push((division.fetched, division.divided_from));
    };
    divide(&mut survey, &first);
    let regular: Vec<[f32; 3]> = promoted.into_iter().filter(|p| !first.contains(p)).collect();
    let new = survey.promote(&regular);
    divide(&mut survey, &second);
    let regions: Vec<_> = survey.regions.iter().map(|p| (p.first, p.triangles, p.extent, p.bounds)).collect();
    (divisions, new, survey.irregular_triangles, survey.irregular_triangle_regions, regions, survey.promoted)
}

proptest! {
    /// Chunks that are not solved again when the surface is divided say what they would say.
    #[test]
    fn chunks_do_not_show_where_surface_is_divided(
        triangles in soup(),
        corners in std::array::from_fn::<_, 3, _>(|_| proptest::collection::vec(0usize..1000, 0..4)),
    ) {
        let records = records(&triangles);
        prop_assume!(records.iter().any(|r| record::corners(r).as_flattened().iter().all(|x| x.is_finite())));
        let whole = divided(&records, u32::MAX, &corners);
        for chunk_triangles in [1, 2, 7] {
            prop_assert_eq!(&divided(&records, chunk_triangles, &corners), &whole);
        }
    }
}

#[test]
fn a_cube_is_one_region_and_no_irregular_triangle() {
    let records = records(&cuboid([0.0; 3], [2.0; 3]));
    for chunk_triangles in [1, u32::MAX] {
        let limits = Limits { threads: 1, chunk_triangles, ..Limits::default() };
        let survey = Survey::new(Path::new("test"), &records, true, &limits, &Quiet).unwrap();
        assert!(survey.irregular_triangles.is_empty());
        assert_eq!((survey.regions.len(), survey.regions[0].triangles, survey.vertices), (1, 12, 8));
        assert!((survey.measure.volume(survey.regions[0].extent) - 8.0).abs() < 1e-9);
    }
}

/// Boxes of a cone's side and of its base overlap in so many pairs that these are looked for askew: with the same pairs, and no others.
#[test]
fn chunks_do_not_show_where_boxes_select_badly() {
    let ring = |i: usize, n: usize| {
        let angle = (i % n) as f32 / n as f32 * std::f32::consts::TAU;
        [50.0 * angle.cos(), 50.0 * angle.sin(), 0.0]
    };
    let n = 6000;
    let side = (0..n).map(|i| [[0.0, 0.0, 80.0], ring(i, n), ring(i + 1, n)]);
    let base = (0..n).map(|i| [[0.0; 3], ring(i + 1, n), ring(i, n)]);
    let mut triangles: Vec<[[f32; 3]; 3]> = side.chain(base).collect();
    triangles.extend(cuboid([10.0, 10.0, -3.0], [10.01, 10.01, 3.0]));
    let records = records(&triangles);
    let found = [200, 2000, 1 << 20].map(|chunk_triangles| {
        let limits = Limits { chunk_triangles, threads: 2, ..Limits::default() };
        let survey = Survey::new(Path::new("cone"), &records, true, &limits, &Quiet).unwrap();
        (survey.self_intersections, survey.crossing_pairs)
    });
    let (summed, pairs) = &found[0];
    assert!(summed.as_ref().is_some_and(|s| !s.given_up && s.crossing_pairs > 0) && pairs.is_some());
    assert!(found.iter().all(|f| *f == found[0]));
}
