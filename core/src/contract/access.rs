//! How the bytes of a file that others may change come into memory, as the caller chooses.

/// How files that others may change are read. Results do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Access(Kind);

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Kind {
    #[default]
    Copied,
    Mapped,
}

impl Access {
    /// From a copy that only the engine knows: in memory for a small file, else in a file without a name, in the folder for spools. The default.
    pub const COPIED: Self = Self(Kind::Copied);

    /// Through a memory map of the file itself: no copy is made, and the system can drop its pages at any time.
    ///
    /// # Safety
    /// As long as the work goes on, nobody may change or truncate the input and the output, which no program can promise of files that
    /// others can write to. A process whose only task is this work may use it all the same if it can bear both: a truncated file ends it with
    /// SIGBUS; after a change, the bytes of a mapped file are not what they were, which the engine finds out in the end
    /// ([`Error::Changed`](crate::contract::error::Error::Changed)), but which Rust does not allow for.
    pub const unsafe fn mapped() -> Self {
        Self(Kind::Mapped)
    }

    /// By a map of the file itself?
    pub(crate) fn is_mapped(self) -> bool {
        self.0 == Kind::Mapped
    }
}
