//! Questions that several callers of one daemon ask at the same time go to the database together: one statement, one way there and back, one commit for all that
//! wait while the one before is under way. Whoever comes alone waits for no one.

use std::sync::{Mutex, MutexGuard, PoisonError};

use sqlx::postgres::PgConnection;
use tokio::sync::Semaphore;
use tokio::sync::oneshot::{Sender, channel, error::TryRecvError};

use super::database::Failure;

/// Asks of one sort, and who waits for their answers.
pub(super) struct Together<Ask, Answer> {
    waiting: Mutex<Vec<(Ask, Sender<Answer>)>>,
    turns: Semaphore,
}

impl<Ask, Answer> Together<Ask, Answer> {
    /// With so many statements under way at a time: while one becomes durable, the next is made.
    pub(super) fn new(turns: usize) -> Self {
        Self { waiting: Mutex::default(), turns: Semaphore::new(turns) }
    }

    fn waiting(&self) -> MutexGuard<'_, Vec<(Ask, Sender<Answer>)>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks, by this connection or by another caller's; `all` answers all that are asked, in their order. `None`: another caller's connection was lost, and no
    /// one knows what was done.
    pub(super) async fn ask(
        &self,
        connection: &mut PgConnection,
        ask: Ask,
        all: impl AsyncFn(&mut PgConnection, &[Ask]) -> Result<Vec<Answer>, Failure>,
    ) -> Result<Option<Answer>, Failure> {
        let (tell, mut told) = channel();
        self.waiting().push((ask, tell));
        let turn = self.turns.acquire().await;
        loop {
            match told.try_recv() {
                Ok(answer) => return Ok(Some(answer)),
                Err(TryRecvError::Closed) => return Ok(None),
                Err(TryRecvError::Empty) => {}
            }
            let mut now = std::mem::take(&mut *self.waiting());
            if now.is_empty() {
                // Its own is under way, by someone who has another turn.
                drop(turn);
                return Ok(told.await.ok());
            }
            // Whoever has given up meanwhile wants nothing any more.
            now.retain(|(_, tell)| !tell.is_closed());
            let (asks, tells): (Vec<_>, Vec<_>) = now.into_iter().unzip();
            match all(connection, &asks).await {
                Ok(answers) => tells.into_iter().zip(answers).for_each(|(tell, answer)| _ = tell.send(answer)),
                Err(failure) => {
                    // Whoever waits hears that nothing is known.
                    drop(tells);
                    drop(turn);
                    return match told.try_recv() {
                        Err(TryRecvError::Closed) => Err(failure),
                        Ok(answer) => Ok(Some(answer)),
                        Err(TryRecvError::Empty) => Ok(told.await.ok()),
                    };
                }
            }
        }
    }
}
