//! Stream: records in spatial chunks, in bounded memory.
//!
//! **In:** all records of a file, and a budget of memory.
//! **Out:** a plan of chunks ([`plan`]), for each chunk its triangles in ascending order ([`members`]), and triangles by number or by place
//! ([`source`], [`spool`]).
//! **Promise:** memory is counted before it is taken ([`budget`]); too little is a refusal. Where the planes of the plan lie changes no
//! result.

pub(crate) mod budget;
pub(crate) mod columns;
pub(crate) mod members;
pub(crate) mod plan;
pub(crate) mod run_list;
pub(crate) mod source;
pub(crate) mod spool;
pub(crate) mod stretches;
pub(crate) mod weld;
