//! Connections: not too many at a time, and none that keeps the server waiting.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

/// Connections at a time, those of sessions not counted: they have seats of their own. A browser opens six per page.
const MOST: usize = 128;
/// Bytes of a request's header.
const LONGEST_HEADER: usize = 16 << 10;
/// Before the next try where a connection could not be accepted: out of descriptors, most likely.
const PAUSE: Duration = Duration::from_millis(50);

/// Accepts and serves for as long as the runtime runs. `axum::serve` would, too, but waits for ever for whoever sends
/// half of a request.
pub(super) async fn accept(listener: TcpListener, app: Router, patience: Duration) {
    let places = Arc::new(Semaphore::new(MOST));
    while let Ok(place) = places.clone().acquire_owned().await {
        let Ok((stream, _)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        let app = app.clone();
        tokio::spawn(async move {
            serve(stream, app, patience).await;
            drop(place);
        });
    }
}

/// Serves one connection until it is closed or has become a session's socket.
async fn serve(stream: TcpStream, app: Router, patience: Duration) {
    // Frames are answers, and somebody waits for each of them. Without it they only come a little later.
    let _ = stream.set_nodelay(true);
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(patience)
        .max_buf_size(LONGEST_HEADER)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(app))
        .with_upgrades();
    // Whoever asks for files and does not take them is given up at last. Broken connections are the peer's affair.
    let _ = timeout(10 * patience, connection).await;
}
