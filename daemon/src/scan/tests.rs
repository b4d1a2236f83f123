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

fn new(id: u64) -> Submitted {
    Submitted { id: JobId(id), new: true, ended: false }
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
    r.submitted(&first[0].0, &first[0].1, new(1));
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
    next.known(&found[0].1.source, JobId(1), None);
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
    next.known(&source, JobId(1), None);
    assert!(settle(&mut next, Instant::now()).is_empty());
    source.ino += 1;
    next.known(&source, JobId(1), None);
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
    r.submitted(&found[0].0, &found[0].1, new(1));
    assert!(r.left_out().is_empty());
}

/// Seconds from the start at which a look is taken, and the names that came to rest in it; an OBJ and its companions are submitted, as the keeper does.
struct Watched {
    dir: tempfile::TempDir,
    r: Reconciler,
    start: Instant,
    jobs: u64,
    /// Names that have had a job.
    known: BTreeSet<PathBuf>,
}

impl Watched {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let r = reconciler(dir.path());
        Self { dir, r, start: Instant::now(), jobs: 0, known: BTreeSet::new() }
    }

    fn put(&self, name: &str, text: &str) {
        let path = self.dir.path().join("in").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    /// Name of each file that is taken by looks at these seconds, `?` before those that are only noticed.
    fn taken(&mut self, seconds: std::ops::RangeInclusive<u64>) -> Vec<String> {
        let mut names = Vec::new();
        for second in seconds {
            let now = self.start + Duration::from_secs(second);
            self.r.scan(now).unwrap();
            for (path, submission) in self.r.look(now) {
                self.jobs += 1;
                let answer = Submitted { new: self.known.insert(path.clone()), ..new(self.jobs) };
                self.r.submitted(&path, &submission, answer);
                names.push(format!("{}{}", if submission.foreign.is_some() { "?" } else { "" }, path.display()));
            }
        }
        names
    }
}

const OBJ: &str = "mtllib part.mtl\nv 0 0 0\n";
const MTL: &str = "newmtl red\nmap_Kd wood.png\n";

#[test]
fn an_obj_goes_with_the_files_that_it_names() {
    let mut w = Watched::new();
    for (name, text) in [("o/part.obj", OBJ), ("o/part.mtl", MTL), ("o/wood.png", "png"), ("o/notes.txt", "n"), ("part.mtl", MTL)]
    {
        w.put(name, text);
    }
    let taken = w.taken(0..=5);
    assert_eq!(taken, ["o/part.mtl", "o/wood.png", "?o/notes.txt", "o/part.obj", "?part.mtl"], "another folder's is not named");
    assert!(!w.r.is_settling());
}

/// The rest is one second: six are waited, at most, and what comes later, while its OBJ is in work, goes along all the same.
#[test]
fn an_obj_waits_for_what_it_names_but_not_for_ever() {
    let mut w = Watched::new();
    w.put("part.obj", OBJ);
    w.put("notes.txt", "n");
    assert_eq!(w.taken(0..=3), ["?notes.txt"]);
    assert!(w.r.left_out()[0].ends_with("part.obj: it waits for files that it names: part.mtl"), "{:?}", w.r.left_out());
    assert!(w.r.have_waits_changed() && !w.r.have_waits_changed());
    w.put("part.mtl", MTL);
    assert_eq!(w.taken(4..=5), ["part.mtl"], "its library goes along, and names a texture");
    assert_eq!(w.taken(6..=8), ["part.obj"], "its patience is over");
    assert!(w.r.left_out().is_empty() && w.r.have_waits_changed());
    w.put("wood.png", "png");
    assert_eq!(w.taken(9..=14), ["wood.png"]);
    w.r.ended(Path::new("part.obj"));
    std::fs::remove_file(w.dir.path().join("in/part.obj")).unwrap();
    w.put("wood2.png", "png");
    w.put("part.mtl", "map_Kd wood2.png\n");
    assert_eq!(w.taken(15..=20), ["?part.mtl", "?wood2.png"], "no OBJ in `in/` names them any more");
}

/// Whatever lies there already is taken when an OBJ comes that names it: as a new submission of the same file, which the store knows.
#[test]
fn what_was_noticed_is_taken_when_its_obj_comes() {
    let mut w = Watched::new();
    w.put("part.mtl", MTL);
    w.put("wood.png", "png");
    assert_eq!(w.taken(0..=4), ["?part.mtl", "?wood.png"]);
    w.put("part.obj", OBJ);
    let mut taken = w.taken(5..=9);
    taken.sort();
    assert_eq!(taken, ["part.mtl", "part.obj", "wood.png"], "each once");
    // They have gone along while a second OBJ that names them is copied: it need not wait.
    let mut w = Watched::new();
    w.put("a.obj", OBJ);
    w.put("b.obj", OBJ.strip_suffix("\n").unwrap());
    w.put("part.mtl", "newmtl red\n");
    assert_eq!(w.taken(0..=3), ["part.mtl", "a.obj"], "the other one's length does not fit");
    w.r.ended(Path::new("part.mtl"));
    std::fs::remove_file(w.dir.path().join("in/part.mtl")).unwrap();
    w.put("b.obj", OBJ);
    assert_eq!(w.taken(4..=7), ["b.obj"]);
}

/// The most urgent OBJ lends its companions its own priority; one that is handed over does not wait, and its companions go along.
#[test]
fn companions_are_as_urgent_as_their_obj() {
    let mut w = Watched::new();
    w.put("part.obj", OBJ);
    w.put("part.mtl", "newmtl red\n");
    w.r.scan(w.start).unwrap();
    let (handed, _answer) = Handed::new("hot".into(), RelPath::new(*b"part.obj").unwrap(), None, None);
    let submission = w.r.hand_over(&handed).unwrap();
    w.r.known(&submission.source, JobId(1), Some(Priority::HIGHEST));
    let found = settle(&mut w.r, w.start);
    assert_eq!((found[0].0.as_path(), found[0].1.priority), (Path::new("part.mtl"), Priority::HIGHEST));
    assert!(found[0].1.foreign.is_none());
}

#[test]
fn no_link_and_no_mesh_is_a_companion() {
    let mut w = Watched::new();
    w.put("../secret.mtl", "s");
    w.put("other.stl", "solid a\nendsolid a\n");
    w.put("part.obj", "mtllib link.mtl\nmtllib ../secret.mtl\nmtllib other.stl\nmtllib way/a.mtl\n");
    let inbox = w.dir.path().join("in");
    std::os::unix::fs::symlink("../secret.mtl", inbox.join("link.mtl")).unwrap();
    std::fs::create_dir(w.dir.path().join("elsewhere")).unwrap();
    std::fs::write(w.dir.path().join("elsewhere/a.mtl"), "s").unwrap();
    std::os::unix::fs::symlink("../elsewhere", inbox.join("way")).unwrap();
    let mut taken = w.taken(0..=7);
    taken.sort();
    assert_eq!(taken, ["?link.mtl", "?way", "other.stl", "part.obj"]);
}

/// Originals stay: an OBJ that is done waits for nothing, and leads nothing any more, in this life and the next.
#[test]
fn an_obj_that_is_done_and_stays_waits_for_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let settings = Settings::fixed(Config::for_folder(dir.path()));
    let config = FolderConfig { name: "hot".into(), leave_originals: true, ..FolderConfig::of(dir.path()) };
    let folder = Arc::new(Folder::open(&config, None).unwrap());
    let r = Reconciler::new(Arc::clone(&folder), Arc::new(settings), Rest { settle: Duration::from_secs(1) });
    let mut w = Watched { dir, r, start: Instant::now(), jobs: 0, known: BTreeSet::new() };
    w.put("part.obj", OBJ);
    assert_eq!(w.taken(0..=7), ["part.obj"]);
    w.r.ended(Path::new("part.obj"));
    w.put("part.mtl", MTL);
    let taken = w.taken(8..=11);
    assert_eq!(taken, ["?part.mtl", "part.obj"], "found again, and known to the store");
}
