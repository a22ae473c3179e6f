//! Connections: not too many at a time, and none that keeps the server or another peer waiting.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::Router;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

/// Connections at a time, those of sessions not counted: they have seats of their own. A browser opens six per page.
const MOST: usize = 128;
/// Bytes of a request's header.
const LONGEST_HEADER: usize = 16 << 10;
/// Before the next try where a connection could not be accepted (out of descriptors, most likely) or all are at work.
const PAUSE: Duration = Duration::from_millis(50);
/// Of the last answer some may still be on its way.
const AFTER_ANSWER: Duration = Duration::from_secs(1);

/// Accepts and serves for as long as the runtime runs. `axum::serve` would, too, but waits for ever for whoever sends
/// half of a request. Where there are too many, the one that has been idle for the longest makes room.
pub(super) async fn accept(listener: TcpListener, app: Router, patience: Duration) {
    let mut open: VecDeque<Connection> = VecDeque::new();
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            sleep(PAUSE).await;
            continue;
        };
        loop {
            open.retain(|connection| !connection.task.is_finished());
            if open.len() < MOST {
                break;
            }
            match open.iter().position(|connection| connection.is_idle()) {
                Some(idle) => open.remove(idle).into_iter().for_each(|connection| connection.task.abort()),
                None => sleep(PAUSE).await,
            }
        }
        let work = Arc::new(Mutex::new(Work::default()));
        let task = tokio::spawn(serve(stream, app.clone(), patience, work.clone())).abort_handle();
        open.push_back(Connection { task, work });
    }
}

struct Connection {
    task: AbortHandle,
    work: Arc<Mutex<Work>>,
}

/// What a connection is doing.
#[derive(Default)]
struct Work {
    /// Requests that have no answer yet.
    requests: usize,
    /// When the last one got its answer.
    answered: Option<Instant>,
}

impl Connection {
    fn is_idle(&self) -> bool {
        // Nothing that could panic is done while it is locked.
        let work = self.work.lock().unwrap_or_else(|held| held.into_inner());
        work.requests == 0 && work.answered.is_none_or(|at| at.elapsed() > AFTER_ANSWER)
    }
}

/// Serves one connection until it is closed or has become a session's socket.
async fn serve(stream: TcpStream, app: Router, patience: Duration, work: Arc<Mutex<Work>>) {
    // Frames are answers, and somebody waits for each of them. Without it they only come a little later.
    let _ = stream.set_nodelay(true);
    let app = TowerToHyperService::new(app);
    let service = service_fn(move |request| {
        let change = |by: fn(&mut Work), work: &Mutex<Work>| {
            by(&mut work.lock().unwrap_or_else(|held| held.into_inner()));
        };
        change(|work| work.requests += 1, &work);
        let (answer, work) = (app.call(request), work.clone());
        async move {
            let answer = answer.await;
            change(|work| (work.requests, work.answered) = (work.requests - 1, Some(Instant::now())), &work);
            answer
        }
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(patience)
        .max_buf_size(LONGEST_HEADER)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    // Whoever asks for files and does not take them is given up at last. Broken connections are the peer's affair.
    let _ = timeout(10 * patience, connection).await;
}
