//! Input and output: bytes of files become records, and the disk is asked early and written in turn.

pub(crate) mod digest;
pub(crate) mod disk_space;
pub mod read;
pub(crate) mod read_ahead;
pub mod record;
pub(crate) mod write_behind;
