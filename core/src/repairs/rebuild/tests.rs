use std::path::Path;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::Defects;
use crate::contract::settings::Limits;
use crate::diagnosis::Diagnosis;
use crate::geometry::tri_tri::Triangle as Corners;
use crate::output::edit::Edit;
use crate::testing::{cuboid, diagnose, plate, records, shifted, written};

struct After {
    rebuilt: Rebuilt,
    defects: Defects,
    good: bool,
    doubts: Vec<String>,
    untouched: u64,
}

/// Rebuilds what is wrong in these triangles, and counts on what would be written.
fn after(mesh: &[Corners], kept_open: &[[f32; 3]]) -> After {
    let input = records(mesh);
    let (profile, limits) = (Profile::default(), Limits { threads: 1, ..Limits::default() });
    let mut d = Diagnosis::of(Path::new("test"), &input, &profile, &limits, &Quiet).unwrap();
    let mut cx = Context::of(&mut d, Path::new("test"), &profile, &limits, &Quiet);
    cx.handed.may_cross = true;
    cx.handed.kept_open = kept_open.to_vec();
    let rebuilt = rebuild(&mut cx);
    let told = Rebuilt { regions: rebuilt.regions.clone(), gone: rebuilt.gone.clone(), ..rebuilt };
    told.tell(&mut cx);
    let Context { reversed, account, .. } = cx;
    let edit = Edit::of(&d.survey, &d.submesh, &reversed, &[]);
    let output = written(&edit, &input);
    let defects = diagnose(&output).defects;
    let good = crate::detect::verdict::judge(&defects, &[]).good;
    After { rebuilt, defects, good, doubts: account.doubts, untouched: edit.summary(input.len()).untouched }
}

/// A box of so many squares a side.
fn fine_box(side: u8) -> Vec<Corners> {
    let at = |t: &Corners, place: &dyn Fn(f32, f32) -> [f32; 3]| t.map(|[x, y, _]| place(x, y));
    let s = f32::from(side);
    let flat = plate(side, |_, _| true);
    let upward = (flat[0][1][0] - flat[0][0][0]) * (flat[0][2][1] - flat[0][0][1])
        - (flat[0][1][1] - flat[0][0][1]) * (flat[0][2][0] - flat[0][0][0])
        > 0.0;
    let sides: [&dyn Fn(f32, f32) -> [f32; 3]; 6] =
        [&|x, y| [x, y, s], &|x, y| [y, x, 0.0], &|x, y| [s, x, y], &|x, y| [0.0, y, x], &|x, y| [y, s, x], &|x, y| [x, 0.0, y]];
    let all = sides.iter().flat_map(|place| flat.iter().map(|t| at(t, place)).collect::<Vec<_>>());
    if upward { all.collect() } else { all.map(|[a, b, c]| [a, c, b]).collect() }
}

#[test]
fn one_of_two_bodies_that_share_a_vertex_is_closed_without_it() {
    let mesh = [fine_box(8), shifted(&fine_box(8), [8.0; 3])].concat();
    let got = after(&mesh, &[]);
    assert!(got.good, "{:?}", got.defects);
    assert_eq!((got.rebuilt.places, got.defects.bodies, got.rebuilt.all), (1, 2, true));
    // The triangles at the corner of one of them go, and no more.
    assert!(
        got.rebuilt.triangles <= 6 && got.untouched == mesh.len() as u64 - got.rebuilt.triangles,
        "{}",
        got.rebuilt.triangles
    );
    assert!(got.rebuilt.moved > 0.2 && got.rebuilt.moved < 1.0, "{}", got.rebuilt.moved);
    // A corner of a square of 64 is far more than a share of the diagonal.
    assert_eq!(got.doubts.len(), 1, "{:?}", got.doubts);
}

#[test]
fn a_spike_through_the_surface_is_cut_out_with_what_it_crosses() {
    let mut mesh = fine_box(8);
    // The middle of the bottom is drawn up through the top.
    let middle = [4.0, 4.0, 0.0];
    mesh.iter_mut().flatten().filter(|p| **p == middle).for_each(|p| *p = [4.1, 4.2, 8.5]);
    let got = after(&mesh, &[]);
    assert!(!got.good, "a spike as long as the body is nobody's to guess");
    mesh.iter_mut().flatten().filter(|p| **p == [4.1, 4.2, 8.5]).for_each(|p| *p = middle);
    // That of the top is folded over its neighbours.
    mesh.iter_mut().flatten().filter(|p| **p == [4.0, 4.0, 8.0]).for_each(|p| *p = [5.3, 5.2, 7.9]);
    let got = after(&mesh, &[]);
    assert!(got.good, "{:?}", got.defects);
    assert!((got.defects.volume - 512.0).abs() < 0.5 && got.untouched > mesh.len() as u64 - 30, "{:?}", got.defects);
}

#[test]
fn what_is_sound_or_open_on_purpose_stays() {
    let got = after(&fine_box(4), &[]);
    assert_eq!((got.rebuilt.places, got.untouched), (0, 192));
    let mut open = fine_box(8);
    open.retain(|t| !t.iter().all(|p| p[2] == 8.0 && p[0] <= 4.0 && p[1] <= 4.0 && p[0] >= 3.0 && p[1] >= 3.0));
    let got = after(&open, &[[4.0, 4.0, 8.0]]);
    assert_eq!((got.rebuilt.places, got.untouched), (0, open.len() as u64));
    // Else it is closed as what was around it was.
    assert!(after(&open, &[]).good);
}

#[test]
fn where_defects_are_everywhere_nothing_is_rebuilt() {
    // Two boxes of twelve triangles: all are at what is wrong.
    let mesh = [cuboid([0.0; 3], [4.0; 3]), cuboid([2.0; 3], [6.0; 3])].concat();
    let got = after(&mesh, &[]);
    assert_eq!((got.rebuilt.places, got.untouched), (0, 24));
}
