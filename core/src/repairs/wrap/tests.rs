use crate::algorithms::wrap::tree::Corners;
use crate::contract::report::Wrap;
use crate::io::record;
use std::path::Path;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::{Defects, Verdict};
use crate::contract::settings::Limits;
use crate::diagnosis::Diagnosis;
use crate::output::edit::Edit;
use crate::repairs::shared::overlay::Overlay;
use crate::testing::{cuboid, diagnose, plate, records, reversed, shifted, written};

struct After {
    listed: Vec<Wrap>,
    defects: Defects,
    verdict: Verdict,
    untouched: u64,
    output: Vec<record::Record>,
}

/// Wraps what is no solid in these triangles, and counts on what would be written.
fn wrapped(mesh: &[Corners], kept_open: &[[f32; 3]], profile: &Profile, limits: &Limits) -> After {
    wrapped_with(mesh, Kept { open: kept_open, sheets: &[] }, profile, limits)
}

fn wrapped_with(mesh: &[Corners], kept: Kept<'_>, profile: &Profile, limits: &Limits) -> After {
    let input = records(mesh);
    let mut d = Diagnosis::of(Path::new("test"), &input, profile, limits, &Quiet).unwrap();
    let mut reversed = Reversed::none(&d.survey);
    let work = &mut Work::new(&mut d.submesh);
    let pairs = Overlay::of(&d.survey, work, &reversed).and_then(|overlay| overlay.crossing_triangles(&d.survey, work));
    let wraps = replace(&d.survey, work, &mut reversed, pairs.as_deref(), kept, profile, (limits.threads, &Quiet));
    let edit = Edit::of(&d.survey, &d.submesh, &reversed, &wraps.triangles);
    let output = written(&edit, &input);
    let defects = diagnose(&output).defects;
    let verdict = crate::detect::verdict::judge(&defects, &[]);
    After { listed: wraps.listed, defects, verdict, untouched: edit.summary(input.len()).untouched, output }
}

fn by_default(mesh: &[Corners]) -> After {
    wrapped(mesh, &[], &Profile::default(), &Limits { threads: 1, ..Limits::default() })
}

/// A cube without its top.
fn tray() -> Vec<Corners> {
    let mut tray = cuboid([0.0; 3], [8.0; 3]);
    tray.drain(2..4);
    tray
}

#[test]
fn bodies_that_run_into_each_other_become_one_and_others_stay() {
    let beside = cuboid([20.0; 3], [21.0; 3]);
    let got = by_default(&[cuboid([0.0; 3], [4.0; 3]), cuboid([2.0; 3], [6.0; 3]), beside].concat());
    assert!(got.verdict.good, "{:?}", got.verdict.reasons);
    assert_eq!((got.defects.bodies, got.untouched, got.listed.len()), (2, 12, 1));
    assert!((got.defects.volume / 121.0 - 1.0).abs() < 0.02, "{}", got.defects.volume);
    let told = &got.listed[0];
    assert_eq!((told.replaced, told.bounds, &told.left), (24, [[0.0; 3], [6.0; 3]], &None));
    // The corner of each in the other does not count, the sharp edges do.
    assert!(told.moved < told.cell && told.new_ground < told.cell, "{told:?}");
}

#[test]
fn bodies_that_share_an_edge_become_one() {
    let got = by_default(&[cuboid([0.0; 3], [4.0; 3]), cuboid([4.0, 4.0, 0.0], [8.0, 8.0, 4.0])].concat());
    assert!(got.verdict.good, "{:?}", got.verdict.reasons);
    assert_eq!((got.untouched, got.listed.len()), (0, 1));
}

#[test]
fn what_is_inside_out_and_open_is_found_to_be() {
    let got = by_default(&reversed(&tray()));
    assert!(got.verdict.good && got.defects.volume > 400.0, "{}", got.defects.volume);
}

#[test]
fn what_was_left_open_on_purpose_stays_and_so_does_what_runs_into_it() {
    let limits = Limits { threads: 1, ..Limits::default() };
    let mesh = [tray(), cuboid([7.0; 3], [9.0; 3])].concat();
    let got = wrapped(&mesh, &[[0.0, 0.0, 8.0]], &Profile::default(), &limits);
    assert_eq!((got.untouched, got.listed.len()), (22, 1));
    assert!(got.listed[0].left.as_ref().is_some_and(|reason| reason.contains("on purpose")), "{:?}", got.listed);
}

/// A lone sheet stays open; one that runs into what is broken goes with that, unless the profile keeps it.
#[test]
fn a_sheet_that_runs_into_a_broken_body_goes_with_it() {
    let touching = [cuboid([0.0; 3], [4.0; 3]), cuboid([4.0, 4.0, 0.0], [8.0, 8.0, 4.0])].concat();
    let sheet = shifted(&plate(1, |_, _| true), [-0.25, 1.5, 2.0]);
    let rim = [sheet[0][0]];
    let limits = Limits { threads: 1, ..Limits::default() };
    let after = |sheets: &[[f32; 3]]| {
        let mesh = [touching.clone(), sheet.clone()].concat();
        wrapped_with(&mesh, Kept { open: &rim, sheets }, &Profile::default(), &limits)
    };
    let got = after(&rim);
    assert!(got.verdict.good && got.untouched == 0, "{:?}", got.verdict.reasons);
    let kept = after(&[]);
    assert!(!kept.verdict.good && kept.untouched == 26, "{}", kept.untouched);
    // Alone it stays.
    let alone = wrapped_with(&sheet, Kept { open: &rim, sheets: &rim }, &Profile::default(), &limits);
    assert!(alone.listed[0].left.as_ref().is_some_and(|reason| reason.contains("on purpose")), "{:?}", alone.listed);
}

/// The faces of a box in squares of 1, each triangle a little smaller than it was, so that none meets another one. Every seventh is lost.
fn loose_box() -> Vec<Corners> {
    let flat = plate(6, |_, _| true);
    let places: [fn([f32; 3]) -> [f32; 3]; 3] = [|[x, y, _]| [x, y, 6.0], |[x, y, _]| [6.0, x, y], |[x, y, _]| [y, 6.0, x]];
    let turned: [fn([f32; 3]) -> [f32; 3]; 3] = [|[x, y, _]| [x, y, 0.0], |[x, y, _]| [0.0, x, y], |[x, y, _]| [y, 0.0, x]];
    let side = |place: fn([f32; 3]) -> [f32; 3], is_outward: bool| {
        let faces = flat.iter().map(move |t| t.map(place));
        faces.map(move |[a, b, c]| if is_outward { [a, b, c] } else { [a, c, b] }).collect::<Vec<Corners>>()
    };
    let all = places.into_iter().map(|place| side(place, true)).chain(turned.into_iter().map(|place| side(place, false)));
    let all: Vec<Corners> = all.flatten().collect();
    let smaller = |t: &Corners| {
        let middle: [f32; 3] = std::array::from_fn(|k| (t[0][k] + t[1][k] + t[2][k]) / 3.0);
        t.map(|p| std::array::from_fn(|k| p[k] + (middle[k] - p[k]) / 64.0))
    };
    all.iter().enumerate().filter(|(i, _)| i % 7 != 3).map(|(_, t)| smaller(t)).collect()
}

#[test]
fn a_soup_that_encloses_something_is_wrapped_as_one() {
    let mesh = loose_box();
    let got = by_default(&mesh);
    assert!(got.verdict.good && got.listed.len() == 1, "{:?}", got.listed);
    assert!((got.defects.volume.abs() / 216.0 - 1.0).abs() < 0.05, "{}", got.defects.volume);
    // One side of the box alone encloses nothing, in however many pieces.
    let flat: Vec<Corners> = mesh.into_iter().filter(|t| t.iter().all(|p| p[2] == 6.0)).collect();
    assert!(flat.len() > 40);
    assert_eq!(by_default(&flat).untouched, flat.len() as u64);
}

#[test]
fn a_lone_sheet_stays_and_is_named() {
    let got = by_default(&plate(4, |_, _| true));
    assert_eq!(got.untouched, 32);
    assert!(got.listed[0].left.as_ref().is_some_and(|reason| reason.contains("next to nothing")), "{:?}", got.listed);
}

#[test]
fn what_stands_in_a_mouth_joins_the_wrap_that_closes_it() {
    let post = cuboid([3.0, 3.0, 2.0], [5.0, 5.0, 12.0]);
    let apart = shifted(&post, [20.0, 0.0, 0.0]);
    let got = by_default(&[tray(), post, apart].concat());
    assert!(got.verdict.good, "{:?}", got.verdict.reasons);
    assert_eq!((got.listed.len(), got.listed[0].replaced, got.untouched), (1, 22, 12));
}

#[test]
fn the_profile_bounds_how_much_and_how_far() {
    let limits = Limits { threads: 1, ..Limits::default() };
    let mesh = [tray(), cuboid([20.0; 3], [28.0; 3])].concat();
    for (profile, reason) in [
        (Profile { wrap_max_share: 0.4, ..Profile::default() }, "of the surface would be replaced"),
        (Profile { wrap_max_move: 0.0, ..Profile::default() }, "would move"),
    ] {
        let got = wrapped(&mesh, &[], &profile, &limits);
        assert_eq!(got.untouched, 22);
        assert!(got.listed[0].left.as_ref().is_some_and(|left| left.contains(reason)), "{:?}", got.listed);
    }
}

#[test]
fn chunks_and_threads_change_nothing() {
    // Balls of a few hundred triangles, so that most of them is no irregular triangle.
    let ball = |at: f32| -> Vec<Corners> {
        let p = |i: u32, j: u32| {
            let (a, b) = (f64::from(i) * 0.3141592653589793, f64::from(j) * 0.3141592653589793);
            [(b.sin() * a.cos() + f64::from(at)) as f32, (b.sin() * a.sin()) as f32, b.cos() as f32]
        };
        let mut mesh = Vec::new();
        for i in 0..20 {
            for j in 1..9 {
                mesh.extend([
                    [p(i, j), p(i, j + 1), p((i + 1) % 20, j + 1)],
                    [p(i, j), p((i + 1) % 20, j + 1), p((i + 1) % 20, j)],
                ]);
            }
            mesh.extend([[[at, 0.0, 1.0], p(i, 1), p((i + 1) % 20, 1)], [p(i, 9), [at, 0.0, -1.0], p((i + 1) % 20, 9)]]);
        }
        mesh
    };
    let mesh = [ball(0.0), ball(1.3), ball(5.0)].concat();
    let profile = Profile::default();
    let one = wrapped(&mesh, &[], &profile, &Limits { threads: 1, ..Limits::default() });
    assert!(one.verdict.good && one.untouched == 360, "{:?}", one.verdict.reasons);
    let many = wrapped(&mesh, &[], &profile, &Limits { threads: 3, chunk_triangles: 40, ..Limits::default() });
    assert!(one.output == many.output && one.listed == many.listed);
}
