//! When is a dropped file complete? When nothing about it has changed for a while, over several looks, and its length is one
//! that a complete file of its format has. A file whose length never fits (cut short for good, or not a mesh at all) is taken
//! too, after a longer rest. Pure: time comes from outside, and is monotonic.

use std::time::{Duration, Instant};

use crate::fsx::Identity;

/// Looks that must agree.
const LOOKS: u32 = 3;
/// A file whose length does not fit must rest this many times longer.
const DOUBT: u32 = 6;

/// A file that some program keeps open for writing is spoken of after so long.
const TELL_AFTER: Duration = Duration::from_secs(600);

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
    /// It was said that it does not come to rest.
    told: bool,
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
        Self { identity, since: now, looks: 1, renamed: false, told: false }
    }

    /// The system says that it was renamed into place: whoever did that had finished it.
    pub(crate) fn came_whole(&mut self) {
        self.renamed = true;
    }

    /// As it was seen last.
    pub(crate) fn identity(&self) -> &Identity {
        &self.identity
    }

    /// How long nothing about it has changed.
    pub(crate) fn rested(&self, now: Instant) -> Duration {
        now.duration_since(self.since)
    }

    /// Has it been at rest, but for a program that has it open for writing, for so long that people should know? Once.
    pub(crate) fn is_to_be_told(&mut self, now: Instant) -> bool {
        let long = now.duration_since(self.since) >= TELL_AFTER;
        long && !std::mem::replace(&mut self.told, true)
    }

    /// Was that said?
    pub(crate) fn was_told(&self) -> bool {
        self.told
    }

    /// Looks again.
    pub(crate) fn look(&mut self, identity: Identity, now: Instant, rest: Rest) -> Look {
        if identity != self.identity {
            *self = Self::new(identity, now);
            return Look::Wait;
        }
        self.looks = self.looks.saturating_add(1);
        let rested = now.duration_since(self.since);
        let has_rested = self.looks >= LOOKS && rested >= rest.settle;
        if has_rested && rested >= rest.settle.saturating_mul(DOUBT) {
            // Also where it came by a rename: whoever did that may have renamed what is no mesh.
            Look::Ready
        } else if has_rested || self.renamed {
            Look::IfLengthFits
        } else {
            Look::Wait
        }
    }
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
    fn f21_a_growing_file_starts_over() {
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
    fn f15_time_alone_is_no_rest() {
        let start = Instant::now();
        let mut file = Settling::new(identity(1), start);
        assert_eq!(file.look(identity(1), start + Duration::from_secs(100), REST), Look::Wait);
        assert_ne!(file.look(identity(1), start + Duration::from_secs(101), REST), Look::Wait);
    }

    #[test]
    fn f22_renamed_into_place_counts_at_once() {
        let start = Instant::now();
        let mut file = Settling::new(identity(1), start);
        file.came_whole();
        assert_eq!(file.look(identity(1), start, REST), Look::IfLengthFits);
    }

    /// A picture that is renamed to `part.stl` does not lie in the folder for ever.
    #[test]
    fn f22_what_is_renamed_into_place_and_is_no_mesh_is_taken_too() {
        let start = Instant::now();
        let mut file = Settling::new(identity(1), start);
        file.came_whole();
        for s in 1..18 {
            assert_eq!(file.look(identity(1), start + Duration::from_secs(s), REST), Look::IfLengthFits);
        }
        assert_eq!(file.look(identity(1), start + Duration::from_secs(18), REST), Look::Ready);
    }
}
