//! Work folders that no job has in work any more: daemons died over them, or lost their claims.

use std::collections::BTreeSet;

use suture_store::job::Kind;
use suture_store::{Job, Query, StoreError};

use super::{Context, remove_work};
use crate::folder::Folder;

/// Clears away what no job has in work, in a folder that this daemon keeps.
///
/// # Errors
/// When the store failed.
pub(crate) fn clear(context: &Context, folder: &Folder) -> Result<(), StoreError> {
    if context.unread.has(folder) {
        return Ok(());
    }
    // In this order: a work folder is made after its claim, by whatever machine, so that each of a job under claim is among those listed then.
    let found: Vec<_> = std::fs::read_dir(folder.work_root()).into_iter().flatten().flatten().collect();
    if found.is_empty() {
        return Ok(());
    }
    let kinds = Kind::ALL.into_iter().filter(|kind| kind.is_held() || *kind == Kind::Parked).collect();
    let jobs = context.store.list(&Query { kinds, ..Query::default() })?;
    let tokens = |job: &Job| [job.work, job.hold().map(|hold| hold.token)];
    let held: BTreeSet<String> = jobs.iter().flat_map(tokens).flatten().map(|token| token.to_string()).collect();
    for entry in found.iter().filter(|entry| !entry.file_name().to_str().is_some_and(|name| held.contains(name))) {
        remove_work(&entry.path());
    }
    Ok(())
}
