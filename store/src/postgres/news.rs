//! Words from other daemons, by a connection of their own: there may be something new to claim. None is ever missed for good, since whoever waits
//! looks now and then by himself.

use std::sync::Arc;
use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgListener, PgPoolOptions};
use tokio::time::sleep;

/// After a connection ended, and before each further try.
const PAUSE: Duration = Duration::from_secs(1);

/// Calls `news` with each word on the channel, as long as the store's runtime runs.
pub(super) async fn listen(options: PgConnectOptions, channel: String, news: Arc<dyn Fn() + Send + Sync>) {
    loop {
        if let Err(error) = hear(&options, &channel, &news).await {
            tracing::debug!(%error, "Words from other daemons are not heard; it is tried again.");
        }
        sleep(PAUSE).await;
    }
}

/// Listens until the connection ends.
async fn hear(options: &PgConnectOptions, channel: &str, news: &Arc<dyn Fn() + Send + Sync>) -> Result<(), sqlx::Error> {
    let pool = PgPoolOptions::new().max_connections(1).connect_lazy_with(options.clone());
    let mut listener = PgListener::connect_with(&pool).await?;
    listener.listen(channel).await?;
    // Whatever was said before is not heard any more.
    tell(news).await;
    while listener.try_recv().await?.is_some() {
        // Words that came together are one.
        while listener.next_buffered().is_some() {}
        tell(news).await;
    }
    Ok(())
}

/// On a thread that may wait: whoever is told may have to wait for someone who waits for the database, whose answers come by this thread.
async fn tell(news: &Arc<dyn Fn() + Send + Sync>) {
    let news = Arc::clone(news);
    // It ends in a panic, or it does not; the next word comes either way.
    let _ = tokio::task::spawn_blocking(move || news()).await;
}
