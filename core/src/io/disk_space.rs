//! Room on the disk, asked for before anything is written: an hour's work should not end at a full disk.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::contract::error::{Error, Result};
use crate::util::words::Count;

/// Something that will be written.
#[derive(Clone, Debug)]
pub(crate) struct Need {
    pub(crate) folder: PathBuf,
    pub(crate) bytes: u64,
    /// Continues "… for".
    pub(crate) what: &'static str,
}

/// Refuses the work on `path` if a file system has less room than all that goes there needs. What cannot be found out is no reason to
/// refuse.
pub(crate) fn check(path: &Path, needs: &[Need]) -> Result<()> {
    let device = |need: &Need| std::fs::metadata(&need.folder).map(|m| m.dev()).ok();
    for (i, first) in needs.iter().enumerate() {
        let here = device(first);
        let same = || needs.iter().filter(|need| here.is_some() && device(need) == here && need.bytes > 0);
        let is_first_of_device = needs[..i].iter().all(|earlier| device(earlier) != here);
        let needed = same().fold(0u64, |sum, need| sum.saturating_add(need.bytes));
        let free = free_bytes(&first.folder).unwrap_or(u64::MAX);
        if is_first_of_device && needed > free {
            let parts: Vec<String> =
                same().map(|need| format!("{} MiB for {}", Count(mebibytes(need.bytes)), need.what)).collect();
            return Err(Error::NoSpace {
                path: path.into(),
                reason: format!("the work needs {} MiB of disk ({})", Count(mebibytes(needed)), parts.join(", ")),
                advice: format!("{} has {} MiB free", first.folder.display(), Count(free >> 20)),
            });
        }
    }
    Ok(())
}

fn mebibytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// What an ordinary user may still write to the file system that holds `folder`.
fn free_bytes(folder: &Path) -> Option<u64> {
    let stat = rustix::fs::statvfs(folder).ok()?;
    Some(stat.f_bavail.saturating_mul(stat.f_frsize))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::error::ErrorClass;

    fn need(folder: &Path, bytes: u64, what: &'static str) -> Need {
        Need { folder: folder.into(), bytes, what }
    }

    #[test]
    fn what_goes_to_one_disk_is_added_up() {
        let folder = tempfile::tempdir().unwrap();
        let sub = folder.path().join("sub");
        std::fs::create_dir(&sub).unwrap();
        let free = free_bytes(folder.path()).unwrap();
        let half = free / 4 * 3;
        let check = |needs: &[Need]| check(Path::new("part.stl"), needs);
        check(&[need(folder.path(), half, "the output")]).unwrap();
        check(&[need(folder.path(), half, "the output"), need(Path::new("/nowhere"), u64::MAX, "nothing known")]).unwrap();
        let error = check(&[need(folder.path(), half, "the output"), need(&sub, half, "the spool")]).unwrap_err();
        assert_eq!(error.class(), ErrorClass::Shortage, "room can be made");
        let line = error.to_string();
        for word in ["part.stl", &Count(mebibytes(half * 2)).to_string(), "for the output", "for the spool", "free"] {
            assert!(line.contains(word), "{word} in {line}");
        }
    }
}
