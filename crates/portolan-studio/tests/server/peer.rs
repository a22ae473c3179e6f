//! Whoever talks to the server: a page that behaves, and a socket that may do anything.
#![allow(clippy::unwrap_used)] // what cannot be set up ends the test

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use portolan_studio::engine::Logs;
use portolan_studio::server::{Server, Settings};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::Request;
use tungstenite::protocol::CloseFrame;
use tungstenite::{Error, Message, WebSocket};

/// So long everything may take, on a machine that is busy with other things.
pub(crate) const SOON: Duration = Duration::from_secs(60);

pub(crate) fn serve(settings: &Settings) -> Server {
    Server::start(Logs::default(), settings).unwrap()
}

/// A page with a session.
pub(crate) struct Page {
    pub(crate) socket: WebSocket<TcpStream>,
    next: u32,
}

impl Page {
    pub(crate) fn open(server: &Server) -> Self {
        let origin = server.url().trim_end_matches('/').to_owned();
        let request = upgrade(server, Some(&origin));
        let (socket, _) = tungstenite::client(request, stream(server)).unwrap();
        Self { socket, next: 1 }
    }

    /// Asks and gives the answer: its JSON, or its header where arrays come with it.
    pub(crate) fn ask(&mut self, view: &str, ask: Value) -> Result<Value, String> {
        let id = self.next;
        self.next += 1;
        self.send(&json!({ "id": id, "view": view, "ask": ask }).to_string());
        let answer = self.answer();
        assert_eq!(answer["id"], id, "{answer}");
        match answer.get("error") {
            Some(error) => Err(error.as_str().unwrap().to_owned()),
            None => Ok(answer["ok"].clone()),
        }
    }

    pub(crate) fn step(&mut self, scans: usize) -> Value {
        self.ask("fusion", json!({ "op": "step", "scans": scans })).unwrap()
    }

    pub(crate) fn send(&mut self, text: &str) {
        self.socket.send(Message::text(text)).unwrap();
    }

    pub(crate) fn answer(&mut self) -> Value {
        match self.socket.read().unwrap() {
            Message::Text(text) => serde_json::from_str(&text).unwrap(),
            Message::Binary(bytes) => {
                assert_eq!(&bytes[..4], b"PSTU");
                let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
                serde_json::from_slice(&bytes[8..8 + length]).unwrap()
            }
            other => panic!("no answer: {other:?}"),
        }
    }

    /// Reads until the server has closed, and gives its reason, where one arrived.
    pub(crate) fn closed(mut self) -> Option<CloseFrame> {
        loop {
            match self.socket.read() {
                Ok(Message::Close(frame)) => return frame,
                Ok(_) => {}
                Err(Error::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => {
                    panic!("the socket is still open")
                }
                Err(_) => return None,
            }
        }
    }
}

pub(crate) fn stream(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(SOON)).unwrap();
    stream.set_write_timeout(Some(SOON)).unwrap();
    stream
}

/// What opens a socket.
pub(crate) fn upgrade(server: &Server, origin: Option<&str>) -> Request<()> {
    let url = format!("ws://{}/engine", server.address());
    let mut request = url.into_client_request().unwrap();
    if let Some(origin) = origin {
        request.headers_mut().insert("Origin", origin.parse().unwrap());
    }
    request
}

/// The status that opening a socket is refused with.
pub(crate) fn refused(server: &Server, request: Request<()>) -> u16 {
    match tungstenite::client(request, stream(server)) {
        Err(tungstenite::HandshakeError::Failure(Error::Http(response))) => response.status().as_u16(),
        other => panic!("not refused: {:?}", other.map(|_| ())),
    }
}

/// Sends these bytes and reads until the server closes.
pub(crate) fn raw(server: &Server, bytes: &[u8]) -> String {
    let mut stream = stream(server);
    stream.write_all(bytes).unwrap();
    let mut answer = Vec::new();
    // A reset is an end, too.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// A request for a file under this name of the server.
pub(crate) fn get(server: &Server, path: &str, host: &str, more: &str) -> String {
    raw(server, format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}\r\n").as_bytes())
}

pub(crate) fn wait_until(what: &str, done: impl Fn() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < SOON, "never came: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}
