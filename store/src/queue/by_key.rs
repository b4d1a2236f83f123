//! Whose job is whose file: the key by what makes a file that file.

use crate::job::Source;

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
