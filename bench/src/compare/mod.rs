//! Suture and its peers over the same files: whole processes in alternation, outputs synced, all judged alike.
//!
//! Every run starts with its input brought into the page cache, or out of it, and everything else written back. Rounds go through
//! all programs, forwards and backwards by turns, so that no program always follows the same one. The outputs of the first run of
//! each side are judged, by another process, so that the memory that needs is not counted against a child of this one. Every run is
//! in the journal ([`record`]) before the next begins: a comparison that is stopped can be resumed. Pages and plots are made from
//! journals alone ([`publish`]).

mod book;
mod cache;
mod cgroup;
mod child;
pub(crate) mod closing;
mod csv;
mod error;
mod filled;
mod folders;
pub(crate) mod formats;
mod load_obj;
mod machine;
mod made;
mod markdown;
pub(crate) mod meaning;
mod options;
pub(crate) mod outlines;
mod page;
mod page_arrays;
mod page_closing;
mod page_damage;
mod page_formats;
mod page_meaning;
mod page_outlines;
mod page_simplify;
mod page_skin;
mod page_solids;
mod page_stores;
mod plot;
mod programs;
mod record;
mod sides;
mod simplified;
pub(crate) mod simplify;
pub(crate) mod skin;
pub(crate) mod solids;
mod statistics;
mod stored;
pub(crate) mod stores;
mod together;
mod transfer;
mod trial;
mod way;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use suture_bench::generate::{Case, Density};

pub(crate) use error::Error;
pub(crate) use folders::{home, places, results};
pub(crate) use load_obj::load_obj;
pub(crate) use options::Options;
pub(crate) use record::Judged;
pub(crate) use sides::Side;
pub(crate) use way::Cache;

use machine::Machine;
use record::{Journal, Line, Session};

/// Runs the comparison and keeps its raw runs.
///
/// # Errors
/// When suture cannot be built, or the system fails. A program that is missing, or fails over an input, is a result.
pub(crate) fn compare(options: &Options) -> Result<(), Error> {
    let programs = programs::Programs::prepare(&options.sides, options.suture.clone())?;
    let parent = options.folder.clone().unwrap_or_else(std::env::temp_dir);
    let folder = tempfile::Builder::new().prefix("suture-bench-").tempdir_in(&parent).map_err(Error::io("making a folder"))?;
    let mut journal = Journal::open(&options.raw, options.resume)?;
    let machine = Machine::describe(folder.path(), programs.versions());
    let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    journal.write(Line::Session(Session { began, command: options.command.clone(), machine }))?;
    let mut sides = options.sides.clone();
    for &side in &options.sides {
        if let Some(reason) = programs.lack(side) {
            eprintln!("{} is left out: {reason}", side.facts().name);
            journal.write(Line::Skipped { side, reason })?;
            sides.retain(|other| *other != side);
        }
    }
    let options = Options { sides, ..options.clone() };
    let mut trial = trial::Trials::new(&options, programs, journal, folder.path())?;
    for file in &options.files {
        trial.foreign(file)?;
    }
    for &size in &options.sizes {
        let fits = |case: Case| options.up_to.iter().all(|(bounded, most)| *bounded != case || size <= *most);
        for &case in options.cases.iter().filter(|case| fits(**case)) {
            let asked = |density: &&Density| case.has_density() || **density == Density::Sparse;
            for &density in options.densities.iter().filter(asked) {
                trial.generated(case, density, size)?;
            }
        }
    }
    Ok(())
}

/// Makes the page (`RESULTS.md`), the table of real files, the plots and the README's table from the raw runs of `raw`, into the folder `into`.
///
/// # Errors
/// When there are no raw runs, or something cannot be read or written.
pub(crate) fn publish(raw: &Path, into: &Path, readme: Option<&Path>) -> Result<(), Error> {
    let plots = into.join("plots");
    std::fs::create_dir_all(&plots).map_err(Error::io("making the folder of plots"))?;
    for (path, text) in pages(raw, into, &plots, readme)? {
        std::fs::write(&path, text).map_err(Error::io(format!("writing {}", path.display())))?;
    }
    Ok(())
}

/// The published texts that are not those of the raw runs any more; writes nothing there.
///
/// # Errors
/// As [`publish`].
pub(crate) fn outdated(raw: &Path, into: &Path, readme: Option<&Path>) -> Result<Vec<PathBuf>, Error> {
    let plots = tempfile::tempdir().map_err(Error::io("making a folder"))?;
    let mut pages = pages(raw, into, plots.path(), readme)?;
    pages.retain(|(path, text)| std::fs::read_to_string(path).ok().as_ref() != Some(text));
    Ok(pages.into_iter().map(|(path, _)| path).collect())
}

/// The texts that are published, by where they belong; draws the plots.
fn pages(raw: &Path, into: &Path, plots: &Path, readme: Option<&Path>) -> Result<Vec<(PathBuf, String)>, Error> {
    let book = book::Book::load(raw)?;
    let drawn = plot::draw(&book, plots)?;
    let mut pages = vec![(into.join("RESULTS.md"), page::page(&book, &drawn))];
    let files = csv::real_files(&book);
    if !files.is_empty() {
        pages.push((raw.join("real-files.csv"), files));
    }
    if let Some(readme) = readme {
        let text = std::fs::read_to_string(readme).map_err(Error::io(format!("reading {}", readme.display())))?;
        pages.extend(page::put_in(&text, &page::short(&book)).map(|text| (readme.into(), text)));
    }
    Ok(pages)
}

#[cfg(test)]
mod tests {
    /// Whoever adds raw runs, or changes a page, publishes.
    #[test]
    fn what_is_published_is_what_the_raw_runs_say() {
        let readme = super::home().join("../README.md");
        let outdated = super::outdated(&super::results(), super::home(), Some(&readme)).unwrap();
        assert!(outdated.is_empty(), "`suture-bench publish` makes these anew: {outdated:?}");
    }
}
