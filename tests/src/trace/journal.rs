//! Writes down what a program does to the files below a folder: names, bytes, sizes, and what it makes durable.

use std::collections::{BTreeMap, HashMap};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};

use super::run::{Eyes, Next};
use super::stop::Stop;

/// A file, whatever its names: numbered in the order in which files were found or made.
pub type FileId = usize;

/// Something done to files. Paths are below the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Act {
    /// A file was opened so that it could be written to.
    OpenedForWriting(FileId),
    /// Its mode, owner or times were set.
    Touched(FileId),
    /// It was mapped into memory so that it could be written to.
    MappedForWriting(FileId),
    /// Bytes were written.
    Write { file: FileId, at: u64, bytes: Vec<u8> },
    /// Its size was set.
    Resize { file: FileId, size: u64 },
    /// It got a name.
    Name { path: PathBuf, file: FileId },
    /// A name went.
    Unname { path: PathBuf, file: FileId },
    /// It changed its name; what had the new one lost it.
    Rename { from: PathBuf, to: PathBuf, file: FileId },
    /// A folder was made.
    MakeFolder(PathBuf),
    /// A folder was removed.
    RemoveFolder(PathBuf),
    /// A folder changed its name.
    RenameFolder { from: PathBuf, to: PathBuf },
    /// A file's bytes and size are durable.
    SyncFile(FileId),
    /// A folder's names are durable.
    SyncFolder(PathBuf),
}

/// What was done, in order.
pub struct Journal {
    root: PathBuf,
    /// Of the root: files elsewhere (as those of `/proc`) are not looked at.
    device: u64,
    /// By device and inode; a new file may have the inode of one that is gone.
    ids: HashMap<(u64, u64), FileId>,
    next: FileId,
    /// Files that were there before.
    pub inputs: BTreeMap<PathBuf, FileId>,
    /// In order.
    pub acts: Vec<Act>,
    /// Calls that are being made: what was to be seen before.
    pending: HashMap<i32, Before>,
}

/// What a call is about to touch.
#[derive(Default)]
struct Before {
    /// The path was there.
    existed: bool,
    from: PathBuf,
    to: PathBuf,
    file: Option<FileId>,
    folder: bool,
}

const OPEN: [i64; 4] = [libc::SYS_open, libc::SYS_openat, libc::SYS_openat2, libc::SYS_creat];
const WRITE: [i64; 5] = [libc::SYS_write, libc::SYS_writev, libc::SYS_pwrite64, libc::SYS_pwritev, libc::SYS_pwritev2];
const COPY: [i64; 3] = [libc::SYS_copy_file_range, libc::SYS_sendfile, libc::SYS_ioctl];
const SIZE: [i64; 3] = [libc::SYS_ftruncate, libc::SYS_truncate, libc::SYS_fallocate];
const NAMES: [i64; 11] = [
    libc::SYS_rename,
    libc::SYS_renameat,
    libc::SYS_renameat2,
    libc::SYS_link,
    libc::SYS_linkat,
    libc::SYS_unlink,
    libc::SYS_unlinkat,
    libc::SYS_rmdir,
    libc::SYS_mkdir,
    libc::SYS_mkdirat,
    libc::SYS_symlinkat,
];
// `sync_file_range` is none: it orders nothing and leaves the drive's cache alone.
const SYNC: [i64; 2] = [libc::SYS_fsync, libc::SYS_fdatasync];
const TOUCH: [i64; 8] = [
    libc::SYS_chmod,
    libc::SYS_fchmod,
    libc::SYS_fchmodat,
    libc::SYS_chown,
    libc::SYS_lchown,
    libc::SYS_fchown,
    libc::SYS_fchownat,
    libc::SYS_utimensat,
];

impl Journal {
    /// Of what is done below `root`, which is looked at now.
    pub fn new(root: &Path) -> Self {
        let (root, empty) = (root.canonicalize().unwrap_or_else(|_| root.to_owned()), Vec::new());
        let (ids, inputs, pending) = (HashMap::new(), BTreeMap::new(), HashMap::new());
        let device = look(&root).map_or(0, |found| found.dev());
        let mut journal = Self { root, device, ids, next: 0, inputs, acts: empty, pending };
        let mut found = Vec::new();
        below(&journal.root, &mut found);
        for path in found {
            let id = journal.known(&path);
            if let (Some(path), Some(id)) = (journal.inside(&path), id) {
                journal.inputs.insert(path, id);
            }
        }
        journal
    }

    fn inside(&self, path: &Path) -> Option<PathBuf> {
        path.strip_prefix(&self.root).ok().map(Path::to_owned)
    }

    /// The file a path leads to (not followed when it is a link, but for those below `/proc`).
    fn known(&mut self, path: &Path) -> Option<FileId> {
        let found = look(path)?;
        if found.is_dir() || found.dev() != self.device {
            return None;
        }
        let next = self.next;
        let id = *self.ids.entry((found.dev(), found.ino())).or_insert(next);
        self.next += usize::from(id == next);
        Some(id)
    }

    fn made(&mut self, path: &Path) -> Option<FileId> {
        let found = look(path).filter(|found| found.dev() == self.device)?;
        self.ids.insert((found.dev(), found.ino()), self.next);
        self.next += 1;
        Some(self.next - 1)
    }

    /// The folder and the name among the arguments of a call, by their places.
    fn path(stop: &Stop, folder: Option<usize>, name: usize) -> PathBuf {
        let arguments = stop.arguments();
        let name = stop.text(arguments[name]).unwrap_or_default();
        stop.resolved(folder.map_or(libc::AT_FDCWD as u64, |at| arguments[at]), &name)
    }

    fn paths(stop: &Stop) -> (PathBuf, PathBuf) {
        let none = PathBuf::new;
        match stop.number() {
            libc::SYS_rename | libc::SYS_link => (Self::path(stop, None, 0), Self::path(stop, None, 1)),
            libc::SYS_renameat | libc::SYS_renameat2 | libc::SYS_linkat => {
                (Self::path(stop, Some(0), 1), Self::path(stop, Some(2), 3))
            }
            libc::SYS_unlinkat | libc::SYS_mkdirat | libc::SYS_openat | libc::SYS_openat2 => {
                (Self::path(stop, Some(0), 1), none())
            }
            libc::SYS_fchmodat | libc::SYS_fchownat => (Self::path(stop, Some(0), 1), none()),
            libc::SYS_utimensat if stop.arguments()[1] == 0 => (stop.descriptor(stop.arguments()[0]), none()),
            libc::SYS_utimensat => (Self::path(stop, Some(0), 1), none()),
            libc::SYS_fchmod | libc::SYS_fchown => (stop.descriptor(stop.arguments()[0]), none()),
            libc::SYS_symlinkat => (Self::path(stop, Some(1), 2), none()),
            _ => (Self::path(stop, None, 0), none()),
        }
    }

    fn opened(&mut self, stop: &Stop, before: &Before) {
        let flags = match stop.number() {
            libc::SYS_open => stop.arguments()[1],
            libc::SYS_openat => stop.arguments()[2],
            libc::SYS_creat => (libc::O_CREAT | libc::O_WRONLY | libc::O_TRUNC) as u64,
            _ => stop.memory(stop.arguments()[2], 8).map_or(0, |bytes| super::stop::word(&bytes)),
        } as i32;
        let fd = stop.descriptor(stop.result().cast_unsigned());
        let nameless = flags & libc::O_TMPFILE == libc::O_TMPFILE;
        let new = nameless || (flags & libc::O_CREAT != 0 && !before.existed);
        let Some(id) = (if new { self.made(&fd) } else { self.known(&fd) }) else { return };
        if new
            && !nameless
            && let Some(path) = self.inside(&before.from)
        {
            self.acts.push(Act::Name { path, file: id });
        }
        if flags & libc::O_ACCMODE != libc::O_RDONLY || flags & libc::O_TRUNC != 0 {
            self.acts.push(Act::OpenedForWriting(id));
        }
        if flags & libc::O_TRUNC != 0 && !new {
            self.acts.push(Act::Resize { file: id, size: 0 });
        }
    }

    fn written(&mut self, stop: &Stop) {
        let (arguments, moved) = (stop.arguments(), stop.result());
        let out = match stop.number() {
            libc::SYS_copy_file_range => arguments[2],
            _ => arguments[0],
        };
        let fd = stop.descriptor(out);
        let Some(found) = look(&fd).filter(|found| found.is_file() && found.dev() == self.device) else { return };
        let Some(file) = self.known(&fd) else { return };
        if stop.number() == libc::SYS_ioctl {
            const FICLONE: u64 = 0x4004_9409;
            if arguments[1] == FICLONE {
                self.read_back(&fd, file, 0, found.size());
            }
            return;
        }
        if moved <= 0 {
            return;
        }
        let at = match stop.number() {
            libc::SYS_pwrite64 | libc::SYS_pwritev | libc::SYS_pwritev2 => arguments[3],
            libc::SYS_copy_file_range if arguments[3] != 0 => {
                let after = stop.memory(arguments[3], 8).map_or(0, |bytes| super::stop::word(&bytes));
                after - moved.cast_unsigned()
            }
            _ => position(stop, out) - moved.cast_unsigned(),
        };
        self.read_back(&fd, file, at, moved.cast_unsigned());
    }

    /// The bytes as they are in the file now: no one else writes there meanwhile.
    fn read_back(&mut self, fd: &Path, file: FileId, at: u64, length: u64) {
        let mut bytes = vec![0; length as usize];
        let read = std::fs::File::open(fd).and_then(|open| open.read_exact_at(&mut bytes, at));
        read.unwrap_or_else(|error| panic!("{}: what was written cannot be read: {error}", fd.display()));
        self.acts.push(Act::Write { file, at, bytes });
    }

    fn named(&mut self, stop: &Stop, before: Before) {
        let (from, to) = (self.inside(&before.from), self.inside(&before.to));
        let act = match (stop.number(), before.file) {
            (libc::SYS_mkdir | libc::SYS_mkdirat, _) => from.map(Act::MakeFolder),
            (libc::SYS_rmdir, _) => from.map(Act::RemoveFolder),
            (libc::SYS_unlink | libc::SYS_unlinkat, _) if before.folder => from.map(Act::RemoveFolder),
            (libc::SYS_unlink | libc::SYS_unlinkat, Some(file)) => from.map(|path| Act::Unname { path, file }),
            (libc::SYS_link | libc::SYS_linkat, Some(file)) => to.map(|path| Act::Name { path, file }),
            (libc::SYS_rename | libc::SYS_renameat | libc::SYS_renameat2, file) => match (from, to, file) {
                (Some(from), Some(to), None) => Some(Act::RenameFolder { from, to }),
                (Some(from), Some(to), Some(file)) => Some(Act::Rename { from, to, file }),
                _ => None,
            },
            _ => None,
        };
        self.acts.extend(act);
    }

    fn synced(&mut self, stop: &Stop) {
        let fd = stop.descriptor(stop.arguments()[0]);
        let folder = look(&fd).is_some_and(|found| found.is_dir());
        let act = match (folder, std::fs::read_link(&fd)) {
            (true, Ok(path)) => self.inside(&path).map(Act::SyncFolder),
            _ => self.known(&fd).map(Act::SyncFile),
        };
        self.acts.extend(act);
    }
}

impl Eyes for Journal {
    fn numbers(&self) -> Vec<i64> {
        [&OPEN[..], &WRITE, &COPY, &SIZE, &NAMES, &SYNC, &TOUCH, &[libc::SYS_mmap]].concat()
    }

    fn before(&mut self, stop: &Stop) -> Next {
        let number = stop.number();
        let mut before = Before::default();
        if OPEN.contains(&number) || NAMES.contains(&number) || TOUCH.contains(&number) || number == libc::SYS_truncate {
            (before.from, before.to) = Self::paths(stop);
            let found = look(&before.from);
            before.existed = found.is_some();
            before.folder = found.is_some_and(|found| found.is_dir());
            if !OPEN.contains(&number) {
                before.file = self.known(&before.from);
            }
        }
        self.pending.insert(stop.thread, before);
        Next::Return
    }

    fn after(&mut self, stop: &Stop) -> Option<libc::user_regs_struct> {
        let before = self.pending.remove(&stop.thread)?;
        if stop.result() < 0 {
            return None;
        }
        let number = stop.number();
        match number {
            _ if OPEN.contains(&number) => self.opened(stop, &before),
            _ if WRITE.contains(&number) || COPY.contains(&number) => self.written(stop),
            _ if NAMES.contains(&number) => self.named(stop, before),
            _ if SYNC.contains(&number) => self.synced(stop),
            _ if TOUCH.contains(&number) => self.acts.extend(before.file.map(Act::Touched)),
            libc::SYS_truncate => {
                let size = stop.arguments()[1];
                self.acts.extend(before.file.map(|file| Act::Resize { file, size }));
            }
            libc::SYS_ftruncate | libc::SYS_fallocate => {
                let fd = stop.descriptor(stop.arguments()[0]);
                if let (Some(file), Some(found)) = (self.known(&fd), look(&fd)) {
                    self.acts.push(Act::Resize { file, size: found.size() });
                }
            }
            libc::SYS_mmap => {
                let [_, _, protection, flags, fd, _] = stop.arguments();
                let writes = protection as i32 & libc::PROT_WRITE != 0;
                if writes && flags as i32 & libc::MAP_SHARED != 0 && (fd as i32) >= 0 {
                    let file = self.known(&stop.descriptor(fd));
                    self.acts.extend(file.map(Act::MappedForWriting));
                }
            }
            _ => {}
        }
        None
    }
}

/// A path below `/proc` leads to the file that is open there; another one to what has the name.
fn look(path: &Path) -> Option<std::fs::Metadata> {
    if path.starts_with("/proc") { std::fs::metadata(path).ok() } else { std::fs::symlink_metadata(path).ok() }
}

/// Where a descriptor stands.
fn position(stop: &Stop, fd: u64) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{}/fdinfo/{}", stop.thread, fd as i32)).unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix("pos:")).and_then(|number| number.trim().parse().ok()).unwrap_or(0)
}

fn below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            below(&path, found);
        } else {
            found.push(path);
        }
    }
}
