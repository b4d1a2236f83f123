//! Every generated case through `suture repair`: what comes out is closed, manifold and oriented, what was sound is there byte for
//! byte, and the report's edit accounts for the rest.

use suture_bench::generate::Case;
use suture_bench::judge::{Judgement, judge};
use suture_tests::edit::{Change, Edit};
use suture_tests::{Place, stl};

/// What the judge says about a mesh must stand in a report's `before` or `after`.
fn assert_counts(counts: &serde_json::Value, judged: &Judgement, what: &str) {
    let c = judged.counts;
    let expected = [
        ("triangles", c.triangles),
        ("nonfinite", judged.nonfinite),
        ("vertices", judged.vertices),
        ("degenerate_index", c.degenerate_index),
        ("degenerate_area", c.degenerate_area),
        ("boundary_edges", c.boundary_edges),
        ("boundary_loops", c.boundary_loops),
        ("nonmanifold_edges", c.nonmanifold_edges),
        ("nonmanifold_vertices", c.nonmanifold_vertices),
        ("inconsistent_edges", c.inconsistent_edges),
        ("unbalanced_edges", c.unbalanced_edges),
        ("components", c.components),
    ];
    for (field, number) in expected {
        assert_eq!(counts[field], number, "{what}: {field}");
    }
    let duplicates = counts["duplicates_same"].as_u64().unwrap() + counts["duplicates_opposite"].as_u64().unwrap();
    assert_eq!(duplicates, c.duplicates, "{what}: duplicates");
}

/// Repairs a generated file and checks what holds for every case, good or not.
fn repaired(case: Case, triangles: u64, seed: u64) -> (serde_json::Value, Judgement) {
    let what = format!("{case}, {triangles} triangles, seed {seed}");
    let place = Place::new();
    let (input, truth) = place.generate(case, triangles, seed);
    let ran = place.repair(&format!("{case}.stl"), "out.stl", &["--list-edit", "--report", "report.json"]);
    assert!(ran.code() < 2, "{what}: {}", ran.stderr());
    let report: serde_json::Value = serde_json::from_slice(&place.read("report.json")).unwrap();

    let before = std::fs::read(&input).unwrap();
    let after = place.read("out.stl");
    let (old, new) = (stl::records(&before), stl::records(&after));
    assert_counts(&report["before"], &judge(&input).unwrap(), &format!("{what}, before"));
    let judged = judge(&place.at("out.stl")).unwrap();
    let counted = if report["after"].is_null() { &report["before"] } else { &report["after"] };
    assert_counts(counted, &judged, &format!("{what}, after"));

    assert_eq!(after[..80], before[..80], "{what}: the header passes through");
    let edit = Edit::read(&report, old.len());
    assert!(edit.apply(old) == new, "{what}: the output is not the input with the edit of the report");
    let numbers = ["untouched", "deleted", "flipped", "moved", "added"].map(|part| report["edit"][part].as_u64().unwrap());
    assert_eq!(edit.numbers(), numbers, "{what}");
    let mut sound = truth.sound.iter().flat_map(|range| range.clone());
    // Whether a body is inside out is not a question of single records.
    if case != Case::InsideOut {
        assert_eq!(sound.find(|record| edit.changes[*record as usize] != Change::Untouched), None, "{what}: a sound record");
    }
    (report, judged)
}

/// The cases that the repairs of this version make good.
const GOOD: [Case; 16] = [
    Case::Clean,
    Case::Holes,
    Case::Duplicates,
    Case::Flipped,
    Case::Soup,
    Case::Mixed,
    Case::Cracks,
    Case::Gaps,
    Case::Degenerate,
    Case::InsideOut,
    Case::TwoBodies,
    Case::NoiseShells,
    Case::HugeFan,
    Case::Shuffled,
    Case::Fins,
    Case::Islands,
];

/// May a person be asked to look for this reason? Of a coarse mesh, what sticks out may have been the box's outermost. The coarsest has one
/// place for a defect, which is all of it: a fin is more than a thousandth of its skin, and islands lie in a hole of half of it.
fn may_be_asked(case: Case, triangles: u64, reason: &str) -> bool {
    match case {
        // It comes beside a reason.
        _ if reason.starts_with("openings were closed") => true,
        Case::Fins if triangles == 512 && reason.starts_with("visible surface was lost") => true,
        Case::Islands if triangles == 512 => ["a mouth of", "the surface ends in a ragged edge", "visible surface was invented"]
            .iter()
            .any(|told| reason.starts_with(told)),
        Case::Fins | Case::Degenerate | Case::Mixed => reason.contains("bounding box"),
        _ => false,
    }
}

fn ends_good(case: Case) {
    for (triangles, seed) in [(512, 1), (6_000, 2), (6_000, 3), (20_000, 4)] {
        let what = format!("{case}, {triangles} triangles, seed {seed}");
        let (report, judged) = repaired(case, triangles, seed);
        assert!(judged.sound(), "{what}: {:?}", judged.counts);
        assert_eq!(judged.negative_bodies, 0, "{what}: a body is inside out");
        let verdict = &report["verdict"];
        match report["outcome"].as_str().unwrap() {
            // Tiny bodies are no defect.
            "clean" => assert!(matches!(case, Case::Clean | Case::NoiseShells), "{what}"),
            "repaired" => assert!(!matches!(case, Case::Clean | Case::NoiseShells), "{what}"),
            "needs_review" => {
                let reasons: Vec<&str> = verdict["reasons"].as_array().unwrap().iter().map(|r| r.as_str().unwrap()).collect();
                assert!(reasons.iter().all(|reason| may_be_asked(case, triangles, reason)), "{what}: {reasons:?}");
            }
            other => panic!("{what}: {other}"),
        }
        assert_eq!(verdict["statement"], "closed, manifold, oriented, free of self-intersection", "{what}");
        assert_eq!(verdict["good"], true, "{what}");
    }
}

macro_rules! each_case_ends_good {
    ($($name:ident: $case:ident,)*) => {
        $(#[test] fn $name() { ends_good(Case::$case); })*

        #[test]
        fn every_case_has_a_test() {
            assert_eq!(GOOD, [$(Case::$case),*]);
            assert!(Case::ALL.iter().all(|case| GOOD.contains(case) || *case == Case::Touching));
        }
    };
}

each_case_ends_good! {
    clean: Clean,
    holes: Holes,
    duplicates: Duplicates,
    flipped: Flipped,
    soup: Soup,
    mixed: Mixed,
    cracks: Cracks,
    gaps: Gaps,
    degenerate: Degenerate,
    inside_out: InsideOut,
    two_bodies: TwoBodies,
    noise_shells: NoiseShells,
    huge_fan: HugeFan,
    shuffled: Shuffled,
    fins: Fins,
    islands: Islands,
}

/// Bodies that touch in a vertex are taken apart, unless the profile wants them as they are.
#[test]
fn touching_bodies_are_taken_apart() {
    let (report, judged) = repaired(Case::Touching, 6_000, 1);
    assert!(judged.sound(), "{judged:?}");
    assert_eq!(report["outcome"], "repaired");
    let repairs = report["repairs"].as_array().unwrap();
    assert!(repairs.iter().any(|repair| repair["name"] == "separate" && repair["count"].as_u64() > Some(0)), "{repairs:?}");
}
