//! Coordinates at the ends of the range of f32: the work on a mesh of them ends in a report that can be written and read, or in an error that
//! says why not.

use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Quiet;
use crate::contract::report::Report;
use crate::contract::settings::Limits;
use crate::contract::settings::Profile;
use crate::testing::{Corners, cube, cuboid, plate, records, reversed, shifted};

/// A report, in words and back.
fn survives_json(result: &Result<Report>) -> std::result::Result<(), TestCaseError> {
    match result {
        Ok(report) => {
            let text = serde_json::to_string(report).map_err(|e| TestCaseError::fail(e.to_string()))?;
            let back: Report = serde_json::from_str(&text).map_err(|e| TestCaseError::fail(format!("{e} in {text}")))?;
            prop_assert_eq!(serde_json::to_string(&back).unwrap_or_default(), text);
        }
        Err(error) => prop_assert!(matches!(error, Error::Refused { .. } | Error::Starved { .. }), "{}", error),
    }
    Ok(())
}

fn both_end_well(triangles: &[Corners]) -> std::result::Result<(), TestCaseError> {
    inspected_and_repaired(triangles)?.iter().try_for_each(survives_json)
}

fn inspected_and_repaired(triangles: &[Corners]) -> std::io::Result<[Result<Report>; 2]> {
    let folder = tempfile::tempdir()?;
    let (input, output) = (folder.path().join("in.stl"), folder.path().join("out.stl"));
    let records = records(triangles);
    std::fs::write(&input, [&[0; 80][..], &(records.len() as u32).to_le_bytes(), records.as_flattened()].concat())?;
    let limits = Limits { threads: 1, memory_bytes: 256 << 20, ..Limits::default() };
    let profile = Profile::default();
    let inspected = crate::inspect(&input, &profile, &limits, &Quiet);
    Ok([inspected, crate::repair(&input, &output, &profile, &limits, &Quiet)])
}

const ENDS: [f32; 10] = [
    f32::MAX,
    -f32::MAX,
    f32::MAX / 2.0,
    1e30,
    f32::MIN_POSITIVE,
    f32::from_bits(1),
    -f32::from_bits(1),
    f32::from_bits(0x007f_ffff),
    -0.0,
    0.0,
];

/// A common sentinel for "no value", in one corner of a cube.
#[test]
fn one_coordinate_of_flt_max_ends_in_a_report() {
    for at in 0..3 {
        for sentinel in [f32::MAX, -f32::MAX] {
            let mut triangles = cube();
            triangles[4][1][at] = sentinel;
            for result in inspected_and_repaired(&triangles).unwrap() {
                survives_json(&result).unwrap();
                assert!(result.is_ok_and(|report| report.tolerances.weld > 0.0), "measured, not refused");
            }
        }
    }
}

/// Whole meshes as large, as small, and as far away as f32 allows: closed, open, inside out and crossing ones.
#[test]
fn meshes_at_the_ends_of_the_range_end_in_a_report() {
    let meshes = [
        cube(),
        reversed(&cube()),
        cube()[1..].to_vec(),
        plate(3, |x, y| (x, y) != (1, 1)),
        [cube(), shifted(&cube(), [0.5; 3])].concat(),
        [cube(), cuboid([0.25; 3], [0.5; 3])].concat(),
        [cube(), plate(3, |x, y| (x, y) != (1, 1))].concat(),
    ];
    for mesh in meshes {
        for size in [f32::MAX / 4.0, 1e30, 1e-30, f32::MIN_POSITIVE, f32::from_bits(8)] {
            for offset in [0.0, f32::MAX / 8.0, -1e9] {
                let placed: Vec<Corners> = mesh.iter().map(|t| t.map(|p| p.map(|x| x * size + offset))).collect();
                both_end_well(&placed).unwrap_or_else(|error| panic!("size {size:e}, offset {offset:e}: {error}"));
            }
        }
    }
}

proptest! {
    /// Some coordinates of a mesh at the ends of the range, beside ordinary ones.
    #[test]
    fn a_report_comes_back_equal_whatever_the_coordinates(
        which in 0usize..4,
        changes in prop::collection::vec((0usize..1000, 0usize..3, 0usize..3, prop::sample::select(&ENDS[..])), 0..8),
        strays in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(prop::sample::select(&ENDS[..]))), 0..4),
        is_whole in any::<bool>(),
    ) {
        let mut mesh = match which {
            0 => cube(),
            1 => cube()[1..].to_vec(),
            2 => plate(4, |x, y| (x, y) != (1, 2)),
            _ => [cube(), shifted(&cube(), [0.5; 3])].concat(),
        };
        for (t, corner, axis, value) in changes {
            let t = t % mesh.len();
            let old = mesh[t][corner];
            let mut new = old;
            new[axis] = value;
            if is_whole {
                // All corners at this position move, so that the surface stays as closed as it was.
                mesh.iter_mut().flatten().filter(|p| **p == old).for_each(|p| *p = new);
            } else {
                mesh[t][corner] = new;
            }
        }
        both_end_well(&[mesh, strays].concat())?;
    }
}
