//! Bodies whose walls are known.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::sphere::{Around, Sample};
use super::*;
use crate::contract::progress::Quiet;
use crate::contract::settings::Limits;
use crate::io::record::Record;
use crate::testing::{Corners, cuboid, records, reversed, shifted};

fn limits() -> Limits {
    Limits::default().with_threads(2)
}

fn box_and_area(triangles: &[Corners]) -> (Bounds, f64) {
    let area = |t: &Corners| {
        let [a, b, c] = t.map(place);
        (b - a).cross(c - a).length() / 2.0
    };
    (Bounds::of(triangles.as_flattened()), triangles.iter().map(area).sum())
}

fn measured(triangles: &[Corners], minimum: f64, limits: &Limits) -> Result<ThinWalls, String> {
    let (bounds, area) = box_and_area(triangles);
    let surface = Surface { records: &records(triangles), limits, progress: &Quiet };
    measure(&surface, (&bounds, area), minimum)
}

/// The share of the surface that is thin, and the least thickness; 0 and infinity where nothing is.
fn thin(triangles: &[Corners], minimum: f64) -> (f64, f64) {
    let walls = measured(triangles, minimum, &limits()).unwrap();
    assert_eq!(walls.share > 0.0, !walls.places.is_empty());
    (walls.share, walls.places.first().map_or(f64::INFINITY, |place| place.thickness))
}

fn is_about(value: f64, expected: f64) -> bool {
    (value - expected).abs() < 0.02 * expected
}

/// The surface that an outline in r and z sweeps around the z axis, seen from outside if the outline runs upwards on the outside.
fn turned(outline: &[[f64; 2]], steps: u32) -> Vec<Corners> {
    let at = |[r, z]: [f64; 2], i: u32| {
        let angle = TAU * f64::from(i % steps) / f64::from(steps);
        [(r * angle.cos()) as f32, (r * angle.sin()) as f32, z as f32]
    };
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    let quads = sides.flat_map(|(low, high)| {
        (0..steps).flat_map(move |i| {
            let [a, b, c, d] = [at(*low, i), at(*low, i + 1), at(*high, i + 1), at(*high, i)];
            [[a, b, c], [a, c, d]]
        })
    });
    quads.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

fn ball(radius: f64, steps: u32) -> Vec<Corners> {
    let angle = |i: u32| TAU / 2.0 * (f64::from(i) / f64::from(steps) - 0.5);
    let outline: Vec<[f64; 2]> = (0..=steps).map(|i| [radius * angle(i).cos(), radius * angle(i).sin()]).collect();
    let outline: Vec<[f64; 2]> = outline.into_iter().map(|[r, z]| [if r < 1e-9 { 0.0 } else { r }, z]).collect();
    turned(&outline, 2 * steps)
}

/// A right prism over a triangle in x and y.
fn wedge(angle: f64, length: f64) -> Vec<Corners> {
    let [sin, cos] = [angle.to_radians().sin(), angle.to_radians().cos()];
    let p = |[x, y]: [f64; 2], z: f32| [(x * length) as f32, (y * length) as f32, z];
    let rim = [[0.0, 0.0], [1.0, 0.0], [cos, sin]];
    let [low, high] = [0.0, 20.0].map(|z| rim.map(|q| p(q, z)));
    let ends = [[low[0], low[2], low[1]], high];
    let sides = (0..3).flat_map(|i| {
        let j = (i + 1) % 3;
        [[low[i], low[j], high[j]], [low[i], high[j], high[i]]]
    });
    ends.into_iter().chain(sides).collect()
}

/// Each triangle in four, so often.
fn divided(triangles: &[Corners], times: u32) -> Vec<Corners> {
    let halves = |[a, b, c]: &Corners| {
        let half = |p: &[f32; 3], q: &[f32; 3]| std::array::from_fn(|k| p[k].midpoint(q[k]));
        let [ab, bc, ca] = [half(a, b), half(b, c), half(c, a)];
        [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
    };
    (0..times).fold(triangles.to_vec(), |all, _| all.iter().flat_map(halves).collect())
}

#[test]
fn a_plate_is_as_thin_as_it_is() {
    let plate = cuboid([0.0; 3], [40.0, 30.0, 0.5]);
    for plate in [plate.clone(), divided(&plate, 5)] {
        let (share, thinnest) = thin(&plate, 0.8);
        assert!(is_about(thinnest, 0.5) && (0.9..0.98).contains(&share), "{share}, {thinnest}: all but the rim");
        assert_eq!(thin(&plate, 0.5), (0.0, f64::INFINITY), "it is no thinner");
    }
}

#[test]
fn a_tube_is_as_thin_as_its_wall() {
    let tube = turned(&[[10.0, 0.0], [10.0, 30.0], [9.3, 30.0], [9.3, 0.0]], 128);
    let (share, thinnest) = thin(&tube, 0.8);
    assert!((0.69..0.7).contains(&thinnest) && share > 0.85, "{share}, {thinnest}");
    assert_eq!(thin(&tube, 0.68).0, 0.0);
}

#[test]
fn a_rod_is_thin_and_so_is_a_shell() {
    let rod = turned(&[[0.0, 0.0], [0.25, 0.0], [0.25, 30.0], [0.0, 30.0]], 16);
    let (share, thinnest) = thin(&rod, 0.8);
    assert!((0.4..0.5).contains(&thinnest) && share > 0.9, "{share}, {thinnest}");
    let shell = [ball(10.0, 64), reversed(&ball(9.4, 64))].concat();
    let (share, thinnest) = thin(&shell, 0.8);
    assert!((0.58..0.6).contains(&thinnest) && share > 0.9, "{share}, {thinnest}");
}

#[test]
fn edges_and_thick_bodies_are_no_walls() {
    let nothing = (0.0, f64::INFINITY);
    assert_eq!(thin(&cuboid([0.0; 3], [10.0; 3]), 0.8), nothing);
    assert_eq!(thin(&divided(&cuboid([0.0; 3], [10.0; 3]), 6), 0.8), nothing);
    assert_eq!(thin(&ball(10.0, 64), 0.8), nothing);
    for angle in [25.0, 45.0, 60.0] {
        assert_eq!(thin(&wedge(angle, 10.0), 0.8), nothing, "{angle}°");
        assert_eq!(thin(&divided(&wedge(angle, 10.0), 5), 0.8), nothing, "{angle}°");
    }
    let (share, thinnest) = thin(&wedge(15.0, 10.0), 0.8);
    assert!(share > 0.1 && thinnest < 0.4, "a blade: {share}, {thinnest}");
}

#[test]
fn a_gap_is_no_wall() {
    let cube = cuboid([0.0; 3], [10.0; 3]);
    let two = [cube.clone(), shifted(&cube, [10.2, 0.0, 0.0])].concat();
    assert_eq!(thin(&two, 0.8).0, 0.0);
    // The tip of a wedge close above a plate: what lies behind its other side is no wall of it.
    let plate = cuboid([-20.0, -0.5, 0.0], [20.0, -0.2, 20.0]);
    let [alone, both] = [plate.clone(), [plate, wedge(45.0, 10.0)].concat()].map(|of| thin(&of, 0.8));
    assert!(is_about(alone.1, 0.3) && is_about(both.1, 0.3), "{alone:?}, {both:?}");
}

/// Under the line where two sides of a groove meet there is little left; none of them faces the other side.
#[test]
fn a_groove_leaves_a_thin_wall() {
    let outline = [[-10.0, 0.0], [10.0, 0.0], [10.0, 5.0], [4.6, 5.0], [0.0, 0.4], [-4.6, 5.0], [-10.0, 5.0]];
    let at = |[x, z]: [f64; 2], y: f32| [x as f32, y, z as f32];
    let sides = (0..7).flat_map(|i| {
        let [p, q] = [outline[i], outline[(i + 1) % 7]];
        let [a, b, c, d] = [at(p, 0.0), at(q, 0.0), at(q, 20.0), at(p, 20.0)];
        [[a, b, c], [a, c, d]]
    });
    // Its ends, cut so that all of it is closed.
    let ends = [[0, 1, 4], [1, 2, 3], [1, 3, 4], [0, 4, 5], [0, 5, 6]];
    let ends = ends.iter().flat_map(|t| {
        let [a, b, c] = t.map(|i: usize| outline[i]);
        [[at(a, 0.0), at(c, 0.0), at(b, 0.0)], [at(a, 20.0), at(b, 20.0), at(c, 20.0)]]
    });
    let groove: Vec<Corners> =
        reversed(&sides.collect::<Vec<_>>()).into_iter().chain(reversed(&ends.collect::<Vec<_>>())).collect();
    let (share, thinnest) = thin(&groove, 0.8);
    assert!((0.4..0.45).contains(&thinnest) && (0.0005..0.05).contains(&share), "{share}, {thinnest}");
}

#[test]
fn places_are_thinnest_first_and_apart() {
    let at = |i: u8| shifted(&cuboid([0.0; 3], [20.0, 20.0, 0.3 + 0.05 * f32::from(i)]), [0.0, 0.0, 30.0 * f32::from(i)]);
    let plates: Vec<Corners> = (0..3).flat_map(at).collect();
    let walls = measured(&plates, 0.37, &limits()).unwrap();
    assert_eq!(walls.places.len(), PLACES);
    assert!(walls.places.is_sorted_by(|a, b| a.thickness <= b.thickness), "{walls:?}");
    assert!(walls.places.iter().all(|p| p.at[2] <= 30.35 && p.thickness < 0.37), "{walls:?}");
}

#[test]
fn units_are_the_files() {
    let scaled = |by: f32| {
        divided(&cuboid([0.0; 3], [40.0, 30.0, 0.5]), 3).iter().map(|t| t.map(|p| p.map(|x| x * by))).collect::<Vec<_>>()
    };
    let (share, thinnest) = thin(&scaled(1.0), 0.8);
    for by in [0.0009765625f32, 1024.0] {
        let other = thin(&scaled(by), 0.8 * f64::from(by));
        assert!(is_about(other.1, thinnest * f64::from(by)) && other.0 == share, "by {by}: {other:?}, {share}");
    }
}

#[test]
fn neither_threads_nor_memory_change_it() {
    let shell = [ball(10.0, 64), reversed(&ball(9.4, 64))].concat();
    let first = measured(&shell, 0.8, &limits().with_threads(1)).unwrap();
    for (threads, memory) in [(2, 1 << 30), (4, BYTES), (3, 1 << 40)] {
        assert_eq!(measured(&shell, 0.8, &limits().with_threads(threads).with_memory(memory)), Ok(first.clone()));
    }
}

#[test]
fn what_was_not_looked_for_is_told() {
    let cube = cuboid([0.0; 3], [10.0; 3]);
    let why = measured(&cube, 0.8, &limits().with_memory(BYTES - 1)).unwrap_err();
    assert!(why.contains("memory"), "{why}");
    assert!(measured(&cube, 1e-9, &limits()).is_err());
    // Each of its 800,000 triangles is near each point.
    let why = measured(&divided(&cube, 8), 1e9, &limits()).unwrap_err();
    assert!(why.contains("thin_wall_mm"), "{why}");
    assert_eq!(thin(&cube, 1e300).0, 1.0, "all of a small cube is thinner than that");
}

/// All that is found around each sample when every triangle is looked at.
fn by_force(records: &[Record], samples: &[Sample], most: f64) -> Vec<Option<f64>> {
    let around = |sample: &Sample| {
        let mut around = Around { wall: f64::INFINITY, other: (f64::INFINITY, false), depth: f64::INFINITY };
        for (number, record) in (0..).zip(records) {
            let triangle = crate::geometry::position::corners(record).map(place);
            let [lo, hi] = [triangle[0].min(triangle[1]).min(triangle[2]), triangle[0].max(triangle[1]).max(triangle[2])];
            let is_near = sample.has_ahead(&triangle, &[lo, hi], most);
            let Some(touch) = (number != sample.of && is_near).then(|| sample.touch(&triangle, most)).flatten() else { continue };
            if touch.is_opposite && touch.is_apart {
                around.wall = around.wall.min(touch.diameter);
            } else if !touch.is_opposite && touch.diameter < around.other.0 {
                around.other = (touch.diameter, touch.is_apart);
            }
            around.depth = around.depth.min(touch.depth.unwrap_or(f64::INFINITY));
        }
        around.thickness()
    };
    samples.iter().map(around).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn what_is_near_is_all_that_counts(
        sizes in prop::collection::vec((prop::array::uniform3(0.2f32..3.0), prop::array::uniform3(-4.0f32..4.0), 0u32..3), 1..5),
        minimum in 0.1f64..4.0,
    ) {
        let bodies = sizes.iter().flat_map(|(size, at, times)| shifted(&divided(&cuboid([0.0; 3], *size), *times), *at));
        let triangles: Vec<Corners> = bodies.collect();
        let (bounds, area) = box_and_area(&triangles);
        let (records, limits) = (records(&triangles), limits());
        let surface = Surface { records: &records, limits: &limits, progress: &Quiet };
        let samples = surface.samples(area / 200.0);
        let found = surface.around(&samples, minimum, bounds.diagonal()).unwrap();
        let want = by_force(&records, &samples, minimum);
        for ((found, want), sample) in found.iter().map(Around::thickness).zip(want).zip(&samples) {
            let is_same = match (found, want) {
                (Some(found), Some(want)) => (found - want).abs() <= 1e-12,
                (found, want) => found == want,
            };
            prop_assert!(is_same, "{found:?} instead of {want:?} at {sample:?}");
        }
    }
}
