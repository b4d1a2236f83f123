//! Bringing one file under its final name, so that whatever happens in between, it is there once and whole.
//!
//! Within a file system that is one rename that replaces nothing. To another one (`out/` or a sub-folder of `in/` may be a mount of its
//! own) the file is first copied under a hidden name beside its final one, its *stage*:
//!
//! ```text
//! copied to the stage ─► synced ─► the old one removed ─► the stage renamed
//! ```
//! As long as the old one is there the stage is not believed, and made anew; when it is gone, the stage is the file. So the same code
//! goes on after a crash at any point. An original is set aside under a hidden name before it is copied, so that only what was looked at
//! is removed.

use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use suture_store::{Job, Token, crash_point};

use crate::claim::{Original, is_source};
use crate::create;
use crate::fsx::{self, Identity};

/// What became of a file that was to be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Placed {
    Now,
    /// It is there already, from an earlier life of the daemon.
    Before,
    /// Someone else's file has the name.
    Taken,
    /// It is neither under its old name nor in place.
    Missing,
}

/// Says of an original's hidden name that it was set aside there.
pub(crate) const ASIDE: &str = "aside";

/// The hidden name of a job's file on its way into `folder`; `what` tells the files of a job apart.
pub(crate) fn stage(folder: &Path, job: Token, what: &str) -> PathBuf {
    folder.join(OsString::from(format!(".suture-{job}-{what}.tmp")))
}

/// One file of a result.
pub(crate) struct Item<'a> {
    pub from: &'a Path,
    pub to: &'a Path,
    pub stage: &'a Path,
}

impl Item<'_> {
    /// Where the file is now, if it is not in place.
    ///
    /// # Errors
    /// As `lstat`.
    pub(crate) fn source(&self) -> io::Result<Option<&Path>> {
        for path in [self.from, self.stage] {
            if fsx::exists(path)? {
                return Ok(Some(path));
            }
        }
        Ok(None)
    }

    /// Gives the file its name. `is_it` tells whether a file has the right content.
    ///
    /// # Errors
    /// As `rename`, `link`, and copying.
    pub(crate) fn place(&self, is_it: &dyn Fn(&Path) -> io::Result<bool>) -> io::Result<Placed> {
        let Some(source) = self.source()? else {
            return Ok(if fsx::exists(self.to)? && is_it(self.to)? { Placed::Before } else { Placed::Missing });
        };
        if !is_it(source)? {
            return Ok(Placed::Missing);
        }
        match fsx::rename_new(source, self.to) {
            Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
                let file = Original::open(self.from)?;
                copy(file.file(), self.stage)?;
                std::fs::remove_file(self.from)?;
                crash_point("daemon.staged");
                named(fsx::rename_new(self.stage, self.to), self.stage, self.to)
            }
            other => named(other, source, self.to),
        }
    }
}

/// What a rename without replacing came to.
fn named(renamed: io::Result<()>, from: &Path, to: &Path) -> io::Result<Placed> {
    match renamed {
        Ok(()) => Ok(Placed::Now),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let (old, new) = (Identity::of(from)?, Identity::of(to)?);
            if (old.dev, old.ino) == (new.dev, new.ino) {
                // Linked, but not yet unlinked.
                std::fs::remove_file(from)?;
                return Ok(Placed::Before);
            }
            Ok(Placed::Taken)
        }
        Err(error) => Err(error),
    }
}

/// A copy under a new name, durable with it.
fn copy(from: &File, to: &Path) -> io::Result<()> {
    create::copy_new(from, to)?.sync_all()?;
    fsx::sync_dir(fsx::folder_of(to))
}

/// An original on its way from where it was dropped.
pub(crate) struct Move<'a> {
    pub job: &'a Job,
    pub work: Token,
    pub from: &'a Path,
    pub to: &'a Path,
    /// A second name or a copy of it.
    pub claimed: &'a Path,
}

impl Move<'_> {
    fn is_ours(&self, path: &Path) -> io::Result<bool> {
        Ok(fsx::look(path)?.is_some_and(|found| is_source(&found, self.job)))
    }

    /// Moves the original. Only the file that was worked on is moved: what took its name meanwhile is a new drop, and then the claimed
    /// one is the original. [`Placed::Missing`]: it is gone, or has another content by now.
    ///
    /// # Errors
    /// As `rename`, `link`, and copying.
    pub(crate) fn run(&self) -> io::Result<Placed> {
        let stage = stage(fsx::folder_of(self.to), self.work, "original");
        let aside = self::stage(fsx::folder_of(self.from), self.work, ASIDE);
        if fsx::exists(&self.mark())? {
            if self.is_ours(&aside)? {
                std::fs::remove_file(&aside)?;
            }
            return if fsx::exists(&stage)? {
                named(fsx::rename_new(&stage, self.to), &stage, self.to)
            } else {
                Ok(Placed::Before)
            };
        }
        if self.is_ours(self.to)? {
            // Moved by an earlier life of the daemon; where moving is linking and unlinking, perhaps not to its end.
            if self.same_inode(self.from, self.to)? {
                std::fs::remove_file(self.from)?;
            }
            return Ok(Placed::Before);
        }
        if fsx::exists(&aside)? {
            return self.take_aside(&aside, &stage);
        }
        if !self.is_ours(self.from)? {
            return self.take_claimed(&stage);
        }
        match fsx::rename_new(self.from, self.to) {
            Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
                fsx::rename_new(self.from, &aside)?;
                crash_point("daemon.original_aside");
                self.take_aside(&aside, &stage)
            }
            Err(error) => named(Err(error), self.from, self.to),
            Ok(()) if self.is_ours(self.to)? => Ok(Placed::Now),
            // Someone replaced it in the instant between. It is theirs: back with it.
            Ok(()) => self.give_back(self.to).and_then(|()| self.take_claimed(&stage)),
        }
    }

    /// Says that the stage is whole, and that what it was copied from goes.
    fn mark(&self) -> PathBuf {
        self.claimed.with_file_name("staged")
    }

    fn same_inode(&self, a: &Path, b: &Path) -> io::Result<bool> {
        Ok(matches!((fsx::look(a)?, fsx::look(b)?), (Some(a), Some(b)) if (a.dev, a.ino) == (b.dev, b.ino)))
    }

    /// To another file system, from where the original was set aside. While it cannot be taken there, it has its own name.
    fn take_aside(&self, aside: &Path, stage: &Path) -> io::Result<Placed> {
        if self.is_ours(aside)? {
            return self.carry(aside, stage).inspect_err(|_| self.show_again(aside));
        }
        // Someone had replaced it.
        self.give_back(aside)?;
        self.take_claimed(stage)
    }

    /// Gives the original its name back after an error, unless its copy counts already. If that cannot be done, it stays aside, and is
    /// found there.
    fn show_again(&self, aside: &Path) {
        if !matches!(fsx::exists(&self.mark()), Ok(false)) {
            return;
        }
        match fsx::rename_new(aside, self.from) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                tracing::warn!(%error, file = %aside.display(), "The original keeps a hidden name until it can be moved.");
            }
            _ => {}
        }
    }

    fn carry(&self, from: &Path, stage: &Path) -> io::Result<Placed> {
        copy(Original::open(from)?.file(), stage)?;
        create::mark(&self.mark())?;
        fsx::sync_dir(fsx::folder_of(self.claimed))?;
        std::fs::remove_file(from)?;
        crash_point("daemon.original_staged");
        named(fsx::rename_new(stage, self.to), stage, self.to)
    }

    /// Puts a stranger's file back under its name, or under the next one if that is taken.
    fn give_back(&self, theirs: &Path) -> io::Result<()> {
        let name = self.from.file_name().unwrap_or_default();
        for n in 1..crate::names::VERSIONS {
            match fsx::rename_new(theirs, &self.from.with_file_name(fsx::versioned(name, n, 0))) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                other => return other,
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    /// The dropped name is gone, or another file's.
    fn take_claimed(&self, stage: &Path) -> io::Result<Placed> {
        let Some(found) = fsx::look(self.claimed)? else { return Ok(Placed::Missing) };
        let source = &self.job.source;
        if (found.size, found.mtime_ns) != (source.size, source.mtime_ns) {
            return Ok(Placed::Missing);
        }
        match fsx::rename_new(self.claimed, self.to) {
            Err(error) if error.kind() == io::ErrorKind::CrossesDevices => self.carry(self.claimed, stage),
            other => {
                let placed = named(other, self.claimed, self.to)?;
                if placed != Placed::Taken {
                    // A copy that was made for reading was not synced.
                    File::open(self.to)?.sync_all()?;
                }
                Ok(placed)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use suture_store::{RelPath, Source, Time};

    use super::*;

    /// Two folders on different file systems, where the machine has them: a disk and one in memory.
    fn two_file_systems() -> Option<(tempfile::TempDir, tempfile::TempDir)> {
        let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir_in("/dev/shm").ok()?);
        let device = |dir: &tempfile::TempDir| Identity::of(dir.path()).unwrap().dev;
        (device(&a) != device(&b)).then_some((a, b))
    }

    fn always(_: &Path) -> io::Result<bool> {
        Ok(true)
    }

    /// D3: whatever an interrupted try left, the file arrives whole and once.
    #[test]
    fn a_result_crosses_to_another_file_system() {
        let Some((near, far)) = two_file_systems() else { return };
        for left in ["nothing", "half a stage", "the whole stage alone", "a stranger's file"] {
            let (from, to) = (near.path().join("out.stl"), far.path().join(left));
            let stage = stage(far.path(), Token(7), "out.stl");
            std::fs::write(&from, b"whole").unwrap();
            match left {
                "half a stage" => std::fs::write(&stage, b"wh").unwrap(),
                "the whole stage alone" => std::fs::write(&stage, b"whole").and_then(|()| std::fs::remove_file(&from)).unwrap(),
                "a stranger's file" => std::fs::write(&to, b"whole").unwrap(),
                _ => {}
            }
            let item = Item { from: &from, to: &to, stage: &stage };
            let placed = item.place(&always).unwrap();
            if left == "a stranger's file" {
                assert_eq!(placed, Placed::Taken, "equal bytes may be another job's");
                assert_eq!(item.place(&always).unwrap(), Placed::Taken);
                let other = far.path().join("other");
                assert_eq!(Item { to: &other, ..item }.place(&always).unwrap(), Placed::Now);
            } else {
                assert_eq!((placed, std::fs::read(&to).unwrap()), (Placed::Now, b"whole".to_vec()), "{left}");
                assert_eq!(item.place(&always).unwrap(), Placed::Before, "{left}");
            }
            assert!(!from.exists() && !stage.exists(), "{left}");
        }
    }

    fn job(original: &Path) -> Job {
        let found = Identity::of(original).unwrap();
        let source = Source {
            folder: "hot".into(),
            path: RelPath::new(*b"part.stl").unwrap(),
            dev: found.dev,
            ino: found.ino,
            size: found.size,
            mtime_ns: found.mtime_ns,
            profile: "default".into(),
        };
        Job::queued(suture_store::JobId(1), source, Time(0))
    }

    /// D3: an original crosses with its time, and at each point where the daemon may die it is there, and goes on from there.
    #[test]
    fn an_original_crosses_to_another_file_system() {
        let Some((near, far)) = two_file_systems() else { return };
        for died in ["not at all", "set aside", "half copied", "copied", "copied and marked", "removed", "renamed"] {
            let at = |name: &str| near.path().join(name);
            let (from, to, claimed) = (at("part.stl"), far.path().join("part.stl"), at("in.stl"));
            std::fs::write(&from, b"customer's").unwrap();
            std::fs::hard_link(&from, &claimed).unwrap();
            let job = job(&from);
            let way = Move { job: &job, work: Token(7), from: &from, to: &to, claimed: &claimed };
            let (aside, stage) = (stage(near.path(), Token(7), "aside"), stage(far.path(), Token(7), "original"));
            let steps = ["set aside", "half copied", "copied", "copied and marked", "removed", "renamed"];
            for step in steps.iter().take(steps.iter().position(|step| *step == died).map_or(0, |last| last + 1)) {
                match *step {
                    "set aside" => std::fs::rename(&from, &aside).unwrap(),
                    "half copied" => std::fs::write(&stage, b"custo").unwrap(),
                    "copied" => copy(&File::open(&aside).unwrap(), &stage).unwrap(),
                    "copied and marked" => create::mark(&way.mark()).unwrap(),
                    "removed" => std::fs::remove_file(&aside).unwrap(),
                    _ => std::fs::rename(&stage, &to).unwrap(),
                }
            }
            let placed = way.run().unwrap();
            assert!(matches!(placed, Placed::Now | Placed::Before), "{died}: {placed:?}");
            assert_eq!(std::fs::read(&to).unwrap(), b"customer's", "{died}");
            assert_eq!(Identity::of(&to).unwrap().mtime_ns, job.source.mtime_ns, "{died}");
            assert_eq!(way.run().unwrap(), Placed::Before, "{died}");
            assert!(!from.exists() && !aside.exists() && !stage.exists(), "{died}");
            assert_eq!(std::fs::read_dir(far.path()).unwrap().count(), 1, "{died}: once");
            for path in [&to, &claimed, &way.mark()] {
                fsx::remove_if_there(path).unwrap();
            }
            fsx::remove_if_there(&stage).unwrap();
        }
    }

    /// While it cannot cross, an original is under its own name, and no part of a copy takes up room.
    #[test]
    fn an_original_that_cannot_cross_keeps_its_name() {
        let Some((near, far)) = two_file_systems() else { return };
        let at = |name: &str| near.path().join(name);
        let (from, claimed) = (at("part.stl"), at("in.stl"));
        std::fs::write(&from, b"customer's").unwrap();
        std::fs::hard_link(&from, &claimed).unwrap();
        let job = job(&from);
        let (nowhere, there) = (far.path().join("gone/part.stl"), far.path().join("part.stl"));
        let way = Move { job: &job, work: Token(7), from: &from, to: &nowhere, claimed: &claimed };
        // The target's folder is missing: the rename says that before it says that it crosses, so the original is set aside by hand.
        let aside = stage(near.path(), Token(7), "aside");
        std::fs::rename(&from, &aside).unwrap();
        assert!(way.run().is_err());
        assert!(from.exists() && !aside.exists());
        std::fs::rename(&from, &aside).unwrap();
        create::mark(&way.mark()).unwrap();
        way.show_again(&aside);
        assert!(aside.exists(), "its copy counts: the name would be a second original");
        std::fs::remove_file(way.mark()).unwrap();
        assert_eq!(Move { to: &there, ..way }.run().unwrap(), Placed::Now);
        assert!(!from.exists() && !aside.exists() && there.exists());
    }

    /// A file that took the name in the instant before the original was set aside goes back under it.
    #[test]
    fn a_strangers_file_is_given_back() {
        let Some((near, far)) = two_file_systems() else { return };
        let at = |name: &str| near.path().join(name);
        let (from, to, claimed) = (at("part.stl"), far.path().join("part.stl"), at("in.stl"));
        std::fs::write(&claimed, b"customer's").unwrap();
        let job = job(&claimed);
        std::fs::write(stage(near.path(), Token(7), "aside"), b"another").unwrap();
        let way = Move { job: &job, work: Token(7), from: &from, to: &to, claimed: &claimed };
        assert_eq!(way.run().unwrap(), Placed::Now);
        assert_eq!((std::fs::read(&from).unwrap(), std::fs::read(&to).unwrap()), (b"another".to_vec(), b"customer's".to_vec()));
    }
}
