//! Drops in a bucket: a listing says where to look, a HEAD what is there. An object is whole at once. Each bucket has a thread of its own, so that no other
//! folder waits for a slow one. A daemon that leaves drops to others looks only whether the bucket answers.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use suture_store::{RelPath, Role, Seen, Source, StoreError, Submission, Submitted, crash_point};

use super::news::Told;
use crate::attempt::Context;
use crate::bucket::Trouble;
use crate::bucket::requests::Listed;
use crate::choice;
use crate::event::Happening;
use crate::folder::{Folder, NameKind, name_kind};
use crate::publish::litter::{self, NoAnswer};
use crate::shelf::Shelf;

/// Time between looks, unless `rescan` says another.
const LOOK_EVERY: Duration = Duration::from_secs(10);
/// The same while the store does not answer.
const LOOK_FOR: Duration = Duration::from_secs(2);
/// Time between looks for objects that came to nothing, and at drops that have jobs.
const CLEAR_EVERY: Duration = Duration::from_secs(3600);
/// How often it looks whether it is to end.
const IDLE: Duration = Duration::from_millis(50);
/// Drops that become jobs in one step.
const AT_ONCE: usize = 100;

/// Looks after the bucket of a folder, until `ended`.
///
/// # Errors
/// When the store of jobs failed.
pub(crate) fn tend(folder: &Folder, context: &Context, ended: &dyn Fn() -> bool) -> Result<(), StoreError> {
    let Some(shelf) = &folder.bucket else { return Ok(()) };
    let (mut looked, mut is_away) = (None::<Instant>, false);
    let mut intake = Intake {
        folder,
        shelf,
        context,
        ended,
        told: Told::default(),
        known: BTreeMap::new(),
        cleared: None,
        is_served: false,
        refused: RefCell::default(),
    };
    while !ended() {
        let every = if is_away { LOOK_FOR } else { context.settings.now().rescan.unwrap_or(LOOK_EVERY) };
        if looked.is_none_or(|then| context.world.steady().duration_since(then) >= every) {
            let began = context.world.steady();
            let found = if context.has(Role::Intake) { intake.look() } else { intake.reach().map_err(NoAnswer::from) };
            looked = Some(context.world.steady());
            let why = match found {
                Ok(()) => None,
                Err(NoAnswer::Store(error) | NoAnswer::Bucket(Trouble::Store(error))) => return Err(error),
                Err(NoAnswer::Bucket(trouble)) => Some(trouble.to_string()),
            };
            intake.tell(why.as_deref(), is_away)?;
            is_away = why.is_some();
            context.pulse.scanned(&folder.name, context.world.steady().duration_since(began));
            shelf.was_polled.store(true, Ordering::Release);
        }
        std::thread::sleep(IDLE);
    }
    Ok(())
}

struct Intake<'a> {
    folder: &'a Folder,
    shelf: &'a Shelf,
    context: &'a Context,
    ended: &'a dyn Fn() -> bool,
    told: Told,
    known: Known,
    /// It has answered in this life.
    is_served: bool,
    /// When objects that came to nothing were looked for last.
    cleared: Option<Instant>,
    /// Keys of drops that the store refuses to show, which was said.
    refused: RefCell<BTreeSet<String>>,
}

/// What a look at a key shows.
#[derive(Debug)]
enum Looked<S, E> {
    Drop(S),
    /// Nothing that could be a job.
    Nothing,
    /// The store does not show it, for that reason: it is looked at again.
    Refused(E),
}

impl Intake<'_> {
    /// Does the bucket answer, and is it fit to be used?
    fn reach(&mut self) -> Result<(), Trouble> {
        self.shelf.bucket.prove()?;
        if !std::mem::replace(&mut self.is_served, true) {
            tracing::info!(folder = %self.shelf.bucket.address(), polled = true, "Serving a hot folder.");
        }
        // Who works there may have met an outage, and calls no more until it is over.
        if self.shelf.bucket.trouble().is_some() { self.shelf.bucket.must_be_there() } else { Ok(()) }
    }

    /// Has jobs made of what is new.
    fn look(&mut self) -> Result<(), NoAnswer> {
        self.reach()?;
        let now = self.context.world.steady();
        if self.cleared.is_none_or(|then| now.duration_since(then) >= CLEAR_EVERY) {
            litter::clear(self.shelf, &*self.context.store, self.context.world.wall())?;
            self.cleared = Some(now);
            // All drops are looked at again, should a look have been told of an earlier version.
            self.known.clear();
            self.refused.get_mut().clear();
        }
        let listed = self.shelf.bucket.list("in")?.into_iter().filter(|one| is_mesh(&one.key)).collect();
        let known = std::mem::take(&mut self.known);
        let (known, looked) = look_through(listed, known, self.ended, &|key| self.drop_of(key), &|found| self.submit(found));
        self.known = known;
        looked
    }

    /// The drop of that key, if there is one: a listing is not believed.
    fn drop_of(&self, key: &str) -> Result<Looked<Submission, NoAnswer>, NoAnswer> {
        let path = RelPath::new(key.as_bytes());
        let object = match (&path, self.shelf.bucket.stat(&format!("in/{key}"))) {
            (Ok(_), Err(Trouble::Local(error))) => Err(error.to_string()),
            (Ok(_), Err(Trouble::Denied(reason))) => {
                // Where the bucket itself is refused, no drop of it is shown.
                self.shelf.bucket.must_be_there()?;
                if self.refused.borrow_mut().insert(key.to_owned()) {
                    tracing::warn!(
                        key,
                        reason,
                        "The store does not show a drop; it is asked again, and others are taken meanwhile."
                    );
                }
                return Ok(Looked::Refused(Trouble::Denied(reason).into()));
            }
            (Ok(_), found) => Ok(found?),
            (Err(error), _) => Err(error.to_string()),
        };
        let (Ok(path), Ok(object)) = (path, &object) else {
            tracing::warn!(key, reason = object.err(), "A drop cannot be taken; give it another name.");
            return Ok(Looked::Nothing);
        };
        let Some(object) = object else { return Ok(Looked::Nothing) };
        let settings = self.context.settings.now();
        let profile = Folder::profile_folder(&path).filter(|name| settings.profile(name).is_some());
        let profile = profile.unwrap_or_else(|| settings.folder_profile(&self.folder.name).to_owned());
        let priority = choice::priority(&settings, self.folder, &path, &profile);
        let (folder, (dev, ino)) = (self.folder.name.clone(), object.version.numbers());
        let (size, mtime_ns) = (object.version.size, object.version.mtime_ns);
        let source = Source { folder, path, dev, ino, size, mtime_ns, profile };
        Ok(Looked::Drop(Submission { source, foreign: None, priority, seen: Seen::After(None) }))
    }

    fn submit(&self, found: &[Submission]) -> Result<(), NoAnswer> {
        if found.is_empty() {
            return Ok(());
        }
        match self.context.store.submit(found) {
            Err(error) if error.is_callers() && found.len() > 1 => {
                // One by one, to find out which.
                return found.iter().try_for_each(|one| self.submit(std::slice::from_ref(one)));
            }
            Err(error) if error.is_callers() => tracing::warn!(%error, "A drop cannot become a job."),
            submitted => self.look_again(found, &submitted?)?,
        }
        crash_point("daemon.submitted");
        self.context.schedule.news();
        Ok(())
    }

    /// Of a drop that a worker moved while it was looked at no second job is made: it is new only if it is still there.
    fn look_again(&self, found: &[Submission], answers: &[Submitted]) -> Result<(), NoAnswer> {
        for (before, answer) in found.iter().zip(answers).filter(|(_, answer)| answer.ended) {
            let key = String::from_utf8_lossy(before.source.path.as_bytes());
            if let Looked::Drop(again) = self.drop_of(&key)? {
                self.submit(&[Submission { seen: Seen::After(Some(answer.id)), ..again }])?;
            }
        }
        Ok(())
    }

    /// Tells where the bucket stands: once when it goes, and once when it is back.
    fn tell(&mut self, why: Option<&str>, was_away: bool) -> Result<(), StoreError> {
        let (name, root) = (&self.folder.name, self.folder.place());
        match why {
            Some(why) if !was_away => self.context.bus.tell(&Happening::FolderAway { name, root, why }),
            None if was_away => self.context.bus.tell(&Happening::FolderBack { name, root }),
            _ => {}
        }
        let away = why.map(str::to_owned).into_iter().collect();
        self.context.away.lock().unwrap_or_else(PoisonError::into_inner).insert(name.clone(), away);
        // Others hear of it from whoever looks for drops.
        if self.context.has(Role::Intake) { self.told.tell(self.context, name, why) } else { Ok(()) }
    }
}

/// Looks at a key.
type Look<'a, S, E> = &'a dyn Fn(&str) -> Result<Looked<S, E>, E>;

/// Drops that have jobs, and what the listing told of their versions when they were looked at.
type Known = BTreeMap<String, String>;

/// Looks at what is new in a listing, and has jobs made of it. Only what has a job is known from then on: what was looked at before a look failed is
/// looked at again. A drop that is not shown is in no other's way. A daemon that is to end does not wait for the rest of many.
fn look_through<S, E>(
    listed: Vec<Listed>,
    mut known: Known,
    ended: &dyn Fn() -> bool,
    look: Look<'_, S, E>,
    submit: &dyn Fn(&[S]) -> Result<(), E>,
) -> (Known, Result<(), E>) {
    let keys: BTreeSet<&str> = listed.iter().map(|one| one.key.as_str()).collect();
    known.retain(|key, _| keys.contains(key.as_str()));
    let mut refused = None;
    let new: Vec<&Listed> = listed.iter().filter(|one| known.get(&one.key) != Some(&one.seen)).collect();
    for some in new.chunks(AT_ONCE) {
        if ended() {
            break;
        }
        let (mut found, mut settled) = (Vec::new(), Vec::new());
        for one in some {
            match look(&one.key) {
                Ok(Looked::Drop(drop)) => found.push(drop),
                Ok(Looked::Nothing) => {}
                Ok(Looked::Refused(why)) => {
                    refused.get_or_insert(why);
                    continue;
                }
                Err(error) => return (known, Err(error)),
            }
            settled.push((one.key.clone(), one.seen.clone()));
        }
        if let Err(error) = submit(&found) {
            return (known, Err(error));
        }
        known.extend(settled);
    }
    // Where none is shown, that is the folder's trouble.
    let looked = refused.filter(|_| known.is_empty()).map_or(Ok(()), Err);
    (known, looked)
}

/// A mesh, in folders none of which is another program's.
fn is_mesh(key: &str) -> bool {
    let mut parts = key.split('/').map(|part| name_kind(part.as_ref())).rev();
    parts.next() == Some(NameKind::Mesh) && parts.all(|kind| kind != NameKind::Ignored)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    fn listed(seen: &[(&str, &str)]) -> Vec<Listed> {
        seen.iter().map(|(key, seen)| Listed { key: (*key).into(), seen: (*seen).into() }).collect()
    }

    /// A look that fails half way loses nothing, and nothing is looked at twice that has a job.
    #[test]
    fn what_has_no_job_is_looked_at_again() {
        let (jobs, fails) = (RefCell::new(Vec::new()), Cell::new(true));
        let look = |key: &str| match key {
            "b" if fails.get() => Err("away"),
            "gone" => Ok(Looked::Nothing),
            "secret" => Ok(Looked::Refused("hidden")),
            key => Ok(Looked::Drop(key.to_owned())),
        };
        let submit = |found: &[String]| {
            jobs.borrow_mut().extend_from_slice(found);
            Ok(())
        };
        let all = || listed(&[("a", "1"), ("b", "1"), ("gone", "1")]);
        let (known, looked) = look_through(all(), Known::new(), &|| false, &look, &submit);
        assert_eq!((looked, known.len()), (Err("away"), 0));
        fails.set(false);
        let (known, looked) = look_through(all(), known, &|| false, &look, &submit);
        assert_eq!((looked, jobs.take()), (Ok(()), vec!["a".to_owned(), "b".into()]));
        let (known, _) = look_through(all(), known, &|| false, &look, &submit);
        assert_eq!(jobs.take(), [""; 0]);
        let (known, _) = look_through(listed(&[("a", "2")]), known, &|| false, &look, &submit);
        assert_eq!((jobs.take(), known.len()), (vec!["a".to_owned()], 1), "another version");
        let (hidden, looked) = look_through(listed(&[("secret", "1"), ("z", "1")]), Known::new(), &|| false, &look, &submit);
        assert_eq!(
            (looked, jobs.take(), hidden.len()),
            (Ok(()), vec!["z".to_owned()], 1),
            "one that is not shown is in nobody's way"
        );
        let (_, looked) = look_through(listed(&[("secret", "1")]), Known::new(), &|| false, &look, &submit);
        assert_eq!(looked, Err("hidden"), "none is shown");
        let (known, looked) = look_through(all(), known, &|| false, &look, &|_: &[String]| Err("full"));
        assert_eq!(looked, Err("full"));
        let (_, looked) = look_through(all(), known, &|| true, &look, &|_: &[String]| Err("full"));
        assert_eq!(looked, Ok(()), "the daemon is to end");
    }

    #[test]
    fn meshes_that_are_no_other_programs_are_taken() {
        for (key, is_taken) in
            [("a.stl", true), ("order/a.STL", true), ("", false), ("a.txt", false), (".tmp/a.stl", false), ("a.stl/", false)]
        {
            assert_eq!(is_mesh(key), is_taken, "{key}");
        }
    }
}
