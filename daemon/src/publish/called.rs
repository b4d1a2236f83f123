//! What a result and its original are to be called; and its end where its name is taken, and the hot folder wants no second one (`on_taken`): then
//! the file is not repaired at all, or, where the name was taken meanwhile, its result is given up before anything of it is in place.

use std::ffi::OsStr;
use std::io;
use std::path::Path;

use suture_store::{Ending, Job, RelPath};

use super::{Conclusion, Desk};
use crate::config::taken::OnTaken;
use crate::folder::Folder;
use crate::force::{is_forced, plain};
use crate::fsx;
use crate::names::{BEST, COMPANION, Names, best_of, companions, first, with_ending};
use crate::place::{Item, Placed};
use crate::publish_error::{PublishError, io_at};

impl Desk<'_> {
    /// The first free names for a result whose format has this ending, if there is one.
    pub(super) fn names(&self, job: &Job, ending: Ending, output: Option<&OsStr>) -> Result<Names, PublishError> {
        let (now_area, now_path) = job.original();
        let area = self.folder.area(ending.area());
        let here = |path: &RelPath| now_area == ending.area() && now_path == path;
        let folder = self.folder;
        let original_free = |path: &RelPath| Ok(here(path) || is_free(folder, &area, &path.to_path())?);
        let out = self.folder.out();
        let dropped = plain(&job.source.path);
        if ending.is_for_want_of_a_name() && ending.is_good() {
            // Only a report and a receipt, named after the original, and not beside what is another's.
            let free = |path: &RelPath| Ok(original_free(path)? && is_free_for_result(folder, &out, path)?);
            let original = first(&dropped, COMPANION, free)?;
            return Ok(Names { output: None, original });
        }
        if ending.is_good() {
            let wanted = output.map_or_else(|| dropped.clone(), |ending| with_ending(&dropped, ending));
            let result = first(&wanted, COMPANION, |path| is_free_for_result(folder, &out, path))?;
            return Ok(Names { output: Some(result), original: first(&dropped, 0, original_free)? });
        }
        let best = |path: &RelPath| best_of(&output.map_or_else(|| path.clone(), |ending| with_ending(path, ending)));
        let path = if now_area == ending.area() { now_path } else { &dropped };
        let original = first(path, COMPANION + BEST.len(), |path| {
            Ok(original_free(path)? && is_alone(folder, &area, path)? && is_free(folder, &area, &best(path).to_path())?)
        })?;
        Ok(Names { output: output.map(|_| best(&original)), original })
    }

    /// Gives a file its name; a result none that other systems take for another one.
    pub(super) fn put(
        &self,
        item: &Item,
        is_result: bool,
        is_it: &dyn Fn(&Path) -> io::Result<bool>,
    ) -> Result<Placed, PublishError> {
        let put = || {
            let is_new = is_result && item.source()?.is_some() && !fsx::exists(item.to)?;
            let held = if is_new { Some(self.folder.alike.hold(item.to)?) } else { None };
            if let Some(None) = held { Ok(Placed::Taken) } else { item.place(is_it) }
        };
        put().map_err(io_at(item.to))
    }

    /// The end of a job whose result, report or receipt would have a name that is taken; `None` where it is free, or the next one will do, as it
    /// does for work that is forced. `ending`: that of the result's format, once it is known.
    pub(crate) fn barred(&self, job: &Job, ending: Option<&OsStr>) -> Result<Option<Conclusion>, PublishError> {
        let end = match self.folder.on_taken {
            _ if is_forced(&job.source.path) => return Ok(None),
            OnTaken::Version => return Ok(None),
            OnTaken::Fail => Ending::NameTaken,
            OnTaken::Skip => Ending::Skipped,
        };
        let out = self.folder.out();
        let dropped = &job.source.path;
        let wanted =
            first(&ending.map_or_else(|| dropped.clone(), |ending| with_ending(dropped, ending)), COMPANION, |_| Ok(true))?;
        let [report, receipt] = companions(&wanted);
        for name in [wanted.to_path(), report, receipt] {
            let (path, shown) = (out.join(&name), name.display());
            let there = if !is_free(self.folder, &out, &name).map_err(io_at(&path))? {
                format!("out/{shown} is there already")
            } else if self.folder.alike.has_twin(&path).map_err(io_at(&path))? {
                format!("there is a name already that other systems take for out/{shown}")
            } else {
                continue;
            };
            let reason = match end {
                Ending::Skipped => format!("skipped: {there}"),
                _ => format!(
                    "{there}; take it away, then `suture jobs retry {}`, or drop the file again under another name",
                    job.id
                ),
            };
            return Ok(Some(Conclusion::None { ending: end, reason }));
        }
        Ok(None)
    }
}

fn is_free(folder: &Folder, base: &Path, path: &Path) -> io::Result<bool> {
    folder.has(&base.join(path)).map(|there| !there)
}

/// Is there neither a report nor a receipt of this name?
fn is_alone(folder: &Folder, base: &Path, path: &RelPath) -> io::Result<bool> {
    let [report, receipt] = companions(path);
    Ok(is_free(folder, base, &report)? && is_free(folder, base, &receipt)?)
}

/// Is there nothing of this name, of its report's and its receipt's, nor of one that other systems take for the same?
fn is_free_for_result(folder: &Folder, out: &Path, path: &RelPath) -> io::Result<bool> {
    let [report, receipt] = companions(path);
    for name in [path.to_path(), report, receipt] {
        if !is_free(folder, out, &name)? || folder.alike.has_twin(&out.join(name))? {
            return Ok(false);
        }
    }
    Ok(true)
}
