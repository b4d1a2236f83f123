//! Util: what a program needs and a mesh does not: threads, sorts, sets, counts of steps, and what the machine has.

pub(crate) mod cost;
pub(crate) mod machine;
pub(crate) mod parallel;
pub(crate) mod radix;
pub(crate) mod steps;
pub(crate) mod union_find;
pub(crate) mod varint;
