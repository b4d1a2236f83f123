//! A body that is made while it is sent.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::Bytes;
use hyper::body::{Body, Frame, SizeHint};
use tokio::sync::mpsc::Receiver;

/// Pieces that come from somewhere else.
pub(super) struct Flow {
    pieces: Receiver<io::Result<Bytes>>,
    /// Bytes still to come, where that is known.
    left: Option<u64>,
}

impl Flow {
    pub(super) fn new(pieces: Receiver<io::Result<Bytes>>, length: Option<u64>) -> Self {
        Self { pieces, left: length }
    }
}

impl Body for Flow {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        let piece = self.pieces.poll_recv(cx);
        if let Poll::Ready(Some(Ok(bytes))) = &piece {
            self.left = self.left.map(|left| left.saturating_sub(bytes.len() as u64));
        }
        piece.map(|piece| piece.map(|piece| piece.map(Frame::data)))
    }

    fn size_hint(&self) -> SizeHint {
        self.left.map_or_else(SizeHint::default, SizeHint::with_exact)
    }
}
