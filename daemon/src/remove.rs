//! Removing what this program has made, and nothing that has become someone else's.

use std::io;
use std::path::Path;

use suture_store::Hash;

use crate::claim::Original;
use crate::fsx::{self, Identity};

/// The file at `path`, if it still has the content that its receipt speaks of; a link is not followed.
///
/// # Errors
/// As `open` and `read`.
pub(crate) fn ours(path: &Path, hash: Option<Hash>) -> io::Result<Option<Identity>> {
    let file = Original::open(path)?;
    let identity = file.identity()?;
    let Some(hash) = hash else { return Ok(Some(identity)) };
    let same = fsx::hash_of(file.file())? == hash && file.identity()? == identity;
    Ok(same.then_some(identity))
}

/// Removes it.
///
/// # Errors
/// When it stays, and why, in words.
pub(crate) fn remove(path: &Path, hash: Option<Hash>) -> Result<(), String> {
    let failed = |error: io::Error| error.to_string();
    let Some(identity) = ours(path, hash).map_err(failed)? else {
        return Err("someone has changed it since".into());
    };
    if Identity::of(path).map_err(failed)? != identity {
        return Err("another file has taken its name".into());
    }
    std::fs::remove_file(path).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_content_of_the_receipt_goes() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.stl");
        let hash = Some(Hash(*blake3::hash(b"ours").as_bytes()));
        std::fs::write(&path, b"ours, and more").unwrap();
        assert!(matches!(remove(&path, hash), Err(why) if why.contains("changed")));
        std::fs::rename(&path, dir.path().join("b")).unwrap();
        std::os::unix::fs::symlink("b", &path).unwrap();
        assert!(remove(&path, hash).is_err(), "a link is not followed");
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, b"ours").unwrap();
        remove(&path, hash).unwrap();
        assert!(!path.exists() && dir.path().join("b").exists());
        assert!(remove(&path, None).is_err(), "it is gone");
    }
}
