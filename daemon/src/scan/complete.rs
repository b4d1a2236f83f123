//! Is a file that someone hands over by name a mesh, and whole? No time is waited for: whoever says so knows.

use std::io;
use std::path::Path;

use super::found::what_else;
use crate::claim::Original;
use crate::folder::{NameKind, is_hot, name_kind};
use crate::fsx::{self, Identity};
use crate::handed::Untaken;
use crate::whole::is_whole;
use crate::writers::Writers;

/// A mesh below `in/` to which nothing is added any more.
///
/// # Errors
/// Why it is none, or cannot be told.
pub(super) fn complete(inbox: &Path, below: &Path) -> Result<Identity, Untaken> {
    let unseen = |error: io::Error| Untaken::Unavailable(format!("the file cannot be looked at: {error}"));
    let name = below.file_name().unwrap_or_default();
    // A file that the scan would not find is not there: no link is followed on the way.
    for folder in below.ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty()) {
        let found = fsx::look(&inbox.join(folder)).map_err(unseen)?;
        let is_folder = found.is_some() && std::fs::symlink_metadata(inbox.join(folder)).is_ok_and(|meta| meta.is_dir());
        let hidden = folder.file_name().is_some_and(|name| name_kind(name) == NameKind::Ignored);
        if !is_folder || hidden || is_hot(&inbox.join(folder)).map_err(unseen)? {
            return Err(Untaken::Missing);
        }
    }
    let full = inbox.join(below);
    if fsx::look(&full).map_err(unseen)?.is_none() {
        return Err(Untaken::Missing);
    }
    let meta = std::fs::symlink_metadata(&full).map_err(unseen)?;
    let kind = name_kind(name);
    let else_it_is = || if meta.is_dir() { Some("a folder".into()) } else { what_else(&meta, kind, &name.to_string_lossy()) };
    match (kind, else_it_is()) {
        (NameKind::Ignored, _) => return Err(Untaken::NoMesh("a temporary or hidden file, which is not taken".into())),
        (_, Some(words)) => return Err(Untaken::NoMesh(words)),
        (_, None) => {}
    }
    let file = Original::open(&full).map_err(unseen)?;
    let identity = file.identity().map_err(unseen)?;
    let whole = is_whole(file.file()).map_err(unseen)? && !Writers::default().has(file.file(), &identity);
    if whole { Ok(identity) } else { Err(Untaken::Unfinished) }
}
