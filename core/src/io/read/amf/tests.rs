//! Whole files, each made here from a few triangles.

use std::path::Path;

use proptest::prelude::*;

use super::intake::WINDOW;
use crate::contract::error::{Error, Result};
use crate::contract::progress::Quiet;
use crate::contract::report::Format;
use crate::contract::settings::Limits;
use crate::io::read::tests::{open, reason, texts};
use crate::io::read::{Loss, MeshFile};
use crate::io::record::{Point, Record, corners, encode};

const POINTS: [Point; 4] = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn vertex([x, y, z]: Point) -> String {
    format!("<vertex><coordinates><x>{x}</x><y>{y}</y><z>{z}</z></coordinates></vertex>")
}

fn triangle([a, b, c]: [usize; 3]) -> String {
    format!("<triangle><v1>{a}</v1><v2>{b}</v2><v3>{c}</v3></triangle>")
}

fn object(id: &str, points: &[Point], faces: &[[usize; 3]]) -> String {
    let vertices: String = points.iter().map(|point| vertex(*point) + "\n").collect();
    let triangles: String = faces.iter().map(|face| triangle(*face) + "\n").collect();
    format!("<object id=\"{id}\"><mesh>\n<vertices>\n{vertices}</vertices>\n<volume>\n{triangles}</volume>\n</mesh></object>\n")
}

fn amf(content: &str) -> String {
    format!("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<amf unit=\"millimeter\" version=\"1.1\">\n{content}</amf>\n")
}

fn tetrahedron() -> String {
    amf(&object("0", &POINTS, &FACES))
}

fn records(points: &[Point], faces: &[[usize; 3]]) -> Vec<Record> {
    faces.iter().map(|face| encode(face.map(|index| points[index]), 0)).collect()
}

fn with_threads(text: &[u8], threads: usize) -> Result<MeshFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.amf");
    std::fs::write(&path, text).unwrap();
    let limits = Limits { threads, ..Limits::default() };
    MeshFile::open(Path::new(&path), folder.path(), &limits, &Quiet)
}

/// The positions of all corners, in order.
fn all_corners(file: &MeshFile) -> Vec<Point> {
    file.records().iter().flat_map(corners).collect()
}

#[test]
fn a_plain_file_is_flawless() {
    let text = tetrahedron().replacen("<object", "<metadata type=\"name\">a &lt;part&gt;</metadata>\n<object", 1);
    let file = open(text.as_bytes()).unwrap();
    assert_eq!((file.format(), texts(&file)), (Format::Amf, vec![]));
    assert_eq!(file.records(), records(&POINTS, &FACES));
    assert!(file.output_header().starts_with(b"a <part>\0"));
    assert!(open(tetrahedron().as_bytes()).unwrap().output_header().starts_with(b"Suture\0"));
}

/// Each form: the text, and what is said about it.
#[test]
fn every_form_gives_the_same_triangles() {
    let plain = tetrahedron();
    let x = "<x>1.5</x>";
    let face = "<v1>0</v1><v2>2</v2><v3>1</v3>";
    let odd = |from: &str, to: &str| {
        assert!(plain.contains(from), "{from}");
        plain.replacen(from, to, 1)
    };
    for text in [
        plain.replace('\n', "\r\n"),
        plain.replace('\n', ""),
        plain.replace("><", ">\n\t<"),
        plain.replace('"', "'"),
        format!("\u{feff}{plain}"),
        format!("<!-- <object> -->\n<?pi <amf?>{}", plain.split_once('\n').unwrap().1),
        odd(x, "<x> 1.5\n</x>"),
        odd(x, "<x>1<!-- 7 -->.5</x>"),
        odd(x, "<x>&#49;.5</x>"),
        odd(x, "<x><![CDATA[1.5]]></x>"),
        odd(x, "<x a=\"</x>\">15e-1</x >"),
        odd("<x>1.5</x><y>0</y>", "<y>0</y><x>1.5</x>"),
        odd("<vertices>", "<vertices><!-- <vertex><coordinates><x>9</x></coordinates></vertex> -->"),
        odd("<vertices>", "<vertices><metadata type=\"vertex\"><vertex/></metadata>"),
        odd("<vertices>", "<vertices>text"),
        odd("</coordinates>", "</coordinates><color><r>1</r><g>0</g><b>0</b></color>"),
        odd("<vertex><coordinates>", "<vertex><metadata/><coordinates><w>5</w>"),
        odd(face, &format!("{face}<color><r>1</r></color>")),
        odd(face, &format!("<texmap rtexid=\"1\"><utex1>0</utex1></texmap>{face}")),
        odd(face, "<v3>1</v3><v2>+2</v2><v1> 00000000000 </v1>"),
        odd("<volume>", "<volume materialid='2'><color/><!-- <triangle> --><metadata type=\"a\">b</metadata>"),
        odd("<volume>", "<volume/><volume>"),
        odd("<mesh>", "<mesh><vertices/>"),
        odd("<object", "<material id=\"2\"><composite materialid=\"3\">x+1</composite></material><texture>AAAA</texture><object"),
        plain.clone() + "<!-- the end -->\n",
    ] {
        let file = open(text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(file.records(), records(&POINTS, &FACES), "{text}");
        let metadata = u64::from(text.contains("<metadata type=\"a\">"));
        assert_eq!(texts(&file).len() as u64, metadata, "{text}");
    }
}

#[test]
fn oddities_are_told() {
    let plain = tetrahedron();
    for (from, to, said, harmless) in [
        ("millimeter", "inch", "unit inch", true),
        ("millimeter", "furlong", "a unit that AMF does not have: furlong", false),
        (
            "</coordinates>",
            "</coordinates><normal><nx>0</nx></normal>",
            "triangles curved by 1 normal and 0 edges, read flat",
            true,
        ),
        ("<vertices>", "<vertices><edge><v1>0</v1></edge>", "triangles curved by 0 normals and 1 edge, read flat", true),
        ("<volume>", "<volume type=\"support\">", "1 volume of support material, read as mesh", true),
        ("</amf>", "</amf> more", "4 bytes behind </amf>, ignored", false),
        ("utf-8", "iso-8859-1", "in the encoding iso-8859-1, not UTF-8", false),
        ("1.5", "1,5", "decimal commas, read as points", false),
    ] {
        assert!(plain.contains(from), "{from}");
        let file = open(plain.replacen(from, to, 1).as_bytes()).unwrap();
        assert_eq!((texts(&file), file.is_flawless()), (vec![said], harmless));
        assert_eq!(file.records(), records(&POINTS, &FACES), "{said}");
    }
}

#[test]
fn a_coordinate_that_is_none_is_nan_and_an_index_that_is_none_leaves_its_triangle_out() {
    for none in ["<x></x>", "", "<x>1.5mm</x>", "<x/>"] {
        let file = open(tetrahedron().replacen("<x>1.5</x>", none, 1).as_bytes()).unwrap();
        assert!(texts(&file)[0].starts_with("1 vertex with a coordinate that is no number"), "{:?}", texts(&file));
        assert!(corners(&file.records()[0])[2][0].is_nan() && corners(&file.records()[2]) == [POINTS[0], POINTS[3], POINTS[2]]);
    }
    for none in ["<v1>4</v1>", "<v1>-1</v1>", "", "<v1>1.0</v1>", "<v1>99999999999999999999</v1>"] {
        let file = open(tetrahedron().replacen("<v1>0</v1>", none, 1).as_bytes()).unwrap();
        assert_eq!(texts(&file), ["1 face refers to vertices that are not there, left out; the first is face 1"]);
        assert_eq!(file.records(), records(&POINTS, &FACES[1..]));
    }
    assert!(
        reason(tetrahedron().replace("<x>", "<x>a").as_bytes()).starts_with("4 vertices with coordinates that are no numbers")
    );
    assert!(reason(tetrahedron().replace("<v1>", "<v1>9").as_bytes()).contains("refer to vertices that are not there"));
}

#[test]
fn whatever_is_not_read_is_refused_in_words() {
    let plain = tetrahedron();
    let body = plain.split_once('\n').unwrap().1;
    for (text, said) in [
        (format!("<!DOCTYPE amf [<!ENTITY a \"b\">]>{body}"), "a declaration of a document type"),
        (plain.replace("1.5", "&a;"), "an entity that is none of XML's own"),
        (plain.replace("utf-8", "utf-16"), "XML in the encoding utf-16, not UTF-8"),
        (plain.replace("</mesh>", "</mash>"), "the end of an element that is not open"),
        (plain.replace("<mesh>", &("<mesh>".to_owned() + &"<a>".repeat(70))), "elements more than 64 deep"),
        (plain.replacen("<vertex>", &("<vertex>".to_owned() + &"<a>".repeat(70)), 1), "elements more than 64 deep"),
        (amf(""), "no triangles"),
        (amf(&object("0", &POINTS, &[])), "no triangles"),
        ("<amf/>".into(), "no triangles"),
        ("<amf>".into(), "cut off before its first triangle"),
    ] {
        let reason = reason(text.as_bytes());
        assert!(reason.contains(said), "{reason}: not {said}");
    }
    let wide: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(reason(&wide).starts_with("UTF-16 text"));
    assert!(reason(&[b"\xff\xfe".as_slice(), &wide].concat()).starts_with("UTF-16 text"));
    for other in ["<?xml version=\"1.0\"?><svg/>", "<!-- <amf> --><model><amf/></model>"] {
        assert!(!reason(other.as_bytes()).contains("triangle, "), "not an AMF: {other}");
    }
}

/// The triangles whose ends lie before the end of the text.
#[test]
fn of_a_file_that_ends_early_all_that_is_complete_counts() {
    let text = tetrahedron();
    let end = text.find("</amf>").unwrap() + "</amf>".len();
    for length in 6..end {
        let part = &text[..length];
        let complete = part.matches("</triangle>").count();
        match open(part.as_bytes()) {
            Ok(file) => {
                assert_eq!(file.records(), records(&POINTS, &FACES[..complete]), "{length}");
                assert!(file.findings().iter().any(|finding| finding.loss == Loss::Certain), "{length}");
            }
            Err(_) => assert_eq!(complete, 0, "{length}"),
        }
    }
    let padded = [&text.as_bytes()[..end - 20], &[0; 5000]].concat();
    assert_eq!(open(&padded).unwrap().records().len(), 4);
    let complete = [text.as_bytes(), &[0; 500]].concat();
    assert_eq!(texts(&open(&complete).unwrap()), ["padded with 500 zero bytes"]);
}

#[test]
fn objects_are_one_mesh_and_indices_are_their_own() {
    let shifted = POINTS.map(|[x, y, z]| [x, y, z + 5.0]);
    let named = object("7", &shifted, &FACES[..2]).replacen("<mesh>", "<metadata type=\"name\">lid</metadata><mesh>", 1);
    // The second object holds its mesh in two parts, each with vertices of its own.
    let two = named.replacen("</mesh>", &format!("</mesh>{}", &object("", &POINTS, &FACES)[14..].replace("</object>\n", "")), 1);
    let file = open(amf(&(object("3", &POINTS, &FACES) + &two)).as_bytes()).unwrap();
    let expected = [records(&POINTS, &FACES), records(&shifted, &FACES[..2]), records(&POINTS, &FACES)].concat();
    assert_eq!(file.records(), expected);
    assert_eq!(texts(&file), ["2 objects (3, lid)"]);
    assert!(file.is_flawless() && file.output_header().starts_with(b"lid\0"));
}

fn instance(of: &str, fields: &[(&str, f64)]) -> String {
    let fields: String = fields.iter().map(|(name, value)| format!("<{name}>{value}</{name}>")).collect();
    format!("<instance objectid=\"{of}\">{fields}</instance>")
}

fn constellation(id: &str, instances: &[String]) -> String {
    format!("<constellation id=\"{id}\">{}</constellation>", instances.concat())
}

/// One triangle.
const FLAT: [Point; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 3.0]];

fn placed(content: &str) -> Vec<Point> {
    all_corners(&open(amf(&(object("o", &FLAT, &[[0, 1, 2]]) + content)).as_bytes()).unwrap())
}

#[test]
fn instances_are_placed_and_objects_they_name_only_so() {
    let shift = |by: f32| FLAT.map(|[x, y, z]| [x + by, y, z]).to_vec();
    let a = constellation("a", &[instance("o", &[("deltax", 10.0)]), instance("o", &[("deltax", 20.0)])]);
    assert_eq!(placed(&a), [shift(10.0), shift(20.0)].concat());
    // Another object, which nothing names, stays; the document's order holds.
    let other = object("p", &FLAT, &[[0, 1, 2]]);
    assert_eq!(placed(&(a.clone() + &other)), [shift(10.0), shift(20.0), shift(0.0)].concat());
    assert_eq!(placed(&(other + &a)), [shift(0.0), shift(10.0), shift(20.0)].concat());
    // Of nested ones only the outer one is printed; b turns around z by 90 degrees, then shifts.
    let b = constellation("b", &[instance("a", &[("rz", 90.0), ("deltaz", 1.0)])]);
    let turned: Vec<Point> = [shift(10.0), shift(20.0)].concat().iter().map(|[x, y, z]| [-y, *x, z + 1.0]).collect();
    assert_eq!(placed(&(a + &b)), turned);
}

#[test]
fn turns_are_around_x_then_y_then_z() {
    let all = constellation("a", &[instance("o", &[("rz", 90.0), ("ry", 90.0), ("rx", 90.0)])]);
    // By hand: (x, y, z), around x (x, -z, y), around y (y, -z, -x), around z (z, y, -x).
    assert_eq!(placed(&all), FLAT.map(|[x, y, z]| [z, y, -x]));
}

#[test]
fn placed_positions_are_rounded_once_and_told() {
    // 0.1 + 2^24 lies nearest to 2^24; through f32 of both it would be the same, so take a shift that shows it: 16777216.9 + 0.2.
    let object = object("o", &FLAT, &[[0, 1, 2]]).replace("<x>1</x>", "<x>16777216.9</x>");
    let text = amf(&(object + &constellation("a", &[instance("o", &[("deltax", 0.2)])])));
    let file = open(text.as_bytes()).unwrap();
    // 16777217.1 is nearer to ...218 than to ...216; rounded twice it would be 16777216 + 0.2 or 16777218 + 0.2.
    assert_eq!(all_corners(&file)[1][0], 16_777_218.0);
    assert!(texts(&file).iter().any(|text| text.starts_with("coordinates finer than 32 bits hold")), "{:?}", texts(&file));
    // A decimal beside the middle of two f32, whose nearest f64 is the middle itself.
    let long = tetrahedron().replace("1.5", "1.000000059604644775390626");
    assert_eq!(all_corners(&open(long.as_bytes()).unwrap())[2][0], 1.0 + f32::EPSILON);
}

#[test]
fn files_of_slic3r_turn_by_radians_and_scale() {
    let maker = "<metadata type=\"cad\">Slic3r 1.3</metadata>";
    let turn = constellation("a", &[instance("o", &[("rz", std::f64::consts::PI), ("scale", 2.0), ("mirrorz", -1.0)])]);
    let found = placed(&(maker.to_owned() + &turn));
    // Mirrored, so that the direction of the triangle is turned, too.
    let expected = [FLAT[0], FLAT[2], FLAT[1]].map(|[x, y, z]| [-2.0 * x, -2.0 * y, -2.0 * z]);
    assert!(found.iter().flatten().zip(expected.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
}

#[test]
fn f14_constellations_without_end_are_refused() {
    let refused = |content: &str, said: &str| {
        let reason = reason(amf(&(object("o", &FLAT, &[[0, 1, 2]]) + content)).as_bytes());
        assert!(reason.contains(said), "{reason}");
    };
    let one = |id: &str, of: &str| constellation(id, &[instance(of, &[])]);
    refused(&one("a", "a"), "contains itself");
    refused(&(one("a", "b") + &one("b", "a")), "contains itself");
    refused(&(one("t", "a") + &one("a", "b") + &one("b", "a")), "contains itself");
    let chain: String = (0..33).map(|k| one(&k.to_string(), &(k + 1).to_string())).collect();
    refused(&chain, "more than 32 deep");
    // 2^21 instances in a few lines, of nothing at all.
    let double =
        |k: i32| constellation(&k.to_string(), &[instance(&(k + 1).to_string(), &[]), instance(&(k + 1).to_string(), &[])]);
    refused(&(0..21).map(double).collect::<String>(), "1 000 000 instances");
    // The deepest that is placed.
    let short: String = (0..31).map(|k| one(&k.to_string(), &(k + 1).to_string())).collect();
    assert_eq!(placed(&(short + &one("31", "o"))), FLAT);
    let lost = open(amf(&(object("o", &FLAT, &[[0, 1, 2]]) + &one("a", "nobody"))).as_bytes()).unwrap();
    assert!(texts(&lost)[0].starts_with("1 instance of objects that are not there"), "{:?}", texts(&lost));
}

#[test]
fn vertices_without_triangles_and_empty_meshes_take_no_time_for_each_instance() {
    let flat = object("o", &FLAT, &[[0, 1, 2]]);
    let loose = vertex([0.1; 3]).repeat(20_000);
    let content = flat.replacen("</vertices>", &format!("{loose}</vertices>"), 1).replacen(
        "<mesh>",
        &("<mesh/>".repeat(20_000) + "<mesh>"),
        1,
    );
    let many = constellation("a", &vec![instance("o", &[("deltax", 1.0)]); 20_000]);
    let file = open(amf(&(content + &many)).as_bytes()).unwrap();
    assert_eq!(file.records().len(), 20_000);
    assert!(file.records().iter().all(|record| corners(record) == FLAT.map(|[x, y, z]| [x + 1.0, y, z])));
    assert_eq!(
        texts(&file),
        ["1 constellation of 20 000 instances: 20 000 objects placed", "1 object (o): their meshes are read as one"]
    );
}

/// Some windows of text, in which comments as long as a hundred vertices hold vertices that are none: guesses of where a child begins go astray.
fn long_text(count: usize) -> (String, Vec<Point>, Vec<[usize; 3]>) {
    let points: Vec<Point> = (0..count).map(|k| [k as f32, (k % 7) as f32, 0.25]).collect();
    let faces: Vec<[usize; 3]> = (2..count).map(|k| [k - 2, k - 1, k]).collect();
    let decoy = format!("<!-- {} -->", vertex([9.0; 3]).repeat(100));
    let other = format!("<metadata>{}</metadata>", "<triangle>x</triangle></volume >".replace("</volume >", "").repeat(40));
    let mut vertices = String::new();
    for (k, point) in points.iter().enumerate() {
        vertices += &vertex(*point);
        vertices += if k % 150 == 0 { &decoy } else { "\n" };
    }
    let mut triangles = String::new();
    for (k, face) in faces.iter().enumerate() {
        triangles += &triangle(*face);
        triangles += if k % 150 == 0 { &other } else { "" };
    }
    let huge = format!("<!--{}-->", " <vertex>".repeat(WINDOW / 3));
    let text = amf(&format!(
        "<object id='0'><mesh><vertices>{vertices}{huge}</vertices><volume>{triangles}</volume><!-- --></mesh></object>"
    ));
    (text, points, faces)
}

#[test]
fn windows_that_begin_in_the_wrong_place_change_nothing() {
    let (text, points, faces) = long_text(40_000);
    assert!(text.len() > 9 * WINDOW);
    let expected = records(&points, &faces);
    for threads in [1, 2, 4] {
        let file = with_threads(text.as_bytes(), threads).unwrap();
        assert!(file.records() == expected, "{threads} threads");
        assert_eq!(
            texts(&file),
            ["267 entries of metadata besides names, which stay in a copy alone"],
            "one in each 150 triangles"
        );
    }
    // The same cut off in the middle of the triangles.
    let part = text.len() - 700_001;
    let complete = text[..part].matches("</v3></triangle>").count();
    for threads in [1, 4] {
        assert!(with_threads(&text.as_bytes()[..part], threads).unwrap().records() == &expected[..complete]);
    }
}

#[test]
fn many_small_objects_keep_their_order() {
    let count = 5_000;
    let text: String =
        (0..count).map(|k| object(&k.to_string(), &FLAT.map(|[x, y, z]| [x + k as f32, y, z]), &[[0, 1, 2]])).collect();
    let file = open(amf(&text).as_bytes()).unwrap();
    assert_eq!(file.records().len(), count);
    assert!(file.records().iter().enumerate().all(|(k, record)| corners(record)[0][0] == k as f32));
    assert_eq!(texts(&file), ["5 000 objects (0, 1, 2, 3, 4, …): their meshes are read as one"]);
}

/// A vertex or triangle in one of several writers' hands, with the same meaning.
fn oddly(style: u8, plain: &str) -> String {
    match style {
        0 => plain.to_owned(),
        1 => plain.replace("><", ">\r\n <"),
        2 => format!("<!-- <vertex> -->{plain}"),
        3 => plain.replacen('>', " a='>'>", 1).replace("</", "<!-- --></"),
        4 => plain.replace("<x>", "<x><![CDATA[").replace("</x>", "]]></x>").replace("<v1>", "<v1>\n").replace("</v1>", " </v1>"),
        5 => plain.replace("</vertex>", "<color><r>0</r></color></vertex>").replace("</triangle>", "<color/></triangle>"),
        _ => format!("{plain}<metadata type=\"m\">&amp;</metadata>"),
    }
}

fn outcome(bytes: &[u8], threads: usize) -> std::result::Result<(Vec<Record>, Vec<String>), String> {
    match with_threads(bytes, threads) {
        Ok(file) => Ok((file.records().to_vec(), texts(&file).into_iter().map(str::to_owned).collect())),
        Err(Error::Unreadable { reason, .. }) => Err(reason),
        Err(other) => Err(format!("{:?}", other.class())),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn a_random_mesh_reads_the_same_in_every_form(
        words in prop::collection::vec(any::<[u32; 3]>(), 3..40),
        picks in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..40),
        styles in prop::collection::vec(0u8..7, 80),
    ) {
        let number = |word: u32| Some(f32::from_bits(word)).filter(|value| value.is_finite()).unwrap_or(0.5);
        let points: Vec<Point> = words.iter().map(|point| point.map(number)).collect();
        let faces: Vec<[usize; 3]> = picks.iter().map(|face| face.map(|pick| pick.index(points.len()))).collect();
        let plain = amf(&object("0", &points, &faces));
        let mut styles = styles.into_iter();
        let mut style = |text: String| oddly(styles.next().unwrap_or(0), &text);
        let vertices: String = points.iter().map(|point| style(vertex(*point))).collect();
        let triangles: String = faces.iter().map(|face| style(triangle(*face))).collect();
        let odd = amf(&format!("<object><mesh><vertices>{vertices}</vertices><volume>{triangles}</volume></mesh></object>"));
        let expected = records(&points, &faces);
        for text in [plain, odd] {
            let file = open(text.as_bytes()).unwrap();
            prop_assert_eq!(file.records(), &expected, "{}", text);
            let told: Vec<_> = texts(&file).into_iter().filter(|text| !text.contains("of metadata besides names")).collect();
            prop_assert_eq!(told, [""; 0]);
        }
    }

    #[test]
    fn f13_any_bytes_in_an_amf_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..300), parts in prop::collection::vec(0usize..12, 0..30)) {
        let words = ["<amf>", "<object>", "<mesh>", "<vertices>", "<vertex>", "</vertices>", "<volume>", "<!--", "<constellation id='a'>",
            "<instance objectid='a'>", "&#x", "]]>"];
        let text: String = parts.iter().map(|part| words[*part]).collect();
        let _ = open(&[b"<amf>".as_slice(), &bytes].concat());
        let _ = open(&[b"<amf>".as_slice(), text.as_bytes(), &bytes].concat());
    }

    #[test]
    fn f13_a_changed_amf_is_survived_and_threads_decide_nothing(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..4), 1..6),
    ) {
        let nested = constellation("a", &[instance("0", &[("rz", 30.0)]), instance("0", &[("deltax", 0.1)])]);
        let mut bytes = amf(&(object("0", &POINTS, &FACES) + &nested)).into_bytes();
        for (place, byte, way) in changes {
            if bytes.is_empty() {
                break;
            }
            let at = place.index(bytes.len());
            match way {
                0 => bytes[at] = byte,
                1 => drop(bytes.remove(at)),
                2 => bytes.insert(at, b"<>/&\"!-]"[usize::from(byte) % 8]),
                _ => bytes.truncate(at.max(1)),
            }
        }
        prop_assert_eq!(outcome(&bytes, 1), outcome(&bytes, 4));
    }
}
