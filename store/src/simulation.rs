//! A farm, simulated from a seed: many hosts on one store, a clock that is set, calls that are lost on their way there or back or arrive when no one waits for them,
//! hosts that are stopped for longer than their leases and woken, cut off, killed, and a database that restarts. The state machine, the queue with its order and
//! shares, submission and notices are the product's; the hosts do what a job's duty says. The same runs over the embedded queue, with leases beside it, and over
//! PostgreSQL with its own.
//!
//! Each seed is one run. When one fails, its last steps are told, and `SUTURE_SEED=n cargo test -p suture-store a_farm_of_choice -- --ignored` has it again.

mod files;
mod ground;
mod host;
#[cfg(feature = "postgres")]
mod on_postgres;
mod oracle;
mod script;
mod stage;
mod tests;
