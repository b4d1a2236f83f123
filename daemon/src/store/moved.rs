//! A job store moves: from a state folder into a database that many machines share, or out of it again.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use suture_store::transfer::{self, Holdings, TransferError};
use suture_store::{Address, SledStore, StateLock, StoreError, Transfer};

use crate::exit::Exit;
use crate::reach::{Failure, elsewhere, must_be_hot, state_of, unseen, watched};
use crate::say::print;
use crate::shared::{daemon_name, make, note, noted, visit};
use crate::units::show_count;

impl From<TransferError> for Failure {
    fn from(error: TransferError) -> Self {
        match error {
            TransferError::Store(error) => error.into(),
            error => Self { line: error.to_string(), exit: Exit::Refused },
        }
    }
}

/// A daemon has the store.
pub(super) fn owned(dir: &Path, pid: Option<u32>) -> Failure {
    let who = pid.map(|pid| format!(" (process {pid})")).unwrap_or_default();
    let line = format!(
        "{}: a daemon{who} has the job store, and may change it at any time: stop it, then verify; `suture store export` works meanwhile",
        dir.display()
    );
    Failure { line, exit: Exit::Owned }
}

fn state(dir: &Path) -> Result<PathBuf, Failure> {
    must_be_hot(dir)?;
    state_of(dir).map_err(|error| unseen(dir, &error))
}

/// The store that holds the jobs of `dir`, or the shared one.
fn open(dir: &Path, address: Option<&Address>) -> Result<Box<dyn Transfer>, Failure> {
    if let Some(address) = address {
        return Ok(visit(address, "")?);
    }
    let state = state(dir)?;
    if let Some(address) = noted(&state).map_err(|error| unseen(&state, &error))? {
        return Err(elsewhere(&state, &address));
    }
    open_folder(dir, &state)
}

fn open_folder(dir: &Path, state: &Path) -> Result<Box<dyn Transfer>, Failure> {
    watched()?;
    let store = SledStore::open(state).map_err(|error| in_use(dir, error))?;
    Ok(Box::new(store))
}

fn in_use(dir: &Path, error: StoreError) -> Failure {
    match error {
        StoreError::Locked { pid, .. } => owned(dir, pid),
        error => error.into(),
    }
}

/// All that the store holds, as [`import`] reads it.
pub(super) fn export(dir: &Path, address: Option<&Address>) -> Result<Vec<u8>, Failure> {
    let mut text = Vec::new();
    transfer::export(&*open(dir, address)?, &mut text)?;
    Ok(text)
}

fn read(file: &Path) -> Result<Holdings, Failure> {
    let wrong = |line: String| Failure { line: format!("{}: {line}", file.display()), exit: Exit::Refused };
    let text = File::open(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    transfer::read(&mut BufReader::new(text)).map_err(|error| wrong(error.to_string()))
}

/// What the store holds otherwise than the export says, a line each.
pub(super) fn differences(dir: &Path, address: Option<&Address>, file: &Path) -> Result<Vec<String>, Failure> {
    let expected = read(file)?;
    Ok(transfer::differences(&*open(dir, address)?, &expected)?)
}

/// Has an empty store take over what an export says, and looks whether it has it. From then on the daemon of `dir` finds its jobs there.
pub(super) fn import(dir: &Path, address: Option<&Address>, file: &Path) -> Result<Exit, Failure> {
    let holdings = read(file)?;
    let state = state(dir)?;
    let unnoted = |error| unseen(&state, &error);
    let (store, shown, lock): (Box<dyn Transfer>, _, _) = match address {
        Some(address) => {
            let lock = StateLock::take(&state).map_err(|error| in_use(dir, error))?;
            make(address)?;
            (visit(address, &daemon_name(&state))?, address.to_string(), Some(lock))
        }
        None => (open_folder(dir, &state)?, state.display().to_string(), None),
    };
    store.take_over(&holdings)?;
    let wrong = transfer::differences(&*store, &holdings)?;
    if let Some(first) = wrong.first() {
        let line = format!("{shown}: it does not hold what it was given: {first}; begin again with an empty store");
        return Err(Failure { line, exit: Exit::TryAgain });
    }
    note(&state, address).map_err(unnoted)?;
    drop(lock);
    let how = address.map_or_else(|| "`suture watch`".to_owned(), |address| format!("`suture watch --store {address}`"));
    let jobs = show_count(holdings.jobs.len() as u64);
    Ok(print(format!("{shown}: {jobs} jobs were taken over; {how} goes on with them\n").as_bytes(), Exit::Good))
}
