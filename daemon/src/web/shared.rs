//! The state that all answers are made of.

use std::io;
use std::sync::Arc;

use tokio::sync::Semaphore;

use crate::attempt::Context;
use crate::config::api::Api;

use super::seats::{Drawings, LISTENERS, LOGINS, Uploads};
use super::sessions::Sessions;
use super::tally::Tally;
use super::tokens::Tokens;
use super::verified::Verified;

/// The state that every handler has.
pub(super) struct Shared {
    pub context: Arc<Context>,
    pub api: Api,
    pub tokens: Tokens,
    pub sessions: Sessions,
    /// Files that were found to be what their jobs left.
    pub verified: Verified,
    pub uploads: Arc<Uploads>,
    /// Seats of those who listen to what happens.
    pub listeners: Arc<Semaphore>,
    /// Seats of those who show a token.
    pub logins: Semaphore,
    /// Who draws for pages.
    pub drawings: Arc<Drawings>,
    /// How many jobs ended in the last day.
    pub tally: Arc<Tally>,
}

impl Shared {
    /// Of one life of the web interface.
    ///
    /// # Errors
    /// When the system has nothing random.
    pub(super) fn new(context: Arc<Context>, api: Api, tokens: Tokens) -> io::Result<Self> {
        Ok(Self {
            context,
            api,
            tokens,
            sessions: Sessions::new()?,
            verified: Verified::default(),
            uploads: Arc::default(),
            listeners: Arc::new(Semaphore::new(LISTENERS)),
            logins: Semaphore::new(LOGINS),
            drawings: Arc::default(),
            tally: Arc::default(),
        })
    }
}
