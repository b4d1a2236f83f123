//! The state that all answers are made of.

use std::sync::Arc;

use tokio::sync::Semaphore;

use crate::attempt::Context;
use crate::config::api::Api;

use super::seats::{LISTENERS, Uploads};
use super::tokens::Tokens;
use super::verified::Verified;

/// The state that every handler has.
pub(super) struct Shared {
    pub context: Arc<Context>,
    pub api: Api,
    pub tokens: Tokens,
    /// Files that were found to be what their jobs left.
    pub verified: Verified,
    pub uploads: Arc<Uploads>,
    /// Seats of those who listen to what happens.
    pub listeners: Arc<Semaphore>,
}

impl Shared {
    pub(super) fn new(context: Arc<Context>, api: Api, tokens: Tokens) -> Self {
        Self {
            context,
            api,
            tokens,
            verified: Verified::default(),
            uploads: Arc::default(),
            listeners: Arc::new(Semaphore::new(LISTENERS)),
        }
    }
}
