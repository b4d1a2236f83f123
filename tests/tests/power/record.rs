//! One run, written down as what the disk was told.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

use suture_tests::disk::{Change, Disk, Event, FileId, Kind, Tree};
use suture_tests::scene::{Files, Scene};
use suture_tests::trace::journal::{Act, Journal};
use suture_tests::trace::run;

const LIMIT: Duration = Duration::from_secs(60);

/// A run, and what is needed to replay it.
pub(crate) struct Record {
    pub disk: Disk,
    /// Second names of what was dropped: jobs know their files by inode, so a replay is made of the same inodes.
    pub kept: BTreeMap<FileId, PathBuf>,
    /// Dropped bytes, to see that no replay changed them.
    pub dropped: BTreeMap<FileId, Vec<u8>>,
    pub binary: PathBuf,
    names: BTreeMap<FileId, PathBuf>,
    /// Holds the second names.
    _scene: Scene,
}

impl Record {
    /// Runs the daemon once over these files.
    pub(crate) fn of(binary: &Path, files: &Files, kind: Kind) -> Self {
        let scene = Scene::new(binary, files);
        let mut journal = Journal::new(scene.path());
        let (mut kept, mut dropped) = (BTreeMap::new(), BTreeMap::new());
        for (path, file) in &journal.inputs {
            let second = scene.beside(&format!("kept-{file}"));
            std::fs::hard_link(scene.path().join(path), &second).expect("a file can have two names");
            dropped.insert(*file, std::fs::read(&second).expect("it can be read"));
            kept.insert(*file, second);
        }
        let names = journal.inputs.clone();
        let ended = run(&scene.once(), &scene.errors(), LIMIT, &mut journal).expect("the daemon can be traced");
        assert_eq!((ended.status.code(), ended.left), (Some(1), 0), "{ended:?}");
        let jobs = scene.jobs().expect("jobs can be listed");
        assert!(jobs.iter().any(|job| job["reused"].is_u64()), "nothing was copied: {jobs:?}");
        let folders = names.keys().flat_map(|path| path.ancestors().skip(1)).filter(|path| !path.as_os_str().is_empty());
        let folders: BTreeSet<PathBuf> = folders.map(Path::to_owned).collect();
        let start = Tree { folders, names, bytes: BTreeMap::new() };
        let mut events = Vec::new();
        let mut names: BTreeMap<FileId, PathBuf> = BTreeMap::new();
        for act in journal.acts {
            if let Act::Name { path, file } | Act::Rename { to: path, file, .. } = &act {
                names.insert(*file, path.clone());
            }
            told(act, &mut events);
        }
        Self { disk: Disk::new(kind, start, events), kept, dropped, binary: binary.into(), names, _scene: scene }
    }

    /// The moment and the loss, for people.
    pub(crate) fn describe(&self, end: usize, lost: &BTreeSet<usize>) -> String {
        let show = |at: usize| self.show(at);
        let before = if end < self.disk.len() { show(end) } else { "the end".into() };
        if lost.is_empty() {
            return format!("power lost before event {end} ({before})");
        }
        let mut lost: Vec<String> = lost.iter().map(|at| show(*at)).collect();
        let count = lost.len();
        lost.truncate(6);
        let dots = if count > 6 { ", …" } else { "" };
        format!("power lost before event {end} ({before}) with {count} changes: {}{dots}", lost.join(", "))
    }

    /// Changes that may be lost before event `end`, but for those that `SUTURE_KEPT` names (words of their lines, with commas between).
    pub(crate) fn open(&self, end: usize) -> Vec<usize> {
        let kept = std::env::var("SUTURE_KEPT").unwrap_or_default();
        let kept: Vec<&str> = kept.split(',').filter(|word| !word.is_empty()).collect();
        let mut open = self.disk.open(end);
        open.retain(|at| kept.is_empty() || !kept.iter().any(|word| self.show(*at).contains(word)));
        open
    }

    /// An event, for people.
    fn show(&self, at: usize) -> String {
        let name = |file: &FileId| self.names.get(file).map_or_else(|| format!("#{file}"), |path| format!("{}", path.display()));
        match self.disk.event(at) {
            Event::Change(Change::Write { file, at, bytes }) => format!("write {} at {at}+{}", name(file), bytes.len()),
            Event::Change(Change::Resize { file, size }) => format!("size {} {size}", name(file)),
            Event::Change(Change::Name { path, .. }) => format!("name {}", path.display()),
            Event::Change(Change::Unname { path, .. }) => format!("unname {}", path.display()),
            Event::Change(Change::MakeFolder(path)) => format!("mkdir {}", path.display()),
            Event::Change(Change::RemoveFolder(path)) => format!("rmdir {}", path.display()),
            Event::SyncFile(file) => format!("sync {}", name(file)),
            Event::SyncFolder(path) => format!("sync {}/", path.display()),
        }
    }
}

/// What an act means to a disk.
fn told(act: Act, events: &mut Vec<Event>) {
    let change = match act {
        Act::OpenedForWriting(_) | Act::Touched(_) => return,
        Act::MappedForWriting(file) => panic!("file {file} is written through a mapping, of which nothing is seen here"),
        Act::RenameFolder { from, to } => panic!("{} becomes {}: not modelled", from.display(), to.display()),
        Act::SyncFile(file) => return events.push(Event::SyncFile(file)),
        Act::SyncFolder(path) => return events.push(Event::SyncFolder(path)),
        Act::Rename { from, to, file } => {
            let after = Some(events.len());
            events.push(Event::Change(Change::Name { path: to, file }));
            Change::Unname { path: from, file, after }
        }
        Act::Write { file, at, bytes } => Change::Write { file, at, bytes },
        Act::Resize { file, size } => Change::Resize { file, size },
        Act::Name { path, file } => Change::Name { path, file },
        Act::Unname { path, file } => Change::Unname { path, file, after: None },
        Act::MakeFolder(path) => Change::MakeFolder(path),
        Act::RemoveFolder(path) => Change::RemoveFolder(path),
    };
    events.push(Event::Change(change));
}
