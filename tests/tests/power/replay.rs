//! Makes the folder that a power cut leaves, and starts the daemon over it.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

use suture_tests::disk::{FileId, Tree};
use suture_tests::oracle::Expected;
use suture_tests::scene::Scene;

use crate::record::Record;

/// Arbitrary losses at each moment.
const SUBSETS: usize = 20;

/// Replays of one run.
pub(crate) struct Replay<'a> {
    record: &'a Record,
    expected: &'a Expected,
    dice: u64,
    seen: HashSet<u64>,
}

impl<'a> Replay<'a> {
    pub(crate) fn new(record: &'a Record, expected: &'a Expected, seed: u64) -> Self {
        Self { record, expected, dice: seed | 1, seen: HashSet::new() }
    }

    /// Trees tried so far.
    pub(crate) fn tried(&self) -> usize {
        self.seen.len()
    }

    fn below(&mut self, bound: usize) -> usize {
        self.dice ^= self.dice << 13;
        self.dice ^= self.dice >> 7;
        self.dice ^= self.dice << 17;
        (self.dice % bound.max(1) as u64) as usize
    }

    fn some_of(&mut self, open: &[usize]) -> BTreeSet<usize> {
        open.iter().copied().filter(|_| self.below(2) == 0).collect()
    }

    /// What may be lost when the power goes before event `end`: nothing, all, each alone, all but each, and arbitrary parts.
    pub(crate) fn losses(&mut self, end: usize) -> Vec<BTreeSet<usize>> {
        let open = self.record.open(end);
        let all: BTreeSet<usize> = open.iter().copied().collect();
        let mut losses = vec![BTreeSet::new(), all.clone()];
        losses.extend(open.iter().map(|one| BTreeSet::from([*one])));
        losses.extend(open.iter().map(|one| all.iter().copied().filter(|other| other != one).collect()));
        losses.extend((0..SUBSETS).map(|_| self.some_of(&open)));
        losses
    }

    /// Any moment and loss.
    pub(crate) fn any(&mut self) -> (usize, BTreeSet<usize>) {
        let end = self.below(self.record.disk.len() + 1);
        let open = self.record.open(end);
        let lost = match self.below(4) {
            0 => open.iter().copied().collect(),
            1 if !open.is_empty() => BTreeSet::from([open[self.below(open.len())]]),
            2 => BTreeSet::new(),
            _ => self.some_of(&open),
        };
        (end, lost)
    }

    /// Complaints about what the daemon makes of the disk; `None` when the same disk was tried before.
    pub(crate) fn try_one(&mut self, end: usize, lost: &BTreeSet<usize>) -> Option<Vec<String>> {
        let tree = self.record.disk.after(end, lost);
        let mut hasher = DefaultHasher::new();
        tree.hash(&mut hasher);
        if !self.seen.insert(hasher.finish()) {
            return None;
        }
        let scene = Scene::empty(&self.record.binary);
        self.make(&tree, &scene);
        let mut complaints: Vec<String> = scene.come_to_rest().err().into_iter().collect();
        complaints.extend(self.expected.judge(&scene));
        for (file, path) in &self.record.kept {
            if std::fs::read(path).ok().as_ref() != self.record.dropped.get(file) {
                complaints.push(format!("original changed: the inode of {}", path.display()));
                // The next replay begins with it as it was.
                let _ = std::fs::write(path, &self.record.dropped[file]);
            }
        }
        Some(complaints)
    }

    fn make(&self, tree: &Tree, scene: &Scene) {
        for folder in &tree.folders {
            std::fs::create_dir_all(scene.path().join(folder)).expect("a folder can be made");
        }
        let mut placed: BTreeMap<FileId, PathBuf> = BTreeMap::new();
        for (name, file) in &tree.names {
            let path = scene.path().join(name);
            // Bytes of a dropped file are never written; if they were, the replay would show it.
            let first = placed.get(file).or_else(|| self.record.kept.get(file).filter(|_| !tree.bytes.contains_key(file)));
            match first {
                Some(first) => std::fs::hard_link(first, &path).expect("a second name can be made"),
                None => {
                    let bytes = tree.bytes.get(file).map_or(&[][..], Vec::as_slice);
                    std::fs::write(&path, bytes).expect("a file can be written");
                    placed.insert(*file, path);
                }
            }
        }
    }
}
