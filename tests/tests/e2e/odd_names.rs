//! Names of all sorts: each file has a result of its own under its own name, and what is written about it is well-formed.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use suture_tests::binary::suture;
use suture_tests::scene::{Files, Scene};
use suture_tests::stl::{cuboid, mesh};

/// The longest name that there is.
const LONGEST: usize = 255;

/// Spaces, words of a shell, ends of lines, escapes, bytes that are no text, twins by case and by the spelling of an accent, names that
/// another system reserves, and the longest one.
fn dropped() -> Files {
    let listed: [&[u8]; 24] = [
        b"two  words .stl",
        b" first.stl",
        b"$HOME `id` $(id).stl",
        b"new\nline.stl",
        b"tab\tbell\x07 escape\x1b[31m.stl",
        b"K\xf6rper.stl",
        b"\xff\xfe.stl",
        "\u{e9}t\u{e9}.stl".as_bytes(),
        "e\u{301}te\u{301}.stl".as_bytes(),
        b"part.stl",
        b"Part.stl",
        b"PART.STL",
        b"part~2.stl",
        b"part.stl.stl",
        b"CON.stl",
        b"aux.stl",
        b"com1.STL",
        b"-o.stl",
        b"--help.stl",
        b"a\"b'c\\d.stl",
        b"*?[x].stl",
        b"x;y|z&<>.stl",
        b"%2e%2e%2fpart.stl",
        b"trailing. .stl",
    ];
    let longest = [&b"n".repeat(LONGEST - 4)[..], b".stl"].concat();
    let names = listed.into_iter().map(<[u8]>::to_vec).chain([longest]);
    // Sound, each of its own size: results are copies, by which they are known.
    let cube = |number: u16| mesh(&cuboid([0.0; 3], [10.0 + f32::from(number); 3]));
    (0..).zip(names).map(|(number, name)| (PathBuf::from(OsStr::from_bytes(&name)), cube(number))).collect()
}

/// Those of which a system that is blind to case, or to how an accent is spelt, sees one; and the name that one of them may get instead.
const TWINS: [&str; 6] = ["part~2.stl", "\u{e9}t\u{e9}.stl", "e\u{301}te\u{301}.stl", "part.stl", "Part.stl", "PART.STL"];

/// JSON without a control character that would steer whoever prints it.
fn document(out: &Files, result: &Path, ending: &str) -> Value {
    let name: OsString = [result.as_os_str(), OsStr::new(ending)].into_iter().collect();
    let bytes = out.get(Path::new(&name)).unwrap_or_else(|| panic!("{name:?} is missing"));
    let text = std::str::from_utf8(bytes).unwrap();
    assert!(!text.chars().any(|c| c.is_ascii_control() && c != '\n'), "{text}");
    serde_json::from_str(text).unwrap()
}

fn meshes(files: &Files) -> Files {
    files.iter().filter(|(name, _)| name.extension() != Some(OsStr::new("json"))).map(|(n, b)| (n.clone(), b.clone())).collect()
}

#[test]
fn f23_each_name_has_a_result_of_its_own() {
    let dropped = dropped();
    let scene = Scene::new(suture(), &dropped);
    scene.come_to_rest().unwrap();
    assert_eq!(scene.files("in"), Files::new());
    let (out, done) = (scene.files("out"), scene.files("done"));
    let results = meshes(&out);
    assert_eq!((results.len(), done.len()), (dropped.len(), dropped.len()), "{:?}", out.keys());
    for (name, bytes) in &dropped {
        let named = |files: &Files| files.iter().filter(|(_, there)| *there == bytes).map(|(n, _)| n.clone()).collect::<Vec<_>>();
        let (result, original) = (named(&results), named(&done));
        assert!(result.len() == 1 && original.len() == 1, "{name:?}: {result:?}, {original:?}");
        if name.as_os_str().len() < LONGEST {
            assert_eq!(&original[0], name);
            assert!(result[0] == *name || TWINS.iter().any(|twin| Path::new(twin) == name), "{name:?}: {result:?}");
        }
        let report = document(&out, &result[0], ".report.json");
        let shown = |part: &str, name: &Path| scene.path().join(part).join(name).to_string_lossy().into_owned();
        assert_eq!(
            (&report["input"]["path"], &report["output"]["path"]),
            (&shown("in", name).into(), &shown("out", &result[0]).into())
        );
        let receipt = document(&out, &result[0], ".suture.json");
        assert_eq!(receipt["output_blake3"], report["output"]["blake3"]);
    }
    let seen: BTreeSet<String> =
        results.keys().map(|name| name.to_string_lossy().to_lowercase().replace("e\u{301}", "\u{e9}")).collect();
    assert_eq!(seen.len(), results.len(), "no result hides another: {seen:?}");
    let jobs = scene.jobs().unwrap();
    let named: BTreeSet<&str> = jobs.iter().map(|job| job["source"]["path"].as_str().unwrap()).collect();
    assert_eq!((jobs.len(), named.len()), (dropped.len(), dropped.len()), "no two of them look alike: {named:?}");
    // For people: a line each, and the summary.
    let list = Command::new(suture()).args(["jobs", "list", "--dir"]).arg(scene.path()).output().unwrap();
    let list = String::from_utf8(list.stdout).unwrap();
    assert_eq!(list.lines().count(), dropped.len() + 1, "{list}");
    assert!(!list.chars().any(|c| c.is_control() && c != '\n'), "{list:?}");
}
