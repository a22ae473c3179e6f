//! One socket, one session: a question, its answer, the next question.

use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};

use super::{Shared, guard};
use crate::engine::{Session, Wire};

/// Bytes of the longest question; a hand-drawn path is the longest that the page has.
const LONGEST: usize = 256 << 10;

/// Opens a session, if there is a seat left.
pub(super) async fn open(
    State(shared): State<Shared>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if !guard::has_origin(&headers) {
        return (StatusCode::FORBIDDEN, "a socket must say whose page it belongs to\n").into_response();
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
    while let Some(Ok(message)) = socket.recv().await {
        let question = match message {
            Message::Text(text) => text,
            Message::Close(_) => return,
            Message::Ping(_) | Message::Pong(_) => continue,
            Message::Binary(_) => {
                return close(socket, close_code::UNSUPPORTED, "questions are JSON texts").await;
            }
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
        let sent = match answer {
            Wire::Text(text) => socket.send(Message::Text(text.into())).await,
            Wire::Binary(bytes) => socket.send(Message::Binary(bytes.into())).await,
        };
        if sent.is_err() {
            return;
        }
    }
}

async fn close(mut socket: WebSocket, code: u16, reason: &'static str) {
    // The peer may be gone already.
    let _ = socket.send(Message::Close(Some(CloseFrame { code, reason: reason.into() }))).await;
}
