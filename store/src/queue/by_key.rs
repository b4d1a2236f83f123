//! Whose job is whose file: the key by what makes a file that file.

use std::collections::BTreeMap;

use crate::id::JobId;
use crate::job::Source;
use crate::record;
use crate::store::StoreError;
use crate::tables::{Put, Table};

/// What makes a dropped file that file. The profile is not part of it: a changed setting does not make a new drop.
pub(super) fn key(source: &Source) -> Vec<u8> {
    let folder = source.folder.as_bytes();
    let mut key = Vec::with_capacity(40 + folder.len() + source.path.as_bytes().len());
    for number in [source.dev, source.ino, source.size] {
        key.extend_from_slice(&number.to_be_bytes());
    }
    key.extend_from_slice(&source.mtime_ns.to_be_bytes());
    key.extend_from_slice(&(folder.len() as u64).to_be_bytes());
    key.extend_from_slice(folder);
    key.extend_from_slice(source.path.as_bytes());
    key
}

/// Entries of the table: whose job each file is from now on.
pub(super) fn puts(keys: BTreeMap<Vec<u8>, JobId>) -> Result<Vec<Put>, StoreError> {
    let put = |(key, id): (Vec<u8>, JobId)| {
        let value = record::encode(Table::ByKey, &key, &id)?;
        Ok(Put { table: Table::ByKey, key, value: Some(value) })
    };
    keys.into_iter().map(put).collect()
}
