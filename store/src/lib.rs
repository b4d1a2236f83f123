//! Durable job state.
