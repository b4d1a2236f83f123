//! A model of a disk under a program that was cut off from power: what was synced is there, of the rest anything may be.
//!
//! A file's bytes and size are durable once the file was synced, a name once its folder was; syncing a new file does not make its name
//! durable. [`Kind::Journal`] is kinder, as ext4 and XFS are. Moving a file is a new name and then the loss of the old one, never the other way round,
//! as every journal keeps it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A file, whatever its names.
pub type FileId = usize;

/// One change that the disk may have or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// Bytes of a file.
    Write { file: FileId, at: u64, bytes: Vec<u8> },
    /// Its size.
    Resize { file: FileId, size: u64 },
    /// A name; what had it loses it.
    Name { path: PathBuf, file: FileId },
    /// The end of a name, if the file has it. `after` is the change that has to be there first.
    Unname { path: PathBuf, file: FileId, after: Option<usize> },
    /// A folder.
    MakeFolder(PathBuf),
    /// The end of a folder.
    RemoveFolder(PathBuf),
}

/// A change, or what makes earlier ones durable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A change.
    Change(Change),
    /// Of a file's bytes and size.
    SyncFile(FileId),
    /// Of the names in a folder.
    SyncFolder(PathBuf),
}

/// Folders, files and their bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Tree {
    /// Besides the root.
    pub folders: BTreeSet<PathBuf>,
    /// Names of files.
    pub names: BTreeMap<PathBuf, FileId>,
    /// Bytes of those that were written to; the others are as they were.
    pub bytes: BTreeMap<FileId, Vec<u8>>,
}

/// What a sync does besides what it must.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing.
    Strict,
    /// It writes the journal out: all names given and taken before are durable, too.
    Journal,
}

/// A disk, and all that happened to it.
pub struct Disk {
    start: Tree,
    events: Vec<Event>,
    /// For each event: the first later one that makes it durable.
    durable: Vec<usize>,
}

impl Disk {
    /// From a tree that is durable, and what was done to it.
    pub fn new(kind: Kind, start: Tree, events: Vec<Event>) -> Self {
        let mut durable = vec![usize::MAX; events.len()];
        for (at, event) in events.iter().enumerate() {
            for (before, slot) in events[..at].iter().zip(&mut durable) {
                if *slot == usize::MAX && makes_durable(kind, event, before) {
                    *slot = at;
                }
            }
        }
        Self { start, events, durable }
    }

    /// Events there are.
    pub fn len(&self) -> usize {
        self.events.len()
    }

    /// Nothing happened.
    pub fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// An event, for people.
    pub fn event(&self, at: usize) -> &Event {
        &self.events[at]
    }

    /// Changes that may or may not be there when the power goes before event `end`.
    pub fn open(&self, end: usize) -> Vec<usize> {
        let change = |at: &usize| matches!(self.events[*at], Event::Change(_)) && self.durable[*at] >= end;
        (0..end).filter(change).collect()
    }

    /// The disk when the power goes before event `end`, and of the changes that are not durable these are lost.
    pub fn after(&self, end: usize, lost: &BTreeSet<usize>) -> Tree {
        let mut tree = self.start.clone();
        let mut there = vec![false; end];
        for at in 0..end {
            let Event::Change(change) = &self.events[at] else { continue };
            if !lost.contains(&at) {
                there[at] = tree.apply(change, &there);
            }
        }
        // A file without a name is gone.
        let named: BTreeSet<FileId> = tree.names.values().copied().collect();
        tree.bytes.retain(|file, _| named.contains(file));
        tree
    }
}

fn makes_durable(kind: Kind, sync: &Event, event: &Event) -> bool {
    let Event::Change(change) = event else { return false };
    let data = matches!(change, Change::Write { .. } | Change::Resize { .. });
    match (sync, change) {
        (Event::SyncFile(_) | Event::SyncFolder(_), _) if kind == Kind::Journal && !data => true,
        (Event::SyncFile(synced), Change::Write { file, .. } | Change::Resize { file, .. }) => synced == file,
        (
            Event::SyncFolder(synced),
            Change::Name { path, .. } | Change::Unname { path, .. } | Change::MakeFolder(path) | Change::RemoveFolder(path),
        ) => path.parent() == Some(synced),
        _ => false,
    }
}

impl Tree {
    fn has_folder(&self, path: &Path) -> bool {
        path.as_os_str().is_empty() || self.folders.contains(path)
    }

    /// Whether it could be applied: a name needs its folder.
    fn apply(&mut self, change: &Change, there: &[bool]) -> bool {
        match change {
            Change::Write { file, at, bytes } => {
                let content = self.bytes.entry(*file).or_default();
                let (at, end) = (*at as usize, *at as usize + bytes.len());
                if content.len() < end {
                    content.resize(end, 0);
                }
                content[at..end].copy_from_slice(bytes);
            }
            Change::Resize { file, size } => self.bytes.entry(*file).or_default().resize(*size as usize, 0),
            Change::Name { path, file } => {
                if !self.has_folder(path.parent().unwrap_or(Path::new(""))) {
                    return false;
                }
                self.names.insert(path.clone(), *file);
            }
            Change::Unname { path, file, after } => {
                if after.is_some_and(|after| !there[after]) || self.names.get(path) != Some(file) {
                    return false;
                }
                self.names.remove(path);
            }
            Change::MakeFolder(path) => {
                if !self.has_folder(path.parent().unwrap_or(Path::new(""))) {
                    return false;
                }
                self.folders.insert(path.clone());
            }
            Change::RemoveFolder(path) => {
                // Not empty when the end of what is in it was lost.
                let full = self.names.keys().chain(&self.folders).any(|below| below.parent() == Some(path));
                if full {
                    return false;
                }
                self.folders.remove(path);
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(path: &str, file: FileId) -> Event {
        Event::Change(Change::Name { path: path.into(), file })
    }

    fn write(file: FileId, bytes: &[u8]) -> Event {
        Event::Change(Change::Write { file, at: 0, bytes: bytes.into() })
    }

    /// A file that is synced, but not its folder, may have no name; with its folder it has.
    #[test]
    fn a_name_needs_its_folder_synced() {
        let disk = Disk::new(
            Kind::Strict,
            Tree::default(),
            vec![name("a", 0), write(0, b"x"), Event::SyncFile(0), Event::SyncFolder("".into())],
        );
        assert_eq!(disk.open(1), [0]);
        assert_eq!(disk.open(2), [0, 1]);
        assert_eq!(disk.open(3), [0], "the bytes are durable, the name is not");
        assert_eq!(disk.open(4), Vec::<usize>::new());
        assert_eq!(disk.after(3, &[0].into()), Tree::default());
        assert_eq!(disk.after(2, &[1].into()).names.len(), 1, "a name without bytes");
        assert_eq!(disk.after(4, &[].into()).bytes[&0], b"x");
    }

    /// A moved file is under its old name, its new one, or both; never under none.
    #[test]
    fn a_moved_file_is_somewhere() {
        let start = Tree { names: [("a".into(), 0)].into(), ..Tree::default() };
        let gone = Event::Change(Change::Unname { path: "a".into(), file: 0, after: Some(0) });
        let disk = Disk::new(Kind::Strict, start, vec![name("b", 0), gone]);
        for (lost, names) in [(vec![], vec!["b"]), (vec![1], vec!["a", "b"]), (vec![0], vec!["a"]), (vec![0, 1], vec!["a"])] {
            let tree = disk.after(2, &lost.iter().copied().collect());
            assert_eq!(tree.names.keys().map(|p| p.to_str().unwrap()).collect::<Vec<_>>(), names, "{lost:?}");
        }
    }

    /// Without its folder a file has no place.
    #[test]
    fn a_lost_folder_takes_its_files_along() {
        let events = vec![Event::Change(Change::MakeFolder("f".into())), name("f/a", 0), Event::SyncFolder("f".into())];
        let disk = Disk::new(Kind::Strict, Tree::default(), events.clone());
        assert_eq!(disk.open(3), [0]);
        assert_eq!(disk.after(3, &[0].into()), Tree::default());
        assert_eq!(Disk::new(Kind::Journal, Tree::default(), events).open(3), Vec::<usize>::new());
    }
}
