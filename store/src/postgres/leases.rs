//! Leases of the claims that a store has given out: as long as the store lives, so do they, whatever its callers are busy with.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use sqlx::postgres::PgConnection;
use tokio::runtime::Runtime;

use super::claim::{Life, extend};
use super::database::{Again, Database, Failure, wait};
use super::hosts::see;
use super::row::int;
use super::step::Seen;
use crate::id::{Epoch, JobId, Token};
use crate::store::Claim;

/// A claim that was given out.
struct Kept {
    token: Token,
    /// Its row as it was left by this life.
    seen: Option<Seen>,
}

/// The claims that this life has given out and that have not ended. One whose answer was lost on the way is not among them, and runs out.
#[derive(Default)]
pub(super) struct Claims(Mutex<BTreeMap<JobId, Kept>>);

impl Claims {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<JobId, Kept>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tokens(&self) -> Vec<Token> {
        self.lock().values().map(|kept| kept.token).collect()
    }

    /// `seen`: its row as it was written just now, if it is known.
    pub(super) fn keep(&self, claim: &Claim, seen: Option<Seen>) {
        self.lock().insert(claim.id, Kept { token: claim.token, seen });
    }

    /// The row as it was left, for the one step that comes next.
    pub(super) fn seen(&self, claim: &Claim) -> Option<Seen> {
        self.lock().get_mut(&claim.id).filter(|kept| kept.token == claim.token)?.seen.take()
    }

    /// The step was made, and the claim goes on.
    pub(super) fn go_on(&self, claim: &Claim, seen: Seen) {
        if let Some(kept) = self.lock().get_mut(&claim.id).filter(|kept| kept.token == claim.token) {
            kept.seen = Some(seen);
        }
    }

    pub(super) fn end(&self, claim: &Claim) {
        let mut claims = self.lock();
        if claims.get(&claim.id).is_some_and(|kept| kept.token == claim.token) {
            claims.remove(&claim.id);
        }
    }
}

/// The daemon ends of itself: its folders are free at once.
pub(super) async fn end(connection: &mut PgConnection, life: &Life) -> Result<(), Failure> {
    let over = sqlx::query("UPDATE lives SET is_over = true WHERE epoch = $1").bind(int(life.epoch.0));
    over.execute(connection).await?;
    Ok(())
}

/// Gives a sign of life, and begins the leases of all claims anew, again and again, until the store ends: as long as the daemon lives, so do its
/// claims.
pub(super) fn keep_leases(runtime: &Runtime, database: &Database, life: &Life, claims: &Claims, ended: &Receiver<Arc<Runtime>>) {
    let pause = Duration::from_millis(life.lease.unsigned_abs() / 4);
    while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(pause) {
        if life.epoch == Epoch(0) {
            continue;
        }
        let tokens = claims.tokens();
        let keep = async |connection: &mut PgConnection| {
            see(connection, life).await?;
            if tokens.is_empty() { Ok(0) } else { extend(connection, life, &tokens).await }
        };
        let kept = wait(runtime, async || database.call(Again::Yes, false, keep).await);
        if let Err(error) = kept {
            tracing::warn!(%error, "The leases of this daemon's jobs could not be kept; others may take them.");
        }
    }
}
