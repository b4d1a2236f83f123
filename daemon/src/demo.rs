//! `suture demo`: a hot folder of small broken meshes, served by the real daemon, and what came of each file. Run again, it drops
//! the same files again: nothing is overwritten, so the second `holes.stl` becomes `holes~2.stl`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use suture_core::Report;
use suture_store::{Job, JobId, State};

use crate::config::Config;
use crate::control::JobsWish;
use crate::exit::Exit;
use crate::say::complain;
use crate::settings::Settings;
use crate::signals::Stop;
use crate::{create, fsx, left, reach, table, watch};

mod meshes;

/// A file that no one can repair, so that one sees where those go.
const NO_MESH: (&str, &[u8]) = ("holiday.stl", b"\x89PNG\r\n\x1a\nthis is a picture with the wrong name");

/// Makes the folder, drops the files, serves them, tells.
pub(crate) fn run() -> Exit {
    match demo() {
        Ok(exit) => exit,
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

fn demo() -> Result<Exit, String> {
    let dir = folder()?;
    let shown = dir.display();
    let stop = Stop::listen().map_err(|e| format!("cannot listen for signals: {e}"))?;
    let before = known_jobs(&dir)?.iter().map(|job| job.id).max().unwrap_or(JobId(0));
    let dropped = drop_files(&dir.join("in"))?;
    say(format_args!("Dropped {dropped} small files into {shown}/in; serving them, as `suture watch` would.\n"));
    let mut config = Config::for_folder(&dir);
    // Nobody writes slowly here.
    config.settle = Some(Duration::from_millis(100));
    let exit = watch::serve(Settings::fixed(config), true, &stop, false);
    if !matches!(exit, Exit::Good | Exit::NotGood) {
        return Ok(exit);
    }
    let mut jobs = known_jobs(&dir)?;
    jobs.retain(|job| job.id > before);
    jobs.iter().for_each(|job| tell(&dir, job));
    farewell(&dir, jobs.iter().find(|job| job.source.path.name() == b"mixed.stl").map_or(1, |job| job.id.0));
    Ok(Exit::Good)
}

fn farewell(dir: &Path, id: u64) {
    let shown = dir.display();
    let lines = [
        (format!("{shown}/out"), "the results, each with a report and a receipt"),
        (format!("{shown}/done"), "the originals of those"),
        (format!("{shown}/failed"), "what could not be made good, with the reason"),
        (String::new(), ""),
        (format!("suture jobs list --dir {shown}"), "what became of every file"),
        (format!("suture jobs show {id} --dir {shown}"), "one of them in full"),
        ("suture repair YOUR.stl -o repaired.stl".into(), "one file"),
        (format!("suture watch {shown}"), "serve the folder; drop meshes into its in/, end with Ctrl-C"),
    ];
    let width = lines.iter().map(|(what, _)| what.chars().count()).max().unwrap_or(0);
    say(format_args!("\nWhere things are"));
    for (what, why) in &lines {
        if what.is_empty() {
            say(format_args!("\nWhat to type next (`suture` stands for `cargo run --release --` until it is installed)"));
        } else {
            say(format_args!("  {what:<width$}  {why}"));
        }
    }
}

/// `./demo` where that can be made or was made by us before, else a temporary folder that stays.
fn folder() -> Result<PathBuf, String> {
    let here = PathBuf::from("demo");
    let ours = fsx::is_folder(&here.join(".suture")).unwrap_or(false);
    if ours || (fsx::exists(&here).is_ok_and(|there| !there) && std::fs::create_dir(&here).is_ok()) {
        let probe = create::temporary_in(&here);
        if create::write_new(&probe, b"").is_ok() && fsx::remove_if_there(&probe).is_ok() {
            return Ok(here);
        }
    }
    let made = tempfile::Builder::new().prefix("suture-demo-").tempdir();
    made.map(tempfile::TempDir::keep).map_err(|e| format!("no folder for the demo can be made: {e}"))
}

/// Writes each file under a hidden name and renames it into place, as a careful program would; returns their number.
fn drop_files(inbox: &Path) -> Result<usize, String> {
    let failed = |path: &Path, e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", path.display());
    std::fs::create_dir_all(inbox).map_err(|e| failed(inbox, &e))?;
    let place = |temporary: &Path, name: &str| {
        let target = inbox.join(name);
        // One that waits from an interrupted demo is as good.
        match fsx::rename_new(temporary, &target) {
            Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => Err(failed(&target, &e)),
            _ => fsx::remove_if_there(temporary).map_err(|e| failed(temporary, &e)),
        }
    };
    let meshes = meshes::all();
    let files = meshes.iter().map(|mesh| (format!("{}.stl", mesh.name), mesh.bytes()));
    for (name, bytes) in files.chain([(NO_MESH.0.to_owned(), NO_MESH.1.to_vec())]) {
        let temporary = create::temporary_in(inbox);
        create::write_new(&temporary, &bytes).map_err(|e| failed(&temporary, &e))?;
        place(&temporary, &name)?;
    }
    Ok(meshes.len() + 1)
}

fn known_jobs(dir: &Path) -> Result<Vec<Job>, String> {
    let is_new = fsx::is_folder(&dir.join(".suture")).map(|there| !there);
    if is_new.map_err(|error| format!("{}: cannot be looked at: {error}", dir.display()))? {
        return Ok(Vec::new());
    }
    reach::jobs(dir, &JobsWish::List).map_err(|failure| failure.line)
}

fn tell(dir: &Path, job: &Job) {
    let name = job.source.path.to_string();
    let State::Ended { publication } = &job.state else {
        return say(format_args!("{name:<16} {}", job.kind()));
    };
    let report = left::report_path(dir, job).and_then(|path| std::fs::read(path).ok());
    let Some(report) = report.and_then(|bytes| serde_json::from_slice::<Report>(&bytes).ok()) else {
        say(format_args!("{name:<16} {}\n{:16} reason  {}", job.kind(), "", publication.reason));
        return;
    };
    let (wrong, done) = table::summary(&report);
    let state = if publication.ending.is_good() { "good" } else { job.kind().name() };
    say(format_args!("{name:<16} {state}: {}", report.verdict.statement));
    say(format_args!("{:16} wrong   {wrong}\n{:16} done    {done}", "", ""));
    for reason in &report.verdict.reasons {
        say(format_args!("{:16} why     {reason}", ""));
    }
}

fn say(text: std::fmt::Arguments) {
    // A reader that has gone away has seen enough.
    let _ = writeln!(std::io::stdout(), "{text}");
}
