//! A day of trouble: something goes wrong around the daemon, then it is put right again, and the daemon goes on by itself. Originals
//! stay whole, each file ends in one place with one result, and while it waits its job says why.
//!
//! `cargo test -p suture-tests --test trouble -- --nocapture --test-threads 1` prints a table of what was done and seen. Mounts and other
//! users need root: without it a scenario says so and is skipped. `SUTURE_EXHAUSTIVE=1` adds what takes minutes or much disk.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a scenario that cannot be set up has failed")]

#[path = "trouble/clock.rs"]
mod clock;
#[path = "trouble/copier.rs"]
mod copier;
#[path = "trouble/cuts.rs"]
mod cuts;
#[path = "trouble/ending.rs"]
mod ending;
#[path = "trouble/farm.rs"]
mod farm;
#[path = "trouble/farm_members.rs"]
mod farm_members;
#[path = "trouble/mounts.rs"]
mod mounts;
#[path = "trouble/moved.rs"]
mod moved;
#[path = "trouble/processes.rs"]
mod processes;
#[path = "trouble/refused.rs"]
mod refused;
#[path = "trouble/room.rs"]
mod room;
#[path = "trouble/silent.rs"]
mod silent;
#[path = "trouble/stage.rs"]
mod stage;
#[path = "trouble/strangers.rs"]
mod strangers;
#[path = "trouble/words.rs"]
mod words;
#[path = "trouble/world.rs"]
mod world;
