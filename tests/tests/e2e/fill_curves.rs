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

/// Six lines between four points are a tetrahedron.
#[test]
fn the_edges_of_a_tetrahedron_become_its_faces() {
    let place = Place::new();
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let lines: Vec<Value> = (0..4).flat_map(|a| (a + 1..4).map(move |b| json!({ "line": [corners[a], corners[b]] }))).collect();
    place.put("wire.json", json!({ "unit": "mm", "curves": lines }).to_string().as_bytes());
    let told = told(&place, &["wire.json", "-o", "out.stl"]);
    assert_eq!(
        (told["mesh"]["verdict"]["good"].as_bool(), told["outlines"].as_array().map(Vec::len)),
        (Some(true), Some(4)),
        "{told}"
    );
    assert!((told["mesh"]["before"]["volume"].as_f64().unwrap() - 1.0 / 6.0).abs() < 1e-6, "{told}");
}

/// Two squares that cross each other: both are filled, and the mesh crosses itself, which the exit status says.
#[test]
fn a_mesh_that_crosses_itself_is_not_good() {
    let place = Place::new();
    let square = |corners: [[f64; 3]; 4]| (0..4).map(move |k| json!({ "line": [corners[k], corners[(k + 1) % 4]] }));
    let flat = square([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]);
    let upright = square([[0.0, -0.5, -1.0], [0.0, 0.5, -1.0], [0.0, 0.5, 1.0], [0.0, -0.5, 1.0]]);
    place.put("cross.json", json!({ "unit": "mm", "curves": flat.chain(upright).collect::<Vec<_>>() }).to_string().as_bytes());
    let said = place.suture(["fill-curves", "cross.json", "-o", "out.stl"]).expect(1).stdout();
    assert!(said.contains("self-intersecting"), "{said}");
}

/// A whole sphere has no curve, and half of one has the same curve as a disc: both are what the file says. A face whose surface has no equation and that no
/// curve bounds is named.
#[test]
fn surfaces_that_a_file_says_are_used() {
    let place = Place::new();
    let step = |faces: &str| {
        format!(
            "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=CARTESIAN_POINT('',(0.,0.,0.));\n#2=AXIS2_PLACEMENT_3D('',#1,$,$);\n\
             #3=SPHERICAL_SURFACE('',#2,5.);\n#4=PLANE('',#2);\n#5=CARTESIAN_POINT('',(5.,0.,0.));\n#6=VERTEX_POINT('',#5);\n\
             #7=CIRCLE('',#2,5.);\n#8=EDGE_CURVE('',#6,#6,#7,.T.);\n#9=ORIENTED_EDGE('',*,*,#8,.T.);\n#10=EDGE_LOOP('',(#9));\n\
             #11=FACE_BOUND('',#10,.T.);\n#12=FACE_BOUND('',#10,.F.);\n#13=VERTEX_LOOP('',#6);\n#14=FACE_BOUND('',#13,.T.);\n\
             #15=OFFSET_SURFACE('',#3,1.,.F.);\n{faces}\n\
             #30=(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#31)) REPRESENTATION_CONTEXT('',''));\n\
             #31=(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.));\nENDSEC;\nEND-ISO-10303-21;\n"
        )
    };
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 125.0;
    let whole = "#20=ADVANCED_FACE('',(#14),#3,.T.);\n#21=CLOSED_SHELL('',(#20));\n#22=MANIFOLD_SOLID_BREP('',#21);\n#23=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#22),#30);";
    let half = "#20=ADVANCED_FACE('',(#11),#3,.T.);\n#24=ADVANCED_FACE('',(#12),#4,.F.);\n#21=CLOSED_SHELL('',(#20,#24));\n#22=MANIFOLD_SOLID_BREP('',#21);\n#23=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#22),#30);";
    for (faces, volume) in [(whole, ball), (half, 0.5 * ball)] {
        place.put("ball.stp", step(faces).as_bytes());
        let told = told(&place, &["ball.stp", "-o", "out.stl", "--chord", "0.005"]);
        assert_eq!(told["mesh"]["verdict"]["good"].as_bool(), Some(true), "{told}");
        assert!((told["mesh"]["before"]["volume"].as_f64().unwrap() / volume - 1.0).abs() < 4e-3, "{told}");
    }
    let bare = half
        .replace("#21=CLOSED_SHELL('',(#20,#24))", "#25=ADVANCED_FACE('',(#14),#15,.T.);\n#21=CLOSED_SHELL('',(#20,#24,#25))");
    place.put("bare.stp", step(&bare).as_bytes());
    let said = place.suture(["fill-curves", "bare.stp", "-o", "out.stl", "--force"]).expect(1).stdout();
    assert!(said.contains("#25") && said.contains("OFFSET_SURFACE"), "{said}");
    // Without the surfaces, a circle bounds a disc: the same twice.
    let said =
        place.suture(["fill-curves", "--json", "ball.stp", "-o", "out.stl", "--force", "--curves-alone"]).expect(1).stdout();
    let alone: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(alone["outlines"][0]["method"], "plane", "{alone}");
}
