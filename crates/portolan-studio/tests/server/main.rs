//! The server against pages of other sites, broken peers and hostile messages: it refuses, and goes on.
#![allow(clippy::unwrap_used)]

mod messages;
mod peer;

use std::io::{Read, Write};
use std::net::Shutdown;
use std::time::{Duration, Instant};

use portolan_studio::engine::Limits;
use portolan_studio::server::Settings;
use serde_json::json;
use tungstenite::Message;

use peer::{Page, SOON, get, raw, refused, serve, stream, upgrade, wait_until};

#[test]
fn gives_the_page_and_keeps_it_to_itself() {
    let server = serve(&Settings::default());
    let host = server.address().to_string();
    let page = get(&server, "/", &host, "");
    assert!(page.starts_with("HTTP/1.1 200"), "{page}");
    assert!(page.contains("<title>portolan studio</title>"));
    for header in
        ["content-security-policy: default-src 'none'; script-src 'self';", "x-content-type-options: nosniff"]
    {
        assert!(page.to_lowercase().contains(header), "{header} is missing in {page}");
    }
    for missing in ["/nothing", "/../Cargo.toml", "/%2e%2e/Cargo.toml", "//etc/passwd", "/page/index.html"] {
        let answer = get(&server, missing, &host, "");
        assert!(answer.starts_with("HTTP/1.1 404"), "{missing}: {answer}");
    }
    let post = raw(
        &server,
        format!("POST / HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
            .as_bytes(),
    );
    assert!(post.starts_with("HTTP/1.1 405"), "{post}");
}

#[test]
fn refuses_other_names_and_other_sites() {
    let server = serve(&Settings::default());
    let address = server.address();
    let port = address.port();
    for host in ["evil.example", &format!("evil.example:{port}"), "127.0.0.1:1", ""] {
        let answer = get(&server, "/", host, "");
        assert!(answer.starts_with("HTTP/1.1 403"), "{host}: {answer}");
    }
    let answer = get(&server, "/", &address.to_string(), "Origin: http://evil.example\r\n");
    assert!(answer.starts_with("HTTP/1.1 403"), "{answer}");
    assert!(raw(&server, b"GET / HTTP/1.0\r\n\r\n").starts_with("HTTP/1.0 403"));

    assert_eq!(refused(&server, upgrade(&server, None)), 403, "without Origin");
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1", &format!("https://{address}")] {
        assert_eq!(refused(&server, upgrade(&server, Some(origin))), 403, "{origin}");
    }
    let mut rebound = upgrade(&server, Some(&format!("http://evil.example:{port}")));
    rebound.headers_mut().insert("Host", format!("evil.example:{port}").parse().unwrap());
    assert_eq!(refused(&server, rebound), 403, "a name that was made to point here");
    assert_eq!(server.sessions(), 0);
}

#[test]
fn with_a_token_nobody_gets_in_without_it() {
    let server = serve(&Settings { token: true, ..Settings::default() });
    let host = server.address().to_string();
    let url = server.url();
    let query = url.strip_prefix(&format!("http://{host}/")).unwrap();
    assert_eq!(query.len(), "?token=".len() + 32, "{query}");
    let wrong = query.replace(&query[7..8], if &query[7..8] == "0" { "1" } else { "0" });
    for path in ["/", "/main.js", &format!("/{wrong}"), &format!("/main.js{query}"), "/?token="] {
        let answer = get(&server, path, &host, "");
        assert!(answer.starts_with("HTTP/1.1 403") && answer.contains("token"), "{path}: {answer}");
    }
    assert_eq!(refused(&server, upgrade(&server, Some(&format!("http://{host}")))), 403);

    let answer = get(&server, &format!("/{query}"), &host, "");
    assert!(answer.starts_with("HTTP/1.1 303") && answer.contains("location: /\r\n"), "{answer}");
    let cookie = answer.split("set-cookie: ").nth(1).unwrap().split(';').next().unwrap();
    assert!(answer.contains("; HttpOnly; SameSite=Lax"), "{answer}");
    for cookies in [cookie.to_owned(), format!("other=1; {cookie}")] {
        let page = get(&server, "/", &host, &format!("Cookie: {cookies}\r\n"));
        assert!(page.starts_with("HTTP/1.1 200"), "{page}");
    }
    let other = get(&server, "/", &host, &format!("Cookie: {cookie}0\r\n"));
    assert!(other.starts_with("HTTP/1.1 403"), "{other}");
    let mut request = upgrade(&server, Some(&format!("http://{host}")));
    request.headers_mut().insert("Cookie", cookie.parse().unwrap());
    tungstenite::client(request, stream(&server)).unwrap();
}

/// Whoever listens for others has a token without asking for one.
#[test]
fn other_machines_need_the_token() {
    let settings = Settings { address: std::net::Ipv4Addr::UNSPECIFIED.into(), ..Settings::default() };
    let server = serve(&settings);
    assert!(server.url().contains("/?token="), "{}", server.url());
    let host = format!("127.0.0.1:{}", server.address().port());
    assert!(get(&server, "/", &host, "").starts_with("HTTP/1.1 403"));
    assert!(!serve(&Settings::default()).url().contains("token"));
}

#[test]
fn no_message_ends_a_session() {
    let server = serve(&Settings::default());
    let mut page = Page::open(&server);
    let deep =
        format!("{{\"id\":1,\"view\":\"fusion\",\"ask\":{}{}}}", "[".repeat(60_000), "]".repeat(60_000));
    let hostile = [
        "",
        "{",
        "null",
        "[]",
        "\"open\"",
        "{\"id\":1}",
        r#"{"id":1,"view":"nothing","ask":{"op":"open"}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"nothing"}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"open","more":1}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"open"},"more":1}"#,
        r#"{"id":-1,"view":"fusion","ask":{"op":"open"}}"#,
        r#"{"id":1e99,"view":"fusion","ask":{"op":"open"}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"step","scans":-1}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"step","scans":1e300}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"step","scans":NaN}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"step","scans":1.5}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"move_chair","to":[1e308,-1e308]}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"move_chair","to":[1e999,0]}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"watch","cell":[2147483647,-2147483648]}}"#,
        r#"{"id":1,"view":"fusion","ask":{"op":"export","file":"../../etc/passwd"}}"#,
        &deep,
    ];
    for text in hostile {
        page.send(text);
        let answer = page.answer();
        let head: String = text.chars().take(80).collect();
        assert!(
            answer["error"].as_str().is_some_and(|e| !e.is_empty() && e.len() < 1000),
            "{head}: {answer}"
        );
    }
    assert_eq!(page.step(3)["at"], 3);
}

#[test]
fn too_long_and_binary_messages_close_one_socket_only() {
    let server = serve(&Settings::default());
    let mut other = Page::open(&server);
    other.step(1);

    let mut page = Page::open(&server);
    // The server may close while this is still being sent.
    let _ = page.socket.send(Message::text("x".repeat(1 << 20)));
    let reason = page.closed();
    assert!(reason.is_none_or(|frame| frame.reason.contains("too long")));

    let mut page = Page::open(&server);
    page.socket.send(Message::binary(vec![0; 16])).unwrap();
    assert!(page.closed().unwrap().reason.contains("JSON"));

    // Bytes that are no frames at all.
    let page = Page::open(&server);
    let mut broken = page.socket.get_ref().try_clone().unwrap();
    broken.write_all(&[0xff; 64]).unwrap();
    page.closed();

    wait_until("their seats", || server.sessions() == 1);
    assert_eq!(other.step(1)["at"], 2);
}

#[test]
fn thousands_of_questions_at_once_are_answered_in_their_order() {
    let server = serve(&Settings::default());
    let mut page = Page::open(&server);
    let mut sender = tungstenite::WebSocket::from_raw_socket(
        page.socket.get_ref().try_clone().unwrap(),
        tungstenite::protocol::Role::Client,
        None,
    );
    let sending = std::thread::spawn(move || {
        for id in 0..5000 {
            let text = format!(r#"{{"id":{id},"view":"fusion","ask":{{"op":"watch","cell":null}}}}"#);
            sender.send(Message::text(text)).unwrap();
        }
    });
    for id in 0..5000 {
        assert_eq!(page.answer()["id"], id);
    }
    sending.join().unwrap();
}

#[test]
fn one_tab_too_many_is_told_why() {
    let server = serve(&Settings { sessions: 2, ..Settings::default() });
    let mut first = Page::open(&server);
    let mut second = Page::open(&server);
    first.step(1);
    second.step(1);
    for _ in 0..3 {
        // It asks at once, as the page does, and must still hear why.
        let mut third = Page::open(&server);
        third.send(r#"{"id":1,"view":"fusion","ask":{"op":"open"}}"#);
        let why = third.closed().unwrap();
        assert!(why.reason.contains("too many tabs"), "{why}");
    }
    assert_eq!((first.step(1)["at"].as_u64(), second.step(1)["at"].as_u64()), (Some(2), Some(2)));
    drop(first);
    wait_until("the first one's seat", || server.sessions() == 1);
    assert_eq!(Page::open(&server).step(1)["at"], 1);
}

#[test]
fn a_closed_tab_frees_its_seat_and_its_map() {
    let server = serve(&Settings::default());
    let mut pages: Vec<_> = (0..3).map(|_| Page::open(&server)).collect();
    for page in &mut pages {
        page.step(2);
    }
    let (sessions, bytes) = (server.sessions(), server.memory_bytes());
    assert_eq!(sessions, 3);
    assert!(bytes > 3 * 240 * 180 * 8, "{bytes}");

    // One says goodbye, one is cut off, one is closed while it is at work.
    pages[0].socket.close(None).unwrap();
    pages[1].socket.get_ref().shutdown(Shutdown::Both).unwrap();
    pages[2].send(r#"{"id":1,"view":"fusion","ask":{"op":"step","scans":256}}"#);
    drop(pages);
    wait_until("all seats", || server.sessions() == 0);
    assert_eq!(server.memory_bytes(), 0);
    assert_eq!(Page::open(&server).step(1)["at"], 1);
}

#[test]
fn sessions_do_not_see_each_other() {
    let server = serve(&Settings::default());
    let (mut a, mut b) = (Page::open(&server), Page::open(&server));
    b.ask("fusion", json!({ "op": "open" })).unwrap();
    assert_eq!(a.step(20)["at"], 20);
    let of_b = b.ask("fusion", json!({ "op": "open" })).unwrap();
    assert_eq!((of_b["at"].as_u64(), of_b["observed"].as_u64()), (Some(0), Some(0)));
    // The same scans make the same map.
    let (of_a, of_b) = (a.ask("fusion", json!({ "op": "open" })).unwrap(), b.step(20));
    for same in ["at", "observed", "beams", "pose"] {
        assert_eq!(of_a[same], of_b[same], "{same}");
    }
}

#[test]
fn a_map_that_is_too_large_is_refused_and_the_old_one_stays() {
    let server = serve(&Settings { limits: Limits { memory: 16 << 20 }, ..Settings::default() });
    let mut page = Page::open(&server);
    page.step(5);
    let before = page.ask("fusion", json!({ "op": "open" })).unwrap();
    let mut settings = before["all"]["settings"].clone();
    settings["resolution"] = json!(0.01);
    let refusal = page.ask("fusion", json!({ "op": "set", "settings": settings })).unwrap_err();
    assert!(refusal.contains("choose larger cells"), "{refusal}");
    let after = page.ask("fusion", json!({ "op": "open" })).unwrap();
    assert_eq!(after, before);
}

#[test]
fn whoever_keeps_the_server_waiting_is_given_up() {
    let patience = Duration::from_millis(500);
    let server = serve(&Settings { patience, ..Settings::default() });
    let start = Instant::now();

    // Half of a request, nothing at all, and a session that does not even answer pings.
    let mut half = stream(&server);
    half.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let mut silent = stream(&server);
    let gone = Page::open(&server);
    wait_until("the session", || server.sessions() == 1);
    for waiting in [&mut half, &mut silent] {
        let mut answer = Vec::new();
        let _ = waiting.read_to_end(&mut answer);
    }
    wait_until("its end", || server.sessions() == 0);
    assert!(start.elapsed() < SOON);
    drop(gone);
}

#[test]
fn many_idle_connections_do_not_keep_a_page_out() {
    // However patient it is with them.
    let patience = Duration::from_secs(600);
    let server = serve(&Settings { patience, ..Settings::default() });
    let mut session = Page::open(&server);
    session.step(1);
    let mut idle: Vec<_> = (0..300).map(|_| stream(&server)).collect();
    for connection in &mut idle[200..] {
        connection.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    }
    let start = Instant::now();
    assert_eq!(Page::open(&server).step(1)["at"], 1);
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    assert_eq!(session.step(1)["at"], 2, "a session is not idle");
    drop(idle);
}

#[test]
fn a_session_that_answers_pings_is_kept() {
    let patience = Duration::from_millis(200);
    let server = serve(&Settings { patience, ..Settings::default() });
    let mut page = Page::open(&server);
    page.step(1);
    page.socket.get_ref().set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let start = Instant::now();
    while start.elapsed() < 10 * patience {
        // Reading is what answers pings.
        let _ = page.socket.read();
    }
    page.socket.get_ref().set_read_timeout(Some(SOON)).unwrap();
    assert_eq!(page.step(1)["at"], 2);
}
