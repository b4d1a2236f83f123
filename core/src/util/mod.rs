//! Util: what a program needs and a mesh does not.
//!
//! **In:** closures, keys, counters.
//! **Out:** threads that are a help and never a need ([`parallel`]), sorts by digits ([`radix`]), disjoint sets ([`union_find`], and [`parity`] for what agrees or disagrees), numbers
//! in few bytes ([`varint`]), what a run costs ([`cost`]) and the most memory that it takes ([`peak`]), counted steps of loops ([`steps`]), few values taken by a function ([`each`]), numbers in
//! no order ([`scatter`]), lists that grow by little ([`lean`]), sets of numbers ([`bits`]), what the machine has ([`machine`]), memory that is needed soon ([`prefetch`]), numbers as people read them ([`words`]).
//! **Promise:** nothing here knows a triangle. Parallel work returns its results in the order of its items, so that no result depends on
//! the number of threads.

pub(crate) mod bits;
pub(crate) mod cost;
pub(crate) mod each;
pub(crate) mod ids;
pub(crate) mod lean;
pub(crate) mod legible;
pub(crate) mod linear;
pub(crate) mod machine;
pub(crate) mod parallel;
pub(crate) mod parity;
pub(crate) mod peak;
pub(crate) mod prefetch;
pub(crate) mod radix;
pub(crate) mod scatter;
pub(crate) mod steps;
pub(crate) mod union_find;
pub(crate) mod varint;
pub mod words;
