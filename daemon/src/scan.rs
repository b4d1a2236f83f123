//! The reconciler of one hot folder: it compares what lies in `in/` with what is known of it. Reading the folder is the only
//! truth; a hint from the system only makes it happen sooner (and says that a name was renamed into place).

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{FileType, Metadata};
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use suture_store::{JobId, RelPath, Source, Submission};

use crate::choice;
use crate::claim::Original;
use crate::folder::{Folder, NameKind, endings, is_hot, name_kind};
use crate::force;
use crate::fsx::{self, Identity};
use crate::handed::{Handed, Untaken};
use crate::profiles;
use crate::settings::Settings;
use crate::settle::{Look, Rest, Settling};
use crate::whole::is_whole;
use crate::writers::Writers;

/// Sub-folders are searched to this depth: more than a path that a record can hold has room for in practice.
const DEPTH: usize = 64;

/// So many names that cannot be taken are told of.
const LEFT_OUT: usize = 20;

/// What is known of one name in `in/`.
#[derive(Debug)]
enum Entry {
    /// Being watched until it rests. `foreign`: what it is, when it is no mesh.
    Settling { state: Settling, foreign: Option<String> },
    /// A job answers for it.
    Submitted { id: JobId, identity: Identity, foreign: bool },
    /// It cannot become a job, for this reason; said once in the log.
    Unrecordable { identity: Identity, reason: String },
}

/// Looks after one hot folder's `in/`.
pub(crate) struct Reconciler {
    folder: Arc<Folder>,
    settings: Arc<Settings>,
    /// How long a file must rest.
    pub rest: Rest,
    entries: BTreeMap<PathBuf, Entry>,
    /// Sub-folders whose unknown profile was named in the log.
    warned: BTreeSet<String>,
    /// Sub-folders that could not be read, and why: what is in them is not gone.
    unreadable: BTreeMap<PathBuf, String>,
}

impl Reconciler {
    pub(crate) fn new(folder: Arc<Folder>, settings: Arc<Settings>, rest: Rest) -> Self {
        Self { folder, settings, rest, entries: BTreeMap::new(), warned: BTreeSet::new(), unreadable: BTreeMap::new() }
    }

    /// A job of an earlier life answers for this file already: it need not settle again, and when the job ends while the folder
    /// is being read, it is not taken for a new drop.
    pub(crate) fn known(&mut self, source: &Source, id: JobId) {
        let Source { dev, ino, size, mtime_ns, .. } = *source;
        let identity = Identity { dev, ino, size, mtime_ns, ctime_ns: 0 };
        self.entries.insert(source.path.to_path(), Entry::Submitted { id, identity, foreign: false });
    }

    /// Reads the folder. Files that are new or changed begin to settle; names that are gone are forgotten, and the jobs of
    /// those that were only noticed are returned. O(names).
    ///
    /// # Errors
    /// When `in/` cannot be read: nothing is forgotten then, since a mount that is gone is not an empty folder.
    pub(crate) fn scan(&mut self, now: Instant) -> io::Result<Vec<JobId>> {
        let mut found = Found::default();
        found.walk(&self.folder.inbox(), Path::new(""), DEPTH)?;
        for (path, reason) in &found.unreadable {
            if !self.unreadable.contains_key(path) {
                tracing::warn!(sub_folder = %path.display(), reason, "A sub-folder cannot be read.");
            }
        }
        self.unreadable = found.unreadable;
        let (unreadable, found) = (&self.unreadable, found.files);
        let mut gone = Vec::new();
        self.entries.retain(|path, entry| {
            let stays = found.contains_key(path) || unreadable.keys().any(|folder| path.starts_with(folder));
            if let (false, Entry::Submitted { id, foreign: true, .. }) = (stays, entry) {
                gone.push(*id);
            }
            stays
        });
        for (path, (identity, foreign)) in found {
            let known = match self.entries.get(&path) {
                // Its identity is looked at where it settles.
                Some(Entry::Settling { .. }) => true,
                // A claim's hard link changes ctime, which says nothing here; nor does the number of a device.
                Some(Entry::Submitted { identity: old, .. } | Entry::Unrecordable { identity: old, .. }) => {
                    old.same_but_for_device(&identity)
                }
                None => false,
            };
            if !known {
                self.entries.insert(path, Entry::Settling { state: Settling::new(identity, now), foreign });
            }
        }
        Ok(gone)
    }

    /// The system says that these names (absolute) were renamed into place.
    pub(crate) fn came_whole(&mut self, paths: &[PathBuf]) {
        let inbox = self.folder.inbox();
        for path in paths {
            if let Ok(path) = path.strip_prefix(&inbox)
                && let Some(Entry::Settling { state, .. }) = self.entries.get_mut(path)
            {
                state.came_whole();
            }
        }
    }

    /// Looks at everything that is settling; returns what has come to rest.
    pub(crate) fn look(&mut self, now: Instant) -> Vec<(PathBuf, Submission)> {
        let inbox = self.folder.inbox();
        let mut ready = Vec::new();
        let mut writers = Writers::default();
        for (path, entry) in &mut self.entries {
            let Entry::Settling { state, foreign } = entry else { continue };
            let full = inbox.join(path);
            // A name that is gone is the next scan's business.
            let Ok(identity) = Identity::of(&full) else { continue };
            let rests = match state.look(identity, now, self.rest) {
                Look::Wait => false,
                Look::IfLengthFits => {
                    foreign.is_some() || Original::open(&full).and_then(|file| is_whole(file.file())).unwrap_or(false)
                }
                Look::Ready => true,
            };
            // What cannot be opened is the claim's business.
            let written = rests && Original::open(&full).is_ok_and(|file| writers.has(file.file(), &identity));
            if written && state.is_to_be_told(now) {
                tracing::warn!(folder = %self.folder.name, file = %path.display(), "A program keeps the file open for writing; it waits.");
            }
            if rests && !written {
                ready.push((path.clone(), *state.identity(), foreign.clone()));
            }
        }
        let mut submissions = Vec::new();
        for (path, identity, foreign) in ready {
            match RelPath::from_path(&path) {
                Ok(name) => {
                    let source = self.source(name, &identity);
                    let priority = choice::priority(&self.settings.now(), &self.folder, &source.path, &source.profile);
                    submissions.push((path, Submission { source, foreign, priority }));
                }
                Err(error) => self.give_up(&path, identity, &error.to_string()),
            }
        }
        submissions
    }

    /// A job answers for a file now. `new`: it was not known before.
    pub(crate) fn submitted(&mut self, path: &Path, submission: &Submission, id: JobId) {
        if let Some(entry) = self.entries.get_mut(path)
            && let Entry::Settling { state, foreign } = entry
        {
            let identity = *state.identity();
            if identity.size == submission.source.size && identity.mtime_ns == submission.source.mtime_ns {
                *entry = Entry::Submitted { id, identity, foreign: foreign.is_some() };
            }
        }
    }

    /// A file that someone says is whole, ready to be submitted. One that this program has put there is taken as it was then.
    ///
    /// # Errors
    /// When there is no file that could be taken.
    pub(crate) fn hand_over(&mut self, handed: &Handed) -> Result<Submission, Untaken> {
        let away = self.folder.check();
        away.map_err(Untaken::Unavailable)?;
        let identity = match handed.placed {
            Some(identity) => identity,
            None => complete(&self.folder.inbox(), &handed.path.to_path())?,
        };
        let source = self.source(handed.path.clone(), &identity);
        let priority = choice::priority(&self.settings.now(), &self.folder, &source.path, &source.profile);
        Ok(Submission { source, foreign: None, priority })
    }

    /// Does this very file lie where it was dropped?
    ///
    /// # Errors
    /// When that cannot be told: an error is no absence.
    pub(crate) fn is_there(&self, source: &Source) -> io::Result<bool> {
        let found = fsx::look(&self.folder.inbox().join(source.path.to_path()))?;
        let Source { dev, ino, size, mtime_ns, .. } = *source;
        Ok(found.is_some_and(|found| found.same_content(&Identity { dev, ino, size, mtime_ns, ctime_ns: 0 })))
    }

    /// The store cannot hold a record of this file; it stays where it is, and is named once.
    pub(crate) fn refused(&mut self, path: &Path, reason: &str) {
        if let Some(Entry::Settling { state, .. }) = self.entries.get(path) {
            let identity = *state.identity();
            self.give_up(path, identity, reason);
        }
    }

    fn give_up(&mut self, path: &Path, identity: Identity, reason: &str) {
        tracing::warn!(folder = %self.folder.name, file = %path.display(), reason, "A file cannot be taken and stays where it is.");
        self.entries.insert(path.to_owned(), Entry::Unrecordable { identity, reason: reason.to_owned() });
    }

    /// A job ended: should its name be seen again, it is a new drop.
    pub(crate) fn ended(&mut self, path: &Path) {
        self.entries.remove(path);
    }

    /// Is anything on its way to rest?
    pub(crate) fn is_settling(&self) -> bool {
        self.entries.values().any(|entry| matches!(entry, Entry::Settling { .. }))
    }

    /// A line for each name in `in/` that cannot be taken, a few at most.
    pub(crate) fn left_out(&self) -> Vec<String> {
        let inbox = self.folder.inbox();
        let line = |path: &Path, reason: &str| format!("{}: {reason}", inbox.join(path).display());
        let folders = self.unreadable.iter().map(|(path, reason)| line(path, reason));
        let files = self.entries.iter().filter_map(|(path, entry)| match entry {
            Entry::Unrecordable { reason, .. } => Some(line(path, reason)),
            Entry::Settling { state, .. } if state.was_told() => Some(line(path, "a program keeps it open for writing")),
            _ => None,
        });
        folders.chain(files).take(LEFT_OUT).collect()
    }

    /// Is anything below this sub-folder on its way to rest, or cannot be seen?
    pub(crate) fn is_settling_below(&self, folder: &Path) -> bool {
        let below = self.entries.range(folder.to_owned()..).take_while(|(path, _)| path.starts_with(folder));
        let hidden = self.unreadable.keys().any(|path| path.starts_with(folder) || folder.starts_with(path));
        hidden || below.into_iter().any(|(_, entry)| matches!(entry, Entry::Settling { .. }))
    }

    fn source(&mut self, path: RelPath, identity: &Identity) -> Source {
        let profile = self.profile_name(&path);
        Source {
            folder: self.folder.name.clone(),
            path,
            dev: identity.dev,
            ino: identity.ino,
            size: identity.size,
            mtime_ns: identity.mtime_ns,
            profile,
        }
    }

    /// A sub-folder's name is the profile's, if there is one of that name.
    fn profile_name(&mut self, path: &RelPath) -> String {
        let config = self.settings.now();
        let default = config.folder_profile(&self.folder.name).to_owned();
        let Some(name) = Folder::profile_folder(&force::plain(path)) else { return default };
        if config.profile(&name).is_some() {
            return name;
        }
        let own = self.folder.inbox().join(&name).join(profiles::FOLDER_FILE);
        if fsx::exists(&own).is_ok_and(|there| !there) && self.warned.insert(name.clone()) {
            tracing::info!(folder = %self.folder.name, sub_folder = name, profile = default, "No profile has this sub-folder's name: it is an order.");
        }
        default
    }
}

/// A mesh below `in/` to which nothing is added any more.
fn complete(inbox: &Path, below: &Path) -> Result<Identity, Untaken> {
    let unseen = |error: io::Error| Untaken::Unavailable(format!("the file cannot be looked at: {error}"));
    let name = below.file_name().unwrap_or_default();
    // A file that the scan would not find is not there: no link is followed on the way.
    for folder in below.ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty()) {
        let found = fsx::look(&inbox.join(folder)).map_err(unseen)?;
        let is_folder = found.is_some() && std::fs::symlink_metadata(inbox.join(folder)).is_ok_and(|meta| meta.is_dir());
        let hidden = folder.file_name().is_some_and(|name| name_kind(name) == NameKind::Ignored);
        if !is_folder || hidden || is_hot(&inbox.join(folder)).map_err(unseen)? {
            return Err(Untaken::Missing);
        }
    }
    let full = inbox.join(below);
    if fsx::look(&full).map_err(unseen)?.is_none() {
        return Err(Untaken::Missing);
    }
    let meta = std::fs::symlink_metadata(&full).map_err(unseen)?;
    let kind = name_kind(name);
    let else_it_is = || if meta.is_dir() { Some("a folder".into()) } else { what_else(&meta, kind, &name.to_string_lossy()) };
    match (kind, else_it_is()) {
        (NameKind::Ignored, _) => return Err(Untaken::NoMesh("a temporary or hidden file, which is not taken".into())),
        (_, Some(words)) => return Err(Untaken::NoMesh(words)),
        (_, None) => {}
    }
    let file = Original::open(&full).map_err(unseen)?;
    let identity = file.identity().map_err(unseen)?;
    let whole = is_whole(file.file()).map_err(unseen)? && !Writers::default().has(file.file(), &identity);
    if whole { Ok(identity) } else { Err(Untaken::Unfinished) }
}

/// What lies in a folder.
#[derive(Default)]
struct Found {
    /// Everything that is neither a folder nor temporary; what is no regular mesh file comes with words for what it is.
    files: BTreeMap<PathBuf, (Identity, Option<String>)>,
    /// Sub-folders that cannot be read, and why.
    unreadable: BTreeMap<PathBuf, String>,
}

impl Found {
    fn walk(&mut self, root: &Path, below: &Path, depth: usize) -> io::Result<()> {
        for entry in std::fs::read_dir(root.join(below))? {
            // A folder that is read half is not read.
            let entry = entry?;
            let name = entry.file_name();
            let kind = name_kind(&name);
            if kind == NameKind::Ignored {
                continue;
            }
            // Not followed, if it is a link.
            let meta = match entry.metadata() {
                Ok(meta) => meta,
                // Gone between the two calls: not there.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(error),
            };
            let path = below.join(&name);
            if meta.is_dir() {
                // Someone else's files.
                // A sub-folder that cannot be read does not hide the others.
                let walked = match is_hot(&root.join(&path)) {
                    Ok(true) => Err("it is a hot folder of its own".into()),
                    Ok(false) if depth == 0 => Err(format!("it lies deeper than {DEPTH} folders")),
                    Ok(false) => self.walk(root, &path, depth - 1).map_err(|error| error.to_string()),
                    Err(error) => Err(error.to_string()),
                };
                if let Err(why) = walked {
                    self.unreadable.insert(path, why);
                }
                continue;
            }
            self.files.insert(path, (Identity::from(&meta), what_else(&meta, kind, &name.to_string_lossy())));
        }
        Ok(())
    }
}

/// Words for what is no mesh.
fn what_else(meta: &Metadata, kind: NameKind, name: &str) -> Option<String> {
    let special = |t: FileType| {
        let words = [
            (t.is_symlink(), "a symbolic link, which is not followed"),
            (t.is_fifo(), "a pipe"),
            (t.is_socket(), "a socket"),
            (t.is_block_device() || t.is_char_device(), "a device"),
        ];
        words.iter().find(|(is, _)| *is).map(|(_, words)| (*words).to_owned())
    };
    if let Some(words) = special(meta.file_type()) {
        return Some(words);
    }
    (kind == NameKind::Foreign).then(|| match name.rsplit_once('.') {
        Some((_, extension)) => {
            format!("a .{} file, which is not read; meshes end in {}", extension.to_ascii_lowercase(), endings())
        }
        None => format!("a file of unknown format; meshes end in {}", endings()),
    })
}

#[cfg(test)]
mod tests;
