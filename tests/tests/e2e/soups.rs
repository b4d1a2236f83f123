//! Random soups of small whole coordinates, where everything coincides that can: whatever the chunks and the threads, the engine
//! writes the same bytes, counts what the independent judge counts, and accounts for every record. Too little memory is a refusal,
//! a soup as text is the same soup, and what is good is left alone when it comes back.

use std::path::Path;

use proptest::prelude::*;
use suture_bench::judge::{Judgement, judge};
use suture_core::report::{Defects, Outcome};
use suture_core::{ErrorClass, Guarantee, Limits, Profile, Quiet, Report};
use suture_tests::edit::Edit;
use suture_tests::stl::{self, Triangle, cuboid, mesh};

/// Any triangles whose corners lie on a grid of `side` points each way.
fn any_triangles(side: u8, most: usize) -> impl Strategy<Value = Vec<Triangle>> {
    let corner = prop::array::uniform3((0..side).prop_map(f32::from));
    prop::collection::vec(prop::array::uniform3(corner), 1..most)
}

/// Boxes that overlap, nest and share walls, edges and corners, each triangle with a chance to be turned, doubled or missing.
fn damaged_boxes() -> impl Strategy<Value = Vec<Triangle>> {
    let a_box = (prop::array::uniform3(0u8..4), prop::array::uniform3(1u8..4), any::<bool>()).prop_map(|(low, size, inward)| {
        let low = low.map(f32::from);
        let mut triangles = cuboid(low, std::array::from_fn(|k| low[k] + f32::from(size[k])));
        if inward {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        triangles
    });
    let boxes = prop::collection::vec(a_box, 1..5).prop_map(|boxes| boxes.concat());
    (boxes, prop::collection::vec((0u8..16, 0usize..1000), 0..12)).prop_map(|(mut triangles, damage)| {
        for (kind, at) in damage {
            let at = at % triangles.len();
            match kind {
                0..6 if triangles.len() > 1 => drop(triangles.swap_remove(at)),
                6..9 => triangles[at].swap(0, 1),
                9..11 => triangles.push(triangles[at]),
                11..13 => triangles.push([triangles[at][1], triangles[at][0], triangles[at][2]]),
                13 => triangles[at][0] = triangles[at][1],
                // Split on one side only: a T-junction, off by less than the weld tolerance or not at all.
                _ => {
                    let [a, b, c] = triangles[at];
                    let hair = if kind == 14 { 1e-5 } else { 0.0 };
                    let middle: [f32; 3] = std::array::from_fn(|k| (a[k] + b[k]) / 2.0 + hair);
                    triangles[at] = [a, middle, c];
                    triangles.push([middle, b, c]);
                }
            }
        }
        triangles
    })
}

/// Soups in which corners that were one lie a little apart.
fn crumbled_boxes() -> impl Strategy<Value = Vec<Triangle>> {
    (damaged_boxes(), prop::collection::vec((any::<prop::sample::Index>(), 0usize..9, -2i8..3), 0..30)).prop_map(
        |(mut triangles, crumbs)| {
            for (at, coordinate, steps) in crumbs {
                let at = at.index(triangles.len());
                let triangle = &mut triangles[at];
                triangle[coordinate / 3][coordinate % 3] += f32::from(steps) * 1.5e-5;
            }
            triangles
        },
    )
}

fn assert_counts(counted: &Defects, judged: &Judgement) -> Result<(), TestCaseError> {
    let c = judged.counts;
    let of_engine = [
        ("triangles", counted.triangles, c.triangles),
        ("nonfinite", counted.nonfinite, judged.nonfinite),
        ("vertices", counted.vertices, judged.vertices),
        ("degenerate_index", counted.degenerate_index, c.degenerate_index),
        ("degenerate_area", counted.degenerate_area, c.degenerate_area),
        ("duplicates", counted.duplicates_same + counted.duplicates_opposite, c.duplicates),
        ("boundary_edges", counted.boundary_edges, c.boundary_edges),
        ("boundary_loops", counted.boundary_loops, c.boundary_loops),
        ("nonmanifold_edges", counted.nonmanifold_edges, c.nonmanifold_edges),
        ("nonmanifold_vertices", counted.nonmanifold_vertices, c.nonmanifold_vertices),
        ("inconsistent_edges", counted.inconsistent_edges, c.inconsistent_edges),
        ("unbalanced_edges", counted.unbalanced_edges, c.unbalanced_edges),
        ("components", counted.components, c.components),
    ];
    for (name, engine, judge) in of_engine {
        prop_assert_eq!(engine, judge, "{}: engine, judge", name);
    }
    Ok(())
}

/// Repairs `input` into `output`, which is replaced.
fn repair(input: &Path, output: &Path, limits: &Limits) -> suture_core::error::Result<Report> {
    let _ = std::fs::remove_file(output);
    // A soup that is wrapped takes seconds each time; what a wrap holds is tested beside it.
    let profile = Profile::builder().guarantee(Guarantee::Off).build().expect("it is valid");
    suture_core::repair(input, output, &profile, limits, &Quiet)
}

/// The same with ample memory, in chunks of that many triangles.
fn repaired(input: &Path, output: &Path, chunk_triangles: u32, threads: usize) -> Report {
    let limits = Limits::default().with_threads(threads).with_chunk_triangles(chunk_triangles).with_edit_listed(true);
    repair(input, output, &limits).expect("a soup can be repaired, if not made good")
}

/// Less and less memory: the same bytes, or a refusal that names the budget.
fn holds_in_little_memory(input: &Path, output: &Path, written: &[u8]) -> Result<(), TestCaseError> {
    for memory_bytes in [1 << 20, 1 << 16, 1 << 13, 1 << 10] {
        let limits = Limits::default().with_memory(memory_bytes).with_threads(1).with_chunk_triangles(64);
        match repair(input, output, &limits) {
            Ok(_) => prop_assert!(std::fs::read(output).unwrap() == written, "{} bytes of memory: other bytes", memory_bytes),
            Err(error) => {
                prop_assert_eq!(error.class(), ErrorClass::Starved, "{}", error);
                prop_assert!(error.to_string().contains("--memory"), "{}", error);
            }
        }
    }
    Ok(())
}

/// All that must hold for a soup.
fn holds(triangles: &[Triangle]) -> Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.stl"), folder.path().join("out.stl"));
    let bytes = mesh(triangles);
    std::fs::write(&input, &bytes).unwrap();
    let report = repaired(&input, &output, 1 << 20, 1);
    let written = std::fs::read(&output).unwrap();
    assert_counts(&report.before, &judge(&input).unwrap())?;

    let listed = serde_json::to_value(&report).unwrap();
    let edit = Edit::read(&listed, triangles.len());
    prop_assert!(edit.apply(stl::records(&bytes)) == stl::records(&written), "the edit does not account for the output");
    if !stl::records(&written).is_empty() {
        let judged = judge(&output).unwrap();
        assert_counts(report.after.as_ref().unwrap_or(&report.before), &judged)?;
        let verdict = &report.verdict;
        prop_assert_eq!(
            (verdict.closed, verdict.manifold, verdict.oriented),
            (judged.counts.closed(), judged.counts.manifold(), judged.counts.oriented())
        );
        prop_assert!(!verdict.good || (judged.sound() && judged.volume > 0.0), "called good: {:?}", judged);
        // Of a body that was kept in the material of another one, since a repair has closed one of both, the result no longer tells that.
        let is_kept = verdict.reasons.iter().any(|reason| reason.starts_with("a body lies in the material of another one"));
        if verdict.good && !is_kept {
            let again = folder.path().join("again.stl");
            let report = repaired(&output, &again, 1 << 20, 1);
            prop_assert!(report.outcome == Outcome::Clean && std::fs::read(&again).unwrap() == written, "not left alone");
        }
        // A copy stays text.
        if report.after.is_some() {
            let (text, of_text) = (folder.path().join("text.stl"), folder.path().join("of_text.stl"));
            std::fs::write(&text, stl::text("soup", triangles)).unwrap();
            repaired(&text, &of_text, 64, 1);
            prop_assert!(stl::records(&std::fs::read(&of_text).unwrap()) == stl::records(&written), "not the same as text");
        }
    }
    holds_in_little_memory(&input, &output, &written)?;
    for chunk in [1, 3, 64, 1 << 20] {
        for threads in [1, 2] {
            let other = repaired(&input, &output, chunk, threads);
            prop_assert_eq!(&other.before, &report.before, "chunks of {}, {} threads", chunk, threads);
            prop_assert!(std::fs::read(&output).unwrap() == written, "chunks of {}, {} threads: other bytes", chunk, threads);
            prop_assert_eq!(&other.after, &report.after, "chunks of {}, {} threads", chunk, threads);
        }
    }
    Ok(())
}

/// A box that lacks a triangle, and a body in its material: one of them is asked about, and may go when the result comes back.
#[test]
fn of_a_body_in_a_box_that_lacks_a_triangle() {
    let boxes = [cuboid([1.0, 2.0, 2.0], [4.0, 5.0, 5.0]), cuboid([2.0, 3.0, 3.0], [3.0, 4.0, 4.0])].concat();
    holds(&boxes[1..]).unwrap();
}

/// A part as many soups as usual, since each is repaired a dozen times; PROPTEST_CASES makes them more.
fn one_in(parts: u32) -> ProptestConfig {
    let usual = ProptestConfig::default();
    ProptestConfig { cases: usual.cases / parts, failure_persistence: None, ..usual }
}

proptest! {
    #![proptest_config(one_in(8))]

    #[test]
    fn of_many_triangles_on_a_finer_grid(triangles in any_triangles(6, 200)) {
        holds(&triangles)?;
    }
}

proptest! {
    #![proptest_config(one_in(2))]

    #[test]
    fn of_any_triangles_on_a_coarse_grid(triangles in any_triangles(3, 40)) {
        holds(&triangles)?;
    }

    #[test]
    fn of_damaged_boxes(triangles in damaged_boxes()) {
        holds(&triangles)?;
    }

    #[test]
    fn of_crumbled_boxes(triangles in crumbled_boxes()) {
        holds(&triangles)?;
    }
}
