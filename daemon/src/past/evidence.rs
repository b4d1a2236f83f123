//! A job, as one receipt and the files that it speaks of tell of it.

use std::io;
use std::path::{Path, PathBuf};

use suture_store::job::{Area, one_line};
use suture_store::{Attempt, JobId, Past, Publication, Reached, RelPath, Source, Time, Token};

use crate::claim::CLAIMED;
use crate::folder::Folder;
use crate::force;
use crate::fsx::{self, Identity};
use crate::names::best_of;
use crate::place::{ASIDE, stage};
use crate::receipt::Told;

/// A receipt that was read.
pub(super) struct Evidence<'a> {
    pub folder: &'a Folder,
    pub told: &'a Told,
    /// The number that its job is to have; 0: any.
    pub number: JobId,
    pub written_ns: i64,
}

/// Where an original is whose result is in place.
struct Whereabouts {
    reached: Reached,
    found: Option<Identity>,
    /// Its name in the area of the ending.
    name: RelPath,
    stays: bool,
}

impl Evidence<'_> {
    /// The job of a receipt that stands beside the result of this name. `None`: it speaks of something else (it was moved there), or is no
    /// whole one.
    ///
    /// # Errors
    /// As the file system's: then it is not known.
    pub(super) fn of_placed(&self, area: Area, base: &RelPath) -> io::Result<Option<Past>> {
        let told = self.told;
        let (Some(ending), Some(source)) = (told.ending, &told.source) else { return Ok(None) };
        let output_fits = |output: &RelPath| *output == if ending.is_good() { base.clone() } else { best_of(base) };
        if ending.area() != area || !told.output.as_ref().is_none_or(output_fits) {
            return Ok(None);
        }
        let found = self.whereabouts(area, base, source)?;
        let publication = Publication { original: Some(found.name), stays: found.stays, ..self.publication(None) };
        Ok(self.past(found.found, publication, found.reached))
    }

    /// The job whose receipt, and perhaps result, is in the folder of its attempt still. `None` where its original is not there as it was:
    /// then its result is nobody's.
    ///
    /// # Errors
    /// As [`Evidence::of_placed`].
    pub(super) fn of_attempt(&self, token: Token) -> io::Result<Option<Past>> {
        let Some(source) = &self.told.source else { return Ok(None) };
        let (area, path) = self.told.moved_from.as_ref().map_or((Area::In, source), |(area, path)| (*area, path));
        let named = self.content_at(&self.folder.area(area).join(path.to_path()))?;
        let ctime_ns = named.map(|found| found.ctime_ns);
        let claimed = self.folder.work(token).join(CLAIMED);
        let Some(found) = named.map_or_else(|| self.content_at(&claimed), |found| Ok(Some(found)))? else { return Ok(None) };
        // Where it stays, its name only stands for those of report and receipt.
        let Some(original) = self.told.original.clone().or_else(|| self.told.stays.then(|| force::plain(source))) else {
            return Ok(None);
        };
        let publication = Publication { original: Some(original), stays: self.told.stays, ..self.publication(ctime_ns) };
        Ok(self.past(Some(found), publication, Reached::Publishing))
    }

    fn whereabouts(&self, area: Area, base: &RelPath, source: &RelPath) -> io::Result<Whereabouts> {
        let told = self.told;
        // Receipts of older versions do not name it: by the rules it has the result's name, or its own.
        let guesses = [base, source];
        let names: Vec<&RelPath> = told.original.iter().chain(guesses.into_iter().filter(|_| told.original.is_none())).collect();
        let name = (*names.first().unwrap_or(&base)).clone();
        let stays = told.stays || (told.original.is_none() && self.folder.leave_originals);
        let at = |reached, found, name, stays| Ok(Whereabouts { reached, found, name, stays });
        if !stays {
            for name in names {
                if let Some(found) =
                    regular(&self.folder.area(area).join(name.to_path()))?.filter(|found| self.looks_alike(found))
                {
                    return at(Reached::Ended, Some(found), name.clone(), false);
                }
            }
        }
        let dropped = self.folder.inbox().join(source.to_path());
        if stays {
            let found = regular(&dropped)?.filter(|found| found.size == told.source_bytes);
            let known = found.filter(|found| told.source_mtime_ns == Some(found.mtime_ns));
            let found = known.map_or_else(|| self.content_at(&dropped), |found| Ok(Some(found)))?;
            return at(Reached::Ended, found, name, true);
        }
        for path in self.on_the_way(&dropped) {
            if let Some(found) = self.content_at(&path)?
                && self.result_stands(base)?
            {
                return at(Reached::Published, Some(found), name, false);
            }
        }
        at(Reached::Ended, None, name, false)
    }

    /// Names of an original that has still to be moved.
    fn on_the_way(&self, dropped: &Path) -> Vec<PathBuf> {
        let from = self.told.moved_from.as_ref().map(|(area, path)| self.folder.area(*area).join(path.to_path()));
        let from = from.unwrap_or_else(|| dropped.to_owned());
        let claimed = self.told.work.map(|token| {
            let aside = stage(fsx::folder_of(&from), token, ASIDE);
            [aside, self.folder.work(token).join(CLAIMED)]
        });
        std::iter::once(from).chain(claimed.into_iter().flatten()).collect()
    }

    /// Size and time as the receipt says, as far as it does.
    fn looks_alike(&self, found: &Identity) -> bool {
        found.size == self.told.source_bytes && self.told.source_mtime_ns.is_none_or(|then| then == found.mtime_ns)
    }

    /// The file of that name, if it has the content that the receipt is of; by its time where no hash was taken.
    fn content_at(&self, path: &Path) -> io::Result<Option<Identity>> {
        let Some(found) = regular(path)?.filter(|found| found.size == self.told.source_bytes) else { return Ok(None) };
        let is_it = match self.told.source_blake3 {
            Some(hash) => fsx::hash(path)? == hash,
            None => self.told.source_mtime_ns == Some(found.mtime_ns),
        };
        Ok(is_it.then_some(found))
    }

    /// Is the result in its place, as it was published? If it was taken away, the same file dropped again is a new one.
    fn result_stands(&self, base: &RelPath) -> io::Result<bool> {
        let (Some(output), Some(hash)) = (&self.told.output, self.told.output_blake3) else { return Ok(true) };
        let good = self.told.ending.is_some_and(|ending| ending.is_good());
        let area = if good { self.folder.out() } else { self.folder.area(self.told.ending.map_or(Area::Failed, |e| e.area())) };
        let path = area.join(if good { base.to_path() } else { output.to_path() });
        Ok(regular(&path)?.is_some() && fsx::hash(&path)? == hash)
    }

    fn publication(&self, source_ctime_ns: Option<i64>) -> Publication {
        let told = self.told;
        Publication {
            // Whoever asks has looked that there is one.
            ending: told.ending.unwrap_or(suture_store::Ending::Environment),
            reason: one_line(&told.reason),
            output: told.output.clone(),
            output_hash: told.output_blake3,
            report_hash: told.report_blake3,
            recipe: None,
            reused: told.reused,
            source_ctime_ns,
            original: None,
            stays: false,
            decision: told.decision.clone(),
        }
    }

    fn past(&self, found: Option<Identity>, publication: Publication, reached: Reached) -> Option<Past> {
        let told = self.told;
        told.ending?;
        let source = Source {
            folder: self.folder.name.clone(),
            path: told.source.clone()?,
            dev: found.map_or(0, |found| self.folder.noted_device(found.dev)),
            ino: found.map_or(0, |found| found.ino),
            size: told.source_bytes,
            mtime_ns: found.map(|found| found.mtime_ns).or(told.source_mtime_ns).unwrap_or(0),
            profile: told.profile.clone(),
        };
        Some(Past {
            id: self.number,
            source,
            moved_to: told.moved_from.clone(),
            publication,
            attempts: Attempt(told.attempt),
            work: told.work.filter(|_| reached != Reached::Ended),
            ended: Time(u64::try_from(self.written_ns / 1_000_000).unwrap_or(0)),
            reached,
        })
    }
}

/// A regular file, as it is under that name.
pub(super) fn regular(path: &Path) -> io::Result<Option<Identity>> {
    use io::ErrorKind::{InvalidFilename, NotADirectory, NotFound};
    match std::fs::symlink_metadata(path) {
        Ok(meta) => Ok(meta.is_file().then(|| Identity::from(&meta))),
        // A name that no file can have comes from a receipt that someone made up.
        Err(error) if matches!(error.kind(), NotFound | NotADirectory | InvalidFilename) => Ok(None),
        Err(error) => Err(error),
    }
}
