//! The page cache before a run: filled with the input, or emptied of it.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::path::Path;

use super::way::Cache;

/// Brings every file of `paths` into the page cache, or out of it; returns the share of their pages that is there afterwards.
///
/// Cold needs no privilege: what is dirty is written back first, since only clean pages can be dropped. A disk that is virtual, or
/// has memory of its own, may still answer faster than its medium.
pub(super) fn bring<'a>(state: Cache, paths: impl Iterator<Item = &'a Path> + Clone) -> io::Result<f64> {
    for path in paths.clone() {
        let mut file = File::open(path)?;
        match state {
            Cache::Warm => drop(io::copy(&mut file, &mut io::sink())?),
            Cache::Cold => {
                file.sync_all()?;
                rustix::fs::fadvise(&file, 0, None, rustix::fs::Advice::DontNeed)?;
            }
        }
    }
    let (mut here, mut all) = (0, 0);
    for path in paths {
        let (resident, pages) = resident(path)?;
        here += resident;
        all += pages;
    }
    Ok(if all == 0 { 1.0 } else { here as f64 / all as f64 })
}

/// How many pages of a file are in the page cache, and how many it has.
fn resident(path: &Path) -> io::Result<(usize, usize)> {
    let file = File::open(path)?;
    let bytes = file.metadata()?.len() as usize;
    if bytes == 0 {
        return Ok((0, 0));
    }
    let mut pages = vec![0u8; bytes.div_ceil(rustix::param::page_size())];
    // SAFETY: a new mapping of a file that is open, of the length that it has; nothing is read through it.
    let map = unsafe { libc::mmap(std::ptr::null_mut(), bytes, libc::PROT_READ, libc::MAP_SHARED, file.as_raw_fd(), 0) };
    if map == libc::MAP_FAILED {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: the mapping is `bytes` long, and `pages` has one byte for each page of it.
    let seen = unsafe { libc::mincore(map, bytes, pages.as_mut_ptr()) };
    let result = if seen == 0 { Ok(()) } else { Err(io::Error::last_os_error()) };
    // SAFETY: the mapping made above, which nothing refers to any more.
    unsafe { libc::munmap(map, bytes) };
    result.map(|()| (pages.iter().filter(|page| **page & 1 == 1).count(), pages.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_is_in_the_cache() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, vec![7; 300_000]).unwrap();
        assert_eq!(bring(Cache::Warm, [path.as_path()].into_iter()).unwrap(), 1.0);
        // A file system in memory has nowhere else to keep a file; elsewhere the pages are gone.
        let cold = bring(Cache::Cold, [path.as_path()].into_iter()).unwrap();
        assert!(cold == 0.0 || cold == 1.0, "{cold}");
        assert!(bring(Cache::Warm, [folder.path().join("none").as_path()].into_iter()).is_err());
    }
}
