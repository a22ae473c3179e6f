//! One socket, one session: a question, its answer, the next question.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use tokio::time::timeout;

use super::{Shared, guard};
use crate::engine::{Session, Wire};

/// Bytes of the longest question; a hand-drawn path is the longest that the page has.
const LONGEST: usize = 256 << 10;
/// For the peer to take notice that its socket is closed.
const FAREWELL: Duration = Duration::from_secs(1);

/// Opens a session, if there is a seat left.
pub(super) async fn open(
    State(shared): State<Shared>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if !guard::has_origin(&headers) {
        return (StatusCode::FORBIDDEN, "a socket must send an Origin header\n").into_response();
    }
    upgrade
        .max_message_size(LONGEST)
        .max_frame_size(LONGEST)
        .on_upgrade(move |socket| converse(socket, shared))
}

/// Answers until the tab is closed.
async fn converse(mut socket: WebSocket, shared: Shared) {
    let Ok(_seat) = shared.seats.clone().try_acquire_owned() else {
        return close(socket, close_code::AGAIN, "too many tabs are open; close one and reload").await;
    };
    let mut session = Session::new(&shared.logs, shared.limits, &shared.clock);
    let mut held = Held::nothing(shared.held);
    while let Some(message) = next(&mut socket, shared.patience).await {
        let question = match message {
            Ok(Message::Text(text)) => text,
            Ok(Message::Close(_)) => return,
            Ok(Message::Ping(_) | Message::Pong(_)) => continue,
            Ok(Message::Binary(_)) => {
                return close(socket, close_code::UNSUPPORTED, "questions are JSON texts").await;
            }
            Err(_) => return close(socket, close_code::SIZE, "the question is too long, or no text").await,
        };
        // Maps take their time; other tabs must not wait for it.
        let work = tokio::task::spawn_blocking(move || {
            let answer = session.answer(question.as_str());
            (session, answer)
        });
        // A panic is a bug of ours: it ends this session, and no other.
        let Ok((kept, answer)) = work.await else {
            return close(socket, close_code::ERROR, "the engine failed; reload the page").await;
        };
        session = kept;
        held.set(session.memory_bytes());
        let answer = match answer {
            Wire::Text(text) => Message::Text(text.into()),
            Wire::Binary(bytes) => Message::Binary(bytes.into()),
        };
        if !matches!(timeout(shared.patience, socket.send(answer)).await, Ok(Ok(()))) {
            return;
        }
    }
}

/// The next message; `None` where the peer is gone. A silent one is pinged after a while:
/// of a machine that went to sleep nothing else would ever be heard.
async fn next(socket: &mut WebSocket, patience: Duration) -> Option<Result<Message, axum::Error>> {
    if let Ok(message) = timeout(patience, socket.recv()).await {
        return message;
    }
    timeout(patience, socket.send(Message::Ping(Default::default()))).await.ok()?.ok()?;
    timeout(patience, socket.recv()).await.ok()?
}

/// Closes with a reason, and waits for the peer to have read it: with its questions unread, the connection would be
/// reset and the reason lost.
async fn close(mut socket: WebSocket, code: u16, reason: &'static str) {
    let farewell = async {
        // The peer may be gone already.
        let _ = socket.send(Message::Close(Some(CloseFrame { code, reason: reason.into() }))).await;
        while let Some(Ok(_)) = socket.recv().await {}
    };
    let _ = timeout(FAREWELL, farewell).await;
}

/// What one session adds to the bytes of all.
struct Held {
    all: Arc<AtomicUsize>,
    mine: usize,
}

impl Held {
    fn nothing(all: Arc<AtomicUsize>) -> Self {
        Self { all, mine: 0 }
    }

    fn set(&mut self, bytes: usize) {
        self.all.fetch_add(bytes, Ordering::Relaxed);
        self.all.fetch_sub(self.mine, Ordering::Relaxed);
        self.mine = bytes;
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.set(0);
    }
}
