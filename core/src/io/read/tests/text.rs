//! Text files in every dialect the reader takes.

use proptest::prelude::*;

use super::*;
use crate::io::read::text::WINDOW;
use crate::io::record::{assemble, corners, normal};

/// The tetrahedron's facets as common writers print them.
const FACETS: &str = "  facet normal 0 0 -1
    outer loop
      vertex 0.0 0.0 0.0
      vertex 0.0 1.0 0.0
      vertex 1.0 0.0 0.0
    endloop
  endfacet
  facet normal 0 -1 0
    outer loop
      vertex 0.0 0.0 0.0
      vertex 1.0 0.0 0.0
      vertex 0.0 0.0 1.0
    endloop
  endfacet
  facet normal -1 0 0
    outer loop
      vertex 0.0 0.0 0.0
      vertex 0.0 0.0 1.0
      vertex 0.0 1.0 0.0
    endloop
  endfacet
  facet normal 0.57735026 0.57735026 0.57735026
    outer loop
      vertex 1.0 0.0 0.0
      vertex 0.0 1.0 0.0
      vertex 0.0 0.0 1.0
    endloop
  endfacet
";

pub(super) fn tetrahedron_text() -> String {
    format!("solid a part\n{FACETS}endsolid a part\n")
}

fn tetrahedron_corners() -> Vec<[[f32; 3]; 3]> {
    tetrahedron().iter().map(corners).collect()
}

fn all_corners(file: &MeshFile) -> Vec<[[f32; 3]; 3]> {
    file.records().iter().map(corners).collect()
}

#[test]
fn a_plain_text_file_is_flawless() {
    let text = tetrahedron_text();
    let file = open(text.as_bytes()).unwrap();
    assert_eq!(file.format(), Format::AsciiStl);
    assert_eq!(all_corners(&file), tetrahedron_corners());
    let normals: Vec<_> = file.records().iter().map(normal).collect();
    let third = 0.57735026;
    assert_eq!(normals, [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [third; 3]]);
    assert!(file.records().iter().all(|record| crate::io::record::attribute(record) == 0));
    assert_eq!(texts(&file), [""; 0]);
    assert_eq!(file.bytes(), text.as_bytes());
    assert!(file.output_header().starts_with(b"a part\0"));
}

/// Each dialect: the text, what is said about it, and whether common readers take it as it is.
#[test]
fn every_dialect_gives_the_same_triangles() {
    let plain = tetrahedron_text();
    let two = format!("solid one\n{}endsolid one\nsolid two\n{}endsolid two\n", &FACETS[..half()], &FACETS[half()..]);
    for (text, said, harmless) in [
        (plain.replace('\n', "\r\n"), "CR LF", true),
        (plain.replace('\n', "\r"), "CR alone", false),
        (plain.replace("  ", "\t"), "tabs", true),
        (plain.to_uppercase(), "not in lower case", false),
        (plain.replace("facet", "Facet"), "not in lower case", false),
        (plain.replace('.', ","), "decimal commas", false),
        (format!("\u{feff}{plain}"), "byte order mark", false),
        (plain.replace("endsolid a part\n", ""), "no endsolid", false),
        (two.clone(), "2 solids (one, two)", true),
        (two.replace("endsolid one\n", ""), "1 of 2 solids have no endsolid", false),
        (plain.replace("endfacet\n  facet", "facet"), "3 facets without endfacet", false),
        (FACETS.to_owned(), "does not begin with \"solid\"", false),
        (plain.replace("a part", "a pièce"), "letters beyond ASCII", false),
    ] {
        let file = open(text.as_bytes()).unwrap();
        assert_eq!(all_corners(&file), tetrahedron_corners(), "{said}");
        assert!(texts(&file).iter().any(|text| text.contains(said)), "{said}: {:?}", texts(&file));
        assert_eq!(file.is_flawless(), harmless, "{said}");
    }
    for (text, same) in [
        (format!("\n \t{plain}"), "blanks before solid"),
        (plain.replace('\n', " "), "one line"),
        (plain.replace("endfacet", "end facet").replace("endloop", "end loop").replace("endsolid", "end solid"), "spaced end"),
        (plain.replace("endloop", "endloop G1 X10"), "words after a keyword"),
        (plain.replace("solid a part", "solid facet vertex 1 2 3 endfacet"), "keywords in the name"),
        (plain.replace("solid a part", "solid"), "no name"),
        (format!("{plain}\0\0\0\0"), "zeros at the end"),
    ] {
        let file = open(text.as_bytes()).unwrap();
        assert_eq!(all_corners(&file), tetrahedron_corners(), "{same}");
        assert!(file.findings().iter().all(|finding| finding.harmless), "{same}: {:?}", texts(&file));
    }
}

/// Where the third facet begins.
fn half() -> usize {
    FACETS.match_indices("  facet normal").nth(2).unwrap().0
}

#[test]
fn names_need_not_be_utf8() {
    let mut bytes = tetrahedron_text().into_bytes();
    bytes[6] = 0xe9;
    let file = open(&bytes).unwrap();
    assert_eq!(all_corners(&file), tetrahedron_corners());
    assert!(texts(&file).contains(&"the name of a solid is not UTF-8"), "{:?}", texts(&file));
    assert!(!file.is_flawless());
    assert!(file.output_header().starts_with(b"? part\0"));
}

#[test]
fn headers_made_from_names_are_safe() {
    for (name, header) in [("solid", "model"), ("SOLIDWORKS part", "modelWORKS part"), ("", "Suture"), ("  x", "x")] {
        let file = open(tetrahedron_text().replace("a part", name).as_bytes()).unwrap();
        assert!(file.output_header().starts_with(format!("{header}\0").as_bytes()), "{name}");
    }
    let long = open(tetrahedron_text().replace("a part", &"long".repeat(100)).as_bytes()).unwrap();
    assert_eq!(long.output_header(), "long".repeat(20).as_bytes());
}

#[test]
fn a_polygon_becomes_a_fan() {
    let square =
        "solid s facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 1 1 0 vertex 0 1 0 endloop endfacet endsolid s";
    let file = open(square.as_bytes()).unwrap();
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(file.records(), [assemble([0.0, 0.0, 1.0], [a, b, c], 0), assemble([0.0, 0.0, 1.0], [a, c, d], 0)]);
    assert_eq!(texts(&file), ["1 facet of more than three vertices, cut into triangles"]);
    assert!(!file.is_flawless());
}

#[test]
fn incomplete_facets_are_left_out_and_counted() {
    let short =
        "  facet normal 0 0 1\n outer loop\n vertex 5 5 5\n vertex 6 6 6\n endloop\n endfacet\n facet normal 0 0 1\n endfacet\n";
    let file = open(tetrahedron_text().replace("endsolid", &format!("{short}endsolid")).as_bytes()).unwrap();
    assert_eq!(all_corners(&file), tetrahedron_corners());
    assert_eq!(texts(&file), ["2 facets of fewer than three vertices, left out"]);
}

#[test]
fn numbers_that_are_none_stay_as_nan() {
    let plain = tetrahedron_text();
    let first = plain.find("vertex 0.0 1.0").unwrap();
    for (coordinate, flawless) in
        [("nan", true), ("-1.#IND", true), ("inf", true), ("blah", false), ("1.0.0", false), ("", false)]
    {
        let mut text = plain.clone();
        text.replace_range(first + 7..first + 10, coordinate);
        let file = open(text.as_bytes()).unwrap();
        assert_eq!(all_corners(&file)[1..], tetrahedron_corners()[1..], "{coordinate}: the others are unharmed");
        assert!(!crate::io::record::all_finite(&file.records()[0]), "{coordinate}");
        assert_eq!(file.is_flawless(), flawless, "{coordinate}: {:?}", texts(&file));
    }
    let named = plain.replacen("1.0", "blah", 1);
    assert!(texts(&open(named.as_bytes()).unwrap())[0].ends_with(&format!("the first at byte {}", first + 6)));
    // Half of the four facets may be damaged, not more. The first three have their first vertex at the origin.
    let damaged = |facets| plain.replacen("vertex 0.0 0.0 0.0", "vertex x y z", facets);
    assert_eq!(open(damaged(2).as_bytes()).unwrap().records().len(), 4);
    assert!(reason(damaged(3).as_bytes()).starts_with("3 vertices with coordinates that are no numbers"));
}

#[test]
fn commas_and_points_do_not_mix() {
    let text = tetrahedron_text().replacen("1.0", "1,0", 1);
    assert_eq!(reason(text.as_bytes()), "decimal commas and decimal points are mixed");
    assert!(reason(tetrahedron_text().replace("1.0", "1,234.5").as_bytes()).contains("that are no numbers"));
}

#[test]
fn text_without_triangles_is_refused_in_words() {
    assert_eq!(reason(b"solid nothing\nendsolid nothing\n"), "no triangles");
    assert_eq!(reason(b"solid"), "no triangles");
    assert!(reason("solid advice about nothing in particular\n".repeat(200).as_bytes()).starts_with("text, but not of an STL"));
    let control = tetrahedron_text().replacen("1.0", "1.\x10", 1);
    assert_eq!(reason(control.as_bytes()), "text STL with control characters among its first facets: damaged");
}

#[test]
fn text_without_facets_has_an_end() {
    let text = format!("{}{}", tetrahedron_text(), "chatter ".repeat(WINDOW * 2));
    assert!(reason(text.as_bytes()).contains("without a new facet"));
}

#[test]
fn many_windows_keep_their_order() {
    // Facets that say where they stand, over some windows' length.
    let facet =
        |k: u32| format!("facet normal 0 0 1\nouter loop\nvertex {k} 0 0\nvertex {k} 1 0\nvertex {k} 0 1\nendloop\nendfacet\n");
    let count = 60_000;
    let text = format!("solid long\n{}endsolid\n", (0..count).map(facet).collect::<String>());
    assert!(text.len() > 4 * WINDOW);
    let file = open(text.as_bytes()).unwrap();
    assert_eq!(file.records().len(), count as usize);
    assert!(file.records().iter().enumerate().all(|(k, record)| corners(record)[0][0] == k as f32));
    assert!(file.is_flawless());
}

/// Cancels at once, and remembers the last progress.
struct Impatient(std::sync::atomic::AtomicU64);

impl Progress for Impatient {
    fn at(&self, stage: &'static str, done: u64, total: u64) {
        assert_eq!(stage, "read");
        assert!(done <= total);
        self.0.store(done, std::sync::atomic::Ordering::Relaxed);
    }
    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn reading_text_can_be_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.stl");
    std::fs::write(&path, tetrahedron_text()).unwrap();
    let impatient = Impatient(0.into());
    let error = MeshFile::open(&path, folder.path(), &Limits::default(), &impatient).unwrap_err();
    assert_eq!(error.class(), ErrorClass::Environment);
    assert_eq!(impatient.0.into_inner(), tetrahedron_text().len() as u64);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the spool has no name");
}

/// A triangle in one of several writers' hands.
fn print(style: u8, number: f32) -> String {
    match style {
        0 => format!("{number}"),
        1 => format!("{number:e}"),
        2 => format!("{number:+.8E}"),
        3 => format!("{number:.9e}").replace('e', "D"),
        _ => format!("{number:e}").replace('.', ","),
    }
}

proptest! {
    #[test]
    fn text_gives_the_records_of_the_same_values(
        triangles in prop::collection::vec(any::<[u32; 12]>(), 1..20), style in 0u8..5, crlf: bool, upper: bool,
    ) {
        let end = if crlf { "\r\n" } else { "\n" };
        let mut text = format!("solid s{end}");
        let mut records = Vec::new();
        for words in &triangles {
            let f = words.map(f32::from_bits).map(|f| if f.is_nan() { 0.5 } else { f });
            records.push(assemble([f[0], f[1], f[2]], [[f[3], f[4], f[5]], [f[6], f[7], f[8]], [f[9], f[10], f[11]]], 0));
            let n = f.map(|f| print(style, f));
            text += &format!("facet normal {} {} {}{end} outer loop{end}", n[0], n[1], n[2]);
            for v in n[3..].chunks(3) {
                text += &format!("  vertex {} {} {}{end}", v[0], v[1], v[2]);
            }
            text += &format!(" endloop{end}endfacet{end}");
        }
        text += &format!("endsolid s{end}");
        if upper {
            text = text.to_uppercase();
        }
        let file = open(text.as_bytes()).unwrap();
        prop_assert_eq!(file.records(), &records);
    }
}
