//! `suture store`: is every record of a job store as it must be, and all of its jobs as lines of JSON.

use std::io::ErrorKind;
use std::path::Path;

use suture_store::{SledStore, StoreError, Verified};

use crate::cli::service::{StoreArgs, StoreCommand};
use crate::exit::Exit;
use crate::reach::{Failure, must_be_hot, state_of, unseen, watched};
use crate::say::{complain, plain, print};
use crate::units::show_count;
use crate::{create, fsx, jobs};

/// Lines that are shown of what is wrong: who has more of them needs no more of them.
const SHOWN: usize = 50;

/// Does what the command line asks.
pub(crate) fn run(args: &StoreArgs) -> Exit {
    let done = match &args.command {
        StoreCommand::Verify => verify(&args.dir),
        StoreCommand::Export { output, force } => export(&args.dir, output.as_deref(), *force),
    };
    done.unwrap_or_else(|Failure { line, exit }| {
        complain(&line);
        exit
    })
}

fn verify(dir: &Path) -> Result<Exit, Failure> {
    must_be_hot(dir)?;
    let state = state_of(dir).map_err(|error| unseen(dir, &error))?;
    let place = plain(&state.display().to_string());
    if !fsx::is_folder(&state).map_err(|error| unseen(&state, &error))? {
        let none = format!("{place}: there is no job store yet; the next `suture watch` makes one\n");
        return Ok(print(none.as_bytes(), Exit::Good));
    }
    watched()?;
    let found = SledStore::verify(&state).map_err(|error| match error {
        StoreError::Locked { pid, .. } => owned(dir, pid),
        error => error.into(),
    })?;
    let exit = if found.wrong.is_empty() { Exit::Good } else { Exit::NotGood };
    Ok(print(said(&place, &found).as_bytes(), exit))
}

fn owned(dir: &Path, pid: Option<u32>) -> Failure {
    let who = pid.map(|pid| format!(" (process {pid})")).unwrap_or_default();
    let line = format!(
        "{}: a daemon{who} has the job store, and may change it at any time: stop it, then verify; `suture store export` works meanwhile",
        dir.display()
    );
    Failure { line, exit: Exit::Owned }
}

/// The findings, for people.
fn said(place: &str, found: &Verified) -> String {
    let Verified { jobs, records, mends, wrong, advice } = found;
    let all = format!("{} jobs, {} records", show_count(*jobs), show_count(*records));
    let mut text = match wrong.len() {
        0 => format!("{place}: sound: {all}\n"),
        count => format!("{place}: not sound: {all}, {} found wrong\n", show_count(count as u64)),
    };
    text.extend(wrong.iter().take(SHOWN).map(|line| format!("  {}\n", plain(line))));
    if let Some(more @ 1..) = wrong.len().checked_sub(SHOWN) {
        text += &format!("  … and {more} more\n");
    }
    text.extend(mends.iter().map(|line| format!("  by the next start: {}\n", plain(line))));
    if !wrong.is_empty() {
        text += &format!("{}\n", plain(advice));
    }
    text
}

fn export(dir: &Path, output: Option<&Path>, force: bool) -> Result<Exit, Failure> {
    let text = jobs::all_as_json(dir)?;
    let Some(path) = output else { return Ok(print(text.as_bytes(), Exit::Good)) };
    create::place(path, text.as_bytes(), force).map(|()| Exit::Good).map_err(|error| {
        let advice = if error.kind() == ErrorKind::AlreadyExists { " (--force replaces it)" } else { "" };
        Failure { line: format!("{}: cannot be written: {error}{advice}", path.display()), exit: Exit::Refused }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_said_with_what_to_do_and_bounded() {
        let mut found = Verified { jobs: 1200, records: 4000, mends: vec!["a kill left half".into()], ..Verified::default() };
        assert_eq!(said("s", &found), "s: sound: 1 200 jobs, 4 000 records\n  by the next start: a kill left half\n");
        found.wrong = (1..=SHOWN + 2).map(|id| format!("job {id}: its checksum is wrong")).collect();
        found.advice = "begin anew".into();
        let text = said("s", &found);
        assert!(
            text.starts_with("s: not sound: 1 200 jobs, 4 000 records, 52 found wrong\n  job 1: its checksum is wrong\n"),
            "{text}"
        );
        assert!(text.contains("\n  … and 2 more\n") && text.ends_with("\nbegin anew\n"), "{text}");
        assert_eq!(text.lines().count(), 1 + SHOWN + 1 + 1 + 1);
    }
}
