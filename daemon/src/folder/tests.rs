//! A folder is told by its names, its parts and its owner.

use super::*;

#[test]
fn meshes_litter_and_the_rest() {
    for mesh in ["part.stl", "PART.STL", "a b$.Stl", "CON.stl", "scan.ply", "a.OBJ", "b.off", "c.amf"] {
        assert_eq!(name_kind(OsStr::new(mesh)), NameKind::Mesh, "{mesh}");
    }
    for ignored in [
        ".part.stl",
        "part.stl.crdownload",
        "part.stl.part",
        "part.stl.report.json",
        "part.stl.suture.json",
        "~$part.stl",
        "part.stl~",
        "Thumbs.db",
        "@eaDir",
        "x.TMP",
    ] {
        assert_eq!(name_kind(OsStr::new(ignored)), NameKind::Ignored, "{ignored}");
    }
    for foreign in ["part.step", "notes.txt", "stl", "obj"] {
        assert_eq!(name_kind(OsStr::new(foreign)), NameKind::Foreign, "{foreign}");
    }
}

#[test]
fn meshes_of_other_formats_are_meant_notes_are_not() {
    for (name, meant) in [("a.3mf", true), ("A.OBJ", true), ("link.stl", true), ("notes.txt", false), ("obj", false)] {
        assert_eq!(is_meant(OsStr::new(name)), meant, "{name}");
    }
}

#[test]
fn f17_a_folder_has_one_owner() {
    let dir = tempfile::tempdir().unwrap();
    let config = FolderConfig::of(dir.path());
    let first = Folder::open(&config, None).unwrap();
    assert!(first.inbox().is_dir() && first.out().is_dir());
    match Folder::open(&config, None) {
        Err(FolderError::Owned { pid, .. }) => assert_eq!(pid, Some(std::process::id())),
        other => panic!("{other:?}"),
    }
    let other = Folder::of_other(&config).unwrap();
    let why = [other.check(), other.regain()].map(Result::unwrap_err);
    assert!(why[1].contains("is served by another daemon"), "{why:?}");
    drop(first);
    assert!(other.check().is_err(), "it is not taken by a look");
    other.regain().unwrap();
    other.check().unwrap();
    assert!(matches!(Folder::open(&config, None), Err(FolderError::Owned { .. })));
}

/// D5: neither a folder that was made anew under the old name nor a store that was removed is taken for the one that was opened.
#[test]
fn a_folder_is_told_by_its_identity() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let config = FolderConfig::of(&at("hot"));
    let folder = Folder::open(&config, None).unwrap();
    folder.check().unwrap();
    std::fs::remove_dir(at("hot/out")).unwrap();
    folder.check().expect("a part may be made again");
    std::fs::rename(at("hot"), at("old")).unwrap();
    assert!(folder.check().unwrap_err().contains("out of reach"));
    std::fs::create_dir(at("hot")).unwrap();
    assert!(folder.check().unwrap_err().contains("another folder"));
    Folder::open(&config, None).expect("it is another folder, and another daemon's to serve");
    assert!(folder.check().is_err());
    std::fs::remove_dir_all(at("hot")).unwrap();
    std::fs::rename(at("old"), at("hot")).unwrap();
    folder.check().expect("it is back");
    std::fs::remove_dir_all(at("hot/.suture")).unwrap();
    std::fs::create_dir_all(at("hot/.suture/work")).unwrap();
    assert!(folder.check().is_err(), "the store went with it");
}

/// A bare folder under a mount that is gone is not the folder: nothing is made in it, nothing in it believed.
#[test]
fn f25_a_folder_is_away_until_it_is_back() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let config = FolderConfig::of(&at("hot"));
    let here = Folder::open(&config, None).unwrap().trace();
    let text = serde_json::to_string(&here).unwrap();
    let mut there: serde_json::Value = serde_json::from_str(&text).unwrap();
    there["mount"] = "/mnt/disk".into();
    let there: Trace = serde_json::from_value(there).unwrap();
    Folder::open(&config, Some(&there)).unwrap().check().expect("it has its mark");
    std::fs::rename(at("hot"), at("disk")).unwrap();
    std::fs::create_dir_all(at("hot/in")).unwrap();
    let folder = Folder::open(&config, Some(&there)).unwrap();
    for why in [folder.check(), folder.regain(), folder.missing().map_or(Ok(()), Err)] {
        assert!(why.unwrap_err().contains("the mount /mnt/disk is not there"));
    }
    assert!(!at("hot/out").exists() && !at("hot/.suture").exists());
    std::fs::remove_dir_all(at("hot")).unwrap();
    std::fs::rename(at("disk"), at("hot")).unwrap();
    folder.regain().unwrap();
    folder.check().unwrap();
    assert!(matches!(Folder::open(&config, None), Err(FolderError::Owned { .. })), "its lock is held");
}

/// A disk that is mounted again may be another device: the folder is told by its mark.
#[test]
fn f25_a_folder_with_its_mark_is_the_folder_whatever_its_inode() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let config = FolderConfig::of(&at("hot"));
    let folder = Folder::open(&config, None).unwrap();
    std::fs::rename(at("hot"), at("old")).unwrap();
    std::fs::create_dir_all(at("hot/.suture")).unwrap();
    assert!(folder.regain().unwrap_err().contains("another folder"));
    std::fs::write(at("hot/.suture/id"), "some other\n").unwrap();
    assert!(folder.regain().is_err());
    std::fs::copy(at("old/.suture/id"), at("hot/.suture/id")).unwrap();
    assert!(folder.check().is_err());
    folder.regain().unwrap();
    folder.check().unwrap();
    assert!(at("hot/out").is_dir());
}

/// `out/` or `done/` that leads to `in/` made results of results, without end.
#[test]
fn a_part_that_leads_to_another_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let config = FolderConfig::of(dir.path());
    for (part, target) in [("out", "in"), ("done", "in"), ("failed", "in/deep")] {
        std::fs::create_dir_all(dir.path().join("in/deep")).unwrap();
        std::os::unix::fs::symlink(target, dir.path().join(part)).unwrap();
        assert!(matches!(Folder::open(&config, None), Err(FolderError::Mixed { .. })), "{part} -> {target}");
        std::fs::remove_file(dir.path().join(part)).unwrap();
    }
    let folder = Folder::open(&config, None).unwrap();
    std::fs::remove_dir(dir.path().join("out")).unwrap();
    std::os::unix::fs::symlink("in", dir.path().join("out")).unwrap();
    assert!(folder.check().unwrap_err().contains("results would be taken for drops"), "while it is served, too");
}

/// A hot folder in a part of another one, each with a daemon of its own: both would take its files.
#[test]
fn a_folder_within_a_hot_one_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let config = |path: PathBuf| FolderConfig::of(&path);
    let _outer = Folder::open(&config(dir.path().into()), None).unwrap();
    for inner in ["in", "in/sub/deeper", "out"] {
        let opened = Folder::open(&config(dir.path().join(inner)), None);
        assert!(matches!(opened, Err(FolderError::Within { .. })), "{inner}: {opened:?}");
        assert!(!dir.path().join("in/sub").exists(), "nothing was made");
    }
    Folder::open(&config(dir.path().join("beside")), None).expect("not in a part");
}

#[test]
fn a_sub_folder_names_the_profile() {
    let of = |text: &str| Folder::profile_folder(&RelPath::new(text.as_bytes()).unwrap());
    assert_eq!(of("a.stl"), None);
    assert_eq!(of("scan/a.stl").as_deref(), Some("scan"));
    assert_eq!(of("scan/order 7/a.stl").as_deref(), Some("scan"));
}
