//! Steps that come at the same time are written together: one statement, one way to the database and back, one commit for all that are waiting while the one
//! before is under way. Whoever comes alone waits for no one.

use std::sync::{Mutex, MutexGuard, PoisonError};

use sqlx::postgres::PgConnection;
use tokio::sync::Semaphore;
use tokio::sync::oneshot::{Sender, channel, error::TryRecvError};

use super::database::Failure;
use super::write::{Write, Written, all};

/// So many statements are under way at a time: while one becomes durable, the next is written.
const TURNS: usize = 4;

/// Steps of one store.
pub(super) struct Together {
    waiting: Mutex<Vec<(Write, Sender<Written>)>>,
    turns: Semaphore,
}

impl Default for Together {
    fn default() -> Self {
        Self { waiting: Mutex::default(), turns: Semaphore::new(TURNS) }
    }
}

impl Together {
    fn waiting(&self) -> MutexGuard<'_, Vec<(Write, Sender<Written>)>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes it, by this connection or by another caller's. `None`: another caller's was lost, and no one knows whether it is written.
    pub(super) async fn write(&self, connection: &mut PgConnection, write: Write) -> Result<Option<Written>, Failure> {
        let (tell, mut told) = channel();
        self.waiting().push((write, tell));
        let turn = self.turns.acquire().await;
        loop {
            match told.try_recv() {
                Ok(written) => return Ok(Some(written)),
                Err(TryRecvError::Closed) => return Ok(None),
                Err(TryRecvError::Empty) => {}
            }
            let mut now = std::mem::take(&mut *self.waiting());
            if now.is_empty() {
                // Its own is under way, by someone who has the other turn.
                drop(turn);
                return Ok(told.await.ok());
            }
            // Whoever has given up meanwhile wants nothing written any more.
            now.retain(|(_, tell)| !tell.is_closed());
            now.sort_by_key(|(write, _)| write.columns.id);
            let (writes, tells): (Vec<_>, Vec<_>) = now.into_iter().unzip();
            match all(connection, &writes).await {
                Ok(written) => tells.into_iter().zip(written).for_each(|(tell, written)| _ = tell.send(written)),
                Err(failure) => {
                    // Whoever waits hears that nothing is known.
                    drop(tells);
                    drop(turn);
                    return match told.try_recv() {
                        Err(TryRecvError::Closed) => Err(failure),
                        Ok(written) => Ok(Some(written)),
                        Err(TryRecvError::Empty) => Ok(told.await.ok()),
                    };
                }
            }
        }
    }
}
