//! `suture store`: is every record of a job store as it must be, all of its jobs as lines of JSON, and how it moves ([`moved`]).

use std::io::ErrorKind;
use std::path::Path;

use suture_store::{Address, SledStore, StoreError, Verified};

use crate::cli::service::{StoreArgs, StoreCommand};
use crate::exit::Exit;
use crate::reach::{Failure, elsewhere, must_be_hot, state_of, unseen, watched};
use crate::say::{complain, plain, print};
use crate::shared::{self, make, noted, visit};
use crate::units::show_count;
use crate::{create, fsx, jobs};

mod moved;

use moved::owned;

/// Lines that are shown of what is wrong: who has more of them needs no more of them.
const SHOWN: usize = 50;

/// Does what the command line asks.
pub(crate) fn run(args: &StoreArgs) -> Exit {
    let (dir, address) = (args.dir.as_path(), args.store.as_ref());
    let done = match &args.command {
        StoreCommand::Verify { against: Some(file) } => verify(dir, address).and_then(|exit| compared(dir, address, file, exit)),
        StoreCommand::Verify { against: None } => verify(dir, address),
        StoreCommand::Export { complete, output, force } => export(dir, address, *complete, output.as_deref(), *force),
        StoreCommand::Import { file } => moved::import(dir, address, file),
        StoreCommand::Create => create_shared(address),
        StoreCommand::Role { name } => role(name),
    };
    done.unwrap_or_else(|Failure { line, exit }| {
        complain(&line);
        exit
    })
}

fn verify(dir: &Path, address: Option<&Address>) -> Result<Exit, Failure> {
    if let Some(address) = address {
        return verify_shared(address);
    }
    must_be_hot(dir)?;
    let state = state_of(dir).map_err(|error| unseen(dir, &error))?;
    let place = plain(&state.display().to_string());
    if let Some(address) = noted(&state).map_err(|error| unseen(&state, &error))? {
        return Err(elsewhere(&state, &address));
    }
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

/// The same of a shared store, which others may work with meanwhile.
fn verify_shared(address: &Address) -> Result<Exit, Failure> {
    let store = visit(address, "")?;
    let jobs = store.counts()?.iter().map(|(_, count)| count).sum();
    let advice = "keep a copy of the database, and restore the last one that was sound".into();
    let found = Verified { jobs, records: jobs, wrong: store.verify()?, advice, ..Verified::default() };
    let exit = if found.wrong.is_empty() { Exit::Good } else { Exit::NotGood };
    Ok(print(said(&address.to_string(), &found).as_bytes(), exit))
}

/// The differences of the store from an export.
fn compared(dir: &Path, address: Option<&Address>, file: &Path, exit: Exit) -> Result<Exit, Failure> {
    let lines = moved::differences(dir, address, file)?;
    let mut text = match lines.len() {
        0 => format!("{}: the store holds the same\n", plain(&file.display().to_string())),
        count => format!(
            "{}: the store holds something else in {} places\n",
            plain(&file.display().to_string()),
            show_count(count as u64)
        ),
    };
    text.extend(lines.iter().take(SHOWN).map(|line| format!("  {}\n", plain(line))));
    Ok(print(text.as_bytes(), if lines.is_empty() { exit } else { Exit::NotGood }))
}

fn create_shared(address: Option<&Address>) -> Result<Exit, Failure> {
    let Some(address) = address else {
        let line = "name the database with --store; a folder's store is made by its daemon".to_owned();
        return Err(Failure { line, exit: Exit::Refused });
    };
    make(address)?;
    Ok(print(format!("{address}: the job store is there, and up to date\n").as_bytes(), Exit::Good))
}

fn role(name: &str) -> Result<Exit, Failure> {
    let quoted = format!("\"{}\"", name.replace('"', "\"\""));
    let head = format!(
        "-- To be run by the owner of the database, after `suture store create --store postgres://OWNER@HOST/DATABASE` has made the schema.\n\
         -- A password: \\password {name} in psql, or a line of pg_hba.conf that needs none.\nCREATE ROLE {quoted} LOGIN;\n"
    );
    Ok(print((head + &shared::role(name)?).as_bytes(), Exit::Good))
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

fn export(dir: &Path, address: Option<&Address>, complete: bool, output: Option<&Path>, force: bool) -> Result<Exit, Failure> {
    let text = if complete { moved::export(dir, address)? } else { jobs::all_as_json(dir, address)?.into_bytes() };
    let Some(path) = output else { return Ok(print(&text, Exit::Good)) };
    create::place(path, &text, force).map(|()| Exit::Good).map_err(|error| {
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
