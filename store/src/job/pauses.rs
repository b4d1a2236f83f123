//! How long a job rests before it is tried again.

/// How often an error of the environment is tried again.
pub const ENVIRONMENT_RETRIES: u32 = 5;
/// First pause after an error of the environment; doubles each time.
pub const BACKOFF_MS: u64 = 30_000;
/// Longest pause.
pub const BACKOFF_CAP_MS: u64 = 30 * 60_000;
/// Pause after something that no try of the file changes.
pub const WAIT_MS: u64 = 15_000;
/// First pause of a parked job; doubles each time. It never gives up.
pub const PARK_MS: u64 = 1000;
/// Longest pause of a parked job.
pub const PARK_CAP_MS: u64 = 5 * 60_000;
/// Pause of a job that another host is to have: twice what an idle one takes to look.
pub const HAND_ON_MS: u64 = 2000;
