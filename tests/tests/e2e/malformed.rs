//! Files that are odd as files: each is read for what it is, its oddity is named, and what is written is flawless.

use serde_json::Value;
use suture_bench::judge::judge;
use suture_tests::stl::{self, Record, Triangle, record, unit_normal};
use suture_tests::{Place, Ran};

/// A box, closed.
fn solid_box() -> Vec<Triangle> {
    stl::cuboid([0.0, 0.5, -1.25], [10.0, 20.5, 30.75])
}

/// The same without its last triangle: something to repair, so that a result is written whatever the finding.
fn open_box() -> Vec<Triangle> {
    let mut triangles = solid_box();
    triangles.pop();
    triangles
}

fn records(triangles: &[Triangle]) -> Vec<Record> {
    triangles.iter().map(|t| record(unit_normal(t), t, 0)).collect()
}

/// Repairs the bytes, which must succeed with a sound result; returns report and output.
fn mended(bytes: &[u8]) -> (Value, Vec<u8>) {
    let place = Place::new();
    place.put("in.stl", bytes);
    let report = place.repair("in.stl", "out.stl", &["--list-edit"]).expect(0).report();
    let judged = judge(&place.at("out.stl")).unwrap();
    assert!(judged.sound() && judged.nonfinite == 0 && judged.negative_bodies == 0, "{judged:?}");
    (report, place.read("out.stl"))
}

fn refused(bytes: &[u8]) -> Ran {
    let place = Place::new();
    place.put("in.stl", bytes);
    let ran = place.suture(["repair", "in.stl", "-o", "out.stl"]).expect(2);
    assert_eq!(ran.stderr().lines().count(), 1, "{}", ran.stderr());
    assert_eq!(place.names(""), ["in.stl"]);
    ran
}

fn findings(report: &Value) -> String {
    report["input"]["findings"].to_string()
}

/// The closed box in odd wrapping: the finding is named, the verdict on the input is not "good", and the output holds exactly its
/// records.
fn closed_box_in(bytes: &[u8], words: &[&str]) -> Vec<u8> {
    let (report, out) = mended(bytes);
    let said = findings(&report);
    words.iter().for_each(|word| assert!(said.contains(word), "{said} does not say {word:?}"));
    assert_eq!(report["outcome"], "repaired");
    assert_eq!(stl::records(&out), records(&solid_box()));
    assert_eq!(report["edit"]["untouched"], 12);
    out
}

fn with_count(count: u32, records: &[Record]) -> Vec<u8> {
    let mut bytes = stl::file(b"a box", records);
    bytes[80..84].copy_from_slice(&count.to_le_bytes());
    bytes
}

#[test]
fn header_that_begins_with_solid() {
    for begin in ["solid", "SOLID", "  solid"] {
        let header = format!("{begin} box, exported by something that should know better");
        let out = closed_box_in(&stl::file(header.as_bytes(), &records(&solid_box())), &["solid"]);
        assert!(!out[..80].trim_ascii_start().to_ascii_lowercase().starts_with(b"solid"));
        // Nothing but the word changes.
        let kept = begin.len()..header.len();
        assert_eq!(out[kept.clone()], header.as_bytes()[kept]);
    }
}

#[test]
fn f14_count_left_open() {
    for count in [0, u32::MAX] {
        closed_box_in(&with_count(count, &records(&solid_box())), &["count", "12"]);
    }
}

#[test]
fn f14_count_too_large_or_too_small() {
    closed_box_in(&with_count(100, &records(&solid_box())), &["100", "12"]);
    closed_box_in(&with_count(10, &records(&solid_box())), &["10", "12"]);
}

#[test]
fn bytes_after_the_last_triangle() {
    for tail in [&b"x"[..], b"made by an exporter that signs its files, with more than a record's worth of words"] {
        let bytes = [stl::file(b"a box", &records(&solid_box())), tail.to_vec()].concat();
        closed_box_in(&bytes, &[&tail.len().to_string(), "after the last"]);
    }
}

#[test]
fn cut_off_within_a_record() {
    let whole = stl::file(b"a box", &records(&solid_box()));
    let (report, out) = mended(&whole[..whole.len() - 20]);
    let said = findings(&report);
    assert!(said.contains("cut off") && said.contains("30 bytes"), "{said}");
    // The record that was cut is a hole, which is filled.
    assert_eq!(stl::records(&out)[..11], records(&open_box()));
    assert_eq!(stl::records(&out).len(), 12);
}

#[test]
fn a_part_is_missing() {
    let whole = stl::file(b"a box", &records(&solid_box()));
    // A count that is wrong on a closed mesh loses nothing; four of twelve triangles do.
    let place = Place::new();
    place.put("in.stl", &whole[..whole.len() - 200]);
    let report = place.repair("in.stl", "out.stl", &[]).expect(1).report();
    assert_eq!(report["outcome"], "needs_review");
    assert!(report["verdict"]["reasons"].to_string().contains("a part is missing"));
}

#[test]
fn coordinates_that_are_no_numbers() {
    let mut all = records(&solid_box());
    for (at, bad) in [(3, f32::NAN), (7, f32::INFINITY), (14, f32::NEG_INFINITY)] {
        all.insert(at, record([0.0; 3], &[[0.0; 3], [1.0, bad, 1.0], [2.0; 3]], 0));
    }
    let (report, out) = mended(&stl::file(b"a box", &all));
    assert_eq!((&report["before"]["nonfinite"], &report["before"]["triangles"]), (&3.into(), &12.into()));
    assert_eq!(report["after"]["nonfinite"], 0);
    assert_eq!(report["edit_records"]["deleted"], serde_json::json!([[3, 3], [7, 7], [14, 14]]));
    assert_eq!(stl::records(&out), records(&solid_box()));
}

/// A normal is not part of the shape: one that is no number is no reason to touch a triangle.
#[test]
fn normals_that_are_no_numbers() {
    let odd: Vec<_> = solid_box().iter().map(|t| record([f32::NAN, f32::INFINITY, 0.0], t, 0)).collect();
    let bytes = stl::file(b"a box", &odd);
    let (report, out) = mended(&bytes);
    assert_eq!((&report["outcome"], out), (&"clean".into(), bytes));
}

#[test]
fn minus_zero_is_zero() {
    let mut triangles = solid_box();
    for corner in triangles.iter_mut().step_by(2).flatten().filter(|corner| corner[0] == 0.0) {
        corner[0] = -0.0;
    }
    let bytes = stl::file(b"a box", &records(&triangles));
    let (report, out) = mended(&bytes);
    assert_eq!((&report["outcome"], &report["before"]["vertices"]), (&"clean".into(), &8.into()));
    assert_eq!(out, bytes);
    // Where something else must be written, they stay what they were.
    triangles.pop();
    let open = records(&triangles);
    let (_, out) = mended(&stl::file(b"a box", &open));
    assert_eq!(stl::records(&out)[..11], open);
}

#[test]
fn files_without_triangles() {
    for bytes in [&stl::file(b"nothing", &[])[..], b"solid nothing\nendsolid nothing\n", &[0; 84], &[0; 84 + 50]] {
        let line = refused(bytes).stderr();
        assert!(line.contains("no triangle"), "{line}");
    }
}

#[test]
fn nothing_but_unusable_triangles() {
    let nan = record([0.0; 3], &[[f32::NAN; 3], [0.0; 3], [1.0; 3]], 0);
    let point = record([0.0; 3], &[[1.0; 3]; 3], 0);
    for records in [&[nan][..], &[point], &[nan, point, nan]] {
        let place = Place::new();
        place.put("in.stl", &stl::file(b"nothing much", records));
        let ran = place.repair("in.stl", "out.stl", &[]).expect(1);
        assert_eq!(ran.report()["outcome"], "not_good");
        assert!(ran.report()["output"].is_null() && !place.at("out.stl").exists(), "no mesh is left, so none is written");
        place.inspect("in.stl", &[]).expect(1);
    }
}

/// The open box as text, changed: the finding is named, and the eleven facets come out as the records of their numbers.
fn open_box_in(text: &[u8], words: &[&str]) -> Value {
    let (report, out) = mended(text);
    let said = findings(&report);
    words.iter().for_each(|word| assert!(said.contains(word), "{said} does not say {word:?}"));
    assert_eq!(report["input"]["format"], "ascii_stl");
    assert_eq!(report["output"]["format"], "binary_stl");
    assert_eq!(stl::records(&out)[..11], records(&open_box()));
    assert_eq!(report["edit"]["untouched"], 11);
    report
}

fn open_text() -> String {
    stl::text("box", &open_box())
}

#[test]
fn plain_text() {
    let report = open_box_in(open_text().as_bytes(), &[]);
    assert_eq!(findings(&report), "[]");
    let closed = stl::text("box", &solid_box());
    let place = Place::new();
    place.put("in.stl", closed.as_bytes());
    place.repair("in.stl", "out.stl", &[]).expect(0);
    assert_eq!(place.read("out.stl"), closed.as_bytes(), "a clean file is copied as it is");
}

#[test]
fn text_in_upper_case() {
    open_box_in(open_text().to_uppercase().as_bytes(), &["lower case"]);
}

#[test]
fn line_ends_of_other_systems_and_tabs() {
    open_box_in(open_text().replace('\n', "\r").as_bytes(), &["CR alone"]);
    open_box_in(open_text().replace('\n', "\r\n").as_bytes(), &["CR LF"]);
    open_box_in(open_text().replace("vertex ", "\t\tvertex\t").as_bytes(), &["tab"]);
    open_box_in(open_text().replace('\n', " ").replacen("box", "box\n", 1).as_bytes(), &[]);
}

#[test]
fn byte_order_mark() {
    open_box_in(format!("\u{feff}{}", open_text()).as_bytes(), &["byte order mark"]);
}

#[test]
fn several_solids() {
    let triangles = open_box();
    let text = stl::text("bottom", &triangles[..4]) + "\n" + &stl::text("top", &triangles[4..]);
    open_box_in(text.as_bytes(), &["2 solids", "bottom", "top"]);
}

#[test]
fn missing_endsolid() {
    open_box_in(open_text().replace("endsolid box\n", "").as_bytes(), &["endsolid"]);
}

#[test]
fn missing_solid() {
    open_box_in(open_text().replacen("solid box\n", "", 1).as_bytes(), &["solid"]);
}

#[test]
fn decimal_commas() {
    open_box_in(open_text().replace('.', ",").as_bytes(), &["decimal comma"]);
    let mixed = open_text().replacen("vertex 10 20.5", "vertex 10 20,5", 1);
    let line = refused(mixed.as_bytes()).stderr();
    assert!(line.contains("comma"), "{line}");
}

#[test]
fn exponents_of_all_kinds() {
    let text = open_text().replace("20.5", "2.05e+01").replace("30.75", "3075E-2").replace("10 ", "+1D1 ");
    open_box_in(text.as_bytes(), &[]);
}

#[test]
fn facets_of_more_or_fewer_vertices() {
    let triangles = solid_box();
    let mut text = String::from("solid quads\n");
    // Two triangles of a side share first and third corner: one facet of four vertices.
    for pair in triangles.chunks(2) {
        let [x, y, z] = unit_normal(&pair[0]);
        text += &format!("facet normal {x} {y} {z}\nouter loop\n");
        for [x, y, z] in [pair[0][0], pair[0][1], pair[0][2], pair[1][2]] {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    text += "facet normal 0 0 0\nouter loop\nvertex 1 2 3\nvertex 3 2 1\nendloop\nendfacet\nendsolid quads\n";
    closed_box_in(text.as_bytes(), &["6 facets of more than three vertices", "1 facet of fewer than three vertices"]);
}

#[test]
fn name_that_is_not_utf_8() {
    let mut text = b"solid K\xf6rper\n".to_vec();
    text.extend_from_slice(open_text().split_once('\n').unwrap().1.as_bytes());
    open_box_in(&text, &["UTF-8"]);
}

#[test]
fn text_cut_off_within_a_facet() {
    let text = stl::text("box", &solid_box());
    // After the last facet's second vertex.
    let end = text.rfind("vertex").unwrap();
    let place = Place::new();
    place.put("in.stl", &text.as_bytes()[..end]);
    // Closed, but nobody knows what else is missing.
    let report = place.repair("in.stl", "out.stl", &[]).expect(1).report();
    assert_eq!(report["outcome"], "needs_review");
    assert!(report["verdict"]["reasons"][0].as_str().unwrap().contains("cut off"));
}

#[test]
fn text_with_a_word_for_a_number() {
    let extra = "facet normal 0 0 0\nouter loop\nvertex 1 2 3\nvertex 1 oops 3\nvertex 3 2 1\nendloop\nendfacet\nendsolid box\n";
    let (report, out) = mended(open_text().replace("endsolid box\n", extra).as_bytes());
    let said = findings(&report);
    assert!(said.contains("no number"), "{said}");
    assert_eq!(report["before"]["nonfinite"], 1);
    assert_eq!(stl::records(&out)[..11], records(&open_box()));
}
