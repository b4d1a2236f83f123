//! The promise about panics: no public function panics, whatever it is given.
//!
//! A test here fails when a function panics; what it returns is looked at elsewhere. Each runs a few cases, or for as many seconds as
//! `SUTURE_FUZZ_SECONDS` says, with other cases each time.

#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use serde_json::Value;
use suture_core::operations::{self, Fill, Orient, Union, Wrap};
use suture_core::{Limits, Mesh, MeshView, PatchShape, Profile, Progress, Spill, inspect, inspect_mesh, repair, repair_mesh};

/// Cases of each function if no time is given.
const CASES: u32 = 24;

/// Calls `entry` with what `strategy` makes, for as long as is asked for. Whatever it panics with is told with the smallest input that does it.
fn hold<S: Strategy>(strategy: S, entry: impl Fn(S::Value)) {
    let seconds = std::env::var("SUTURE_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let end = seconds.map(|seconds| Instant::now() + Duration::from_secs(seconds));
    loop {
        let config = Config { cases: CASES, failure_persistence: None, ..Config::default() };
        let result = TestRunner::new(config).run(&strategy, |given| {
            entry(given);
            Ok(())
        });
        if let Err(error) = result {
            panic!("{error}");
        }
        if end.is_none_or(|end| Instant::now() > end) {
            return;
        }
    }
}

/// Coordinates that meet, that nearly meet, and that mean nothing.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        40 => (0i8..4).prop_map(f32::from),
        4 => (0i8..4).prop_map(|x| f32::from(x).next_up()),
        4 => (0u8..=255).prop_map(|x| f32::from(x) / 64.0),
        1 => any::<f32>(),
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -f32::MAX, f32::MIN_POSITIVE, -0.0]),
    ]
}

/// The corners of a box, twice each face.
fn block() -> impl Strategy<Value = Vec<[[f32; 3]; 3]>> {
    let places = (prop::array::uniform3(0u8..4), prop::array::uniform3(1u8..4), any::<bool>(), prop::option::of(0usize..12));
    places.prop_map(|(at, size, turned, lost)| {
        let p = |n: usize| std::array::from_fn(|k| f32::from(at[k] + if n >> k & 1 == 1 { size[k] } else { 0 }));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut faces: Vec<[[f32; 3]; 3]> =
            quads.iter().flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]]).collect();
        lost.into_iter().for_each(|face| {
            faces.remove(face);
        });
        if turned {
            faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        faces
    })
}

/// A few boxes that touch, cross and are inside out or open, and stray triangles.
fn soup() -> impl Strategy<Value = Vec<[[f32; 3]; 3]>> {
    let strays = prop::collection::vec(prop::array::uniform3(prop::array::uniform3(coordinate())), 0..12);
    (prop::collection::vec(block(), 0..4), strays).prop_map(|(blocks, strays)| [blocks.concat(), strays].concat())
}

/// Vertices and faces that fit, or do not.
fn arrays() -> impl Strategy<Value = (Vec<[f32; 3]>, Vec<[u32; 3]>)> {
    let vertices = prop::collection::vec(prop::array::uniform3(coordinate()), 0..20);
    let number = prop_oneof![200 => 0u32..20, 1 => any::<u32>()];
    (vertices, prop::collection::vec(prop::array::uniform3(number), 0..40))
}

fn mesh() -> impl Strategy<Value = Mesh> {
    let indexed = arrays().prop_map(|(vertices, faces)| {
        let count = vertices.len() as u32;
        let fitting = faces.into_iter().filter(|face| face.iter().all(|v| *v < count)).collect();
        Mesh::new(vertices, fitting).unwrap()
    });
    prop_oneof![3 => soup().prop_map(|soup| Mesh::from_triangles(&soup).unwrap()), 1 => indexed]
}

/// Limits that nobody means are limits, too.
fn limits() -> impl Strategy<Value = Limits> {
    let bytes = prop_oneof![4 => Just(1u64 << 30), 1 => 0u64..(64 << 20), 1 => any::<u64>()];
    let chunk = prop_oneof![3 => Just(32u32 << 10), 1 => 0u32..64, 1 => any::<u32>()];
    let spill = prop::sample::select(vec![Spill::Auto, Spill::Never, Spill::Always]);
    (bytes, 0usize..4, chunk, spill, any::<bool>()).prop_map(|(memory_bytes, threads, chunk_triangles, spill, list_edit)| {
        let mut limits = Limits::default().with_memory(memory_bytes).with_spill(spill);
        (limits.threads, limits.chunk_triangles, limits.list_edit) = (threads, chunk_triangles, list_edit);
        limits
    })
}

/// Profiles with one setting or more changed: numbers that mean something, at their ends, and now and then one that does not; switches; every
/// choice. The settings are those that a profile has when it is written down, so that none is forgotten.
fn profile() -> impl Strategy<Value = Profile> {
    let number = prop_oneof![4 => 0.0..1.0f64, 1 => prop::sample::select(vec![0.0, 1.0, 1e-300, 1e300, f64::MAX, -1.0])];
    let count = prop_oneof![Just(20_000u32), 0u32..9, any::<u32>()];
    let change = (any::<prop::sample::Index>(), number, count, any::<prop::sample::Index>());
    let names = prop::sample::select(Profile::BUILT_IN.to_vec());
    (names, prop::collection::vec(change, 0..6), prop::bool::weighted(0.02)).prop_map(|(name, changes, is_nan)| {
        let mut settings = serde_json::to_value(Profile::built_in(name).unwrap()).unwrap();
        for (which, number, count, choice) in changes {
            let all = settings.as_object_mut().unwrap();
            let which = which.index(all.len());
            let (name, value) = all.iter_mut().nth(which).unwrap();
            *value = match &*value {
                Value::Bool(value) => (!value).into(),
                Value::Number(value) if value.is_f64() => number.into(),
                Value::Number(_) => count.into(),
                Value::String(_) if name != "name" => choice.get(&choices(name)).as_str().into(),
                other => other.clone(),
            };
        }
        let mut profile: Profile = serde_json::from_value(settings).unwrap();
        if is_nan {
            // JSON cannot hold it.
            profile.max_volume_change = f64::NAN;
        }
        profile
    })
}

/// The values of a setting that is a choice, as its own error names them.
fn choices(setting: &str) -> Vec<String> {
    let odd = serde_json::from_value::<Profile>(serde_json::json!({ setting: "?" })).unwrap_err().to_string();
    let choices: Vec<_> = odd.split('`').skip(3).step_by(2).map(str::to_owned).collect();
    assert!(choices.len() > 1, "{odd}");
    choices
}

/// Ends the work after so many words about it.
#[derive(Debug)]
struct Patience(AtomicU32);

impl Progress for Patience {
    fn at(&self, _: &'static str, _: u64, _: u64) {
        let _ = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
    }

    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

fn progress() -> impl Strategy<Value = Patience> {
    prop_oneof![9 => Just(u32::MAX), 1 => 1u32..40].prop_map(|words| Patience(AtomicU32::new(words)))
}

/// The bytes of files: meshes, meshes that were cut off or changed, text, and anything.
fn file() -> impl Strategy<Value = Vec<u8>> {
    let binary = soup().prop_map(|soup| {
        let record = |t: &[[f32; 3]; 3]| -> Vec<u8> {
            [0.0f32; 3].iter().chain(t.as_flattened()).flat_map(|x| x.to_le_bytes()).chain([0, 0]).collect()
        };
        [&[0u8; 80][..], &(soup.len() as u32).to_le_bytes(), &soup.iter().flat_map(record).collect::<Vec<_>>()].concat()
    });
    let text = soup().prop_map(|soup| {
        let vertex = |[x, y, z]: &[f32; 3]| format!("vertex {x} {y} {z}\n");
        let facet = |t: &[[f32; 3]; 3]| {
            format!("facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n", t.iter().map(vertex).collect::<String>())
        };
        format!("solid part\n{}endsolid part\n", soup.iter().map(facet).collect::<String>()).into_bytes()
    });
    let meshes = prop_oneof![binary, text];
    let damaged = (
        meshes,
        prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        prop::option::of(any::<prop::sample::Index>()),
    );
    let damaged = damaged.prop_map(|(mut bytes, changes, end)| {
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        end.into_iter().for_each(|end| bytes.truncate(end.index(bytes.len())));
        bytes
    });
    prop_oneof![6 => damaged, 1 => prop::collection::vec(any::<u8>(), 0..400)]
}

#[test]
fn mesh_new() {
    hold(arrays(), |(vertices, faces)| {
        let _ = MeshView::new(&vertices, &faces);
        let _ = Mesh::new(vertices, faces);
    });
}

#[test]
fn mesh_from_triangles() {
    hold(soup(), |soup| drop(Mesh::from_triangles(&soup)));
}

#[test]
fn inspect_mesh_() {
    hold((mesh(), profile(), limits(), progress()), |(mesh, profile, limits, progress)| {
        let _ = inspect_mesh(&mesh, &profile, &limits, &progress);
    });
}

#[test]
fn repair_mesh_() {
    hold((mesh(), profile(), limits(), progress()), |(mesh, profile, limits, progress)| {
        let _ = repair_mesh(&mesh, &profile, &limits, &progress);
    });
}

#[test]
fn operations_find_defects() {
    hold((mesh(), limits(), progress()), |(mesh, limits, progress)| drop(operations::find_defects(&mesh, &limits, &progress)));
}

#[test]
fn operations_find_loops() {
    hold((mesh(), limits(), progress()), |(mesh, limits, progress)| drop(operations::find_loops(&mesh, &limits, &progress)));
}

#[test]
fn operations_find_self_intersections() {
    hold((mesh(), limits(), progress()), |(mesh, limits, progress)| {
        let _ = operations::find_self_intersections(&mesh, &limits, &progress);
    });
}

#[test]
fn operations_certificate() {
    hold((mesh(), limits(), progress()), |(mesh, limits, progress)| drop(operations::certificate(&mesh, &limits, &progress)));
}

#[test]
fn operations_fill() {
    let shape = prop::sample::select(vec![PatchShape::Flat, PatchShape::Fair, PatchShape::Implicit]);
    let place = prop::option::of(prop::array::uniform3(coordinate()));
    let how = (place, shape, prop_oneof![Just(20_000u32), 0u32..9], any::<bool>())
        .prop_map(|(place, shape, edges, sheets)| Fill::default().only_loop(place).shape(shape).max_edges(edges).sheets(sheets));
    hold((mesh(), how, limits(), progress()), |(mesh, how, limits, progress)| {
        let _ = operations::fill(&mesh, &how, &limits, &progress);
    });
}

#[test]
fn operations_orient() {
    hold((mesh(), any::<bool>(), limits(), progress()), |(mesh, by_visibility, limits, progress)| {
        let _ = operations::orient(&mesh, &Orient::default().by_visibility(by_visibility), &limits, &progress);
    });
}

#[test]
fn operations_union() {
    hold((mesh(), any::<[bool; 2]>(), limits(), progress()), |(mesh, [visible, separate], limits, progress)| {
        let _ = operations::union(&mesh, &Union::default().visible_only(visible).separate(separate), &limits, &progress);
    });
}

#[test]
fn operations_wrap() {
    let number = || prop_oneof![3 => 0.0..1.0f64, 1 => any::<f64>()];
    hold((mesh(), number(), number(), limits(), progress()), |(mesh, share, distance, limits, progress)| {
        let _ = operations::wrap(&mesh, &Wrap::default().max_share(share).max_move(distance), &limits, &progress);
    });
}

#[test]
fn inspect_() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.stl");
    hold((file(), profile(), limits(), progress()), |(bytes, profile, limits, progress)| {
        std::fs::write(&input, bytes).unwrap();
        let _ = inspect(&input, &profile, &limits, &progress);
    });
}

#[test]
fn repair_() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.stl"), folder.path().join("out.stl"));
    hold((file(), profile(), limits(), progress()), |(bytes, profile, limits, progress)| {
        std::fs::write(&input, bytes).unwrap();
        let _ = repair(&input, &output, &profile, &limits, &progress);
        let _ = std::fs::remove_file(&output);
    });
}

#[test]
fn profile_validate() {
    hold(profile(), |profile| drop(profile.to_builder().build()));
}

#[test]
fn ends_in_zeros() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.stl");
    hold(file(), |bytes| {
        std::fs::write(&input, bytes).unwrap();
        let _ = suture_core::ends_in_zeros(&std::fs::File::open(&input).unwrap());
    });
}

/// JSON of some curves with numbers of any size; IGES and STEP have fuzz targets of their own.
fn curves() -> impl Strategy<Value = Vec<u8>> {
    let number = prop_oneof![4 => -2.0f64..2.0, 1 => any::<f64>().prop_filter("JSON has no others", |x| x.is_finite())];
    let point = prop::array::uniform3(number.clone());
    let line = prop::array::uniform2(point.clone()).prop_map(|[a, b]| format!("{{\"line\": [{a:?}, {b:?}]}}"));
    let spline = (1usize..5, prop::collection::vec(point, 0..8), prop::collection::vec(number, 0..14))
        .prop_map(|(degree, points, knots)| format!("{{\"degree\": {degree}, \"knots\": {knots:?}, \"points\": {points:?}}}"));
    let all = prop::collection::vec(prop_oneof![3 => line, 1 => spline], 0..8);
    all.prop_map(|all| format!("{{\"unit\": \"mm\", \"curves\": [{}]}}", all.join(", ")).into_bytes())
}

#[test]
fn curves_read_and_loops_find() {
    hold(prop_oneof![file(), curves()], |bytes| {
        let Ok(network) = suture_core::curves::read(&bytes) else { return };
        let mut options = suture_core::curves::loops::Options::default();
        options.closes_gaps = bytes.len().is_multiple_of(2);
        let loops = suture_core::curves::loops::find(&network, &options);
        assert!(loops.loops.iter().all(|own| !own.uses.is_empty()));
        for curve in &network.curves {
            let [low, high] = curve.shape.domain();
            let (point, _) = curve.shape.point_and_derivative(low + (high - low) / 3.0);
            let _ = (curve.shape.length(1e-6), curve.shape.to_spline(), curve.shape.nearest(point));
        }
    });
}
