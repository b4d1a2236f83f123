//! Stream: records in spatial chunks, in bounded memory.

pub(crate) mod budget;
pub(crate) mod columns;
pub(crate) mod members;
pub(crate) mod plan;
pub(crate) mod run_list;
pub(crate) mod source;
pub(crate) mod spool;
