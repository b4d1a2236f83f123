//! The job store of a daemon: in its state folder, or in a database that daemons on many machines share. Of the latter the state folder keeps a
//! note, so that who looks for jobs there is told where they are.

use std::ffi::OsString;
use std::io;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[cfg(feature = "postgres")]
use suture_store::transfer::SharedStore;
use suture_store::{Address, JobStore, Opening, SledStore, StateLock, Station, StoreError};

use crate::config::{Config, default_state, real};
use crate::folder::make_parent;
use crate::{create, fsx};

/// The store of a daemon that runs.
pub(crate) struct Opened {
    pub store: Arc<dyn JobStore>,
    /// The events of the opening.
    pub opening: Opening,
    /// One daemon has the state folder, wherever the jobs are.
    _lock: Option<StateLock>,
}

/// Opens the store that the configuration names.
///
/// # Errors
/// [`StoreError::Locked`] while another daemon has the state folder, [`StoreError::Served`] while one has a folder of the same name; else as
/// the store's.
pub(crate) fn open(config: &Config) -> Result<Opened, StoreError> {
    let Some(address) = &config.store else {
        if let Some(address) = noted(&config.state).map_err(unread(&config.state))? {
            return Err(StoreError::Unusable {
                path: config.state.clone(),
                reason: format!("its jobs are in {address}"),
                advice: format!("start with --store {address}, or bring them here with `suture store export` and `import`"),
            });
        }
        let store = SledStore::open(&config.state)?;
        let opening = store.opening().clone();
        return Ok(Opened { store: Arc::new(store), opening, _lock: None });
    };
    let lock = StateLock::take(&config.state)?;
    if noted(&config.state).map_err(unread(&config.state))?.is_none() && has_jobs(&config.state) {
        let state = config.state.display().to_string();
        tracing::warn!(
            state,
            "The jobs that this folder holds are not read; `suture store export` and `import` move them into the database."
        );
    }
    let store = connect(address, config)?;
    note(&config.state, Some(address)).map_err(unread(&config.state))?;
    Ok(Opened { store, opening: Opening::default(), _lock: Some(lock) })
}

fn unread(state: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = note_in(state);
    move |source| StoreError::Io { path, action: "reading or writing the note of where the jobs are", source }
}

/// Does the folder hold a job store of its own?
pub(crate) fn has_jobs(state: &Path) -> bool {
    fsx::exists(&state.join("db")).unwrap_or(true)
}

/// The name of a daemon in a shared store: one at a time has this state folder on this machine.
pub(crate) fn daemon_name(state: &Path) -> String {
    let state = std::path::absolute(real(state)).unwrap_or_else(|_| state.to_owned());
    format!("{}:{}", host_name(), state.display())
}

fn host_name() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default().trim().to_owned()
}

/// A daemon of this process, as it tells others of itself. It looks for drops in the folders `keeps`.
pub(crate) fn station(config: &Config, keeps: Vec<String>) -> Station {
    Station {
        host: host_name(),
        pid: std::process::id(),
        version: env!("CARGO_PKG_VERSION").into(),
        roles: config.roles,
        workers: u32::try_from(config.workers).unwrap_or(u32::MAX),
        memory: config.memory,
        largest: config.largest,
        keeps,
    }
}

fn note_in(state: &Path) -> PathBuf {
    state.join("SHARED")
}

/// Where the jobs of this state folder are, if they are in a shared store.
///
/// # Errors
/// When that cannot be read.
pub(crate) fn noted(state: &Path) -> io::Result<Option<String>> {
    let bytes = fsx::if_there(std::fs::read(note_in(state)))?;
    Ok(bytes.map(|bytes| OsString::from_vec(bytes).to_string_lossy().trim().to_owned()))
}

/// Notes in a folder that daemons on several machines serve where its jobs are.
///
/// # Errors
/// When that cannot be written.
pub(crate) fn note_in_folder(root: &Path, address: Option<&Address>) -> io::Result<()> {
    let (state, own) = (default_state(root), address.map(ToString::to_string));
    let before = noted(&state)?;
    if before == own {
        return Ok(());
    }
    if let Some(noted) = before {
        let folder = root.display().to_string();
        tracing::warn!(
            folder,
            noted,
            own,
            "The jobs of this shared folder were in another database, or it was called otherwise; see that all its daemons use one."
        );
    }
    make_parent(&note_in(&state))?;
    let written = note(&state, address);
    // Another daemon may have noted it in the same moment.
    if noted(&state)? == own { Ok(()) } else { written }
}

/// Notes that the jobs are there, or in the folder itself.
///
/// # Errors
/// When that cannot be written.
pub(crate) fn note(state: &Path, address: Option<&Address>) -> io::Result<()> {
    match address {
        Some(address) => create::replace(&note_in(state), format!("{address}\n").as_bytes()),
        None => fsx::remove_if_there(&note_in(state)),
    }
}

#[cfg(feature = "postgres")]
fn connect(address: &Address, config: &Config) -> Result<Arc<dyn JobStore>, StoreError> {
    use suture_store::{PostgresStore, Shared};
    let folders = Some(config.folders.iter().map(|folder| folder.name.clone()).collect());
    // A folder in a bucket or on a share lies on no machine more than on another.
    let joint = config.folders.iter().filter(|folder| folder.is_for_many()).map(|folder| folder.name.clone()).collect();
    let new = Shared::new(address.exposed(), &daemon_name(&config.state));
    Ok(Arc::new(PostgresStore::open(&Shared { folders, joint, station: station(config, Vec::new()), ..new })?))
}

/// Opens the shared store to look at it, or to say what is to become of its jobs. `daemon`: whose jobs in work it brings along by an import.
///
/// # Errors
/// When there is none, or it does not answer soon.
#[cfg(feature = "postgres")]
pub(crate) fn visit(address: &Address, daemon: &str) -> Result<Box<dyn SharedStore>, StoreError> {
    use suture_store::{PostgresStore, Shared};
    let shared = Shared { patience: VISIT, ..Shared::new(address.exposed(), daemon) };
    Ok(Box::new(PostgresStore::visit(&shared)?))
}

/// Makes the shared store, or brings it up to date.
///
/// # Errors
/// When the user may not, or the database does not answer soon.
#[cfg(feature = "postgres")]
pub(crate) fn make(address: &Address) -> Result<(), StoreError> {
    use suture_store::{PostgresStore, Shared};
    PostgresStore::make(&Shared { patience: VISIT, ..Shared::new(address.exposed(), "") })
}

/// The SQL that lets the role of that name use the store.
#[cfg(feature = "postgres")]
pub(crate) fn role(name: &str) -> Result<String, StoreError> {
    Ok(suture_store::role(&suture_store::Shared::new("", "").schema, name))
}

/// A person waits for a database no longer.
#[cfg(feature = "postgres")]
const VISIT: std::time::Duration = std::time::Duration::from_secs(5);

#[cfg(not(feature = "postgres"))]
pub(crate) use absent::{make, role, visit};

#[cfg(not(feature = "postgres"))]
use absent::connect;

/// A program that was built without the database.
#[cfg(not(feature = "postgres"))]
mod absent;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    #[test]
    fn a_note_of_where_the_jobs_are_has_no_password_and_keeps_another_store_from_beginning() {
        let dir = tempfile::tempdir().unwrap();
        let config = Config::for_folder(dir.path());
        std::fs::create_dir_all(&config.state).unwrap();
        let address = Address::parse("postgres://farm:secret@db/jobs").unwrap();
        note(&config.state, Some(&address)).unwrap();
        assert_eq!(noted(&config.state).unwrap().as_deref(), Some("postgres://farm@db/jobs"));
        let error = open(&config).err().unwrap().to_string();
        assert!(error.contains("its jobs are in postgres://farm@db/jobs") && error.contains("--store"), "{error}");
        note(&config.state, None).unwrap();
        open(&config).unwrap();
        assert!(has_jobs(&config.state));
    }
}
