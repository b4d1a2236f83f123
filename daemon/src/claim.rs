//! Taking a dropped file into work. An [`Original`] is a handle for reading, and no more: nothing here can write to it, to a second
//! name of it, or believe a name without looking at the inode behind it.
//!
//! The attempt works on a second name (a hard link) in its own new folder, which keeps the file even if its own name goes meanwhile.
//! Where no second name can be made (another file system, other people's files), it works on a copy, a new file. The dropped name stays
//! where it is in any case, so that whatever happens to the attempt's folder, the file is there.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD};
use suture_core::ErrorClass;
use suture_store::job::Withdrawal;
use suture_store::{Job, Source, Token};

use crate::bucket::Trouble;
use crate::create;
use crate::folder::{Folder, make_parent};
use crate::fsx::{self, Identity, NO_DEVICE};
use crate::shelf::Shelf;
use crate::units::show_size;

/// Name of the claimed file in its attempt's folder. Plain, whatever the dropped file is called.
pub(crate) const CLAIMED: &str = "in.stl";

/// A dropped file, open for reading.
pub(crate) struct Original {
    path: PathBuf,
    file: File,
}

impl Original {
    /// Opens a regular file; a link of that name is not followed, a pipe is not waited for.
    ///
    /// # Errors
    /// As `open`; of kind `InvalidInput` where it is no regular file.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let file = create::open_to_read(path)?;
        if !file.metadata()?.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file"));
        }
        Ok(Self { path: path.to_owned(), file })
    }

    /// The file that was opened, whatever its name stands for by now.
    ///
    /// # Errors
    /// As `fstat`.
    pub(crate) fn identity(&self) -> io::Result<Identity> {
        Ok(Identity::from(&self.file.metadata()?))
    }

    /// For reading.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Gives it a second name, which must not exist.
    ///
    /// # Errors
    /// As `link`.
    fn link(&self, to: &Path) -> io::Result<()> {
        // By the open file, not by its name, which may be another file's by now.
        let by_descriptor = format!("/proc/self/fd/{}", self.file.as_raw_fd());
        Ok(rustix::fs::linkat(CWD, by_descriptor, CWD, to, AtFlags::SYMLINK_FOLLOW)?)
    }
}

/// A file in work, and what tells whether it changed since.
pub(crate) struct Claimed {
    original: Original,
    identity: Identity,
    /// It was copied: its name must still stand for it then.
    copied: bool,
    /// It lies on a share: another machine that once worked on it may give its own second name of it up at any time, which changes the time of the
    /// inode. Then size and time of the content must do, and whoever publishes compares the content.
    is_shared: bool,
}

impl Claimed {
    /// Is it as it was when it was claimed? Renaming or removing it counts as a change, too.
    ///
    /// # Errors
    /// As `fstat` and `lstat`: then it is not known.
    pub(crate) fn is_unchanged(&self) -> io::Result<bool> {
        let is_same = |found: &Identity| is_same(found, &self.identity, self.is_shared);
        Ok(is_same(&self.original.identity()?)
            && (!self.copied || fsx::look(&self.original.path)?.is_some_and(|found| is_same(&found))))
    }

    /// Last change of its inode; as long as that stays, its content does.
    pub(crate) fn ctime_ns(&self) -> i64 {
        self.identity.ctime_ns
    }
}

fn is_same(found: &Identity, before: &Identity, is_shared: bool) -> bool {
    if is_shared { found.same_content(before) } else { found == before }
}

/// Why a file could not be claimed.
#[derive(Debug)]
pub(crate) enum Unclaimed {
    Withdrawn(Withdrawal),
    Environment(String),
    /// The machine has too little of something, for now.
    Shortage(String),
}

fn failed<'a>(what: &'a str) -> impl FnOnce(io::Error) -> Unclaimed + 'a {
    move |error| {
        let reason = format!("{what}: {error}");
        match ErrorClass::of(&error) {
            ErrorClass::Shortage => Unclaimed::Shortage(reason),
            _ => Unclaimed::Environment(reason),
        }
    }
}

/// Is this the very file, whatever became of its content?
pub(crate) fn is_inode(found: &Identity, source: &Source) -> bool {
    found.ino == source.ino && (source.dev == NO_DEVICE || found.dev == source.dev)
}

/// Is this the file that the job was submitted for? Where this program has moved it itself, perhaps to another file system, size and
/// time must do.
pub(crate) fn is_source(found: &Identity, job: &Job) -> bool {
    let source = &job.source;
    (is_inode(found, source) || job.moved_to.is_some()) && (found.size, found.mtime_ns) == (source.size, source.mtime_ns)
}

/// Takes the job's original into `work`, which is made. `free`: bytes that may still be written there.
///
/// # Errors
/// When the file is gone or another one, or the world does not allow it.
pub(crate) fn claim(folder: &Folder, job: &Job, work: &Path, free: u64) -> Result<Claimed, Unclaimed> {
    if let Some(shelf) = &folder.bucket {
        return fetch(folder, shelf, job, work, free);
    }
    let original = folder.original(job);
    folder.look_anew(fsx::folder_of(&original));
    let original = open(&original)?;
    let before = look(&original, job)?;
    has_room(before.size.saturating_mul(3), free)?;
    make_work(work)?;
    take(original, job, &work.join(CLAIMED), folder.is_shared)
}

/// Room for the result and for what the engine puts aside: a large file must not fill the disk half way.
fn has_room(needed: u64, free: u64) -> Result<(), Unclaimed> {
    if free < needed {
        let (needed, free) = (show_size(needed), show_size(free));
        return Err(Unclaimed::Shortage(format!("the disk has room for {free} more; this file may need {needed}")));
    }
    Ok(())
}

/// Makes a new folder: what is in it, this attempt has put there.
fn make_work(work: &Path) -> Result<(), Unclaimed> {
    make_parent(work).and_then(|()| std::fs::create_dir(work)).map_err(failed("the work folder cannot be made"))
}

/// Has the job's original, from its bucket, in `work`, which is made: the very version that the job is of.
fn fetch(folder: &Folder, shelf: &Shelf, job: &Job, work: &Path, free: u64) -> Result<Claimed, Unclaimed> {
    let away = |trouble: Trouble| match trouble {
        Trouble::Changed => Unclaimed::Withdrawn(Withdrawal::Changed),
        Trouble::Local(error) => failed("the file cannot be fetched")(error),
        other => Unclaimed::Shortage(other.to_string()),
    };
    let key = Shelf::key(&folder.root, &folder.original(job)).map_err(failed("the file has no key"))?;
    let Some(found) = shelf.bucket.stat(&key).map_err(away)? else {
        shelf.bucket.must_be_there().map_err(away)?;
        return Err(Unclaimed::Withdrawn(Withdrawal::Vanished));
    };
    if !Shelf::is_source(&found, job) {
        return Err(Unclaimed::Withdrawn(Withdrawal::Changed));
    }
    // One more for the drop itself.
    has_room(found.version.size.saturating_mul(4), free)?;
    make_work(work)?;
    let claimed = work.join(CLAIMED);
    shelf.cache.give(&shelf.bucket, &key, &found.version, &claimed).map_err(away)?;
    let original = open(&claimed)?;
    let identity = original.identity().map_err(failed("the file cannot be looked at"))?;
    Ok(Claimed { original, identity, copied: false, is_shared: false })
}

/// Gives the second name of an attempt's original up. That changes the time of the inode, which another attempt would take for a change of the file:
/// so it comes before the job can be claimed once more.
pub(crate) fn let_go(folder: &Folder, attempt: Token) {
    // Another daemon may have the folder, and a work folder of that name in it.
    if folder.check().is_ok() {
        // What stays goes with the folder; then a second attempt at worst begins anew.
        let _ = fsx::remove_if_there(&folder.work(attempt).join(CLAIMED));
    }
}

fn open(path: &Path) -> Result<Original, Unclaimed> {
    use rustix::io::Errno;
    Original::open(path).map_err(|error| match error.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::NOENT) => Unclaimed::Withdrawn(Withdrawal::Vanished),
        // A link or a folder has taken the name.
        Some(Errno::LOOP | Errno::ISDIR | Errno::NXIO) => Unclaimed::Withdrawn(Withdrawal::Changed),
        _ if error.kind() == io::ErrorKind::InvalidInput => Unclaimed::Withdrawn(Withdrawal::Changed),
        _ => failed("the file cannot be opened")(error),
    })
}

fn look(original: &Original, job: &Job) -> Result<Identity, Unclaimed> {
    let found = original.identity().map_err(failed("the file cannot be looked at"))?;
    if is_source(&found, job) { Ok(found) } else { Err(Unclaimed::Withdrawn(Withdrawal::Changed)) }
}

fn take(original: Original, job: &Job, claimed: &Path, is_shared: bool) -> Result<Claimed, Unclaimed> {
    let linked = original.link(claimed).is_ok();
    if !linked {
        // A second name that is there already would count as a change when it goes.
        fsx::remove_if_there(claimed).map_err(failed("the work folder cannot be cleared"))?;
    }
    // Linking changed ctime: from here on it must stay.
    let identity = look(&original, job)?;
    if !linked {
        create::copy_new(&original.file, claimed).map_err(failed("the file cannot be copied"))?;
        if !is_same(&look(&original, job)?, &identity, is_shared) {
            return Err(Unclaimed::Withdrawn(Withdrawal::Changed));
        }
    }
    let claimed = Claimed { original, identity, copied: !linked, is_shared };
    match claimed.is_unchanged() {
        Ok(true) => Ok(claimed),
        Ok(false) => Err(Unclaimed::Withdrawn(Withdrawal::Changed)),
        Err(error) => Err(failed("the file cannot be looked at")(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::tests::Scene;
    use suture_store::State;

    fn changed<T>(result: Result<T, Unclaimed>) -> bool {
        matches!(result, Err(Unclaimed::Withdrawn(Withdrawal::Changed)))
    }

    /// D1: a claim that is made again, over whatever an earlier one left, touches nothing.
    #[test]
    fn claiming_twice_leaves_the_original_alone() {
        let scene = Scene::dropped();
        let work = scene.folder.work(scene.claim.token);
        let content = || std::fs::read(scene.folder.inbox().join("part.stl")).unwrap();
        let before = content();
        claim(&scene.folder, &scene.claim.job, &work, u64::MAX).unwrap();
        assert!(
            matches!(claim(&scene.folder, &scene.claim.job, &work, u64::MAX), Err(Unclaimed::Environment(_))),
            "the folder is not new"
        );
        assert_eq!(content(), before);
        // A second name that is there already, of the original itself.
        let original = Original::open(&scene.folder.inbox().join("part.stl")).unwrap();
        let taken = take(original, &scene.claim.job, &work.join(CLAIMED), false);
        assert!(taken.is_ok(), "it gets an inode of its own");
        assert_eq!((content(), std::fs::read(work.join(CLAIMED)).unwrap()), (before.clone(), before));
        let inode = |path: &Path| Identity::of(path).unwrap().ino;
        assert_ne!(inode(&work.join(CLAIMED)), inode(&scene.folder.inbox().join("part.stl")));
    }

    #[test]
    fn f22_another_file_of_that_name_is_not_claimed() {
        let scene = Scene::dropped();
        let path = scene.folder.inbox().join("part.stl");
        let work = scene.folder.work(scene.claim.token);
        let claim = || claim(&scene.folder, &scene.claim.job, &work, u64::MAX);
        std::fs::rename(&path, scene.folder.inbox().join("mine")).unwrap();
        assert!(matches!(claim(), Err(Unclaimed::Withdrawn(Withdrawal::Vanished))));
        std::os::unix::fs::symlink("mine", &path).unwrap();
        assert!(changed(claim()), "a link is not followed");
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, b"another").unwrap();
        assert!(changed(claim()));
        assert!(!work.exists(), "nothing was begun");
        assert!(matches!(scene.claim.job.state, State::Running { .. }));
    }

    /// On a share the device is not told by, and the second name that another machine gives up is no change of the file; another content is.
    #[test]
    fn on_a_share_a_file_is_told_by_its_number_and_its_content() {
        let scene = Scene::dropped();
        let path = scene.folder.inbox().join("part.stl");
        let found = Identity::of(&path).unwrap();
        let mut job = scene.claim.job.clone();
        assert!(!is_source(&Identity { dev: found.dev + 1, ..found }, &job), "on a machine of its own");
        job.source.dev = NO_DEVICE;
        assert!(is_source(&Identity { dev: found.dev + 1, ..found }, &job));
        assert!(!is_source(&Identity { ino: found.ino + 1, ..found }, &job));
        let theirs = scene.folder.root.join("theirs");
        std::fs::hard_link(&path, &theirs).unwrap();
        let (work, alone) = (scene.folder.work(scene.claim.token), scene.folder.root.join("alone"));
        make_work(&work).unwrap();
        make_work(&alone).unwrap();
        let take = |work: &Path, is_shared| take(Original::open(&path).unwrap(), &job, &work.join(CLAIMED), is_shared).unwrap();
        let alone = take(&alone, false);
        std::thread::sleep(std::time::Duration::from_millis(20));
        let shared = take(&work, true);
        assert!(!alone.is_unchanged().unwrap(), "its inode changed");
        std::fs::remove_file(&theirs).unwrap();
        assert!(shared.is_unchanged().unwrap());
        std::fs::write(&path, b"AS DROPPED").unwrap();
        assert!(!shared.is_unchanged().unwrap());
    }

    /// In place, by a new name or by none at all.
    #[test]
    fn f22_a_change_is_noticed() {
        for change in ["write", "rename", "remove"] {
            let scene = Scene::dropped();
            let path = scene.folder.inbox().join("part.stl");
            let claimed = claim(&scene.folder, &scene.claim.job, &scene.folder.work(scene.claim.token), u64::MAX).unwrap();
            assert!(claimed.is_unchanged().unwrap());
            std::thread::sleep(std::time::Duration::from_millis(20));
            match change {
                "write" => std::fs::write(&path, b"AS DROPPED").unwrap(),
                "rename" => std::fs::rename(&path, scene.folder.inbox().join("mine")).unwrap(),
                _ => std::fs::remove_file(&path).unwrap(),
            }
            assert!(!claimed.is_unchanged().unwrap(), "{change}");
        }
    }
}
