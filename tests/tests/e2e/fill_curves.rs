//! Curves filled, on the built binary: a mesh that is closed if they are, and surfaces that are read again.

use serde_json::{Value, json};
use suture_bench::judge::judge;
use suture_tests::Place;

/// The twelve edges of a cuboid of these sides.
fn cuboid(sides: [f64; 3]) -> String {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { sides[axis] } else { 0.0 });
    let mut curves = Vec::new();
    for k in 0..8 {
        for axis in 0..3 {
            if k >> axis & 1 == 0 {
                curves.push(json!({ "line": [corner(k), corner(k | 1 << axis)] }));
            }
        }
    }
    json!({ "unit": "mm", "curves": curves }).to_string()
}

fn told(place: &Place, options: &[&str]) -> Value {
    let said = place.suture([&["fill-curves", "--json", "--force"], options].concat()).expect(0).stdout();
    serde_json::from_str(&said).unwrap()
}

#[test]
fn the_edges_of_a_cuboid_become_a_closed_mesh_in_millimetres() {
    let place = Place::new();
    place.put("wire.json", cuboid([2.0, 3.0, 4.0]).as_bytes());
    for output in ["out.stl", "out.3mf", "out.ply"] {
        let told = told(&place, &["wire.json", "-o", output]);
        let mesh = &told["mesh"];
        assert!(mesh["input"]["path"].as_str().unwrap().ends_with(output), "{mesh}");
        assert_eq!((mesh["verdict"]["good"].as_bool(), told["outlines"].as_array().unwrap().len()), (Some(true), 6), "{told}");
        assert!((mesh["before"]["volume"].as_f64().unwrap() - 24.0).abs() < 1e-6, "{mesh}");
    }
    assert!(judge(&place.at("out.stl")).unwrap().sound());
    place.put("inches.json", cuboid([1.0, 1.0, 1.0]).replace("\"mm\"", "\"inch\"").as_bytes());
    let told = told(&place, &["inches.json", "-o", "inch.stl"]);
    assert!((told["mesh"]["before"]["volume"].as_f64().unwrap() / 25.4_f64.powi(3) - 1.0).abs() < 1e-6, "{told}");
}

#[test]
fn surfaces_are_written_and_their_curves_are_read_again() {
    let place = Place::new();
    place.put("wire.json", cuboid([2.0, 3.0, 4.0]).as_bytes());
    for output in ["out.igs", "out.step"] {
        told(&place, &["wire.json", "-o", output]);
        let again: Value = serde_json::from_str(&place.suture(["curves", "--json", output]).expect(0).stdout()).unwrap();
        assert_eq!(again["faces"].as_array().unwrap().len(), 6, "{output}");
        // And filled again they are the same solid.
        let told = told(&place, &[output, "-o", "again.stl"]);
        let mesh = &told["mesh"];
        assert_eq!(mesh["verdict"]["good"].as_bool(), Some(true), "{output}: {mesh}");
        assert!((mesh["before"]["volume"].as_f64().unwrap() - 24.0).abs() < 1e-6, "{output}: {mesh}");
    }
}

#[test]
fn a_square_within_a_square_bounds_a_hole_and_curves_without_a_loop_are_refused() {
    let place = Place::new();
    let ring = |half: f64| {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| [x * half, y * half, 0.0]);
        (0..4).map(move |k| json!({ "line": [corners[k], corners[(k + 1) % 4]] }))
    };
    let text = json!({ "unit": "mm", "curves": ring(2.0).chain(ring(1.0)).collect::<Vec<_>>() }).to_string();
    place.put("frame.json", text.as_bytes());
    let told = told(&place, &["frame.json", "-o", "frame.stl"]);
    assert_eq!((told["outlines"].as_array().unwrap().len(), told["outlines"][0]["inner"].as_array().unwrap().len()), (1, 1));
    assert!((told["mesh"]["before"]["area"].as_f64().unwrap() - 12.0).abs() < 1e-6, "{told}");
    let text = json!({ "unit": "mm", "curves": ring(2.0).take(3).collect::<Vec<_>>() }).to_string();
    place.put("open.json", text.as_bytes());
    let refused = place.suture(["fill-curves", "open.json", "-o", "open.stl"]).expect(2).stderr();
    assert!(refused.contains("no closed loop") && !place.at("open.stl").exists(), "{refused}");
    place.suture(["fill-curves", "open.json", "-o", "open.stl", "--close-gaps", "5"]).expect(0);
}

/// The first ten edges of a cuboid in one file, the last two and a loose one in another, in inches.
#[test]
fn several_files_are_one_network_and_their_picture_stands_beside_the_result() {
    let place = Place::new();
    let all: Value = serde_json::from_str(&cuboid([2.0, 3.0, 4.0])).unwrap();
    let curves = all["curves"].as_array().unwrap();
    let inches = |curve: &Value| {
        let ends = curve["line"].as_array().unwrap().iter();
        let ends = ends.map(|end| end.as_array().unwrap().iter().map(|x| x.as_f64().unwrap() / 25.4).collect::<Vec<_>>());
        json!({ "line": ends.collect::<Vec<_>>() })
    };
    let loose = json!({ "line": [[0.2, 0.2, 0.2], [0.3, 0.2, 0.2]] });
    place.put("first.json", json!({ "unit": "mm", "curves": curves[..10] }).to_string().as_bytes());
    let last: Vec<Value> = curves[10..].iter().map(inches).chain([loose]).collect();
    place.put("last.json", json!({ "unit": "inch", "curves": last }).to_string().as_bytes());
    let told = told(&place, &["first.json", "last.json", "-o", "out.stl", "--picture", "out.png"]);
    assert_eq!(
        (told["mesh"]["verdict"]["good"].as_bool(), told["outlines"].as_array().unwrap().len()),
        (Some(true), 6),
        "{told}"
    );
    assert!((told["mesh"]["before"]["volume"].as_f64().unwrap() - 24.0).abs() < 1e-5, "{told}");
    assert!(std::fs::read(place.at("out.png")).unwrap().starts_with(b"\x89PNG"));
    // An input is never written over, nor is a result by its picture.
    let refused = place.suture(["fill-curves", "first.json", "last.json", "-o", "new.stl", "--picture", "last.json", "--force"]);
    assert!(refused.expect(2).stderr().contains("ends with .png") && !place.at("new.stl").exists());
}
