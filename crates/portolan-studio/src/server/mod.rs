//! The page and the engines behind one address.
//!
//! | what a hostile or broken peer does | what happens |
//! |---|---|
//! | another web page sends its visitors here | refused: `Host` and `Origin` are checked ([`guard`]) |
//! | a message is no JSON, of no view, of impossible values, or too long | an error in words, or the socket is closed |
//! | too many tabs | refused with a reason, the others go on |
//! | a tab asks for too large maps | refused before they are made |
//! | a tab is closed | its session is dropped, also where it is at work |

mod assets;
mod guard;
mod socket;

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Instant;

use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::get;
use tokio::sync::Semaphore;

use crate::engine::{Clock, Limits, Logs};

/// How the studio is served.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where to listen; another address than the loopback's makes the studio visible to the network.
    pub address: IpAddr,
    /// 0: any that is free.
    pub port: u16,
    /// Sessions at a time; one more tab is told to wait.
    pub sessions: usize,
    /// What each of them may take.
    pub limits: Limits,
}

impl Default for Settings {
    /// 127.0.0.1, any port, eight sessions.
    fn default() -> Self {
        Self { address: Ipv4Addr::LOCALHOST.into(), port: 0, sessions: 8, limits: Limits::default() }
    }
}

/// What requests share.
#[derive(Clone)]
struct Shared {
    logs: Arc<Logs>,
    limits: Limits,
    clock: Clock,
    seats: Arc<Semaphore>,
    address: SocketAddr,
}

/// A studio that listens.
pub struct Server {
    runtime: tokio::runtime::Runtime,
    address: SocketAddr,
    seats: (Arc<Semaphore>, usize),
}

impl Server {
    /// Listens, and answers from now on, on threads of its own.
    ///
    /// # Errors
    /// Where the address cannot be listened at.
    pub fn start(logs: Logs, settings: &Settings) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind((settings.address, settings.port))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        let started = Instant::now();
        let seats = Arc::new(Semaphore::new(settings.sessions));
        let shared = Shared {
            logs: Arc::new(logs),
            limits: settings.limits,
            clock: Clock::new(move || started.elapsed().as_secs_f64()),
            seats: seats.clone(),
            address,
        };
        let app = Router::new()
            .route("/engine", get(socket::open))
            .fallback(assets::serve)
            .layer(from_fn_with_state(shared.clone(), guard::check))
            .with_state(shared);
        runtime.spawn(async move {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            axum::serve(listener, app).await
        });
        Ok(Self { runtime, address, seats: (seats, settings.sessions) })
    }

    /// Where the page is.
    pub fn url(&self) -> String {
        let ip = self.address.ip();
        let host = if ip.is_unspecified() { Ipv4Addr::LOCALHOST.into() } else { ip };
        format!("http://{}/", SocketAddr::new(host, self.address.port()))
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sessions that are open.
    pub fn sessions(&self) -> usize {
        self.seats.1 - self.seats.0.available_permits()
    }

    /// Serves until the process ends.
    pub fn wait(self) {
        self.runtime.block_on(std::future::pending::<()>());
    }
}
