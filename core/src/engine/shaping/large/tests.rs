use std::collections::BTreeSet;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::settings::{Limits, Profile};
use crate::engine::mesh::Mesh;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::self_crossing::{SelfCrossing, self_crossing};
use crate::geometry::tri_tri::Triangle;
use crate::stream::plan::Plan;

/// Cells in both passes, or in the first one.
const SIZES: [Sizes; 2] = [Sizes { cell: 500, whole: 300 }, Sizes { cell: 500, whole: 4500 }];

/// A torus of n × n squares with bumps.
fn torus(n: u32) -> Vec<Record> {
    let angle = |i: u32| f64::from(i % n) / f64::from(n) * std::f64::consts::TAU;
    let point = |(i, j): (u32, u32)| {
        let (u, v) = (angle(i), angle(j));
        let r = 1.0 + 0.1 * (5.0 * u).sin() * (3.0 * v).cos();
        let out = 3.0 + r * v.cos();
        [out * u.cos(), out * u.sin(), r * v.sin()].map(|x| x as f32)
    };
    let squares = (0..n * n).map(|s| (s / n, s % n));
    let faces = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(point);
        [[a, b, c], [a, c, d]]
    });
    faces.map(|corners| record::encode(corners, 7)).collect()
}

fn limits(threads: usize, memory_bytes: u64) -> Limits {
    Limits { threads, memory_bytes, ..Limits::default() }
}

fn run(records: &[Record], sizes: &Sizes, profile: &Profile, limits: &Limits) -> std::result::Result<Change, String> {
    simplify((Path::new("torus.stl"), records), sizes, Work { profile, limits, progress: &Quiet }).unwrap()
}

/// A course that has made no pass yet.
fn course<'a>((records, sizes): (&'a [Record], &'a Sizes), profile: &'a Profile, limits: &'a Limits) -> Course<'a> {
    Course::new((Path::new("torus.stl"), records), sizes, Work { profile, limits, progress: &Quiet }).unwrap()
}

/// The triangles after a change.
fn after(records: &[Record], change: &Change) -> Vec<Record> {
    let stays = (0..).zip(records).filter(|(at, _)| !bits::holds(&change.gone, *at)).map(|(_, record)| record);
    stays.chain(change.added.iter()).copied().collect()
}

fn triangles(records: &[Record]) -> Vec<Triangle> {
    records.iter().map(record::corners).collect()
}

/// Each edge is run along once each way.
fn is_closed(triangles: &[Triangle]) -> bool {
    let mesh = Mesh::from_triangles(triangles).unwrap();
    let sides = mesh.faces().iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    let ways: BTreeSet<[u32; 2]> = sides.collect();
    ways.len() == 3 * triangles.len() && ways.iter().all(|[from, to]| ways.contains(&[*to, *from]))
}

/// The farthest of some places of the one from the other.
fn off(from: &[Triangle], to: &[Triangle]) -> f64 {
    let to: Vec<_> = to.iter().map(|t| t.map(place)).collect();
    let places = from.iter().step_by(7).flat_map(|t| {
        let [a, b, c] = t.map(place);
        [a, (a + b) * 0.5, (a + b + c) / 3.0]
    });
    let nearest = |p| to.iter().map(|t| square_distance(p, *t)).fold(f64::INFINITY, f64::min).sqrt();
    places.map(nearest).fold(0.0, f64::max)
}

fn told(change: &Change) -> &Simplified {
    let Told::Simplified(told) = &change.told else { panic!("another step") };
    told
}

#[test]
fn cells_leave_a_closed_surface_that_does_not_cross_itself_within_the_bound_that_is_told() {
    let records = torus(50);
    let before = triangles(&records);
    let profiles = [
        Profile { simplify_ratio: 0.4, ..Profile::default() },
        Profile { simplify_triangles: 1800, ..Profile::default() },
        Profile { simplify_within_mm: 0.05, ..Profile::default() },
    ];
    for (profile, sizes) in profiles.iter().flat_map(|profile| SIZES.iter().map(move |sizes| (profile, sizes))) {
        let change = run(&records, sizes, profile, &limits(2, 1 << 30)).unwrap();
        let result = triangles(&after(&records, &change));
        assert!(is_closed(&result));
        assert_eq!(self_crossing(&result, u64::MAX), SelfCrossing::None);
        let told = told(&change);
        assert_eq!((told.before, told.after), (records.len() as u64, result.len() as u64));
        assert!(off(&before, &result) <= told.to_result && off(&result, &before) <= told.from_result, "{told:?}");
        if profile.simplify_within_mm > 0.0 {
            assert!(told.to_result.max(told.from_result) <= profile.simplify_within_mm, "{told:?}");
            assert!(result.len() < records.len() / 2, "{told:?}");
        } else {
            let wanted = simplifying::wanted(profile, records.len()).unwrap();
            assert!(result.len() <= wanted && result.len() + 60 > wanted, "{told:?}");
        }
    }
}

/// Memory decides how many cells are done at a time, and threads who does them.
#[test]
fn the_result_depends_on_neither_threads_nor_memory() {
    let records = torus(50);
    let profile = Profile { simplify_ratio: 0.2, ..Profile::default() };
    let of = |limits| after(&records, &run(&records, &SIZES[0], &profile, &limits).unwrap());
    let one = of(limits(1, 1 << 30));
    assert!(one == of(limits(2, 1 << 30)) && one == of(limits(3, 400 << 10)));
    let refused = run(&records, &SIZES[0], &profile, &limits(1, 100 << 10)).err();
    assert!(refused.is_some_and(|why| why.contains("1 MiB may be used")));
}

/// After one pass all triangles that have corners in several cells are what they were, byte for byte.
#[test]
fn seams_stay_in_a_pass_and_go_with_others() {
    let records = torus(50);
    let profile = Profile { simplify_ratio: 0.2, ..Profile::default() };
    let limits = limits(2, 1 << 30);
    let mut course = course((&records, &SIZES[0]), &profile, &limits);
    let passed = course.pass(Turn::First).run().unwrap();
    let plan = Plan::shifted(&records, &crate::io::read_ahead::Guide::new(records.as_flattened(), &limits), SIZES[0].cell, 0.0);
    let is_of_seam = |record: &Record| record::corners(record).windows(2).any(|two| plan.home(two[0]) != plan.home(two[1]));
    let seams: Vec<usize> = (0..records.len()).filter(|at| is_of_seam(&records[*at])).collect();
    assert!(seams.len() > 300 && seams.iter().all(|at| bits::holds(&passed.taken.stays, *at)), "{}", seams.len());
    let stay: Vec<Record> = bits::ones(&passed.taken.stays).map(|at| records[at as usize]).collect();
    assert!(passed.spool.0.records().ends_with(&stay) && stay.len() < records.len() / 3);
    course.take(Turn::First, passed);
    let next = course.pass(Turn::Strips).run().unwrap();
    course.take(Turn::Strips, next);
    let left = seams.iter().filter(|at| bits::holds(&course.stays, **at)).count();
    assert!(left < seams.len() / 2, "{left} of {}", seams.len());
    assert_eq!(course.survivors, bits::count(&course.stays) as usize);
    let stay: Vec<Record> = bits::ones(&course.stays).map(|at| records[at as usize]).collect();
    assert!(course.current().ends_with(&stay), "what is left of the input is in its order");
}

/// A plane parts a finer torus. After the first pass only triangles around it are more than they are to be: nothing else is touched, no other corner moves, and
/// the count is reached.
#[test]
fn the_second_pass_touches_what_is_near_to_seams_alone() {
    let records = torus(160);
    let profile = Profile { simplify_ratio: 0.2, ..Profile::default() };
    let limits = limits(2, 1 << 30);
    let mut course = course((&records, &Sizes { cell: 25_600, whole: 300 }), &profile, &limits);
    let first = course.pass(Turn::First).run().unwrap();
    course.take(Turn::First, first);
    let (axis, at) = course.plan.as_ref().and_then(|plan| plan.plane(1)).unwrap();
    let before = course.current().len();
    let wanted = simplifying::wanted(&profile, records.len()).unwrap();
    assert!(before > wanted + 300 && before < wanted + 1000, "{before}: seams of two circles of 160 squares are too many");
    assert_eq!(course.next(), Some(Turn::Strips));
    let second = course.pass(Turn::Strips).run().unwrap();
    // The torus is about eight wide.
    let is_far = |record: &Record| record::corners(record).iter().all(|p| (p[axis] - at).abs() > 2.0);
    let far: Vec<usize> = (0..before).filter(|i| is_far(&course.current()[*i])).collect();
    assert!(far.len() > before / 3, "{} of {before}", far.len());
    assert!(far.iter().all(|i| bits::holds(&second.taken.stays, *i)));
    // Corners of no triangle that goes across the plane: they stay where the first pass put them.
    let is_across = |record: &&Record| {
        record::corners(record).iter().any(|p| p[axis] < at) && record::corners(record).iter().any(|p| p[axis] >= at)
    };
    let places = |records: &[Record]| -> BTreeSet<[u32; 3]> {
        records.iter().flat_map(record::corners).map(|p| p.map(f32::to_bits)).collect()
    };
    let across: Vec<Record> = course.current().iter().filter(is_across).copied().collect();
    let stay: Vec<[u32; 3]> = places(course.current()).difference(&places(&across)).copied().collect();
    course.take(Turn::Strips, second);
    let left = places(course.current());
    assert!(stay.len() > 1000 && stay.iter().all(|p| left.contains(p)), "{}", stay.len());
    let after = course.current().len();
    assert!(after <= wanted && after + 60 > wanted, "{after}");
    assert_eq!(course.next(), None);
    assert!(is_closed(&triangles(course.current())));
}

/// Where cells cannot become as small as they were to be, seams alone are not enough, and the next cells lie elsewhere.
#[test]
fn cells_go_on_where_seams_are_not_enough() {
    let records = torus(50);
    let profile = Profile { simplify_ratio: 0.2, simplify_within_mm: 0.002, ..Profile::default() };
    let limits = limits(2, 1 << 30);
    let mut course = course((&records, &SIZES[0]), &profile, &limits);
    let first = course.pass(Turn::First).run().unwrap();
    assert!(first.taken.missed > 300, "{}", first.taken.missed);
    course.take(Turn::First, first);
    assert_eq!(course.next(), Some(Turn::Shifted));
    let told = run(&records, &SIZES[0], &profile, &limits).unwrap().told;
    let Told::Simplified(told) = told else { panic!("another step") };
    assert!(told.to_result.max(told.from_result) <= 0.002 && told.why_not.is_some(), "{told:?}");
}

#[test]
fn what_is_nowhere_is_refused() {
    let mut records = torus(50);
    records[77] = record::encode([[0.0; 3], [1.0; 3], [f32::NAN, 0.0, 0.0]], 0);
    let profile = Profile { simplify_ratio: 0.2, ..Profile::default() };
    assert!(run(&records, &SIZES[0], &profile, &limits(1, 1 << 30)).is_err());
}
