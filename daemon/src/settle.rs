//! When is a dropped file complete? When nothing about it has changed for a while, over several looks, and its length is one
//! that a complete file of its format has. A file whose length never fits (cut short for good, or not a mesh at all) is taken
//! too, after a longer rest. Pure but for [`length_fits`]; time comes from outside, and is monotonic.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::fsx::Identity;

/// Looks that must agree.
const LOOKS: u32 = 3;
/// A file whose length does not fit must rest this many times longer.
const DOUBT: u32 = 6;

/// How long a file must rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rest {
    pub settle: Duration,
}

impl Rest {
    /// Local file systems tell us at once; on network mounts a writer's pauses and our view of them are longer.
    pub(crate) fn by_default(network: bool, once: bool) -> Self {
        let settle = match (network, once) {
            (true, _) => Duration::from_secs(30),
            (false, false) => Duration::from_secs(5),
            // Whoever starts `--once` has usually put the files there before.
            (false, true) => Duration::from_millis(300),
        };
        Self { settle }
    }

    /// Time between looks at a file that is settling.
    pub(crate) fn look_every(self) -> Duration {
        (self.settle / LOOKS).clamp(Duration::from_millis(20), Duration::from_secs(5))
    }
}

/// A file on its way to rest.
#[derive(Clone, Debug)]
pub(crate) struct Settling {
    identity: Identity,
    since: Instant,
    looks: u32,
    /// It came here whole, by a rename.
    renamed: bool,
}

/// What a look at a settling file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    /// Not yet.
    Wait,
    /// At rest, provided that its length fits.
    IfLengthFits,
    /// At rest, whatever its length.
    Ready,
}

impl Settling {
    /// A file seen for the first time.
    pub(crate) fn new(identity: Identity, now: Instant) -> Self {
        Self { identity, since: now, looks: 1, renamed: false }
    }

    /// The system says that it was renamed into place: whoever did that had finished it.
    pub(crate) fn came_whole(&mut self) {
        self.renamed = true;
    }

    /// As it was seen last.
    pub(crate) fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Looks again.
    pub(crate) fn look(&mut self, identity: Identity, now: Instant, rest: Rest) -> Look {
        if identity != self.identity {
            *self = Self::new(identity, now);
            return Look::Wait;
        }
        self.looks = self.looks.saturating_add(1);
        let rested = now.duration_since(self.since);
        if self.renamed {
            Look::IfLengthFits
        } else if self.looks < LOOKS || rested < rest.settle {
            Look::Wait
        } else if rested < rest.settle * DOUBT {
            Look::IfLengthFits
        } else {
            Look::Ready
        }
    }
}

/// Has the file a length that a complete STL has: 84 bytes and 50 for each triangle that its header announces, or text whose end
/// says `endsolid`? Reads 1.1 KB at most.
///
/// # Errors
/// As `open` and `read`.
pub(crate) fn length_fits(path: &Path) -> io::Result<bool> {
    let nofollow = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
    // The flags are small positive constants.
    let mut file = File::options().read(true).custom_flags(nofollow.bits() as i32).open(path)?;
    let size = file.metadata()?.len();
    let mut head = [0; 84];
    if size >= 84 {
        file.read_exact(&mut head)?;
        let [.., a, b, c, d] = head;
        if 84 + 50 * u64::from(u32::from_le_bytes([a, b, c, d])) == size {
            return Ok(true);
        }
    }
    let tail_len = size.min(1024);
    file.seek(SeekFrom::Start(size - tail_len))?;
    let mut tail = Vec::new();
    file.take(tail_len).read_to_end(&mut tail)?;
    Ok(ends_a_solid(&tail))
}

/// Is the last line of text one that begins with `endsolid`, in any case?
fn ends_a_solid(tail: &[u8]) -> bool {
    let text = tail.trim_ascii_end();
    let line = text.rsplit(|&b| b == b'\n' || b == b'\r').next().unwrap_or_default().trim_ascii_start();
    line.get(..8).is_some_and(|word| word.eq_ignore_ascii_case(b"endsolid"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: Rest = Rest { settle: Duration::from_secs(3) };

    fn identity(size: u64) -> Identity {
        Identity { dev: 1, ino: 2, size, mtime_ns: 3, ctime_ns: 4 }
    }

    /// A look every second: ready when three seconds have passed since the last change, not before.
    #[test]
    fn a_growing_file_starts_over() {
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let mut file = Settling::new(identity(1), at(0));
        assert_eq!(file.look(identity(1), at(1), REST), Look::Wait);
        assert_eq!(file.look(identity(2), at(2), REST), Look::Wait);
        assert_eq!(file.look(identity(2), at(4), REST), Look::Wait);
        assert_eq!(file.look(identity(2), at(5), REST), Look::IfLengthFits);
        assert_eq!(file.look(identity(2), at(19), REST), Look::IfLengthFits);
        assert_eq!(file.look(identity(2), at(20), REST), Look::Ready, "six times the rest whatever the length");
    }

    /// Two looks far apart are not enough: the machine may have slept in between.
    #[test]
    fn time_alone_is_no_rest() {
        let start = Instant::now();
        let mut file = Settling::new(identity(1), start);
        assert_eq!(file.look(identity(1), start + Duration::from_secs(100), REST), Look::Wait);
        assert_ne!(file.look(identity(1), start + Duration::from_secs(101), REST), Look::Wait);
    }

    #[test]
    fn renamed_into_place_counts_at_once() {
        let start = Instant::now();
        let mut file = Settling::new(identity(1), start);
        file.came_whole();
        assert_eq!(file.look(identity(1), start, REST), Look::IfLengthFits);
    }

    #[test]
    fn lengths_of_complete_files() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        let fits = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            length_fits(&path).unwrap()
        };
        let mut binary = vec![0; 84 + 100];
        binary[80] = 2;
        assert!(fits(&binary));
        assert!(!fits(&binary[..183]), "cut short");
        assert!(!fits(&[&binary[..], b"x"].concat()), "still growing, or with a tail");
        assert!(fits(b"solid a\nfacet\nENDSOLID a\r\n"));
        assert!(!fits(b"solid a\nfacet normal 0 0 1"));
        assert!(!fits(b""));
    }
}
