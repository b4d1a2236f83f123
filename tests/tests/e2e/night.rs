//! What became of a night's files, in one file: a page, or a table.

use suture_tests::Place;
use suture_tests::hot::{doubtful, holes};

#[test]
fn a_night_is_a_page_or_a_table() {
    let place = Place::new();
    place.put("hot/in/good.stl", &holes(1));
    place.put("hot/in/doubtful.stl", &doubtful());
    place.put("hot/in/=1+1,<b>.stl", b"no mesh");
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(1);
    let night = |rest: &[&str]| place.suture([&["night", "--dir", "hot"], rest].concat());
    night(&["-o", "night.html"]).expect(0);
    let page = String::from_utf8(place.read("night.html")).unwrap();
    for words in [
        "2 files need you.",
        "Since <time",
        "<code>suture jobs approve</code>",
        "<th scope=\"col\" class=\"n\">Job</th>",
        "<div class=\"wide\">",
        "Needs review: 1; Failed: 1.",
        "doubtful.stl",
        "=1+1,&lt;b&gt;.stl",
        "1 done",
        "good.stl",
        "Repaired",
    ] {
        assert!(page.contains(words), "{words}: {page}");
    }
    assert!(!page.contains("<script") && !page.contains("<b>.stl"));
    // It is there already.
    night(&["-o", "night.html"]).expect(2);
    night(&["-o", "night.txt"]).expect(2);
    night(&["-o", "night.csv"]).expect(0);
    let table = String::from_utf8(place.read("night.csv")).unwrap();
    let lines: Vec<&str> = table.split_terminator("\r\n").collect();
    assert_eq!(lines.len(), 4, "{table}");
    assert!(lines.iter().any(|line| line.contains(",\"'=1+1,<b>.stl\",failed,Failed,")), "{table}");
    assert!(lines.iter().any(|line| line.contains(",good.stl,done,Repaired,") && line.contains(",out/good.stl,")), "{table}");
    // What needs no one is as old as it is.
    night(&["-o", "none.csv", "--since", "0s"]).expect(0);
    let table = String::from_utf8(place.read("none.csv")).unwrap();
    assert!(table.contains("doubtful.stl") && !table.contains("good.stl"), "{table}");
}
