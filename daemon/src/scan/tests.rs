use super::*;
use crate::config::{Config, FolderConfig};
use std::time::Duration;

fn reconciler(root: &Path) -> Reconciler {
    let settings = Settings::fixed(Config::for_folder(root));
    let folder = Folder::open(&FolderConfig { name: "hot".into(), ..FolderConfig::of(root) }, None).unwrap();
    Reconciler::new(Arc::new(folder), Arc::new(settings), Rest { settle: Duration::from_secs(1) })
}

/// Three looks, a second apart each.
fn settle(r: &mut Reconciler, start: Instant) -> Vec<(PathBuf, Submission)> {
    r.scan(start).unwrap();
    let mut all = Vec::new();
    for s in 1..=3 {
        all.extend(r.look(start + Duration::from_secs(s)));
    }
    all
}

fn mesh(path: &Path) {
    std::fs::write(path, [0; 84]).unwrap();
}

#[test]
fn f24_meshes_settle_foreign_files_are_noticed_links_are_not_followed() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    let inbox = dir.path().join("in");
    std::fs::create_dir(inbox.join("scan")).unwrap();
    mesh(&inbox.join("a.stl"));
    mesh(&inbox.join("scan/B.STL"));
    mesh(&inbox.join(".hidden.stl"));
    std::fs::write(inbox.join("x.step"), "v").unwrap();
    std::os::unix::fs::symlink("/etc/passwd", inbox.join("link.stl")).unwrap();
    let found = settle(&mut r, Instant::now());
    let said: BTreeMap<String, (String, Option<String>)> =
        found.into_iter().map(|(path, s)| (path.display().to_string(), (s.source.profile, s.foreign))).collect();
    assert_eq!(said.keys().collect::<Vec<_>>(), ["a.stl", "link.stl", "scan/B.STL", "x.step"]);
    assert_eq!(said["a.stl"], ("default".into(), None));
    assert_eq!(said["scan/B.STL"], ("scan".into(), None));
    assert!(said["link.stl"].1.as_ref().unwrap().contains("symbolic link"));
    assert!(said["x.step"].1.as_ref().unwrap().contains(".step"));
}

#[test]
fn a_file_is_submitted_once_until_it_changes() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    let path = dir.path().join("in/a.stl");
    mesh(&path);
    let start = Instant::now();
    let first = settle(&mut r, start);
    assert_eq!(first.len(), 2, "offered until it is submitted");
    r.submitted(&first[0].0, &first[0].1, JobId(1));
    assert!(settle(&mut r, start + Duration::from_secs(10)).is_empty());
    assert!(!r.is_settling());
    std::fs::remove_file(&path).unwrap();
    std::fs::write(&path, [0; 85]).unwrap();
    r.scan(start + Duration::from_secs(20)).unwrap();
    assert!(r.is_settling());
}

#[test]
fn a_job_of_an_earlier_life_answers_for_its_file() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    mesh(&dir.path().join("in/a.stl"));
    let found = settle(&mut r, Instant::now());
    let mut next = Reconciler::new(Arc::clone(&r.folder), Arc::clone(&r.settings), r.rest);
    next.known(&found[0].1.source, JobId(1));
    assert!(settle(&mut next, Instant::now()).is_empty());
    std::fs::write(dir.path().join("in/a.stl"), [0; 85]).unwrap();
    next.scan(Instant::now()).unwrap();
    assert!(next.is_settling(), "another content is another drop");
}

#[test]
fn deep_folders_are_searched_and_what_cannot_be_taken_is_told_of() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    let inbox = dir.path().join("in");
    let deep = |depth: usize| inbox.join("d/".repeat(depth));
    std::fs::create_dir_all(deep(DEPTH + 2)).unwrap();
    mesh(&deep(12).join("a.stl"));
    mesh(&deep(DEPTH).join("b.stl"));
    mesh(&deep(DEPTH + 1).join("lost.stl"));
    let long = inbox.join("n".repeat(250)).join("n".repeat(250)).join("n".repeat(200));
    std::fs::create_dir_all(&long).unwrap();
    mesh(&long.join("c.stl"));
    let start = Instant::now();
    let found = settle(&mut r, start);
    let names: BTreeSet<_> = found.iter().map(|(path, _)| path.file_name().unwrap().to_owned()).collect();
    assert_eq!(names.into_iter().collect::<Vec<_>>(), ["a.stl", "b.stl"]);
    let left = r.left_out();
    assert_eq!(left.len(), 2, "{left:?}");
    assert!(left[0].ends_with("it lies deeper than 64 folders") && left[1].contains("c.stl: longer than"), "{left:?}");
}

/// An original that is left in its place, on a disk that is another device since: taken once.
#[test]
fn a_file_of_a_disk_that_was_mounted_anew_is_known() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    mesh(&dir.path().join("in/a.stl"));
    let mut source = settle(&mut r, Instant::now()).remove(0).1.source;
    source.dev += 1;
    let mut next = Reconciler::new(Arc::clone(&r.folder), Arc::clone(&r.settings), r.rest);
    next.known(&source, JobId(1));
    assert!(settle(&mut next, Instant::now()).is_empty());
    source.ino += 1;
    next.known(&source, JobId(1));
    assert!(!settle(&mut next, Instant::now()).is_empty(), "another file");
}

#[test]
fn f25_a_folder_that_is_gone_is_not_empty() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    mesh(&dir.path().join("in/a.stl"));
    r.scan(Instant::now()).unwrap();
    std::fs::rename(dir.path().join("in"), dir.path().join("gone")).unwrap();
    assert!(r.scan(Instant::now()).is_err());
    assert!(r.is_settling(), "nothing is forgotten");
}

/// Whoever looks for the file need not read the log.
#[test]
fn a_file_that_a_program_keeps_open_is_told_of() {
    let dir = tempfile::tempdir().unwrap();
    let mut r = reconciler(dir.path());
    let path = dir.path().join("in/a.stl");
    mesh(&path);
    let writer = std::fs::OpenOptions::new().append(true).open(&path).unwrap();
    let start = Instant::now();
    assert!(settle(&mut r, start).is_empty() && r.left_out().is_empty(), "it may be closed soon");
    assert!(settle(&mut r, start + Duration::from_secs(3600)).is_empty());
    let left = r.left_out();
    assert!(left.len() == 1 && left[0].ends_with("a.stl: a program keeps it open for writing"), "{left:?}");
    drop(writer);
    let found = settle(&mut r, start + Duration::from_secs(7200));
    r.submitted(&found[0].0, &found[0].1, JobId(1));
    assert!(r.left_out().is_empty());
}
