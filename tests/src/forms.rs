//! Meshes in formats other than STL, written as other programs write them, and read by small readers that know no more than a reader of the
//! formats must.

use std::collections::HashMap;

use crate::stl::Triangle;
use crate::zip;

/// Distinct positions, and for each triangle the numbers of its corners.
pub type Indexed = (Vec<[f32; 3]>, Vec<[usize; 3]>);

/// How a mesh is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    PlyText,
    /// Little-endian.
    PlyBinary,
    /// Big-endian.
    PlyBig,
    Off,
    Obj,
    Amf,
    /// An AMF in an archive.
    PackedAmf,
    /// One object, built once where it is.
    ThreeMf,
}

impl Form {
    pub const ALL: [Self; 8] =
        [Self::PlyText, Self::PlyBinary, Self::PlyBig, Self::Off, Self::Obj, Self::Amf, Self::PackedAmf, Self::ThreeMf];

    /// The ending of its names, which is its name in reports, too.
    pub fn ending(self) -> &'static str {
        match self {
            Self::PlyText | Self::PlyBinary | Self::PlyBig => "ply",
            Self::Off => "off",
            Self::Obj => "obj",
            Self::Amf | Self::PackedAmf => "amf",
            Self::ThreeMf => "3mf",
        }
    }
}

/// Numbers the positions, as they come.
pub fn indexed(triangles: &[Triangle]) -> Indexed {
    let (mut positions, mut numbers) = (Vec::new(), HashMap::new());
    let mut number = |corner: [f32; 3]| {
        *numbers.entry(corner.map(f32::to_bits)).or_insert_with(|| {
            positions.push(corner);
            positions.len() - 1
        })
    };
    let faces = triangles.iter().map(|triangle| triangle.map(&mut number)).collect();
    (positions, faces)
}

/// A file of these triangles. Vertices of PLY, OFF and OBJ are coloured, so that a copy differs from whatever is written anew.
pub fn write(form: Form, triangles: &[Triangle]) -> Vec<u8> {
    let mesh = indexed(triangles);
    match form {
        Form::PlyText | Form::PlyBinary | Form::PlyBig => ply(form, &mesh),
        Form::Off => {
            let vertices = lines(&mesh.0, |[x, y, z]| format!("{x} {y} {z} 200 10 10"));
            let faces = lines(&mesh.1, |[a, b, c]| format!("3 {a} {b} {c}"));
            format!("COFF\n{} {} 0\n{vertices}{faces}", mesh.0.len(), mesh.1.len()).into()
        }
        Form::Obj => {
            let vertices = lines(&mesh.0, |[x, y, z]| format!("v {x} {y} {z} 0.8 0.1 0.1"));
            let faces = lines(&mesh.1, |[a, b, c]| format!("f {} {} {}", a + 1, b + 1, c + 1));
            format!("# a box\n{vertices}{faces}").into()
        }
        Form::Amf => amf(&mesh).into(),
        Form::PackedAmf => zip::write(&[("box.amf", amf(&mesh).as_bytes())], 0),
        Form::ThreeMf => {
            let object = format!("<object id=\"1\" type=\"model\">{}</object>", mesh_of_model(&mesh, |_| String::new()));
            package(&model(&object, "<item objectid=\"1\"/>"), &[])
        }
    }
}

fn lines<T: Copy>(all: &[T], line: impl Fn(T) -> String) -> String {
    all.iter().map(|item| line(*item) + "\n").collect()
}

fn ply(form: Form, (positions, faces): &Indexed) -> Vec<u8> {
    let kind = match form {
        Form::PlyText => "ascii",
        Form::PlyBig => "binary_big_endian",
        _ => "binary_little_endian",
    };
    let mut bytes = format!(
        "ply\nformat {kind} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        positions.len(),
        faces.len()
    )
    .into_bytes();
    if form == Form::PlyText {
        bytes.extend(lines(positions, |[x, y, z]| format!("{x} {y} {z} 200")).bytes());
        bytes.extend(lines(faces, |[a, b, c]| format!("3 {a} {b} {c}")).bytes());
        return bytes;
    }
    let is_big = form == Form::PlyBig;
    for position in positions {
        let numbers = position.map(|x| if is_big { x.to_be_bytes() } else { x.to_le_bytes() });
        bytes.extend(numbers.as_flattened());
        bytes.push(200);
    }
    for face in faces {
        bytes.push(3);
        let numbers = face.map(|k| if is_big { (k as u32).to_be_bytes() } else { (k as u32).to_le_bytes() });
        bytes.extend(numbers.as_flattened());
    }
    bytes
}

fn amf((positions, faces): &Indexed) -> String {
    let vertices =
        lines(positions, |[x, y, z]| format!("<vertex><coordinates><x>{x}</x><y>{y}</y><z>{z}</z></coordinates></vertex>"));
    let triangles = lines(faces, |[a, b, c]| format!("<triangle><v1>{a}</v1><v2>{b}</v2><v3>{c}</v3></triangle>"));
    format!(
        "<?xml version=\"1.0\"?>\n<amf unit=\"millimeter\"><metadata type=\"cad\">a test</metadata><object id=\"1\"><mesh>\n<vertices>\n{vertices}\
         </vertices>\n<volume>\n{triangles}</volume></mesh></object></amf>\n"
    )
}

/// The `<mesh>` of a 3MF object; `more` is what the tag of a triangle has beside its corners, by its number, and begins with a blank.
pub fn mesh_of_model((positions, faces): &Indexed, more: impl Fn(usize) -> String) -> String {
    let vertices = lines(positions, |[x, y, z]| format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>"));
    let tag = |(k, [a, b, c]): (usize, &[usize; 3])| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"{}/>\n", more(k));
    let triangles: String = faces.iter().enumerate().map(tag).collect();
    format!("<mesh>\n<vertices>\n{vertices}</vertices>\n<triangles>\n{triangles}</triangles>\n</mesh>")
}

/// A 3MF model with these objects and this build.
pub fn model(objects: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" \
         xmlns:slic3rpe=\"http://schemas.slic3r.org/3mf/2017/06\">\n<metadata name=\"Title\">A  test</metadata>\n<resources>\n{objects}\n\
         </resources>\n<build>{build}</build>\n</model>\n"
    )
}

/// A 3MF package of this model, with other parts.
pub fn package(model: &str, others: &[(&str, &[u8])]) -> Vec<u8> {
    zip::write(&parts(model, others), 0)
}

/// The parts of such a package.
pub fn parts<'t>(model: &'t str, others: &[(&'t str, &'t [u8])]) -> Vec<(&'t str, &'t [u8])> {
    let types: &[u8] = b"<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
        <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
        <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>";
    let relationships: &[u8] = b"<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship \
        Target=\"/3D/3dmodel.model\" Id=\"rel-1\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let own = [("[Content_Types].xml", types), ("_rels/.rels", relationships), ("3D/3dmodel.model", model.as_bytes())];
    [&own[..], others].concat()
}

/// The triangles of a file whose name has this ending, in its order. A 3MF's are those of all its objects, unplaced.
///
/// # Panics
/// When it is none, or has what these readers do not know.
pub fn read(ending: &str, bytes: &[u8]) -> Vec<Triangle> {
    match ending {
        "ply" => read_ply(bytes),
        "off" => read_off(text(bytes)),
        "obj" => read_obj(text(bytes)),
        "amf" if bytes.starts_with(b"PK") => read("amf", &zip::read(bytes)[0].content),
        "amf" => read_amf(text(bytes)),
        "3mf" => {
            let entries = zip::read(bytes);
            let model = entries.iter().find(|entry| entry.name == "3D/3dmodel.model").expect("a model");
            text(&model.content).split("<object ").skip(1).flat_map(read_object).collect()
        }
        _ => panic!("no reader of {ending}"),
    }
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("a text in UTF-8")
}

/// # Panics
/// When a face refers to a vertex that is not there.
fn joined(positions: &[[f32; 3]], faces: impl IntoIterator<Item = [usize; 3]>) -> Vec<Triangle> {
    faces.into_iter().map(|face| face.map(|k| positions[k])).collect()
}

/// In any form, of vertices of three floats and maybe a byte of colour, and faces of three integers.
fn read_ply(bytes: &[u8]) -> Vec<Triangle> {
    let mark = b"end_header\n";
    let head = bytes.windows(mark.len()).position(|window| window == mark).expect("a header") + mark.len();
    let header = text(&bytes[..head]);
    let is_said = |line: &&str| !["comment", "element", "format", "ply"].iter().any(|word| line.starts_with(word));
    let body: Vec<&str> = header.lines().filter(is_said).filter(|line| *line != "property uchar red").collect();
    assert_eq!(
        body.join("|"),
        "property float x|property float y|property float z|property list uchar int vertex_indices|end_header"
    );
    let is_coloured = header.contains("property uchar red");
    let count = |element: &str| -> usize {
        let line = header.lines().find_map(|line| line.strip_prefix(&format!("element {element} ")));
        line.expect("an element").parse().expect("a count")
    };
    if header.contains("format ascii 1.0\n") {
        let mut lines = text(&bytes[head..]).lines();
        let positions: Vec<[f32; 3]> = lines.by_ref().take(count("vertex")).map(|line| first_three(numbers(line))).collect();
        let faces: Vec<[usize; 3]> = lines.map(|line| three(numbers(line.strip_prefix("3 ").expect("a triangle")))).collect();
        assert_eq!((positions.len(), faces.len()), (count("vertex"), count("face")));
        return joined(&positions, faces);
    }
    let is_big = header.contains("format binary_big_endian 1.0\n");
    assert!(is_big || header.contains("format binary_little_endian 1.0\n"), "{header}");
    let word = |bytes: &[u8]| {
        let bytes = bytes.try_into().expect("four bytes");
        if is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    };
    let row = 12 + usize::from(is_coloured);
    let (positions, faces) = bytes[head..].split_at(row * count("vertex"));
    let positions: Vec<[f32; 3]> =
        positions.chunks(row).map(|row| std::array::from_fn(|k| f32::from_bits(word(&row[4 * k..4 * k + 4])))).collect();
    assert_eq!(faces.len(), 13 * count("face"));
    let faces = faces.chunks(13).map(|row| {
        assert_eq!(row[0], 3, "a triangle");
        std::array::from_fn(|k| word(&row[1 + 4 * k..5 + 4 * k]) as usize)
    });
    joined(&positions, faces)
}

fn read_off(text: &str) -> Vec<Triangle> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    assert!(lines.next().is_some_and(|line| line == "OFF" || line == "COFF"), "a keyword");
    let counts: Vec<usize> = numbers(lines.next().expect("counts"));
    let positions: Vec<[f32; 3]> = lines.by_ref().take(counts[0]).map(|line| first_three(numbers(line))).collect();
    let faces: Vec<[usize; 3]> = lines.map(|line| three(numbers(line.strip_prefix("3 ").expect("a triangle")))).collect();
    assert_eq!((positions.len(), faces.len()), (counts[0], counts[1]));
    joined(&positions, faces)
}

fn read_obj(text: &str) -> Vec<Triangle> {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        match line.split_once(' ') {
            Some(("v", rest)) => positions.push(first_three(numbers(rest))),
            Some(("f", rest)) => faces.push(three(numbers::<usize>(rest)).map(|k: usize| k - 1)),
            _ => panic!("{line}"),
        }
    }
    joined(&positions, faces)
}

fn read_amf(text: &str) -> Vec<Triangle> {
    let values = |names: [&str; 3]| {
        let [first, second, third] = names.map(|name| {
            let start = format!("<{name}>");
            let all = text.split(start.as_str()).skip(1).map(|rest| rest.split('<').next().expect("a value"));
            all.collect::<Vec<_>>()
        });
        assert!(first.len() == second.len() && second.len() == third.len());
        (0..first.len()).map(move |k| [first[k], second[k], third[k]])
    };
    let positions: Vec<[f32; 3]> = values(["x", "y", "z"]).map(|row| row.map(|x| x.parse().expect("a number"))).collect();
    joined(&positions, values(["v1", "v2", "v3"]).map(|row| row.map(|k| k.parse().expect("a number"))))
}

/// The triangles of a 3MF object.
///
/// # Panics
/// When it has no mesh.
pub fn read_object(text: &str) -> Vec<Triangle> {
    let text = text.split("</object>").next().expect("an object");
    let tags = |name: &str| text.split(&format!("<{name} ")).skip(1).collect::<Vec<_>>();
    let positions: Vec<[f32; 3]> =
        tags("vertex").into_iter().map(|tag| ["x", "y", "z"].map(|axis| value(tag, axis).parse().expect("a number"))).collect();
    let faces =
        tags("triangle").into_iter().map(|tag| ["v1", "v2", "v3"].map(|name| value(tag, name).parse().expect("a number")));
    joined(&positions, faces)
}

/// The value of an attribute in what stands behind the name of a tag.
fn value<'t>(tag: &'t str, name: &str) -> &'t str {
    let tag = tag.split('>').next().expect("a tag");
    let rest = tag.split(&format!("{name}=\"")).nth(1).unwrap_or_else(|| panic!("{name} in {tag}"));
    rest.split('"').next().expect("a value")
}

fn numbers<T: std::str::FromStr>(line: &str) -> Vec<T> {
    line.split(' ').map(|word| word.parse().unwrap_or_else(|_| panic!("{line}"))).collect()
}

fn three<T: Copy>(numbers: Vec<T>) -> [T; 3] {
    numbers.try_into().unwrap_or_else(|numbers: Vec<T>| panic!("{} numbers, not three", numbers.len()))
}

/// Those of a position, before its colour.
fn first_three<T: Copy>(mut numbers: Vec<T>) -> [T; 3] {
    numbers.truncate(3);
    three(numbers)
}
