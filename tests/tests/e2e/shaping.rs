//! Fewer triangles, smoother surfaces and no marks of tools, on the built binary: within the distance that is proved, told, and the same for any threads.

use std::f64::consts::{PI, TAU};

use serde_json::Value;
use suture_bench::cut::{self, CASES, FRESH};
use suture_bench::judge::judge;
use suture_tests::Place;
use suture_tests::served::{Served, jobs, wait_until};
use suture_tests::stl::{self, Triangle};

/// Rows and columns of the sphere, and its radius.
const ROWS: usize = 60;
const COLUMNS: usize = 120;
const RADIUS: f64 = 10.0;
/// The sphere's chords are no farther below it than this: of the widest cell, from its middle.
const CHORD: f64 = 0.03;

/// A sphere whose surface is moved outwards by so much at each corner of its grid, by row and column.
fn sphere(out: impl Fn(usize, usize) -> f64) -> Vec<Triangle> {
    let point = |row: usize, column: usize| {
        let column = if row == 0 || row == ROWS { 0 } else { column % COLUMNS };
        let (down, around) = (PI * row as f64 / ROWS as f64, TAU * column as f64 / COLUMNS as f64);
        let radius = RADIUS + out(row, column);
        [down.sin() * around.cos(), down.sin() * around.sin(), down.cos()].map(|x| (radius * x) as f32)
    };
    let mut all = Vec::new();
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let [a, b] = [point(row, column), point(row, column + 1)];
            let [c, d] = [point(row + 1, column + 1), point(row + 1, column)];
            if row > 0 {
                all.push([a, d, b]);
            }
            if row + 1 < ROWS {
                all.push([b, d, c]);
            }
        }
    }
    all
}

fn norm(point: [f64; 3]) -> f64 {
    point.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The largest distance of corners, and of the middles of triangles, from the sphere.
fn off(triangles: &[Triangle]) -> f64 {
    let places = |[a, b, c]: &Triangle| {
        let middle = [0, 1, 2].map(|k| (f64::from(a[k]) + f64::from(b[k]) + f64::from(c[k])) / 3.0);
        [a, b, c].map(|point| point.map(f64::from)).into_iter().chain([middle])
    };
    triangles.iter().flat_map(places).map(|place| (norm(place) - RADIUS).abs()).fold(0.0, f64::max)
}

fn read(place: &Place, name: &str) -> Vec<Triangle> {
    stl::records(&place.read(name)).iter().map(stl::corners).collect()
}

/// Runs a command on `in.stl`, and what its report says.
fn run(place: &Place, command: &str, options: &[&str]) -> Value {
    run_to(place, 0, command, options)
}

/// The same, with this exit code.
fn run_to(place: &Place, code: i32, command: &str, options: &[&str]) -> Value {
    let paths = ["in.stl", "-o", "out.stl", "--report", "report.json", "--force"];
    place.suture([&[command], &paths[..], options].concat()).expect(code);
    serde_json::from_slice(&place.read("report.json")).unwrap()
}

#[test]
fn fewer_triangles_are_as_near_as_is_proved() {
    let place = Place::new();
    let before = sphere(|_, _| 0.0);
    place.put("in.stl", &stl::mesh(&before));
    for options in [["--ratio", "0.25"], ["--triangles", "3000"], ["--max-deviation", "0.1"]] {
        let made = ["1", "2"].map(|threads| {
            let told = run(&place, "simplify", &[&options[..], &["--threads", threads]].concat());
            let simplified = &told["simplified"];
            let proved = simplified["to_result"].as_f64().unwrap().max(simplified["from_result"].as_f64().unwrap());
            let after = read(&place, "out.stl");
            assert_eq!(
                (simplified["before"].as_u64(), simplified["after"].as_u64()),
                (Some(before.len() as u64), Some(after.len() as u64))
            );
            assert!(off(&after) <= proved + CHORD, "{options:?}: {} of {proved}", off(&after));
            assert!(proved > 0.0 && proved < 0.2, "{options:?}: {simplified}");
            let bound = match options {
                ["--ratio", _] => before.len() / 4,
                ["--triangles", _] => 3000,
                _ => before.len() / 2,
            };
            assert!(after.len() <= bound, "{options:?}: {} triangles", after.len());
            assert_eq!(told["verdict"]["good"].as_bool(), Some(true), "{told}");
            place.read("out.stl")
        });
        assert!(made[0] == made[1], "{options:?}");
        assert!(judge(&place.at("out.stl")).unwrap().sound(), "{options:?}");
    }
    let refused = place.suture(["simplify", "in.stl", "-o", "new.stl"]).expect(2).stderr();
    assert!(refused.contains("--ratio") && !place.at("new.stl").exists(), "{refused}");
}

/// Every second row stands out: waves of two rows, whose height is measured at the corners.
#[test]
fn waves_are_smoothed_and_the_volume_stays() {
    let place = Place::new();
    let before = sphere(|row, _| if row % 2 == 0 { 0.05 } else { -0.05 });
    place.put("in.stl", &stl::mesh(&before));
    let told = run(&place, "smooth", &["--waves-below", "2.2"]);
    let after = read(&place, "out.stl");
    // Away from the poles, where the grid is no longer even; about the middle, for a mean of crests and troughs is no wave.
    let height = |triangles: &[Triangle]| {
        let corners = triangles.iter().flatten().filter(|point| f64::from(point[2]).abs() < 0.7 * RADIUS);
        let mut radii: Vec<f64> = corners.map(|point| norm(point.map(f64::from))).collect();
        radii.sort_by(f64::total_cmp);
        0.5 * (radii[radii.len() * 9 / 10] - radii[radii.len() / 10])
    };
    assert!(height(&after) < 0.1 * height(&before), "{} of {}", height(&after), height(&before));
    let smoothed = &told["smoothed"];
    let volume = 4.0 / 3.0 * PI * RADIUS.powi(3);
    assert!((smoothed["volume_change"].as_f64().unwrap() / volume).abs() < 0.01, "{smoothed}");
    assert!(
        after.len() == before.len() && smoothed["displacement"].as_f64().unwrap() < 0.2,
        "twice from crest to trough: {smoothed}"
    );
    assert!(judge(&place.at("out.stl")).unwrap().sound());
}

/// A hole is closed first; a profile says how few triangles are wanted, in a hot folder, too.
#[test]
fn a_profile_asks_for_fewer_triangles() {
    let place = Place::new();
    let mut part = sphere(|_, _| 0.0);
    part.truncate(part.len() - 40);
    place.put("in.stl", &stl::mesh(&part));
    place.put("small.toml", b"simplify_ratio = 0.3\nsimplify_within_mm = 0.2\n");
    let told = run(&place, "repair", &["--profile", "small.toml"]);
    let names: Vec<&str> = told["repairs"].as_array().unwrap().iter().filter_map(|repair| repair["name"].as_str()).collect();
    assert!(names.contains(&"fill") && names.last() == Some(&"simplify"), "{names:?}");
    assert!(told["edit"]["deleted"].as_u64().is_some_and(|deleted| deleted > 0), "{told}");
    let after = read(&place, "out.stl");
    assert!(after.len() <= part.len() * 3 / 10 + 20, "{}", after.len());
    assert!(judge(&place.at("out.stl")).unwrap().sound());
    let said = place.suture(["repair", "in.stl", "-o", "again.stl", "--profile", "small.toml"]).expect(0).stdout();
    assert!(said.contains("proved within"), "{said}");
}

/// A floor, a wall and a floor that nothing was tuned for: the waves of the tool go, the triangles become few, and all else keeps its bits.
#[test]
fn marks_of_a_tool_go() {
    let named = |name: &str| CASES.iter().chain(&FRESH).find(|case| case.name == name).unwrap();
    for name in ["floor ball 1", "wall 60 ball 1", FRESH[0].name] {
        let (place, case) = (Place::new(), named(name));
        let part = cut::make(case);
        place.put("in.stl", &part.stl());
        place.put("in.nc", part.code.as_bytes());
        let made = ["1", "2"].map(|threads| {
            let tool = case.cutter.words();
            let told = run(&place, "residue", &["--toolpath", "in.nc", "--tool", &tool, "--threads", threads]);
            let residue = &told["residue"];
            let marked = part.labels.iter().filter(|is_marked| **is_marked).count() as f64;
            let found = residue["triangles_before"].as_f64().unwrap();
            assert!((found / marked - 1.0).abs() < 0.05, "{name}: {found} of {marked}: {residue}");
            let height = residue["regions"][0]["height"].as_f64().unwrap();
            assert!((height / part.height - 1.0).abs() < 0.2, "{name}: {height} of {}", part.height);
            assert!(residue["triangles_after"].as_f64().unwrap() < 0.35 * found, "{name}: {residue}");
            place.read("out.stl")
        });
        assert!(made[0] == made[1], "{name}");
        let after = read(&place, "out.stl");
        let verdict = cut::judge(case, &part, &after);
        assert!(
            verdict.height_after < 0.2 * part.height && verdict.off < 0.5 * part.height,
            "{name}: {verdict:?} of {}",
            part.height
        );
        assert!(judge(&place.at("out.stl")).unwrap().sound(), "{name}");
        let all: std::collections::BTreeSet<_> = after.iter().map(bits).collect();
        let outside = part.triangles().zip(&part.labels).filter(|(_, is_marked)| !**is_marked);
        let (mut kept, mut count) = (0, 0);
        for (triangle, _) in outside {
            (kept, count) = (kept + usize::from(all.contains(&bits(&triangle))), count + 1);
        }
        assert!(kept as f64 > 0.97 * f64::from(count), "{name}: {kept} of {count}");
    }
}

/// A mesh and its tool path come to a hot folder, the path later; where none comes in time, the mesh is done without it.
#[test]
fn a_mesh_waits_for_the_tool_path_beside_it() {
    let (place, case) = (Place::new(), CASES.iter().find(|case| case.name == "floor ball 1").unwrap());
    let part = cut::make(case);
    let settings = |minutes: u32| {
        format!("[residue]\ntoolpath = \"*.nc\"\nwait_minutes = {minutes}\ntools = [\"{}\"]\n", case.cutter.words())
    };
    place.put("hot/in/cut/.suture.toml", settings(10).as_bytes());
    place.put("hot/in/alone/.suture.toml", settings(0).as_bytes());
    place.put("hot/in/cut/part.stl", &part.stl());
    place.put("hot/in/alone/lone.stl", &part.stl());
    let _daemon = Served::start(&place, &["hot", "--settle", "300ms"], "log");
    let note = |path: &str| {
        let all = jobs(&place, "hot");
        let job = all.iter().find(|job| job["source"]["path"] == path);
        job.map(|job| format!("{} {}", job["kind"], job["note"])).unwrap_or_default()
    };
    wait_until("it waits, and says for which file", || {
        note("cut/part.stl").contains("part.nc, its tool path, is not beside it yet")
    });
    wait_until("the other one is done", || note("alone/lone.stl").contains("done"));
    place.put("hot/in/cut/part.NC", part.code.as_bytes());
    wait_until("it is done", || note("cut/part.stl").contains("done"));
    let report = |name: &str| -> Value { serde_json::from_slice(&place.read(name)).unwrap() };
    let (cut, alone) = (report("hot/out/cut/part.stl.report.json"), report("hot/out/alone/lone.stl.report.json"));
    assert_eq!(cut["profile"]["residue"]["toolpath"], "*.nc");
    assert_eq!(cut["residue"]["regions"].as_array().unwrap().len(), 1, "{}", cut["residue"]);
    assert!(read(&place, "hot/out/cut/part.stl").len() < part.labels.len());
    assert!(alone["residue"]["why_not"].as_str().unwrap().starts_with("lone.nc: cannot be read"), "{}", alone["residue"]);
    assert!(place.read("hot/out/alone/lone.stl") == part.stl());
    assert!(place.read("hot/in/cut/part.NC") == part.code.as_bytes(), "the path stays where it is");
}

/// A triangle's bits, from its least corner on.
fn bits(triangle: &Triangle) -> [[u32; 3]; 3] {
    let [a, b, c] = triangle.map(|point| point.map(|x| (x + 0.0).to_bits()));
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default()
}

#[test]
fn a_path_that_is_no_path_is_named_and_the_mesh_stays() {
    let place = Place::new();
    place.put("in.stl", &stl::mesh(&sphere(|_, _| 0.0)));
    place.put("lathe.nc", b"G21 G90\nG1 X1 F100\nG33 Z-5 K1\n");
    for (path, words) in [("lathe.nc", "line 3"), ("none.nc", "cannot be read"), ("in.stl", "neither G-code nor APT")] {
        let told = run_to(&place, 1, "residue", &["--toolpath", path, "--tool", "ball,d=6"]);
        assert!(told["residue"]["why_not"].as_str().unwrap().contains(words), "{told}");
        assert!(place.read("out.stl") == place.read("in.stl"));
    }
    let refused = place.suture(["residue", "in.stl", "-o", "new.stl"]).expect(2).stderr();
    assert!(refused.contains("--toolpath"), "{refused}");
}
