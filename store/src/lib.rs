//! Durable job state: what is known about every dropped file, kept so that a power cut loses nothing that was acknowledged.
//!
//! * [`job`] is the pure state machine: which event may follow which state, who is to blame, when to try again. No I/O.
//! * [`store`] is the [`JobStore`] trait, what a queue must promise; [`MemoryStore`] is its model, [`SledStore`] the embedded
//!   default, `PostgresStore` (feature `postgres`) the one that many daemons share: claims are fenced by tokens, transitions are compare-and-set, submission is
//!   idempotent.
//! * [`crash`] holds the crash points that the tests of store and daemon kill the process at.
//!
//! The store is the index, the file system is the evidence: it never says more than what the files can confirm.

#![deny(missing_docs)]
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests may ask whether a file is there"))]

mod address;
pub mod crash;
mod host;
pub mod id;
pub mod job;
mod memory;
mod news;
pub mod path;
pub mod patience;
#[cfg(feature = "postgres")]
mod postgres;
mod queue;
mod record;
mod role;
mod share;
#[cfg(test)]
mod simulation;
mod sled_store;
pub mod stall;
pub mod store;
mod tables;
#[cfg(any(test, feature = "testkit"))]
pub mod testkit;
pub mod transfer;

pub use address::Address;
pub use crash::crash_point;
pub use host::{Host, Station};
pub use id::{Attempt, Boot, Clock, Epoch, Hash, JobId, Recipe, Seq, SystemClock, Time, Token};
pub use job::{
    Decision, Ending, HAND_ON_MS, Job, Kind, Past, Priority, Publication, Reached, Source, State, Step, Verdict, Witness,
};
pub use memory::MemoryStore;
pub use news::{News, Notice, Word};
pub use path::RelPath;
#[cfg(feature = "postgres")]
pub use postgres::{PostgresStore, Shared, role};
pub use role::{NoRole, Role, Roles};
pub use share::{NoWeight, Share, Shares, Weight};
pub use sled_store::{Opening, SledStore, StateLock, Verified};
pub use store::{
    Claim, Control, Filter, JobStore, Lease, Look, Page, Query, Recovered, Seen, StoreError, Submission, Submitted, Waiting,
};
pub use transfer::Transfer;
