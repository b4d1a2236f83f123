//! Hot folders of one configuration lie beside each other.

use std::path::PathBuf;

use super::{FolderConfig, real};

/// Are these hot folders that do not lie in one another, whatever their paths are called? A folder that is made only later is told by its
/// path, through links and `..` as far as there is something. The number of the one that does, and a line for people.
pub(super) fn apart(folders: &[FolderConfig]) -> Result<(), (usize, String)> {
    let real: Vec<PathBuf> = folders.iter().map(|folder| real(&folder.path)).collect();
    for (i, a) in real.iter().enumerate() {
        for (j, b) in real.iter().enumerate().filter(|(j, _)| *j != i) {
            if let (true, Some(inner), Some(outer)) = (a.starts_with(b), folders.get(i), folders.get(j)) {
                let (shown, other) = (inner.path.display(), outer.path.display());
                let line = if a == b {
                    format!("{shown} and {other} are the same folder; remove one of them")
                } else {
                    format!(
                        "{shown} lies in the hot folder {other}, which would take its files; hot folders lie beside each other"
                    )
                };
                return Err((i, line));
            }
        }
    }
    Ok(())
}
