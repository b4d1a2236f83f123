//! `suture retention`: what would go now, and why. Changes nothing.

use std::fmt::Write as _;
use std::path::Path;

use suture_store::{Clock, Job, SystemClock, Time};

use super::archive::Archive;
use super::history::past_of;
use super::plan::{Going, What, going};
use super::stock::Stock;
use crate::config::keep::Keep;
use crate::config::{Config, FolderConfig, read};
use crate::exit::Exit;
use crate::fsx;
use crate::remove::ours;
use crate::say::{complain, plain, print};
use crate::units::{show_count, show_size};

/// Gets all jobs of the store of a hot folder, or a line for people and what it comes to.
type Jobs<'a> = &'a dyn Fn(&Path) -> Result<Vec<Job>, (String, Exit)>;

/// Says for the configuration `file`.
pub(crate) fn run(file: &Path, jobs: Jobs) -> Exit {
    let config = match read::whole(file) {
        Ok(config) => config,
        Err(line) => return fail(&line, Exit::Refused),
    };
    let now = SystemClock.now();
    let mut text = String::new();
    for folder in &config.folders {
        match of_folder(folder, &config.keep, now) {
            Ok(lines) => text += &lines,
            Err(line) => return fail(&line, Exit::TryAgain),
        }
    }
    match of_history(&config, now, jobs) {
        Ok(lines) => text += &lines,
        Err((line, exit)) => return fail(&line, exit),
    }
    if text.is_empty() {
        text = "nothing would go\n".into();
    }
    print(text.as_bytes(), Exit::Good)
}

fn fail(line: &str, exit: Exit) -> Exit {
    complain(&line);
    exit
}

/// A line for each file of a hot folder that would go, and for what keeps originals from it.
fn of_folder(folder: &FolderConfig, keep: &Keep, now: Time) -> Result<String, String> {
    let stock = Stock::of(&folder.path, keep).map_err(|error| format!("{}: cannot be read: {error}", folder.path.display()))?;
    let mut text = String::new();
    let going = going(stock.pieces, keep, now);
    let archive = keep.archive().filter(|_| going.iter().any(|going| going.piece.what == What::Original)).map(Archive::open);
    if let Some(Err(line)) = &archive {
        let _ = writeln!(text, "originals would stay: {}", plain(line));
    }
    for Going { piece, why } in going {
        let path = folder.path.join(&piece.path);
        let (shown, size) = (plain(&path.display().to_string()), show_size(piece.bytes));
        let (verb, to) = match (&archive, piece.what, keep.archive()) {
            (Some(Ok(_)), What::Original, Some(archive)) => {
                ("move", format!(" to {}", plain(&archive.join(&folder.name).display().to_string())))
            }
            (_, What::Original, _) => continue,
            _ if !matches!(ours(&path, piece.hash), Ok(Some(_))) => continue,
            _ => ("remove", String::new()),
        };
        let _ = writeln!(text, "would {verb} {shown}{to} ({}, {size}): {why}", piece.what.word());
    }
    Ok(text)
}

/// A line for the records of jobs that would go.
fn of_history(config: &Config, now: Time, jobs: Jobs) -> Result<String, (String, Exit)> {
    let mut text = String::new();
    // All folders have one store.
    let Some(first) = config.folders.first() else { return Ok(text) };
    let served = fsx::is_folder(&first.path.join(".suture"));
    if !served.map_err(|error| (format!("{}: cannot be looked at: {error}", first.path.display()), Exit::TryAgain))? {
        return Ok(text);
    }
    let jobs = jobs(&first.path)?;
    let is_needed = |job: &Job| {
        let folder = config.folders.iter().find(|folder| folder.name == job.source.folder);
        // A bucket is not asked: then a record may stay that would go.
        let there = |folder: &FolderConfig| {
            folder.bucket.is_some() || fsx::exists(&folder.path.join("in").join(job.source.path.to_path())).unwrap_or(true)
        };
        job.answers_for_source() && folder.is_none_or(there)
    };
    for past in past_of(&jobs, &config.keep, now, &is_needed) {
        let _ = writeln!(text, "would forget {} jobs: {}", show_count(past.ids.len() as u64), past.why);
    }
    Ok(text)
}
