//! A map of a file, whose pages can be given back while it is read.
//!
//! Pages of a map that were read stay mapped, and count as the process's own (resident) memory, until the system is short of memory. A text is read
//! once, and is often longer than all that is made of it: the pages behind the reader are let go.

use std::fs::File;
use std::io;
use std::ops::Deref;

use memmap2::{Mmap, MmapOptions, UncheckedAdvice};

/// A read-only map of a file.
#[derive(Debug)]
pub(crate) struct FileMap(Mmap);

impl FileMap {
    /// Maps so many bytes of a file.
    ///
    /// # Safety
    /// As of [`Mmap`]: the file neither changes nor becomes shorter, or the caller answers for that.
    ///
    /// # Errors
    /// Those of `mmap`.
    pub(crate) unsafe fn of(file: &File, length: usize) -> io::Result<Self> {
        // SAFETY: the caller's promise.
        unsafe { MmapOptions::new().len(length).map(file) }.map(Self)
    }

    /// Gives all its pages back. Each comes again from the page cache, or from the disk, when it is read. O(pages that are mapped).
    pub(crate) fn let_go(&self) {
        // SAFETY: the map is of a file and cannot be written, so that it has no bytes but those of the file.
        let _ = unsafe { self.0.unchecked_advise(UncheckedAdvice::DontNeed) };
    }
}

impl Deref for FileMap {
    type Target = Mmap;

    fn deref(&self) -> &Mmap {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// KiB of this map that are resident.
    fn resident(map: &[u8]) -> u64 {
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let from = format!("{:x}-", map.as_ptr() as usize);
        let of_map = maps.lines().skip_while(|line| !line.starts_with(&from));
        let line = of_map.into_iter().find_map(|line| line.strip_prefix("Rss:")).unwrap();
        line.trim().trim_end_matches(" kB").parse().unwrap()
    }

    #[test]
    fn pages_that_went_come_again() {
        use std::io::Write;
        let bytes: Vec<u8> = (0..4 << 20).map(|i: u32| (i >> 7) as u8).collect();
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        // SAFETY: nobody else knows the file.
        let map = unsafe { FileMap::of(&file, bytes.len()) }.unwrap();
        assert!(map[..] == bytes[..]);
        assert_eq!(resident(&map), 4 << 10);
        map.let_go();
        assert_eq!(resident(&map), 0);
        assert!(map[..] == bytes[..]);
    }
}
