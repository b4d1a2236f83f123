//! Forms that few programs write: rows that give no triangle, numbers that name nothing, narrow indices, binary OFF.

use super::*;

/// Such a face gives no triangle, and goes; what stands around it is as if it had never been there, whether the mesh is whole or not.
#[test]
fn faces_of_fewer_than_three_corners_cost_nothing_else() {
    for whole in [true, false] {
        let mut mesh = Mesh::of(&cube());
        if !whole {
            mesh.faces.pop();
        }
        let with = |plain: &str, lines: [&str; 2], count: [&str; 2]| {
            let at = plain.match_indices('\n').nth_back(4).unwrap().0 + 1;
            let changed = format!("{}{}{}{}", &plain[..at], lines[0], &plain[at..], lines[1]);
            changed.replacen(count[0], count[1], 1)
        };
        let text = String::from_utf8(ply(&mesh, Form::Text, ["s", "t"], |k| k as u8)).unwrap();
        let count = |faces: usize| format!("element face {faces}\n");
        let short_ply = with(&text, ["7 2 0 1 0.5\n", "8 1 0 0.5\n"], [&count(mesh.faces.len()), &count(mesh.faces.len() + 2)]);
        let obj = obj(&mesh, |k| k as u8);
        let short_obj = with(&obj, ["f 1/1 2/2\n", "f 3\n"], ["", ""]);
        let faces: String = mesh.faces.iter().map(|face| format!("3 {} {} {} 255 0 0\n", face[0], face[1], face[2])).collect();
        let points: String = mesh.points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
        let head = |faces: usize| format!("OFF\n{} {faces} 0\n", mesh.points.len());
        let off = format!("{}{points}{faces}", head(mesh.faces.len()));
        let short_off = with(&off, ["2 0 1 255 0 0\n", "1 0 255 0 0\n"], [&head(mesh.faces.len()), &head(mesh.faces.len() + 2)]);
        for (ending, plain, short) in [("ply", text, short_ply), ("obj", obj, short_obj), ("off", off, short_off)] {
            let [expected, result] = [&plain, &short].map(|text| repaired(ending, text.as_bytes(), &Profile::default()));
            assert_eq!(String::from_utf8(result.output).unwrap(), String::from_utf8(expected.output).unwrap(), "{ending}");
            let attributes = result.report.attributes.unwrap();
            assert_eq!((attributes.kept, attributes.lost), (mesh.faces.len() as u64, 0), "{ending}");
            assert_eq!(result.report.outcome, Outcome::Repaired, "{ending}");
        }
    }
}

/// A form whose rows are not written: its colours are lost, and that is told.
#[test]
fn colours_of_faces_in_a_binary_off_are_told_as_lost() {
    let mesh = Mesh::of(&cube());
    for colours in [0i32, 4] {
        let mut bytes = b"OFF BINARY\n".to_vec();
        [mesh.points.len(), 11, 0].iter().for_each(|count| bytes.extend((*count as i32).to_be_bytes()));
        mesh.points.iter().flatten().for_each(|x| bytes.extend(x.to_be_bytes()));
        for face in &mesh.faces[..11] {
            bytes.extend(3i32.to_be_bytes());
            face.iter().for_each(|vertex| bytes.extend((*vertex as i32).to_be_bytes()));
            bytes.extend(colours.to_be_bytes());
            (0..colours).for_each(|_| bytes.extend(0.5f32.to_be_bytes()));
        }
        let report = repaired("off", &bytes, &Profile::default()).report;
        let lost = if colours == 0 { None } else { Some(11) };
        assert_eq!((report.outcome, report.attributes.map(|own| own.lost)), (Outcome::Repaired, lost));
        let told = report.hints.iter().any(|hint| hint.text == "colours, paint or other attributes of 11 triangles are lost");
        assert_eq!(told, lost.is_some(), "{:?}", report.hints);
        let refuse = Profile { attributes: KeepAttributes::Refuse, ..Profile::default() };
        let outcome = repaired("off", &bytes, &refuse).report.outcome;
        assert_eq!(outcome, if colours == 0 { Outcome::Repaired } else { Outcome::NotGood });
    }
}

/// Found by fuzzing. A row that is new would have the number that faces name in vain, and give them a place in the texture that they never had.
#[test]
fn numbers_of_rows_that_are_not_there_stay_without_a_meaning() {
    let mesh = Mesh::of(&crossing());
    let whole = obj(&mesh, |k| k as u8);
    let rows: Vec<&str> = whole.lines().filter(|line| line.starts_with("vt ")).collect();
    for left in [0, rows.len() - 1] {
        let lines = whole.lines().filter(|line| !rows[left..].contains(line));
        let text: String = lines.map(|line| format!("{line}\n")).collect();
        let result = repaired("obj", text.as_bytes(), &Profile::default());
        let output = String::from_utf8(result.output).unwrap();
        assert!(result.report.outcome.is_good() && result.report.attributes.is_some_and(|own| own.divided > 0));
        assert_eq!(output.matches("\nvt ").count(), left, "{output}");
        assert!(output.starts_with("# made by a test\nmtllib part.mtl\n") && output.matches("usemtl").count() >= 12, "{output}");
    }
}

/// Of 128 vertices, the last one that a signed byte tells apart: where the result has more, it is the same as that of a file with wider indices.
#[test]
fn indices_become_wider_where_vertices_are_new() {
    let apart = (0..14).flat_map(|k| shifted(&cube(), [0.0, 4.0 + 2.0 * k as f32, 0.0]));
    let mesh = Mesh::of(&[crossing(), apart.collect()].concat());
    assert_eq!(mesh.points.len(), 128);
    let file = |form: Form, kind: &str| {
        let wide = ply(&mesh, form, ["s", "t"], |k| k as u8);
        if form == Form::Text {
            return String::from_utf8(wide).unwrap().replace("uchar int vertex", &format!("uchar {kind} vertex")).into_bytes();
        }
        let end = wide.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
        let head = std::str::from_utf8(&wide[..end]).unwrap().replace("uchar int vertex", &format!("uchar {kind} vertex"));
        let faces = end + mesh.points.len() * 20;
        let low = if form == Form::Big { 3 } else { 0 };
        // Red, the count, three indices of four bytes, the normal.
        let narrow = |row: &[u8]| [&row[..2], &[2, 6, 10].map(|at| row[at + low]), &row[14..]].concat();
        [head.as_bytes(), &wide[end..faces], &wide[faces..].chunks(18).flat_map(narrow).collect::<Vec<u8>>()].concat()
    };
    for form in [Form::Text, Form::Little, Form::Big] {
        let wide = repaired("ply", &ply(&mesh, form, ["s", "t"], |k| k as u8), &Profile::default());
        for kind in ["char", "int8"] {
            let narrow = repaired("ply", &file(form, kind), &Profile::default());
            assert!(
                narrow.report.attributes.is_some_and(|own| own.lost == 0 && own.kept > 150),
                "{:?}",
                narrow.report.attributes
            );
            assert_eq!(narrow.output, wide.output);
        }
    }
    // Where they suffice, they stay.
    let mut few = Mesh::of(&cube());
    few.faces.pop();
    let text = String::from_utf8(ply(&few, Form::Text, ["s", "t"], |_| 1)).unwrap().replace("uchar int v", "uchar char v");
    let output = repaired("ply", text.as_bytes(), &Profile::default()).output;
    assert!(String::from_utf8(output).unwrap().contains("uchar char vertex_indices"));
}

/// One of two cubes is inside out. Normals that agree with its faces as they came look against them once they are turned, and others do not.
#[test]
fn normals_that_look_against_a_turned_face_are_told() {
    let far = shifted(&cube(), [5.0, 0.0, 0.0]);
    let mesh = Mesh::of(&[cube(), reversed(&far)].concat());
    let normal = |face: &[usize]| {
        let [a, b, c] = [0, 1, 2].map(|k| mesh.points[face[k]]);
        let ([x, y, z], [u, v, w]) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        [y * w - z * v, z * u - x * w, x * v - y * u]
    };
    for (sign, kept, approximated) in [(1.0, 12, 12), (-1.0, 24, 0)] {
        let signed = |k: usize, face: &[usize]| normal(face).map(|x| if k < 12 { x } else { sign * x });
        let mut text = String::new();
        mesh.points.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
        let all: Vec<Point> = mesh.faces.iter().enumerate().map(|(k, face)| signed(k, face)).collect();
        all.iter().for_each(|[x, y, z]| writeln!(text, "vn {x} {y} {z}").unwrap());
        for (k, face) in mesh.faces.iter().enumerate() {
            let [a, b, c] = [0, 1, 2].map(|j| face[j] + 1);
            writeln!(text, "f {a}//{0} {b}//{0} {c}//{0}", k + 1).unwrap();
        }
        let attributes = repaired("obj", text.as_bytes(), &Profile::default()).report.attributes.unwrap();
        assert_eq!((attributes.kept, attributes.approximated), (kept, approximated), "{sign}");
        // A normal that a face of a PLY says looks where the face looks, however it looked before.
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face 24\n\
             property list uchar int vertex_indices\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n",
            mesh.points.len()
        );
        mesh.points.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
        for (face, [x, y, z]) in mesh.faces.iter().zip(&all) {
            writeln!(text, "3 {} {} {} {x} {y} {z}", face[0], face[1], face[2]).unwrap();
        }
        let output = String::from_utf8(repaired("ply", text.as_bytes(), &Profile::default()).output).unwrap();
        let faces: Vec<Vec<f32>> = output
            .lines()
            .skip_while(|line| *line != "end_header")
            .skip(1 + mesh.points.len())
            .map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect())
            .collect();
        assert_eq!(faces.len(), 24);
        for face in faces {
            let outward = normal(&[face[1] as usize, face[2] as usize, face[3] as usize]);
            assert!(outward.iter().zip(&face[4..]).map(|(x, y)| x * y).sum::<f32>() > 0.0, "{sign}: {face:?}");
        }
    }
}

/// Nothing is lost of a file that says nothing but its mesh, in whatever form.
#[test]
fn plain_files_of_rare_forms_lose_nothing() {
    let mesh = Mesh::of(&cube());
    let mut text = String::from("\u{feff}# plain\r");
    mesh.points.iter().for_each(|[x, y, z]| write!(text, "v {x} {y} {z}\r").unwrap());
    mesh.faces.iter().for_each(|face| write!(text, "f {} {} {}\r", face[0] + 1, face[1] + 1, face[2] + 1).unwrap());
    let profile = Profile { format: crate::OutputFormat::Stl, attributes: KeepAttributes::Refuse, ..Profile::default() };
    let result = repaired("obj", text.as_bytes(), &profile);
    assert_eq!((result.report.outcome, result.report.attributes), (Outcome::Repaired, None), "{:?}", result.report.verdict);
}
