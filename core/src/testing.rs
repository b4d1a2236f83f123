//! Small meshes for the tests, and the way of one repair from triangles to what would be written.

use std::path::Path;

use proptest::prelude::*;

use crate::contract::progress::Quiet;
use crate::contract::report::{Defects, Verdict};
use crate::contract::settings::{Limits, Profile};
use crate::diagnosis::Diagnosis;
use crate::io::record::{self, Record};
use crate::output::edit::{Edit, Step};
use crate::output::incremental;
use crate::output::readback::Expectation;
use crate::submesh::components::Reversed;
use crate::topology::survey::Survey;

/// A triangle by its positions.
pub(crate) type Corners = [[f32; 3]; 3];

pub(crate) fn records(triangles: &[Corners]) -> Vec<Record> {
    triangles.iter().map(|t| record::encode(*t, 0)).collect()
}

/// Twelve triangles seen from outside: two each for low z, high z, low y, high y, low x, high x.
pub(crate) fn cuboid(lo: [f32; 3], hi: [f32; 3]) -> Vec<Corners> {
    // Corner numbers are bits x, y, z.
    let p = |n: usize| std::array::from_fn(|k| if n >> k & 1 == 1 { hi[k] } else { lo[k] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads.iter().flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]]).collect()
}

/// The cube from the origin to (1, 1, 1).
pub(crate) fn cube() -> Vec<Corners> {
    cuboid([0.0; 3], [1.0; 3])
}

/// The unit squares (x, y) of a side × side grid at z = 0 that `keep` wants, facing up, two triangles each.
pub(crate) fn plate(side: u8, keep: impl Fn(u8, u8) -> bool) -> Vec<Corners> {
    let p = |x: u8, y: u8| [f32::from(x), f32::from(y), 0.0];
    (0..side)
        .flat_map(|x| (0..side).map(move |y| (x, y)))
        .filter(|(x, y)| keep(*x, *y))
        .flat_map(|(x, y)| [[p(x, y), p(x + 1, y), p(x + 1, y + 1)], [p(x, y), p(x + 1, y + 1), p(x, y + 1)]])
        .collect()
}

/// The same triangles by this much farther on.
pub(crate) fn shifted(triangles: &[Corners], by: [f32; 3]) -> Vec<Corners> {
    triangles.iter().map(|t| t.map(|p| std::array::from_fn(|k| p[k] + by[k]))).collect()
}

/// The same triangles seen from the other side.
pub(crate) fn reversed(triangles: &[Corners]) -> Vec<Corners> {
    triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

pub(crate) fn diagnose(records: &[Record]) -> Diagnosis<'_> {
    let limits = Limits { threads: 1, ..Limits::default() };
    Diagnosis::of(Path::new("test"), records, &Profile::default(), &limits, &Quiet).unwrap()
}

/// What a repair returned, and what its edit makes of the file.
pub(crate) struct After<R> {
    pub(crate) result: R,
    pub(crate) defects: Defects,
    pub(crate) verdict: Verdict,
    pub(crate) untouched: u64,
}

/// Runs one repair on these triangles, writes its edit and counts again, as the engine does.
pub(crate) fn after<R>(triangles: &[Corners], repair: impl FnOnce(&mut Diagnosis<'_>, &mut Reversed) -> R) -> After<R> {
    let input = records(triangles);
    let mut diagnosis = diagnose(&input);
    let mut turned = Reversed::none(&diagnosis.survey);
    let result = repair(&mut diagnosis, &mut turned);
    let edit = Edit::of(&diagnosis.survey, &diagnosis.submesh, &turned, &[]);
    let defects = diagnose(&written(&edit, &input)).defects;
    check_second_look(diagnosis.survey, &edit, &defects);
    let verdict = crate::detect::verdict::judge(&defects, &[]);
    After { result, defects, verdict, untouched: edit.summary(input.len()).untouched }
}

/// The second look by the difference, if it comes to anything, must find what a look at everything finds. Says if it came to anything.
pub(crate) fn check_second_look(survey: Survey<'_>, edit: &Edit, anew: &Defects) -> bool {
    let difference = Expectation::of(survey.records, edit).difference;
    let Some((survey, submesh)) = incremental::look(survey, &difference) else { return false };
    let mut defects = Diagnosis::count(survey, submesh, &Profile::default()).defects;
    // Sums are rounded by the box they are taken in, which may be another.
    for (got, want) in [(&mut defects.area, anew.area), (&mut defects.volume, anew.volume)] {
        assert!((*got - want).abs() <= 1e-9 * (1.0 + want.abs()), "{got} instead of {want}");
        *got = want;
    }
    assert_eq!(&defects, anew);
    true
}

/// The records that an edit makes of the input.
pub(crate) fn written(edit: &Edit, input: &[Record]) -> Vec<Record> {
    let mut output = Vec::new();
    let walked: Result<(), ()> = edit.walk(input, |step| {
        match step {
            Step::Untouched(run) => output.extend_from_slice(run),
            Step::Changed(_, record, _) => output.push(record),
            Step::Deleted(_) => {}
            Step::Added(record, _) => output.push(*record),
        }
        Ok(())
    });
    walked.unwrap();
    output
}

/// Unit cubes on a grid, which touch and overlap, and stray triangles: regular and irregular stars side by side.
pub(crate) fn soup() -> impl Strategy<Value = Vec<Corners>> {
    let cubes = prop::collection::vec(prop::array::uniform3(0u8..4), 0..5);
    let coordinate = prop_oneof![60 => (0u8..5).prop_map(f32::from), 1 => Just(f32::NAN)];
    let strays = prop::collection::vec(prop::array::uniform3(prop::array::uniform3(coordinate)), 0..8);
    (cubes, strays)
        .prop_map(|(cubes, strays)| {
            let cube = |at: &[u8; 3]| cuboid(at.map(f32::from), at.map(|x| f32::from(x + 1)));
            cubes.iter().flat_map(cube).chain(strays).collect::<Vec<_>>()
        })
        .prop_shuffle()
}

/// A torus of 2 × 384 × 176 triangles, of which no two share a position: each corner lies up to `jitter` beside its place.
pub(crate) fn shaken_torus(jitter: f32) -> Vec<Corners> {
    let (around, across) = (384usize, 176usize);
    let at = |i: usize, j: usize| {
        let turn = |k: usize, of: usize| (k % of) as f64 / of as f64 * std::f64::consts::TAU;
        let ((u, v), wide) = ((turn(i, around), turn(j, across)), 20.0);
        let from_axis = wide + 8.0 * v.cos();
        [(from_axis * u.cos()) as f32, (from_axis * u.sin()) as f32, (8.0 * v.sin()) as f32]
    };
    let mut number = 0;
    let mut shaken = |x: f32| {
        number += 1;
        x + jitter * (2.0 * crate::util::scatter::share(number) as f32 - 1.0)
    };
    let mut all = Vec::new();
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        all.extend([[a, b, c], [a, c, d]].map(|t| t.map(|p| p.map(&mut shaken))));
    }
    all
}
