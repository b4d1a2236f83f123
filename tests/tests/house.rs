//! The rules of the house, read from the source: files import each other in no circle, nor do folders, those of the engine import only those
//! above them and state their contract, and no file or function is too long to be read in one go. And every fault that the daemon is built
//! against has a test of its number.

#[path = "house/faults.rs"]
mod faults;
#[path = "house/imports.rs"]
mod imports;
#[path = "house/lengths.rs"]
mod lengths;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use imports::Imports;

/// The folders of the engine, each of which may import those before it, and only those.
const ROOMS: [&str; 21] = [
    "util",
    "contract",
    "curves",
    "defeature",
    "toolpath",
    "attributes",
    "io",
    "geometry",
    "stream",
    "topology",
    "submesh",
    "detect",
    "algorithms",
    "proof",
    "simplify",
    "smooth",
    "residue",
    "output",
    "diagnosis",
    "repairs",
    "engine",
];

/// The crates that are held to these rules.
const CRATES: [&str; 5] = ["core", "store", "daemon", "python", "bench"];

fn sources(of_crate: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(of_crate).join("src")
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for of_crate in CRATES {
        let imports = Imports::of(&sources(of_crate));
        assert!(imports.edges() >= imports.files().count(), "{of_crate}: imports are found");
        let circles = imports.circles();
        assert!(circles.is_empty(), "{of_crate}: {circles:#?}");
    }
}

#[test]
fn no_folders_import_each_other_in_a_circle() {
    for of_crate in CRATES {
        let circles: Vec<_> = Imports::of(&sources(of_crate)).folders().iter().flat_map(Imports::circles).collect();
        assert!(circles.is_empty(), "{of_crate}: {circles:#?}");
    }
}

#[test]
fn each_folder_of_the_engine_states_its_contract() {
    for room in ROOMS {
        let [folder, file] = [sources("core").join(room).join("mod.rs"), sources("core").join(format!("{room}.rs"))];
        let text = std::fs::read_to_string(if folder.exists() { &folder } else { &file }).expect("it can be read");
        for part in ["//! **In:**", "//! **Out:**", "//! **Promise:**"] {
            assert!(text.contains(part), "{room} lacks `{part}`");
        }
    }
}

#[test]
fn no_folder_of_the_engine_imports_one_below_it() {
    let imports = Imports::of(&sources("core"));
    let rank =
        |room: &str| ROOMS.iter().position(|known| *known == room).unwrap_or_else(|| panic!("{room} has no place in ROOMS"));
    let mut upward = Vec::new();
    for (from, to) in imports.all() {
        // The root of the crate says what the engine offers, and may import anything; nothing imports the root.
        match (from.first(), to.first()) {
            (Some(from_room), Some(to_room)) if rank(to_room) > rank(from_room) => {
                upward.push(format!("{from:?} imports {to:?}"))
            }
            (Some(_), None) => upward.push(format!("{from:?} imports the root")),
            _ => {}
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
}

#[test]
fn circles_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("it has a parent")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    write("lib.rs", "mod a; mod b; mod c; mod d; #[cfg(test)] mod e;");
    write("a.rs", "use crate::b::{self, B};");
    write("b.rs", "struct B; mod inner { use super::super::c::C; }");
    write("c/mod.rs", "mod child; struct C; #[cfg(test)] mod tests { use crate::a; }");
    write("c/child.rs", "fn f() { crate::d::g(); }");
    write("d.rs", "fn g() {}");
    write("e.rs", "use crate::d; mod f { use crate::e; }");
    assert_eq!(Imports::of(folder.path()).circles(), Vec::<Vec<String>>::new(), "tests may look anywhere");
    write("d.rs", "use super::a::A;");
    assert_eq!(Imports::of(folder.path()).circles(), Vec::<Vec<String>>::new(), "c does not use its child");
    write("c/mod.rs", "mod child; use child::f; struct C;");
    assert_eq!(Imports::of(folder.path()).circles(), [["a", "b", "c", "c::child", "d"]]);
}

#[test]
fn circles_of_folders_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("it has a parent")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    write("lib.rs", "mod a; mod b;");
    write("a/mod.rs", "mod one; mod two;");
    write("a/one.rs", "use crate::b::B;");
    write("a/two.rs", "pub struct Two;");
    write("b.rs", "use crate::a::two::Two;");
    let imports = Imports::of(folder.path());
    assert!(imports.circles().is_empty(), "no file leads to itself");
    let circles: Vec<_> = imports.folders().iter().flat_map(Imports::circles).collect();
    assert_eq!(circles, [["a", "b"]]);
}

#[test]
fn the_map_names_every_file() {
    let map = std::fs::read_to_string(sources("core").join("../../ARCHITECTURE.md")).expect("the map");
    let mut named = BTreeSet::new();
    for line in map.lines() {
        // Every second part of a line stands between backticks.
        let quoted = line.split('`').skip(1).step_by(2);
        let heading = line.strip_prefix("### ");
        named.extend(quoted.chain(heading).flat_map(|part| part.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')));
    }
    for of_crate in ["core", "store", "daemon", "python"] {
        let unnamed: Vec<_> = Imports::of(&sources(of_crate))
            .files()
            .filter_map(|file| file.last().filter(|name| !named.contains(name.as_str())).map(|_| file.join("/")))
            .collect();
        assert!(unnamed.is_empty(), "{of_crate}: {unnamed:?} are not in ARCHITECTURE.md");
    }
}

/// Lines of a file, at most.
const LONGEST_FILE: usize = 500;
/// Lines of a function, at most.
const LONGEST_FUNCTION: usize = 60;

#[test]
fn no_file_and_no_function_is_too_long() {
    let mut long = Vec::new();
    for of_crate in CRATES {
        long.extend(lengths::beyond(&sources(of_crate), LONGEST_FILE, LONGEST_FUNCTION));
    }
    assert!(long.is_empty(), "{long:#?}");
}

/// Bytes of a file of the repository, at most: what is larger was made or fetched, and taken in by mistake.
const LARGEST: u64 = 1 << 20;

#[test]
fn no_file_of_the_repository_is_large() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let listed = std::process::Command::new("git").arg("-C").arg(&root).args(["ls-files", "-z"]).output();
    // A copy without its history has only what was packed into it.
    let Some(listed) = listed.ok().filter(|listed| listed.status.success()) else { return };
    let names = String::from_utf8(listed.stdout).expect("names in UTF-8");
    let size = |name: &str| std::fs::metadata(root.join(name)).map_or(0, |data| data.len());
    let large: Vec<&str> = names.split('\0').filter(|name| !name.is_empty() && size(name) > LARGEST).collect();
    assert!(large.is_empty(), "{large:?}");
}

/// Faults without a test, and why there is none.
const WITHOUT: [(u32, &str); 0] = [];

/// The last fault.
const FAULTS: u32 = 30;

#[test]
fn every_fault_has_a_test_of_its_number() {
    let mut proofs = faults::Proofs::new();
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    CRATES.iter().map(|of_crate| sources(of_crate)).chain([tests]).for_each(|folder| faults::gather(&folder, &mut proofs));
    let without: BTreeSet<u32> = WITHOUT.iter().map(|(number, _)| *number).collect();
    let missing: Vec<_> = (1..=FAULTS).filter(|number| !proofs.contains_key(number) && !without.contains(number)).collect();
    assert!(missing.is_empty(), "no test is named after {missing:?}");
    let surplus: Vec<_> =
        proofs.iter().filter(|(number, _)| without.contains(number) || !(1..=FAULTS).contains(*number)).collect();
    assert!(surplus.is_empty(), "there are tests of faults that are said to have none, or that nobody knows: {surplus:?}");
    let map = std::fs::read_to_string(sources("core").join("../../ARCHITECTURE.md")).expect("the map");
    let named: BTreeSet<&str> = map.split('`').filter(|part| faults::number_of(part).is_some()).collect();
    let there: BTreeSet<&str> = proofs.values().flatten().map(String::as_str).collect();
    let differ: Vec<_> = named.symmetric_difference(&there).collect();
    assert!(differ.is_empty(), "in ARCHITECTURE.md or in the sources, but not in both: {differ:?}");
}

#[test]
fn tests_of_faults_are_found() {
    let text = "fn f01_helper() {}\n#[test]\nfn f02_a() {\n    #[test]\n    #[cfg(unix)]\n    fn f03_b(x in 0..3) {\n#[test]\nlet x;\nfn f04_c() {}";
    assert_eq!(faults::tests_in(text), ["f02_a", "f03_b"]);
    assert_eq!(
        ["f07_a", "f7_a", "f107_a", "fast", "f07_", "from_a"].map(faults::number_of),
        [Some(7), None, None, None, None, None]
    );
}
