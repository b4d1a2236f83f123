//! Connections: so many at a time, each with little time and room for what it asks.

use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpStream;
use tokio::runtime::Builder;
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use super::patience::Patient;

/// Connections at a time; further ones wait.
const AT_ONCE: usize = 256;
/// Threads for what touches a disk.
const BLOCKING: usize = 4;
/// How long the head of a request may take, and how long a connection may say nothing.
const HEAD_TIME: Duration = Duration::from_secs(10);
/// Room for the head of a request in bytes.
const HEAD_ROOM: usize = 32 << 10;
const MOST_HEADERS: usize = 64;
/// How often the end is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// How long answers under way may take when the daemon ends.
const GOODBYE: Duration = Duration::from_secs(1);

/// Serves until `ended`.
///
/// # Errors
/// When there is no runtime to be had.
pub(super) fn serve(listener: TcpListener, router: Router, ended: &dyn Fn() -> bool) -> io::Result<()> {
    let runtime = Builder::new_current_thread().enable_io().enable_time().max_blocking_threads(BLOCKING).build()?;
    let served = runtime.block_on(accept(listener, router, ended));
    runtime.shutdown_timeout(GOODBYE);
    served
}

async fn accept(listener: TcpListener, router: Router, ended: &dyn Fn() -> bool) -> io::Result<()> {
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let seats = Arc::new(Semaphore::new(AT_ONCE));
    while !ended() {
        let Ok(Ok(seat)) = timeout(LOOK_EVERY, Arc::clone(&seats).acquire_owned()).await else { continue };
        match timeout(LOOK_EVERY, listener.accept()).await {
            Ok(Ok((stream, _))) => {
                let router = router.clone();
                tokio::spawn(async move {
                    attend(stream, router).await;
                    drop(seat);
                });
            }
            // Too many files are open, or the client has gone.
            Ok(Err(_)) => sleep(LOOK_EVERY).await,
            Err(_) => {}
        }
    }
    Ok(())
}

async fn attend(stream: TcpStream, router: Router) {
    // Small answers at once; where that cannot be had, a little later.
    let _ = stream.set_nodelay(true);
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME).max_buf_size(HEAD_ROOM).max_headers(MOST_HEADERS);
    let connection = server.serve_connection(TokioIo::new(Patient::new(stream)), TowerToHyperService::new(router));
    if let Err(error) = connection.await {
        tracing::debug!(%error, "A client was left.");
    }
}
