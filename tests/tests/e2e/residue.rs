//! Residue as a person corrects it (a brush, a mask), and as it is looked for without a tool path, on the built binary.

use std::collections::BTreeSet;

use serde_json::Value;
use suture_bench::cut::{self, CASES, Case, Part};
use suture_tests::Place;
use suture_tests::served::{Served, jobs, wait_until};
use suture_tests::stl::{self, Triangle};

fn case() -> &'static Case {
    CASES.iter().find(|case| case.name == "floor ball 1").unwrap()
}

/// A part in `in.stl` and its path in `in.nc`.
fn milled() -> (Place, Part) {
    let (place, part) = (Place::new(), cut::make(case()));
    place.put("in.stl", &part.stl());
    place.put("in.nc", part.code.as_bytes());
    (place, part)
}

/// Runs the command on `in.stl`, and what its report says.
fn run(place: &Place, options: &[&str], code: i32) -> Value {
    let paths = ["residue", "in.stl", "-o", "out.stl", "--report", "report.json", "--force"];
    place.suture([&paths[..], options].concat()).expect(code);
    serde_json::from_slice(&place.read("report.json")).unwrap()
}

fn with_path<'a>(tool: &'a str, options: &[&'a str]) -> Vec<&'a str> {
    [&["--toolpath", "in.nc", "--tool", tool], options].concat()
}

fn before(told: &Value) -> u64 {
    told["residue"]["triangles_before"].as_u64().unwrap_or_else(|| panic!("{told}"))
}

/// A triangle's bits, from its least corner on.
fn bits(triangle: &Triangle) -> [[u32; 3]; 3] {
    let [a, b, c] = triangle.map(|point| point.map(|x| (x + 0.0).to_bits()));
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default()
}

fn kept(place: &Place) -> BTreeSet<[[u32; 3]; 3]> {
    stl::records(&place.read("out.stl")).iter().map(stl::corners).map(|corners| bits(&corners)).collect()
}

fn centre(triangle: &Triangle) -> [f64; 3] {
    [0, 1, 2].map(|axis| triangle.iter().map(|point| f64::from(point[axis])).sum::<f64>() / 3.0)
}

/// A box as a mesh.
fn block(low: [f32; 3], high: [f32; 3]) -> Vec<Triangle> {
    let point = |n: usize| [0, 1, 2].map(|axis| if n >> axis & 1 == 1 { high[axis] } else { low[axis] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|face| face.map(point)).collect()
}

/// What a box as a mask encloses is moved, and all else keeps its bits; so it is where the mask is a piece of the part's own surface.
#[test]
fn a_mask_says_where_residue_may_be() {
    let (place, part) = milled();
    let tool = case().cutter.words();
    let all: Vec<Triangle> = part.triangles().collect();
    let (split, far) = (5.5, 99.0);
    let is_masked = |triangle: &&Triangle| centre(triangle)[0] < split;
    place.put("solid.stl", &stl::mesh(&block([-far as f32; 3], [split as f32, far as f32, far as f32])));
    place.put("piece.stl", &stl::mesh(&all.iter().filter(is_masked).copied().collect::<Vec<_>>()));
    let whole = before(&run(&place, &with_path(&tool, &[]), 0));
    let made = ["solid.stl", "piece.stl"].map(|mask| {
        let told = run(&place, &with_path(&tool, &["--mask", mask]), 0);
        assert_eq!(told["profile"]["residue"]["mask"], mask);
        let found = before(&told);
        assert!(found > whole / 3 && found < whole * 2 / 3, "{mask}: {found} of {whole}");
        let stay = kept(&place);
        assert!(all.iter().filter(|triangle| !is_masked(triangle)).all(|triangle| stay.contains(&bits(triangle))), "{mask}");
        place.read("out.stl")
    });
    assert!(made[0] == made[1]);
}

/// A brush paints triangles by the numbers of the input, though the repair took one away before them; a mask counts more.
#[test]
fn a_brush_has_the_numbers_of_the_input() {
    let (place, part) = milled();
    let tool = case().cutter.words();
    let all: Vec<Triangle> = part.triangles().collect();
    let is_painted = |number: &usize| part.labels[*number] && centre(&all[*number])[0] < 5.5;
    let painted: Vec<usize> = (0..all.len()).filter(is_painted).collect();
    let everywhere = ["--exclude", "-99,-99,-99:99,99,99"];
    let text = |shift: usize| painted.iter().map(|number| format!("{}\n", number + shift)).collect::<String>();
    place.put("brush.txt", format!("# painted\n{}", text(0)).as_bytes());
    let told = run(&place, &with_path(&tool, &[&everywhere[..], &["--brush", "brush.txt"]].concat()), 0);
    assert_eq!((before(&told), &told["profile"]["residue"]["brush"]), (painted.len() as u64, &Value::from("brush.txt")));
    let plain = kept(&place);
    let others = (0..all.len()).filter(|number| !is_painted(number));
    assert!(others.clone().all(|number| plain.contains(&bits(&all[number]))));
    // A triangle without an area stands first, and goes.
    let needle = [all[0][0], all[0][0], all[0][1]];
    place.put("in.stl", &stl::mesh(&[&[needle][..], &all].concat()));
    place.put("shifted.txt", text(1).as_bytes());
    let told = run(&place, &with_path(&tool, &[&everywhere[..], &["--brush", "shifted.txt"]].concat()), 0);
    assert_eq!((told["edit"]["deleted"].as_u64() > Some(0), before(&told)), (true, painted.len() as u64));
    assert!(kept(&place) == plain);
    place.put("away.stl", &stl::mesh(&block([50.0; 3], [60.0; 3])));
    let told = run(&place, &with_path(&tool, &["--brush", "shifted.txt", "--mask", "away.stl"]), 0);
    assert_eq!(before(&told), 0, "{told}");
}

/// A path that did not cut this mesh is noticed, and the mesh stays as it is to the bit: the cuts of one are half a step beside its path and a little higher,
/// and the other is elsewhere.
#[test]
fn a_path_of_another_part_is_noticed() {
    let (place, part) = milled();
    let tool = case().cutter.words();
    let fit = run(&place, &with_path(&tool, &[]), 0)["residue"]["path_fit"].as_f64();
    assert!(fit > Some(0.99), "{fit:?}");
    for (by, words) in [([0.5, 0.0, 0.2], "lie where it left the material"), ([500.0, 0.0, 0.0], "reaches no vertex of the mesh")]
    {
        let moved = |triangle: Triangle| triangle.map(|point| [0, 1, 2].map(|axis| point[axis] + by[axis]));
        place.put("in.stl", &stl::mesh(&part.triangles().map(moved).collect::<Vec<_>>()));
        let told = run(&place, &with_path(&tool, &[]), 1);
        let residue = &told["residue"];
        assert!(residue["why_not"].as_str().is_some_and(|why| why.contains(words)), "{by:?}: {residue}");
        assert!(residue["path_fit"].as_f64() < Some(0.5) && told["outcome"] == "needs_review", "{by:?}: {residue}");
        assert!(place.read("out.stl") == place.read("in.stl"), "{by:?}");
    }
}

/// A mesh with Y up and its path with Z up: the path is turned, which the report says, and a person has to look.
#[test]
fn a_mesh_with_another_axis_up_is_noticed() {
    let (place, part) = milled();
    let turned = |triangle: Triangle| triangle.map(|[x, y, z]| [x, z, -y]);
    let back = |triangle: &Triangle| triangle.map(|[x, y, z]| [x, -z, y]);
    place.put("in.stl", &stl::mesh(&part.triangles().map(turned).collect::<Vec<_>>()));
    let told = run(&place, &with_path(&case().cutter.words(), &[]), 1);
    assert_eq!((&told["residue"]["path_axes"], &told["outcome"]), (&Value::from("x, -z, y"), &Value::from("needs_review")));
    let after: Vec<Triangle> =
        stl::records(&place.read("out.stl")).iter().map(stl::corners).map(|corners| back(&corners)).collect();
    let verdict = cut::judge(case(), &part, &after);
    assert!(verdict.triangles > 0 && verdict.height_after < 0.2 * part.height && verdict.off < 0.5 * part.height, "{verdict:?}");
}

/// Files that are no corrections are named in one line: before any work where that can be seen, else in the report, and the mesh stays.
#[test]
fn corrections_that_are_none_are_named() {
    let (place, _) = milled();
    let tool = case().cutter.words();
    place.put("word.txt", b"12\n7-x\n");
    place.put("empty.txt", b"# none\n");
    for (option, file, words) in [
        ("--brush", "none.txt", "none.txt: cannot be read"),
        ("--brush", "word.txt", "word.txt: line 2: `7-x` is no number of a triangle"),
        ("--brush", "empty.txt", "empty.txt: it names no triangle"),
        ("--mask", "none.stl", "none.stl: cannot be read"),
        ("--mask", ".", ".: is no file"),
    ] {
        let options = with_path(&tool, &[option, file]);
        let refused = place.suture([&["residue", "in.stl", "-o", "new.stl"], &options[..]].concat()).expect(2).stderr();
        assert!(refused.contains(words) && refused.trim_end().lines().count() == 1, "{refused}");
        assert!(!place.at("new.stl").exists());
    }
    place.put("beyond.txt", b"4000000000");
    for (option, file, words) in [
        ("--brush", "beyond.txt", "beyond.txt: it names triangle 4000000000, and the mesh has"),
        ("--mask", "word.txt", "word.txt: "),
    ] {
        let told = run(&place, &with_path(&tool, &[option, file]), 1);
        assert!(told["residue"]["why_not"].as_str().is_some_and(|why| why.starts_with(words)), "{}", told["residue"]);
        assert!(place.read("out.stl") == place.read("in.stl"));
    }
}

/// In a hot folder a brush comes beside the mesh and is waited for, as its path is; a mask there would be a mesh to repair.
#[test]
fn a_mesh_waits_for_the_brush_beside_it() {
    let (place, part) = (Place::new(), cut::make(case()));
    let settings = |more: &str| format!("[residue]\ntoolpath = \"*.nc\"\ntools = [\"{}\"]\n{more}", case().cutter.words());
    let exclude = "exclude = [[[-99, -99, -99], [99, 99, 99]]]\nbrush = \"*.brush\"\n";
    place.put("hot/in/cut/.suture.toml", settings(exclude).as_bytes());
    place.put("hot/in/masked/.suture.toml", settings("mask = \"*.mask.stl\"\n").as_bytes());
    for folder in ["cut", "masked"] {
        place.put(&format!("hot/in/{folder}/part.nc"), part.code.as_bytes());
        place.put(&format!("hot/in/{folder}/part.stl"), &part.stl());
    }
    let _daemon = Served::start(&place, &["hot", "--settle", "300ms"], "log");
    let note = |path: &str| {
        let all = jobs(&place, "hot");
        let job = all.iter().find(|job| job["source"]["path"] == path);
        job.map(|job| format!("{} {}", job["kind"], job["note"])).unwrap_or_default()
    };
    wait_until("it waits for its brush", || note("cut/part.stl").contains("part.brush, its brush, is not beside it yet"));
    wait_until("the other one says why it waits", || note("masked/part.stl").contains("would repair itself"));
    let painted: Vec<usize> = (0..part.labels.len()).filter(|number| part.labels[*number]).take(400).collect();
    place.put("hot/in/cut/part.brush", format!("{painted:?}").as_bytes());
    wait_until("it is done", || note("cut/part.stl").contains("done"));
    let report: Value = serde_json::from_slice(&place.read("hot/out/cut/part.stl.report.json")).unwrap();
    assert_eq!((before(&report), &report["profile"]["residue"]["brush"]), (400, &Value::from("*.brush")));
}

/// Without a path, waves are told with pitch, height and direction; nothing is changed, and a person has to look, even where nothing is found.
#[test]
fn waves_without_a_path_are_told_and_left() {
    let (place, part) = milled();
    let told = run(&place, &["--without-path"], 1);
    assert_eq!((&told["outcome"], told["verdict"]["good"].as_bool()), (&Value::from("needs_review"), Some(true)));
    let suspects = told["residue"]["suspects"].as_array().unwrap();
    let [suspect] = &suspects[..] else { panic!("{}", told["residue"]) };
    let number = |name: &str| suspect[name].as_f64().unwrap();
    assert!((number("pitch") / case().step - 1.0).abs() < 0.03, "{suspect}");
    assert!((0.8..1.1).contains(&(number("height") / part.height)), "{suspect} of {}", part.height);
    assert!(suspect["across"][0].as_f64().unwrap().abs() > 0.998 && number("confidence") > 0.7, "{suspect}");
    assert!(place.read("out.stl") == place.read("in.stl"));
    let said = place.suture(["residue", "in.stl", "-o", "two.stl", "--without-path"]).expect(1).stdout();
    assert!(said.contains("1 place with periodic waves, left as they are") && said.contains("apart across (1.00"), "{said}");
    place.put("in.stl", &stl::mesh(&block([0.0; 3], [20.0, 30.0, 10.0])));
    let told = run(&place, &["--without-path"], 1);
    assert_eq!((&told["outcome"], &told["residue"]["suspects"]), (&Value::from("needs_review"), &Value::Array(Vec::new())));
    let refused =
        place.suture(["residue", "in.stl", "-o", "new.stl", "--without-path", "--toolpath", "in.nc"]).expect(2).stderr();
    assert!(refused.contains("--without-path"), "{refused}");
}
