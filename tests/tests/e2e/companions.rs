//! An OBJ goes with its materials and textures: they are beside its result, byte for byte, in whatever order they come.

use std::time::Duration;

use serde_json::Value;
use suture_bench::judge::judge_triangles;
use suture_tests::Place;
use suture_tests::forms::{self, Form};
use suture_tests::served::{Served, jobs, wait_until};
use suture_tests::stl;

const LIBRARY: &[u8] = b"newmtl wood\r\nmap_Kd -s 1 1 1 tex\\my wood.png\r\n";
const PICTURE: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

/// A box without its last triangle, with these rows before it.
fn obj(rows: &str) -> Vec<u8> {
    let mut triangles = stl::cuboid([0.5; 3], [10.25, 20.75, 30.5]);
    triangles.pop();
    [rows.as_bytes(), &forms::write(Form::Obj, &triangles)].concat()
}

/// A place with a configuration of one folder.
fn place_with(of_folder: &str) -> Place {
    let place = Place::new();
    place.put("suture.toml", format!("settle = \"30ms\"\n[[folders]]\npath = \"hot\"\n{of_folder}\n").as_bytes());
    place
}

fn once(place: &Place, code: i32) -> String {
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(code).stderr()
}

/// Path and kind of each job, sorted.
fn kinds(place: &Place) -> Vec<String> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut all: Vec<_> =
        jobs(place, "hot").iter().map(|job| format!("{} {}", text(&job["source"]["path"]), text(&job["kind"]))).collect();
    all.sort();
    all
}

fn reason(place: &Place, path: &str) -> String {
    let all = jobs(place, "hot");
    let job = all.iter().find(|job| job["source"]["path"] == path).unwrap_or_else(|| panic!("{path}: {all:?}"));
    job["state"]["ended"]["publication"]["reason"].as_str().unwrap().to_owned()
}

/// Whatever comes first: all are taken, once, and nothing is left.
#[test]
fn an_obj_its_library_and_its_texture_come_in_any_order() {
    let files: [(&str, Vec<u8>); 3] = [
        ("part.obj", obj("mtllib part.mtl\nusemtl wood\n")),
        ("part.mtl", LIBRARY.to_vec()),
        ("tex/my wood.png", PICTURE.to_vec()),
    ];
    let run = |order: [usize; 3]| {
        let place = Place::new();
        let _daemon = Served::start(&place, &["hot", "--settle", "1s", "--log-format", "json"], "log");
        for at in order {
            let (name, bytes) = &files[at];
            place.put(&format!("hot/in/{name}"), bytes);
            std::thread::sleep(Duration::from_millis(1300));
        }
        wait_until("all three have ended", || kinds(&place) == ["part.mtl carried", "part.obj done", "tex/my wood.png carried"]);
        assert!(place.names("hot/in").is_empty(), "{order:?}: {:?}", place.names("hot/in"));
        for (name, bytes) in &files {
            assert_eq!(place.read(&format!("hot/done/{name}")), *bytes, "{order:?}: {name}");
        }
        for (name, bytes) in &files[1..] {
            assert_eq!(place.read(&format!("hot/out/{name}")), *bytes, "{order:?}: {name}");
            assert!(!place.at(&format!("hot/out/{name}.report.json")).exists(), "nothing was judged");
        }
        let result = place.read("hot/out/part.obj");
        assert!(result.starts_with(b"mtllib part.mtl\n"));
        let text = String::from_utf8(result).unwrap();
        let mesh: String = text.lines().filter(|row| row.starts_with(['v', 'f'])).map(|row| format!("{row}\n")).collect();
        assert!(judge_triangles(&forms::read("obj", mesh.as_bytes())).sound());
    };
    std::thread::scope(|scope| {
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            scope.spawn(move || run(order));
        }
    });
}

/// It is taken without it, and that is said; while it waits, whoever asks is told why.
#[test]
fn an_obj_whose_library_never_comes_is_taken_all_the_same() {
    let place = place_with("");
    place.put("hot/in/part.obj", &obj("mtllib part.mtl\n"));
    let said = once(&place, 0);
    let told: Vec<_> = said.lines().filter(|line| line.contains("did not come")).collect();
    assert!(told.len() == 1 && told[0].contains("part.mtl"), "{said}");
    assert_eq!(kinds(&place), ["part.obj done"]);

    let place = Place::new();
    let _daemon = Served::start(&place, &["hot", "--settle", "2s", "--log-format", "json"], "log");
    place.put("hot/in/part.obj", &obj("mtllib part.mtl\n"));
    let asked = || place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    wait_until("it is said why it waits", || asked().contains("part.obj: it waits for files that it names: part.mtl"));
    wait_until("it is done", || kinds(&place) == ["part.obj done"]);
    assert!(!asked().contains("it waits"), "{}", asked());
}

/// What has the name in `out/` stays. The same bytes are there already; with others, the folder's rule decides.
#[test]
fn f23_a_library_whose_name_is_taken_goes_by_the_rule_of_its_folder() {
    for (of_folder, code, kind) in [("", 0, "carried"), ("on_taken = \"fail\"", 1, "failed"), ("on_taken = \"skip\"", 0, "done")]
    {
        for bytes in [LIBRARY, b"theirs"] {
            let place = place_with(of_folder);
            place.put("hot/out/part.mtl", bytes);
            place.put("hot/in/part.mtl", LIBRARY);
            place.put("hot/in/tex/my wood.png", PICTURE);
            place.put("hot/in/part.obj", &obj("mtllib part.mtl\n"));
            let is_same = bytes == LIBRARY;
            once(&place, if is_same { 0 } else { code });
            let kind = if is_same { "carried" } else { kind };
            assert_eq!(kinds(&place), [&format!("part.mtl {kind}"), "part.obj done", "tex/my wood.png carried"]);
            assert_eq!(place.read("hot/out/part.mtl"), bytes, "{of_folder}");
            let why = reason(&place, "part.mtl");
            let words = match (is_same, of_folder) {
                (true, _) => "with the same bytes",
                (false, "") => "out/part.mtl was taken, and meshes that name it do not get this file, which is out/part~2.mtl",
                (false, _) => "out/part.mtl is there already",
            };
            assert!(why.contains(words), "{of_folder}: {why}");
            assert_eq!(place.at("hot/out/part~2.mtl").exists(), !is_same && of_folder.is_empty());
            assert!(place.names("hot/in").is_empty());
        }
    }
}

/// Nothing goes along but what lies in `in/`, is seen there, and is no mesh.
#[test]
fn f23_names_in_an_obj_lead_nowhere() {
    let place = place_with("");
    place.put("secret.mtl", b"secret");
    place.put("hot/secret.mtl", b"secret");
    place.put("hot/in/.hidden.mtl", b"hidden");
    place.put("hot/in/notes.txt", b"notes");
    place.put("hot/in/order/part.obj", &obj(&format!(
        "mtllib ../../secret.mtl\nmtllib ../../../secret.mtl\nmtllib {}\nmtllib C:\\secret.mtl\nmtllib ../.hidden.mtl\nmtllib ../link.mtl\n\
         mtllib ../way/secret.mtl\nmtllib part.obj\n",
        place.at("secret.mtl").display()
    )));
    std::os::unix::fs::symlink(place.at("secret.mtl"), place.at("hot/in/link.mtl")).unwrap();
    std::os::unix::fs::symlink(place.at(""), place.at("hot/in/way")).unwrap();
    once(&place, 0);
    assert_eq!(kinds(&place), ["link.mtl noticed", "notes.txt noticed", "order/part.obj done", "way noticed"]);
    assert!(place.names("hot/out").iter().all(|name| name.starts_with("order/")), "{:?}", place.names("hot/out"));
    assert!(place.read("secret.mtl") == b"secret" && place.read("hot/secret.mtl") == b"secret");
    assert!(place.read("hot/in/.hidden.mtl") == b"hidden" && place.read("hot/in/notes.txt") == b"notes");
}

/// Orders, forced work, and originals that stay; and what a lost store knows again from receipts.
#[test]
fn f06_carried_files_are_known_again_when_the_state_is_lost() {
    for of_folder in ["", "leave_originals = true"] {
        let place = place_with(of_folder);
        let put = |folder: &str| {
            place.put(&format!("hot/in/{folder}part.obj"), &obj("mtllib part.mtl\n"));
            place.put(&format!("hot/in/{folder}part.mtl"), LIBRARY);
            place.put(&format!("hot/in/{folder}tex/my wood.png"), PICTURE);
        };
        put("order-1/");
        once(&place, 0);
        put("!force/order-1/");
        once(&place, 0);
        let summary: Value = serde_json::from_slice(&place.read("hot/out/order-1/order.report.json")).unwrap();
        assert_eq!(summary["counts"], serde_json::json!({"carried": 2, "done": 1}), "{summary}");
        let out = place.names("hot/out");
        let copies: Vec<_> = out.iter().filter(|name| name.ends_with(".mtl") || name.ends_with(".png")).collect();
        assert_eq!(copies, ["order-1/part.mtl", "order-1/tex/my wood.png"], "the same bytes are not put there twice");
        assert!(place.names("hot/in").is_empty() == of_folder.is_empty());
        let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
        assert!(listed.contains("carried") && listed.contains("out/order-1/part.mtl"), "{listed}");
        let before = (kinds(&place), place.names("hot"));
        for lost in ["hot/.suture/state", "hot/.suture"] {
            std::fs::remove_dir_all(place.at(lost)).unwrap();
            once(&place, 0);
            assert_eq!((kinds(&place), place.names("hot")), before, "{of_folder}, without {lost}");
        }
    }
}
