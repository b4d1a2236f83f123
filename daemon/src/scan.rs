//! The reconciler of one hot folder: it compares what lies in `in/` with what is known of it. Reading the folder is the only
//! truth; a hint from the system only makes it happen sooner (and says that a name was renamed into place).
//!
//! An OBJ is not whole without the files that it names ([`companions`]): it waits for them, as long as a file waits whose length does not fit. They
//! go along with it, as jobs of their own ([`crate::carry`]); what no OBJ in `in/` names is noticed, and left where it is.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use suture_store::{JobId, Priority, RelPath, Seen, Source, Submission, Submitted};

use crate::choice;
use crate::claim::{Original, is_inode};
use crate::folder::Folder;
use crate::force;
use crate::fsx::{self, Identity};
use crate::handed::{Handed, Untaken};
use crate::profiles;
use crate::settings::Settings;
use crate::settle::{Look, Rest, Settling};
use crate::whole::is_whole;
use crate::writers::Writers;
use companions::is_obj;
use complete::complete;
use found::{DEPTH, Found};
use references::References;

mod companions;
mod complete;
mod found;
mod references;

/// So many names that cannot be taken are told of.
const LEFT_OUT: usize = 20;

/// So many companions that a file lacks are named.
const NAMED: usize = 5;

/// What is known of one name in `in/`.
#[derive(Debug)]
enum Entry {
    /// Being watched until it rests. `foreign`: what it is, when it is no mesh.
    /// `lacks`: companions that it has waited for so long that people should know.
    Settling { state: Settling, foreign: Option<String>, lacks: Vec<PathBuf> },
    /// A job answers for it. `leads`: it is an OBJ whose job has not ended, wanted this soon.
    Submitted { id: JobId, identity: Identity, foreign: bool, leads: Option<Priority> },
    /// It cannot become a job, for this reason; said once in the log.
    Unrecordable { identity: Identity, reason: String },
}

/// A file that is at rest.
struct Resting {
    identity: Identity,
    foreign: Option<String>,
    /// It may still wait for its companions.
    is_patient: bool,
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
    references: References,
    /// OBJs whose jobs have ended, and whose originals stay: they wait for nothing any more.
    over: BTreeMap<PathBuf, Identity>,
    /// Who waits for companions is another one than at the last look.
    waits_changed: bool,
}

impl Reconciler {
    pub(crate) fn new(folder: Arc<Folder>, settings: Arc<Settings>, rest: Rest) -> Self {
        Self {
            folder,
            settings,
            rest,
            entries: BTreeMap::new(),
            warned: BTreeSet::new(),
            unreadable: BTreeMap::new(),
            references: References::default(),
            over: BTreeMap::new(),
            waits_changed: false,
        }
    }

    /// A job of an earlier life answers for this file already: it need not settle again, and when the job ends while the folder
    /// is being read, it is not taken for a new drop. `live`: how soon a job is wanted that has not ended.
    pub(crate) fn known(&mut self, source: &Source, id: JobId, live: Option<Priority>) {
        let Source { dev, ino, size, mtime_ns, .. } = *source;
        let identity = Identity { dev, ino, size, mtime_ns, ctime_ns: 0 };
        let path = source.path.to_path();
        let leads = live.filter(|_| is_obj(&path));
        self.waits_changed = true;
        self.entries.insert(path, Entry::Submitted { id, identity, foreign: false, leads });
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
        self.over.retain(|path, _| found.contains_key(path));
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
                self.entries.insert(path, Entry::Settling { state: Settling::new(identity, now), foreign, lacks: Vec::new() });
            }
        }
        self.references.keep(|obj| self.entries.contains_key(obj));
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

    /// Looks at everything that is settling; returns what has come to rest, and files that an OBJ has come to name since they were noticed.
    pub(crate) fn look(&mut self, now: Instant) -> Vec<(PathBuf, Submission)> {
        let resting = self.resting(now);
        let named = self.named(&resting);
        let mut ready = Vec::new();
        for (path, Resting { identity, foreign, is_patient }) in &resting {
            let companion = named.get(path).filter(|_| foreign.is_some()).copied();
            let waits = is_obj(path) && foreign.is_none() && self.waits(path, identity, *is_patient, &resting, now);
            if !waits {
                let foreign = foreign.clone().filter(|_| companion.is_none());
                ready.push((path.clone(), *identity, foreign, companion));
            }
        }
        let noticed = named.iter().filter_map(|(path, priority)| match self.entries.get(path) {
            Some(Entry::Submitted { identity, foreign: true, .. }) => Some((path.clone(), *identity, None, Some(*priority))),
            _ => None,
        });
        ready.extend(noticed);
        // An OBJ comes to its end when what it names is beside its result, as far as that is up to the order.
        ready.sort_by_key(|(.., companion)| companion.is_none());
        let mut submissions = Vec::new();
        for (path, identity, foreign, companion) in ready {
            match RelPath::from_path(&path) {
                Ok(name) => {
                    let source = self.source(name, &identity);
                    let own = || choice::priority(&self.settings.now(), &self.folder, &source.path, &source.profile);
                    let priority = companion.unwrap_or_else(own);
                    submissions.push((path, Submission { source, foreign, priority, seen: self.seen() }));
                }
                Err(error) => self.give_up(&path, identity, &error.to_string()),
            }
        }
        submissions
    }

    /// What is at rest of all that is settling.
    fn resting(&mut self, now: Instant) -> BTreeMap<PathBuf, Resting> {
        let inbox = self.folder.inbox();
        let mut resting = BTreeMap::new();
        let mut writers = Writers::default();
        for (path, entry) in &mut self.entries {
            let Entry::Settling { state, foreign, lacks } = entry else { continue };
            let full = inbox.join(path);
            // A name that is gone is the next scan's business.
            let Ok(identity) = Identity::of(&full) else { continue };
            let look = state.look(identity, now, self.rest);
            let rests = match look {
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
                let is_patient = look == Look::IfLengthFits;
                resting.insert(path.clone(), Resting { identity: *state.identity(), foreign: foreign.clone(), is_patient });
            } else if !lacks.is_empty() {
                lacks.clear();
                self.waits_changed = true;
            }
        }
        resting
    }

    /// Files in `in/` that OBJs there name, and how soon the most urgent of these is wanted. Nothing, where that is known and no file waits for it.
    fn named(&mut self, resting: &BTreeMap<PathBuf, Resting>) -> BTreeMap<PathBuf, Priority> {
        let leaders = self.leaders(resting);
        let is_new = |(obj, identity, _): &(PathBuf, Identity, Priority)| {
            resting.contains_key(obj) || !self.references.knows(obj, identity)
        };
        let mut named = BTreeMap::new();
        if !resting.values().any(|file| file.foreign.is_some()) && !leaders.iter().any(is_new) {
            return named;
        }
        let inbox = self.folder.inbox();
        let (entries, references) = (&self.entries, &mut self.references);
        let is_file = |path: &Path| std::fs::symlink_metadata(inbox.join(path)).is_ok_and(|meta| meta.is_file());
        let find = |path: &Path| match entries.get(path) {
            Some(Entry::Settling { state, .. }) => Some(*state.identity()),
            Some(Entry::Submitted { identity, .. }) => Some(*identity),
            _ => None,
        };
        for (obj, identity, priority) in leaders {
            references.read(&inbox, &obj, &identity, &find);
            for name in references.of(&obj).filter(|name| entries.contains_key(*name) && is_file(name)) {
                let known = named.entry(name.to_owned()).or_insert(priority);
                *known = priority.max(*known);
            }
        }
        let has_job = |path: &Path| matches!(entries.get(path), Some(Entry::Submitted { .. }));
        for path in named.keys().filter(|path| resting.contains_key(*path) || has_job(path)) {
            references.goes_along(path);
        }
        named
    }

    /// OBJs that may have companions: those in work or in line, those at rest, and, where a file waits for it, those on their way.
    fn leaders(&mut self, resting: &BTreeMap<PathBuf, Resting>) -> Vec<(PathBuf, Identity, Priority)> {
        let all = resting.values().any(|file| file.foreign.is_some());
        let (mut leaders, mut settling) = (Vec::new(), Vec::new());
        for (path, entry) in self.entries.iter().filter(|(path, _)| is_obj(path)) {
            match entry {
                Entry::Submitted { identity, leads: Some(priority), .. } => leaders.push((path.clone(), *identity, *priority)),
                Entry::Settling { state, foreign: None, .. } if all || resting.contains_key(path) => {
                    settling.push((path.clone(), *state.identity()));
                }
                _ => {}
            }
        }
        for (path, identity) in settling.into_iter().filter(|(path, identity)| !self.is_over(path, identity)).collect::<Vec<_>>()
        {
            if let Ok(name) = RelPath::from_path(&path) {
                let profile = self.profile_name(&name);
                let priority = choice::priority(&self.settings.now(), &self.folder, &name, &profile);
                leaders.push((path, identity, priority));
            }
        }
        leaders
    }

    fn is_over(&self, obj: &Path, identity: &Identity) -> bool {
        self.over.get(obj).is_some_and(|over| over.same_but_for_device(identity))
    }

    /// Has an OBJ at rest still to wait for files that it names? When its patience is over, those that did not come are named.
    fn waits(
        &mut self,
        obj: &Path,
        identity: &Identity,
        is_patient: bool,
        resting: &BTreeMap<PathBuf, Resting>,
        now: Instant,
    ) -> bool {
        if self.is_over(obj, identity) {
            return false;
        }
        let is_at_hand = |name: &Path| match self.entries.get(name) {
            Some(Entry::Settling { .. }) => resting.contains_key(name),
            Some(_) => true,
            None => self.references.has_gone_along(name),
        };
        let missing: Vec<PathBuf> = self.references.of(obj).filter(|name| !is_at_hand(name)).map(Path::to_owned).collect();
        if !is_patient {
            let out = self.folder.out();
            let is_nowhere = |name: &&PathBuf| fsx::exists(&out.join(force::without(name))).is_ok_and(|there| !there);
            let nowhere: Vec<&PathBuf> = missing.iter().filter(is_nowhere).collect();
            if !nowhere.is_empty() {
                let (folder, file, missing) = (&self.folder.name, obj.display(), few(&nowhere));
                tracing::warn!(folder, %file, missing, "A file is taken without files that it names: they did not come.");
            }
        }
        let waits = is_patient && !missing.is_empty();
        if let Some(Entry::Settling { state, lacks, .. }) = self.entries.get_mut(obj) {
            let is_long = state.rested(now) >= self.rest.settle * 2;
            let shown = if waits && is_long { missing } else { Vec::new() };
            self.waits_changed |= *lacks != shown;
            *lacks = shown;
        }
        waits
    }

    /// Who waits for companions, as [`Reconciler::left_out`] tells it, has it changed since this was asked?
    pub(crate) fn have_waits_changed(&mut self) -> bool {
        std::mem::take(&mut self.waits_changed)
    }

    /// Of these submissions, the jobs of which had ended and may have moved the files: those whose files are there still, to be submitted once more.
    pub(crate) fn there_still(&self, found: Vec<(PathBuf, Submission)>) -> Vec<(PathBuf, Submission)> {
        // A file that cannot be looked at settles further, and is submitted then.
        found.into_iter().filter(|(_, submission)| self.is_there(&submission.source).unwrap_or(false)).collect()
    }

    /// Files that lie in `in/` and have jobs.
    pub(crate) fn with_jobs(&self) -> Vec<(PathBuf, JobId)> {
        let job = |(path, entry): (&PathBuf, &Entry)| match entry {
            Entry::Submitted { id, foreign: false, .. } => Some((path.clone(), *id)),
            _ => None,
        };
        self.entries.iter().filter_map(job).collect()
    }

    /// A job answers for a file now.
    pub(crate) fn submitted(&mut self, path: &Path, submission: &Submission, answer: Submitted) {
        let Some(entry) = self.entries.get_mut(path) else { return };
        match entry {
            Entry::Settling { state, lacks, .. } => {
                let identity = *state.identity();
                self.waits_changed |= !lacks.is_empty();
                if identity.size == submission.source.size && identity.mtime_ns == submission.source.mtime_ns {
                    let foreign = submission.foreign.is_some();
                    let leads = (answer.new && !foreign && is_obj(path)).then_some(submission.priority);
                    *entry = Entry::Submitted { id: answer.id, identity, foreign, leads };
                }
            }
            Entry::Submitted { foreign, .. } if submission.foreign.is_none() => *foreign = false,
            _ => {}
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
        Ok(Submission { source, foreign: None, priority, seen: self.seen() })
    }

    /// A worker on another machine may move what lies on a share at any time.
    fn seen(&self) -> Seen {
        if self.folder.is_shared { Seen::After(None) } else { Seen::Now }
    }

    /// Does this very file lie where it was dropped?
    ///
    /// # Errors
    /// When that cannot be told: an error is no absence.
    pub(crate) fn is_there(&self, source: &Source) -> io::Result<bool> {
        let path = self.folder.inbox().join(source.path.to_path());
        self.folder.look_anew(fsx::folder_of(&path));
        let is_same = |found: &Identity| (found.size, found.mtime_ns) == (source.size, source.mtime_ns);
        Ok(fsx::look(&path)?.is_some_and(|found| is_inode(&found, source) && is_same(&found)))
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
        let ended = self.entries.remove(path);
        if !is_obj(path) {
            return;
        }
        if let (Some(Entry::Submitted { identity, .. }), true) = (ended, self.folder.leave_originals) {
            self.over.insert(path.to_owned(), identity);
        }
        self.references.keep(|obj| self.entries.contains_key(obj));
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
            Entry::Settling { lacks, .. } if !lacks.is_empty() => {
                Some(line(path, &format!("it waits for files that it names: {}", few(lacks))))
            }
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
            dev: self.folder.noted_device(identity.dev),
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

/// The first of these names, and how many more there are.
fn few<P: AsRef<Path>>(names: &[P]) -> String {
    let mut words: Vec<_> = names.iter().take(NAMED).map(|name| name.as_ref().display().to_string()).collect();
    if names.len() > NAMED {
        words.push(format!("and {} more", names.len() - NAMED));
    }
    words.join(", ")
}

#[cfg(test)]
mod tests;
