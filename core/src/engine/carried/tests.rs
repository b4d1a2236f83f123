//! Files that say more than positions and faces, through a repair.

use std::collections::BTreeMap;
use std::fmt::Write;

use proptest::prelude::*;

use super::*;
use crate::contract::progress::Quiet;
use crate::engine::entry::repair;
use crate::io::record::Point;
use crate::testing::{Corners, cube, cuboid, reversed, shifted};

mod rare;
mod stl;

/// A mesh by numbers: positions, and the corners of faces.
#[derive(Clone, Debug, Default)]
struct Mesh {
    points: Vec<Point>,
    faces: Vec<Vec<usize>>,
}

impl Mesh {
    fn of(triangles: &[Corners]) -> Self {
        let (mut numbers, mut mesh) = (BTreeMap::new(), Self::default());
        for triangle in triangles {
            let face = triangle.map(|point| {
                let bits = point.map(f32::to_bits);
                *numbers.entry(bits).or_insert_with(|| {
                    mesh.points.push(point);
                    mesh.points.len() - 1
                })
            });
            mesh.faces.push(face.to_vec());
        }
        mesh
    }
}

/// Linear in the position: so what is cut has to say the same at each place.
fn field([x, y, z]: Point) -> [f32; 2] {
    [0.25 * x + 0.5 * y - 0.125 * z, 0.5 * z - 0.25 * y + 1.0]
}

const RED: u8 = 200;

/// With a field in texture coordinates of its corners, and a material for each face.
fn obj(mesh: &Mesh, material: impl Fn(usize) -> u8) -> String {
    let mut text = "# made by a test\nmtllib part.mtl\no part\n".to_owned();
    for [x, y, z] in &mesh.points {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for [u, v] in mesh.points.iter().map(|point| field(*point)) {
        writeln!(text, "vt {u} {v}").unwrap();
    }
    let mut now = None;
    for (k, face) in mesh.faces.iter().enumerate() {
        let own = material(k);
        if now.replace(own) != Some(own) {
            writeln!(text, "usemtl m{own}").unwrap();
        }
        let corners: String = face.iter().map(|vertex| format!(" {0}/{0}", vertex + 1)).collect();
        writeln!(text, "f{corners}").unwrap();
    }
    text
}

/// A face of an output: the positions, texture coordinates and material.
type Read = (Vec<Point>, Vec<[f32; 2]>, String);

fn read_obj(text: &str) -> Vec<Read> {
    let (mut points, mut texture, mut material, mut faces) = (Vec::new(), Vec::new(), String::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = || words[1..].iter().map(|word| word.parse::<f32>().unwrap());
        match words.first() {
            Some(&"v") => points.push(<[f32; 3]>::try_from(numbers().take(3).collect::<Vec<_>>()).unwrap()),
            Some(&"vt") => texture.push(<[f32; 2]>::try_from(numbers().collect::<Vec<_>>()).unwrap()),
            Some(&"usemtl") => material = words[1].to_owned(),
            Some(&"f") => {
                let corners: Vec<Vec<usize>> =
                    words[1..].iter().map(|word| word.split('/').map(|index| index.parse().unwrap()).collect()).collect();
                let coordinates = corners.iter().filter_map(|corner| corner.get(1)).map(|index| texture[index - 1]).collect();
                faces.push((corners.iter().map(|corner| points[corner[0] - 1]).collect(), coordinates, material.clone()));
            }
            _ => {}
        }
    }
    faces
}

/// How a PLY is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Text,
    Little,
    Big,
}

struct Numbers(Form, Vec<u8>);

impl Numbers {
    fn byte(&mut self, value: u8) {
        if self.0 == Form::Text { self.1.extend(format!("{value} ").bytes()) } else { self.1.push(value) }
    }

    fn float(&mut self, value: f32) {
        match self.0 {
            Form::Text => self.1.extend(format!("{value} ").bytes()),
            Form::Little => self.1.extend(value.to_le_bytes()),
            Form::Big => self.1.extend(value.to_be_bytes()),
        }
    }

    fn index(&mut self, value: usize) {
        match self.0 {
            Form::Text => self.1.extend(format!("{value} ").bytes()),
            Form::Little => self.1.extend((value as i32).to_le_bytes()),
            Form::Big => self.1.extend((value as i32).to_be_bytes()),
        }
    }

    fn end(&mut self) {
        if self.0 == Form::Text {
            self.1.push(b'\n');
        }
    }
}

/// With a field in two properties of its vertices, whose names these are, and a colour and a normal in x for each face.
fn ply(mesh: &Mesh, form: Form, names: [&str; 2], red: impl Fn(usize) -> u8) -> Vec<u8> {
    let word = ["ascii", "binary_little_endian", "binary_big_endian"][form as usize];
    let [u, v] = names;
    let head = format!(
        "ply\nformat {word} 1.0\ncomment TextureFile part.png\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float {u}\nproperty float {v}\nelement face {}\nproperty uchar red\nproperty list uchar int vertex_indices\n\
         property float nx\nend_header\n",
        mesh.points.len(),
        mesh.faces.len()
    );
    let mut numbers = Numbers(form, head.into_bytes());
    for point in &mesh.points {
        point.iter().chain(&field(*point)).for_each(|value| numbers.float(*value));
        numbers.end();
    }
    for (k, face) in mesh.faces.iter().enumerate() {
        numbers.byte(red(k));
        numbers.byte(face.len() as u8);
        face.iter().for_each(|vertex| numbers.index(*vertex));
        numbers.float(0.5);
        numbers.end();
    }
    numbers.1
}

/// A face of a PLY: positions, values of the field, red, and the normal in x.
type Face = (Vec<Point>, Vec<[f32; 2]>, u8, f32);

fn read_ply(bytes: &[u8]) -> Vec<Face> {
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let head = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |name: &str| {
        let line = head.lines().find(|line| line.starts_with(&format!("element {name} "))).unwrap();
        line.rsplit(' ').next().unwrap().parse::<usize>().unwrap()
    };
    let form = if head.contains("ascii") {
        Form::Text
    } else if head.contains("little") {
        Form::Little
    } else {
        Form::Big
    };
    let mut words = std::str::from_utf8(&bytes[end..]).unwrap_or_default().split_whitespace();
    let mut at = end;
    let mut take = |length: usize| {
        at += length;
        let mut own = [0; 4];
        own[..length].copy_from_slice(&bytes[at - length..at]);
        if form == Form::Big {
            own[..length].reverse()
        }
        own
    };
    let float = |text: &mut std::str::SplitWhitespace<'_>, take: &mut dyn FnMut(usize) -> [u8; 4]| match form {
        Form::Text => text.next().unwrap().parse().unwrap(),
        _ => f32::from_le_bytes(take(4)),
    };
    let whole = |text: &mut std::str::SplitWhitespace<'_>, take: &mut dyn FnMut(usize) -> [u8; 4], length| match form {
        Form::Text => text.next().unwrap().parse().unwrap(),
        _ => u32::from_le_bytes(take(length)),
    };
    let vertices: Vec<[f32; 5]> = (0..count("vertex")).map(|_| [(); 5].map(|()| float(&mut words, &mut take))).collect();
    let faces = (0..count("face")).map(|_| {
        let red = whole(&mut words, &mut take, 1);
        let corners = whole(&mut words, &mut take, 1);
        let all: Vec<[f32; 5]> = (0..corners).map(|_| vertices[whole(&mut words, &mut take, 4) as usize]).collect();
        let normal = float(&mut words, &mut take);
        let points = all.iter().map(|[x, y, z, ..]| [*x, *y, *z]).collect();
        (points, all.iter().map(|[.., u, v]| [*u, *v]).collect(), red as u8, normal)
    });
    faces.collect()
}

struct Repaired {
    report: Report,
    output: Vec<u8>,
}

fn repaired(name: &str, bytes: &[u8], profile: &Profile) -> Repaired {
    let folder = tempfile::tempdir().unwrap();
    let [input, output] = ["in", "out"].map(|place| folder.path().join(format!("{place}.{name}")));
    std::fs::write(&input, bytes).unwrap();
    let report = repair(&input, &output, profile, &Limits::default(), &Quiet).unwrap();
    Repaired { report, output: std::fs::read(output).unwrap_or_default() }
}

fn assert_near(point: Point, value: [f32; 2]) {
    for (own, wanted) in value.iter().zip(field(point)) {
        assert!((own - wanted).abs() < 1e-4, "{value:?} at {point:?}, not {:?}", field(point));
    }
}

/// Two cuboids that cross.
fn crossing() -> Vec<Corners> {
    let across = cuboid([-1.0, 0.25, 0.25], [2.0, 0.5, 0.75]);
    [cube(), across].concat()
}

#[test]
fn cut_triangles_say_at_each_place_what_the_whole_one_said() {
    let mesh = Mesh::of(&crossing());
    let result = repaired("obj", obj(&mesh, |k| if k < 12 { RED } else { 5 }).as_bytes(), &Profile::default());
    let faces = read_obj(std::str::from_utf8(&result.output).unwrap());
    assert_eq!(faces.len() as u64, result.report.after.unwrap().triangles);
    for (points, texture, material) in &faces {
        assert_eq!(texture.len(), 3);
        points.iter().zip(texture).for_each(|(point, value)| assert_near(*point, *value));
        let is_of_cube = points.iter().all(|point| point[0] >= 0.0 && point[0] <= 1.0) && material == &format!("m{RED}");
        assert!(is_of_cube || material == "m5", "{points:?} {material}");
    }
    let account = result.report.attributes.unwrap();
    assert_eq!((account.divided > 20, account.approximated, account.inherited), (true, 0, 0), "{account:?}");

    for form in [Form::Text, Form::Little, Form::Big] {
        // With and without places in a texture, where one position may have several.
        for names in [["s", "t"], ["quality", "heat"]] {
            let bytes = ply(&mesh, form, names, |k| if k < 12 { RED } else { 5 });
            let result = repaired("ply", &bytes, &Profile::default());
            let read = read_ply(&result.output);
            assert_eq!(read.len(), faces.len(), "{form:?}");
            for (points, values, red, normal) in read {
                points.iter().zip(values).for_each(|(point, value)| assert_near(*point, value));
                assert!([RED, 5].contains(&red) && normal == 0.5);
            }
        }
    }
}

/// The hole of a cube has three triangles around it: two edges of one face that is red, and others.
#[test]
fn a_new_triangle_says_what_most_of_its_rim_does() {
    let mut mesh = Mesh::of(&cube());
    let gone = mesh.faces.remove(0);
    let touches = |face: &Vec<usize>| face.iter().filter(|vertex| gone.contains(vertex)).count() == 2;
    let of_rim: Vec<usize> = (0..mesh.faces.len()).filter(|k| touches(&mesh.faces[*k])).collect();
    let blue = of_rim[0];
    let text = obj(&mesh, |k| if k == blue { 5 } else { RED });
    let result = repaired("obj", text.as_bytes(), &Profile::default());
    let output = String::from_utf8(result.output).unwrap();
    // The file goes on behind its last line.
    let behind = output.strip_prefix(&text).unwrap();
    assert_eq!(behind.lines().filter(|line| line.starts_with("f ")).count(), 1, "{behind}");
    let faces = read_obj(&output);
    let (points, texture, material) = faces.last().unwrap();
    assert_eq!((material.as_str(), texture.len()), ("m200", 3));
    points.iter().zip(texture).for_each(|(point, value)| assert_near(*point, *value));
    let account = result.report.attributes.unwrap();
    assert_eq!((account.kept, account.inherited, account.lost), (11, 1, 0));

    let bytes = ply(&mesh, Form::Text, ["quality", "heat"], |k| if k == blue { 5 } else { RED });
    let output = repaired("ply", &bytes, &Profile::default()).output;
    assert_eq!(read_ply(&output).last().unwrap().2, RED);
    assert!(String::from_utf8(output).unwrap().contains("\ncomment TextureFile part.png\nelement vertex 8\n"));
}

#[test]
fn a_turned_triangle_keeps_what_its_corners_say() {
    let mut triangles = cube();
    let turned = reversed(&triangles[3..4])[0];
    triangles[3] = turned;
    let mesh = Mesh::of(&triangles);
    let text = obj(&mesh, |k| k as u8);
    let result = repaired("obj", text.as_bytes(), &Profile::default());
    for (k, (points, texture, material)) in read_obj(std::str::from_utf8(&result.output).unwrap()).iter().enumerate() {
        assert_eq!(material, &format!("m{k}"), "each in its place");
        points.iter().zip(texture).for_each(|(point, value)| assert_near(*point, *value));
    }
    assert_eq!(result.report.attributes.unwrap().kept, 12);
    let result = repaired("ply", &ply(&mesh, Form::Big, ["s", "t"], |_| 1), &Profile::default());
    let normals: Vec<f32> = read_ply(&result.output).iter().map(|face| face.3).collect();
    assert_eq!((normals[3], normals.iter().sum::<f32>()), (-0.5, 5.0));
}

/// Six squares, of which one becomes two triangles because one of them is doubled; doubles of 64 bits and words of other elements stay as they are.
#[test]
fn untouched_rows_stay_byte_for_byte() {
    let body = "0.1234567890123 0 0 7\n1 0 0 7\n1 1 0 7\n0 1 0 7\n0 0 1 7\n1 0 1 7\n1 1 1 7\n0 1 1 7\n";
    let faces = ["4 3 2 1 0", "4 4 5 6 7", "4 0 1 5 4", "4 1 2 6 5", "4 2 3 7 6", "4 3 0 4 7", "3 0 1 5"];
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\nproperty int label\n\
         element face 7\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nproperty int b\nend_header\n{body}{}\n0 7\n",
        faces.join("\n")
    );
    let result = repaired("ply", text.as_bytes(), &Profile::default());
    let output = String::from_utf8(result.output).unwrap();
    assert!(output.contains(body) && output.ends_with("\n0 7\n"), "{output}");
    for face in ["4 3 2 1 0", "4 4 5 6 7", "4 1 2 6 5", "4 2 3 7 6", "4 3 0 4 7"] {
        assert!(output.contains(&format!("\n{face}\n")), "{face}: {output}");
    }
    assert!(output.contains("element vertex 8\n") && result.report.outcome.is_good(), "{output}");
    let triangles = output.lines().filter(|line| line.starts_with("3 ")).count();
    assert!(output.contains(&format!("element face {}\n", 5 + output.matches("\n4 0 1 5 4\n").count() + triangles)), "{output}");
}

#[test]
fn an_off_keeps_its_colours() {
    let mut mesh = Mesh::of(&crossing());
    mesh.faces.swap(0, 5);
    let rows = mesh.points.iter().map(|[x, y, z]| format!("{x} {y} {z} 10 {} 30 255\n", 4 * field([*x, *y, *z])[1] as i32 + 100));
    let faces = mesh.faces.iter().enumerate().map(|(k, face)| format!("3 {} {} {} {k} 0 0\n", face[0], face[1], face[2]));
    let rows: String = rows.collect();
    let text = format!("COFF # colours\n{} {} 0\n{rows}{}", mesh.points.len(), mesh.faces.len(), faces.collect::<String>());
    let result = repaired("off", text.as_bytes(), &Profile::default());
    let output = String::from_utf8(result.output).unwrap();
    assert!(output.starts_with("COFF # colours\n") && output.contains(&rows), "{output}");
    let lines: Vec<&str> = output.lines().skip(2).collect();
    let vertices: usize = output.lines().nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(vertices > mesh.points.len());
    for line in &lines[mesh.points.len()..vertices] {
        let words: Vec<&str> = line.split(' ').collect();
        assert_eq!((words.len(), words[3], words[5], words[6]), (7, "10", "30", "255"), "{line}");
        assert!(words[4].parse::<u8>().is_ok(), "{line}");
    }
    assert!(lines[vertices..].iter().all(|line| line.split(' ').count() == 7 && line.ends_with(" 0 0")));
    assert_eq!(result.report.attributes.unwrap().lost, 0);
}

#[test]
fn a_profile_may_refuse_to_lose_what_a_file_says() {
    let mut mesh = Mesh::of(&cube());
    mesh.faces.remove(0);
    let text = obj(&mesh, |_| 1);
    let outcome = |attributes, format| {
        let profile = Profile { attributes, format, ..Profile::default() };
        let result = repaired("obj", text.as_bytes(), &profile);
        (result.report.outcome, result.output.is_empty(), result.report.attributes.unwrap().lost)
    };
    use crate::contract::settings::OutputFormat::{Input, Ply, Stl};
    assert_eq!(outcome(KeepAttributes::Refuse, Input), (Outcome::Repaired, false, 0));
    for other in [Ply, Stl] {
        assert_eq!(outcome(KeepAttributes::Best, other), (Outcome::Repaired, false, 11));
        assert_eq!(outcome(KeepAttributes::Keep, other), (Outcome::NeedsReview, false, 11));
        assert_eq!(outcome(KeepAttributes::Refuse, other), (Outcome::NotGood, true, 11));
    }
}

/// A torus of 2 × 12 × 8 triangles.
fn torus() -> Vec<Corners> {
    let at = |i: u8, j: u8| {
        let [u, v] = [f32::from(i % 12) / 12.0, f32::from(j % 8) / 8.0].map(|turn| turn * std::f32::consts::TAU);
        let from_axis = 4.0 + 1.5 * v.cos();
        [from_axis * u.cos(), from_axis * u.sin(), 1.5 * v.sin()]
    };
    let squares = (0..12).flat_map(|i| (0..8).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
    squares.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// Nothing writes colours into an AMF: so the report says that they are lost.
#[test]
fn an_amf_says_that_colours_are_lost() {
    let Mesh { points, faces } = Mesh::of(&cube()[1..]);
    let vertex = |[x, y, z]: &Point| format!("<vertex><coordinates><x>{x}</x><y>{y}</y><z>{z}</z></coordinates></vertex>");
    let triangle =
        |face: &Vec<usize>| format!("<triangle><v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>", face[0], face[1], face[2]);
    let (vertices, triangles): (String, String) = (points.iter().map(vertex).collect(), faces.iter().map(triangle).collect());
    let plain =
        format!("<amf><object id=\"0\"><mesh><vertices>{vertices}</vertices><volume>{triangles}</volume></mesh></object></amf>");
    let colour = "<color><r>1</r><g>0</g><b>0</b></color>";
    assert_eq!(repaired("amf", plain.as_bytes(), &Profile::default()).report.attributes, None);
    for (before, after) in [
        ("<volume>", "<volume materialid=\"2\">".to_owned()),
        ("<volume>", format!("<volume>{colour}")),
        ("<object id", format!("<material id=\"2\">{colour}</material><object id")),
        ("</vertex>", format!("{colour}</vertex>")),
        ("</triangle>", "<texmap rtexid=\"1\"><utex1>0</utex1></texmap></triangle>".to_owned()),
    ] {
        let text = plain.replacen(before, &after, 1);
        let attributes = repaired("amf", text.as_bytes(), &Profile::default()).report.attributes;
        assert_eq!(attributes.map(|attributes| attributes.lost), Some(11), "{text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn whatever_is_damaged_corners_at_old_places_say_what_they_said(
        fates in prop::collection::vec(0u8..12, 1..64), by in 0.0f32..2.0, form in 0usize..3,
    ) {
        let torus = torus();
        let mut triangles = Vec::new();
        for (k, triangle) in torus.iter().enumerate() {
            match fates[k % fates.len()] {
                0 => {}
                1 => triangles.extend(reversed(&[*triangle])),
                2 => triangles.extend([*triangle, *triangle]),
                _ => triangles.push(*triangle),
            }
        }
        triangles.extend(shifted(&cube(), [by, 0.1, 0.2]));
        let mesh = Mesh::of(&triangles);
        let old: BTreeSet<[u32; 3]> = mesh.points.iter().map(|point| point.map(f32::to_bits)).collect();
        let check = |points: &[Point], values: &[[f32; 2]]| {
            for (point, value) in points.iter().zip(values) {
                if old.contains(&point.map(f32::to_bits)) {
                    assert_near(*point, *value);
                }
            }
        };
        let result = repaired("obj", obj(&mesh, |k| (k % 3) as u8).as_bytes(), &Profile::default());
        for (points, texture, _) in read_obj(std::str::from_utf8(&result.output).unwrap()) {
            check(&points, &texture);
        }
        let form = [Form::Text, Form::Little, Form::Big][form];
        let result = repaired("ply", &ply(&mesh, form, ["quality", "heat"], |k| k as u8), &Profile::default());
        for (points, values, ..) in read_ply(&result.output) {
            check(&points, &values);
        }
    }
}
