//! Files of curves, on the built binary: told of as a table and as JSON, closed on request, refused in a line.

use serde_json::{Value, json};
use suture_tests::Place;

/// A square of four lines, of which the last one ends short of the first by `gap`, and one line that leads nowhere.
fn square(gap: f64) -> String {
    let line = |a: [f64; 2], b: [f64; 2]| json!({ "line": [[a[0], a[1], 0.0], [b[0], b[1], 0.0]] });
    let curves = [
        line([0.0, 0.0], [10.0, 0.0]),
        line([10.0, 0.0], [10.0, 10.0]),
        line([0.0, 10.0], [10.0, 10.0]),
        line([0.0, 10.0], [0.0, gap]),
        line([20.0, 20.0], [30.0, 20.0]),
    ];
    json!({ "unit": "mm", "curves": curves }).to_string()
}

#[test]
fn loops_are_found_in_any_direction_and_the_rest_is_named() {
    let place = Place::new();
    place.put("square.json", square(0.0).as_bytes());
    let table = place.suture(["curves", "square.json"]).expect(0).stdout();
    for words in [
        "square.json: 5 curves, 1 closed loop, 0 faces",
        "line × 5, 50.000000 mm",
        "1 loop of 4 curves",
        "1 curve in no loop: [4]",
    ] {
        assert!(table.contains(words), "{words}: {table}");
    }
    let told: Value = serde_json::from_str(&place.suture(["curves", "--json", "square.json"]).expect(0).stdout()).unwrap();
    let uses = told["loops"][0].as_array().unwrap();
    // Each curve begins where the one before it ends.
    let end = |own: &Value, which: [&str; 2]| {
        let curve = &told["curves"][own["curve"].as_u64().unwrap() as usize];
        curve[which[usize::from(own["reversed"] == true)]].clone()
    };
    for (k, own) in uses.iter().enumerate() {
        assert_eq!(end(own, ["end", "start"]), end(&uses[(k + 1) % uses.len()], ["start", "end"]));
    }
    assert_eq!((uses.len(), &told["loose"], &told["unit"]), (4, &json!([4]), &json!("mm")));
}

#[test]
fn gaps_are_closed_if_they_are_short_enough() {
    let place = Place::new();
    place.put("open.json", square(0.5).as_bytes());
    let loops = |options: &[&str]| {
        let told = place.suture([&["curves", "--json", "open.json"], options].concat()).expect(0).stdout();
        let told: Value = serde_json::from_str(&told).unwrap();
        (told["loops"].as_array().unwrap().len(), told["curves"].as_array().unwrap().len())
    };
    assert_eq!([loops(&[]), loops(&["--close-gaps", "0.4"]), loops(&["--close-gaps", "0.6"])], [(0, 5), (0, 5), (1, 6)]);
    assert_eq!(loops(&["--tolerance", "0.6"]), (1, 5));
    let table = place.suture(["curves", "open.json", "--close-gaps", "0.6"]).expect(0).stdout();
    assert!(table.contains("a gap of 0.500000 mm by a straight curve"), "{table}");
}

/// One that is none does not take the others down.
#[test]
fn what_holds_no_curves_is_refused_in_a_line() {
    let place = Place::new();
    place.put("notes.txt", b"# Notes\nnothing here");
    place.put("bad.json", br#"{"unit": "mm", "curves": [{"line": [[0, 0, 0]]}]}"#);
    place.put("square.json", square(0.0).as_bytes());
    let ran = place.suture(["curves", "notes.txt", "bad.json", "missing.igs", "square.json"]).expect(2);
    let said = ran.stderr();
    assert_eq!(said.lines().count(), 3, "{said}");
    for words in [
        "notes.txt: cannot be read as curves: neither IGES nor STEP nor JSON",
        "bad.json: cannot be read as curves: curves[0].line",
        "missing.igs: cannot be read: ",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(ran.stdout().contains("1 closed loop"));
}
