//! Small features of parts, on the built binary: removed below a limit, in any format, and told of.

use std::f64::consts::TAU;

use serde_json::Value;
use suture_tests::Place;
use suture_tests::forms::{self, Form};
use suture_tests::stl::{self, Triangle};

/// Corners of the hole's rim.
const ROUND: usize = 32;
/// Half the width of the plate, and its height.
const HALF: f64 = 20.0;
const HEIGHT: f64 = 4.0;

/// A square plate with a round hole of this radius through its middle.
fn plate(radius: f64) -> Vec<Triangle> {
    let angle = |k: usize| (k % ROUND) as f64 * TAU / ROUND as f64;
    let on = |k: usize, z: f64| [radius * angle(k).cos(), radius * angle(k).sin(), z];
    // In the same direction as the rim's corner, on the square; a corner of the square is one of them.
    let out = |k: usize, z: f64| {
        let [x, y] = [angle(k).cos(), angle(k).sin()];
        let scale = HALF / f64::max(x.abs(), y.abs());
        [x * scale, y * scale, z].map(|x| (x * 1e6).round() / 1e6)
    };
    let mut all = Vec::new();
    let mut quad = |[a, b, c, d]: [[f64; 3]; 4]| {
        all.extend([[a, b, c], [a, c, d]].map(|corners| corners.map(|point| point.map(|x| x as f32))));
    };
    for k in 0..ROUND {
        let n = k + 1;
        quad([on(k, HEIGHT), out(k, HEIGHT), out(n, HEIGHT), on(n, HEIGHT)]);
        quad([on(k, 0.0), on(n, 0.0), out(n, 0.0), out(k, 0.0)]);
        quad([out(k, 0.0), out(n, 0.0), out(n, HEIGHT), out(k, HEIGHT)]);
        quad([on(n, 0.0), on(k, 0.0), on(k, HEIGHT), on(n, HEIGHT)]);
    }
    all
}

fn report(place: &Place) -> Value {
    serde_json::from_slice(&place.read("report.json")).unwrap()
}

fn read(ending: &str, bytes: &[u8]) -> Vec<Triangle> {
    if ending == "stl" { stl::records(bytes).iter().map(stl::corners).collect() } else { forms::read(ending, bytes) }
}

/// The volume that they enclose, exact for such coordinates but for rounding.
fn volume(triangles: &[Triangle]) -> f64 {
    let of = |[a, b, c]: &Triangle| {
        let [[a, b, c], [d, e, f], [g, h, i]] = [a, b, c].map(|point| point.map(f64::from));
        a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    };
    triangles.iter().map(of).sum::<f64>() / 6.0
}

#[test]
fn a_hole_below_the_limit_goes_in_every_format() {
    let place = Place::new();
    let part = plate(3.0);
    for form in [None, Some(Form::PlyBinary), Some(Form::Obj), Some(Form::ThreeMf)] {
        let ending = form.map_or("stl", Form::ending);
        let (input, output) = (format!("part.{ending}"), format!("out.{ending}"));
        place.put(&input, &form.map_or_else(|| stl::mesh(&part), |form| forms::write(form, &part)));
        let options = ["defeature", &input, "-o", &output, "--holes-below", "7", "--report", "report.json", "--force"];
        let said = place.suture(options).expect(0).stdout();
        assert!(said.contains("1 removed, 0 left") && said.contains("through hole of"), "{said}");
        let told = report(&place);
        let hole = &told["features"]["listed"][0];
        assert_eq!((hole["kind"].as_str(), told["outcome"].as_str()), (Some("through-hole"), Some("repaired")), "{told}");
        let size = hole["size"].as_f64().unwrap();
        assert!((size - 6.0).abs() < 0.05, "its diameter is {size}");
        let made = read(ending, &place.read(&output));
        assert!((volume(&made) - 4.0 * HALF * HALF * HEIGHT).abs() < 1e-2, "{}", volume(&made));
        // The outer walls are what they were, to the bit.
        let is_wall = |triangle: &&Triangle| triangle.iter().all(|[x, y, _]| x.abs().max(y.abs()) as f64 == HALF);
        let walls = part.iter().filter(is_wall).filter(|wall| triangle_is_in(wall, &made)).count();
        assert_eq!(walls, 2 * ROUND, "{input}");
    }
}

fn triangle_is_in(one: &Triangle, all: &[Triangle]) -> bool {
    let turns = |[a, b, c]: Triangle| [[a, b, c], [b, c, a], [c, a, b]];
    all.iter().any(|other| turns(*other).contains(one))
}

#[test]
fn a_larger_hole_stays_and_the_file_is_copied() {
    let place = Place::new();
    place.put("part.stl", &stl::mesh(&plate(3.0)));
    place.put("small.toml", b"remove_holes_below_mm = 5.0\n");
    let options = ["repair", "part.stl", "-o", "out.stl", "--profile", "small.toml", "--report", "report.json"];
    let said = place.suture(options).expect(0).stdout();
    assert!(said.contains("clean") && said.contains("0 removed, 0 left"), "{said}");
    assert_eq!((place.read("out.stl") == place.read("part.stl"), report(&place)["outcome"].as_str()), (true, Some("clean")));
    let refused = place.suture(["defeature", "part.stl", "-o", "b.stl"]).expect(2).stderr();
    assert!(refused.contains("--holes-below"), "{refused}");
}

/// A hole in the surface is closed first; then the other hole goes.
#[test]
fn a_broken_part_is_repaired_first_and_the_bytes_are_the_same_for_any_threads() {
    let place = Place::new();
    let mut part = plate(3.0);
    part.remove(4);
    place.put("part.stl", &stl::mesh(&part));
    let made = ["1", "2"].map(|threads| {
        let options = [
            "defeature",
            "part.stl",
            "-o",
            "out.stl",
            "--holes-below",
            "7",
            "--report",
            "report.json",
            "--force",
            "--threads",
            threads,
        ];
        place.suture(options).expect(0);
        let told = report(&place);
        assert_eq!(told["features"]["removed"].as_u64(), Some(1), "{told}");
        let names: Vec<&str> = told["repairs"].as_array().unwrap().iter().filter_map(|repair| repair["name"].as_str()).collect();
        assert!(names.contains(&"fill") && names.last() == Some(&"defeature"), "{names:?}");
        place.read("out.stl")
    });
    assert!(made[0] == made[1]);
    assert!((volume(&read("stl", &made[0])) - 4.0 * HALF * HALF * HEIGHT).abs() < 1e-2);
}
