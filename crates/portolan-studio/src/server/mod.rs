//! The page and the engines behind one address.
//!
//! | what a hostile or broken peer does | what happens |
//! |---|---|
//! | another web page sends its visitors here | refused: `Host` and `Origin` are checked (`guard.rs`) |
//! | another machine asks, where it can | refused, unless it has the token of the printed address (`token.rs`) |
//! | a message is no JSON, of no view, of impossible values, or too long | an error in words, or the socket is closed |
//! | too many tabs | refused with a reason, the others go on |
//! | a tab asks for too large maps | refused before they are made |
//! | a tab is closed | its session is dropped; where it is at work, when that is done |
//! | a peer opens connections and sends nothing, or half of a request | they are closed after a while, or when there are many and another one comes |
//! | a peer opens a session and is gone, or reads no answers | it is asked, and its session is dropped |

mod assets;
mod connections;
mod guard;
mod socket;
mod token;

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::get;
use tokio::sync::Semaphore;

use self::token::Token;
use crate::engine::{Clock, Limits, Logs};

/// How the studio is served.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where to listen; another address than the loopback's makes the studio visible to the network.
    pub address: IpAddr,
    /// 0: any that is free.
    pub port: u16,
    /// Sessions at a time; one more tab is refused.
    pub sessions: usize,
    /// What each of them may take.
    pub limits: Limits,
    /// How long a peer may keep the server waiting.
    pub patience: Duration,
    /// Whether the address has a random token without which nobody is let in. So it is always where other machines can ask.
    pub token: bool,
}

impl Default for Settings {
    /// 127.0.0.1, any port, eight sessions, half a minute, no token.
    fn default() -> Self {
        Self {
            address: Ipv4Addr::LOCALHOST.into(),
            port: 0,
            sessions: 8,
            limits: Limits::default(),
            patience: Duration::from_secs(30),
            token: false,
        }
    }
}

/// What requests share.
#[derive(Clone)]
struct Shared {
    logs: Arc<Logs>,
    limits: Limits,
    clock: Clock,
    patience: Duration,
    seats: Arc<Semaphore>,
    held: Arc<AtomicUsize>,
    address: SocketAddr,
    token: Option<Arc<Token>>,
}

/// A studio that listens.
pub struct Server {
    runtime: tokio::runtime::Runtime,
    address: SocketAddr,
    seats: (Arc<Semaphore>, usize),
    held: Arc<AtomicUsize>,
    token: Option<Arc<Token>>,
}

impl Server {
    /// Listens, and answers from now on, on threads of its own.
    ///
    /// # Errors
    /// Where the address cannot be listened at.
    pub fn start(logs: impl Into<Arc<Logs>>, settings: &Settings) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind((settings.address, settings.port))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        let started = Instant::now();
        let seats = Arc::new(Semaphore::new(settings.sessions));
        let held = Arc::new(AtomicUsize::new(0));
        let wants_token = settings.token || !address.ip().is_loopback();
        let token = wants_token.then(|| Arc::new(Token::random(address.port())));
        let shared = Shared {
            logs: logs.into(),
            limits: settings.limits,
            clock: Clock::new(move || started.elapsed().as_secs_f64()),
            patience: settings.patience,
            seats: seats.clone(),
            held: held.clone(),
            address,
            token: token.clone(),
        };
        let app = Router::new()
            .route("/engine", get(socket::open))
            .fallback(assets::serve)
            .layer(from_fn_with_state(shared.clone(), guard::check))
            .with_state(shared);
        let listener = {
            let _inside = runtime.enter();
            tokio::net::TcpListener::from_std(listener)?
        };
        runtime.spawn(connections::accept(listener, app, settings.patience));
        Ok(Self { runtime, address, seats: (seats, settings.sessions), held, token })
    }

    /// Where the page is, with the token, where there is one.
    pub fn url(&self) -> String {
        let ip = self.address.ip();
        let host = if ip.is_unspecified() { Ipv4Addr::LOCALHOST.into() } else { ip };
        let query = self.token.as_ref().map(|token| token.query()).unwrap_or_default();
        format!("http://{}/{query}", SocketAddr::new(host, self.address.port()))
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sessions that are open.
    pub fn sessions(&self) -> usize {
        self.seats.1 - self.seats.0.available_permits()
    }

    /// Bytes of the maps of all sessions, as of their last answers.
    pub fn memory_bytes(&self) -> usize {
        self.held.load(Ordering::Relaxed)
    }

    /// Serves until the process is interrupted (Ctrl-C).
    ///
    /// # Errors
    /// Where interruptions cannot be listened for.
    pub fn wait(self) -> io::Result<()> {
        let interrupted = self.runtime.block_on(tokio::signal::ctrl_c());
        self.close();
        interrupted
    }

    /// Stops serving. Work of the sessions that is under way is dropped.
    pub fn close(self) {
        self.runtime.shutdown_background();
    }
}
