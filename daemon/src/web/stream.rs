//! `GET /v1/events`: what happens, as it happens, as server-sent events. Who comes back with `Last-Event-ID` is told what was missed, or that it is lost.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::HeaderMap;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc::{Sender, channel};
use tokio::time::timeout;

use crate::event_bus::{Bus, Listening, Message};
use crate::event_metrics::Count;

use super::flow::Flow;
use super::problem::Problem;
use super::seats::LISTENERS;
use super::shared::Shared;

/// How often something is said, if only that nothing is.
const ALIVE_EVERY: Duration = Duration::from_secs(15);
/// Pieces that wait for a client.
const AHEAD: usize = 32;

/// `GET /v1/events`.
pub(super) async fn events(State(shared): State<Arc<Shared>>, headers: HeaderMap) -> Result<Response, Problem> {
    let seat = Arc::clone(&shared.listeners).try_acquire_owned();
    let seat = seat.map_err(|_| Problem::unavailable(format!("{LISTENERS} are listening already; try again")))?;
    let bus = Arc::clone(&shared.context.bus);
    let listening = bus.listen(last_heard(&headers)).ok_or_else(|| Problem::unavailable("no one can listen"))?;
    let (sender, pieces) = channel(AHEAD);
    tokio::spawn(async move {
        // When the client goes, so does the stream.
        let _ = speak(&bus, listening, &sender, seat).await;
    });
    Ok(([(CONTENT_TYPE, "text/event-stream")], Body::new(Flow::new(pieces, None))).into_response())
}

/// The life and number of the last event that was heard. What is no id of ours is from another life.
fn last_heard(headers: &HeaderMap) -> Option<(u64, u64)> {
    let id = headers.get("last-event-id")?;
    let parse = || {
        let (life, number) = id.to_str().ok()?.split_once('-')?;
        Some((life.parse().ok()?, number.parse().ok()?))
    };
    Some(parse().unwrap_or((0, 0)))
}

/// The client has gone.
struct Gone;

type Pieces = Sender<io::Result<Bytes>>;

async fn say(to: &Pieces, text: String) -> Result<(), Gone> {
    to.send(Ok(text.into())).await.map_err(|_| Gone)
}

fn written(bus: &Bus, message: &Message) -> String {
    let Message { number, kind, data } = message;
    format!("id: {}-{number}\nevent: {kind}\ndata: {data}\n\n", bus.life)
}

const LOST: &str = "event: lost\ndata: {}\n\n";

async fn speak(bus: &Bus, mut listening: Listening, to: &Pieces, _seat: OwnedSemaphorePermit) -> Result<(), Gone> {
    say(to, "retry: 2000\n\n".into()).await?;
    if listening.lost {
        say(to, LOST.into()).await?;
    }
    for message in listening.missed {
        say(to, written(bus, &message)).await?;
    }
    loop {
        match timeout(ALIVE_EVERY, listening.more.recv()).await {
            Err(_) => say(to, ":\n\n".into()).await?,
            Ok(Ok(message)) => say(to, written(bus, &message)).await?,
            Ok(Err(RecvError::Lagged(missed))) => {
                bus.metrics.add(Count::EventsLost, &[], missed);
                say(to, LOST.into()).await?;
            }
            Ok(Err(RecvError::Closed)) => return Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_other_lives_are_told() {
        let of = |id: &str| {
            last_heard(&HeaderMap::from_iter([("last-event-id".parse::<axum::http::HeaderName>().unwrap(), id.parse().unwrap())]))
        };
        assert_eq!(of("17-4"), Some((17, 4)));
        for other in ["", "17", "-4", "17-x", "17-4-4", "99999999999999999999999-1"] {
            assert_eq!(of(other), Some((0, 0)), "{other}");
        }
        assert_eq!(last_heard(&HeaderMap::new()), None);
    }
}
