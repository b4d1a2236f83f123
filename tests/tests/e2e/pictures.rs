//! `suture picture`: what it draws, what it refuses, and that it never takes a name that is taken.

use suture_bench::generate::Case;
use suture_tests::{Place, Ran};

fn picture(place: &Place, arguments: &[&str]) -> Ran {
    place.suture([&["picture", "--size", "64x48"], arguments].concat())
}

/// Width and height, as they stand in the file.
fn size(png: &[u8]) -> (u32, u32) {
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn one_mesh_or_two_become_a_picture() {
    let place = Place::new();
    place.generate(Case::Holes, 2_000, 1);
    place.repair("holes.stl", "fixed.stl", &[]).expect(0);
    picture(&place, &["holes.stl", "-o", "one.png"]).expect(0);
    picture(&place, &["holes.stl", "fixed.stl", "-o", "two.png", "--threads", "1"]).expect(0);
    picture(&place, &["holes.stl", "fixed.stl", "-o", "again.png", "--threads", "3"]).expect(0);
    assert_eq!(size(&place.read("one.png")), (64, 48));
    assert_eq!(size(&place.read("two.png")), (128, 48));
    assert_eq!(place.read("two.png"), place.read("again.png"), "the same whatever the threads");
}

#[test]
fn what_is_no_mesh_or_would_replace_something_is_refused() {
    let place = Place::new();
    let (input, _) = place.generate(Case::Clean, 600, 1);
    let before = std::fs::read(&input).unwrap();
    place.put("text.stl", b"not a mesh");
    place.put("there.png", b"mine");
    for (arguments, words) in [
        (&["text.stl", "-o", "a.png"][..], "text.stl"),
        (&["nothing.stl", "-o", "a.png"], "nothing.stl"),
        (&["clean.stl", "-o", "there.png"], "exists already"),
        (&["clean.stl", "-o", "clean.stl", "--force"], "never overwritten"),
    ] {
        let ran = picture(&place, arguments);
        assert_eq!((ran.code(), ran.stderr().contains(words)), (2, true), "{arguments:?}: {}", ran.stderr());
    }
    assert_eq!((place.read("there.png"), std::fs::read(&input).unwrap()), (b"mine".to_vec(), before));
    assert!(!place.names("").iter().any(|name| name.contains("a.png") || name.contains("tmp")), "{:?}", place.names(""));
    picture(&place, &["clean.stl", "-o", "there.png", "--force"]).expect(0);
    assert_eq!(size(&place.read("there.png")), (64, 48));
}

/// The page holds the picture, the counts and the verdict, and needs nothing from elsewhere.
#[test]
fn a_report_becomes_a_page() {
    let place = Place::new();
    place.generate(Case::Holes, 2_000, 1);
    place.repair("holes.stl", "fixed.stl", &["--report", place.at("holes.json").to_str().unwrap()]).expect(0);
    let page = |arguments: &[&str]| place.suture([&["report"], arguments].concat());
    page(&["holes.json", "-o", "holes.html"]).expect(0);
    let text = String::from_utf8(place.read("holes.html")).unwrap();
    for words in ["<h1>holes.stl</h1>", "Repaired", "boundary edges", "data:image/png;base64,iVBORw0KGgo", "Left: as it came."] {
        assert!(text.contains(words), "lacks {words:?}");
    }
    assert!(!text.contains("<script") && !text.contains("http://") && !text.contains("https://") && !text.contains("src=\"/"));
    assert_eq!(page(&["holes.json", "-o", "holes.html"]).code(), 2, "the name is taken");
    assert_eq!(page(&["holes.stl", "-o", "other.html"]).code(), 2, "no report");
    assert_eq!(page(&["holes.json", "-o", "holes.stl", "--force"]).code(), 2, "an input is never overwritten");
    // Another file stands under the name that the report has: no picture, lest it be taken for the one that was repaired.
    place.put("holes.stl", b"solid\nendsolid\n");
    page(&["holes.json", "-o", "without.html"]).expect(0);
    assert!(!String::from_utf8(place.read("without.html")).unwrap().contains("<img"));
}
