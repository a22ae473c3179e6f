//! Who may ask: pages that came from here, under a name that means this machine.
//!
//! A page of another site can open connections to 127.0.0.1, too, and a name of its own can be made to point here
//! (DNS rebinding). The browser sends in `Host` which name was asked for and in `Origin` whose page asks.

use std::net::IpAddr;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::Shared;

/// Nothing from anywhere else, nothing inline but styles that scripts set.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: \
     data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Refuses what was asked for under another name or by another site's page; adds what keeps the page to itself.
pub(super) async fn check(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    if let Err(why) = allowed(request.headers(), shared.address.ip(), shared.address.port()) {
        return (StatusCode::FORBIDDEN, why).into_response();
    }
    if let Some(refusal) = shared.token.as_ref().and_then(|token| token.refusal(&request)) {
        return refusal;
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    let mut set = |name, value| headers.insert(name, HeaderValue::from_static(value));
    set(header::CONTENT_SECURITY_POLICY, POLICY);
    set(header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    set(header::REFERRER_POLICY, "no-referrer");
    set(header::CACHE_CONTROL, "no-cache");
    response
}

fn allowed(headers: &HeaderMap, ip: IpAddr, port: u16) -> Result<(), &'static str> {
    let host =
        headers.get(header::HOST).and_then(|h| h.to_str().ok()).ok_or("the Host header is missing\n")?;
    if !names_this_machine(host, ip, port) {
        return Err("the studio is not known under this name; open it under the address that it printed\n");
    }
    match headers.get(header::ORIGIN).map(|o| o.to_str().ok().and_then(|o| o.strip_prefix("http://"))) {
        None => Ok(()),
        // The page that was asked for under this very name: another server of this machine may be a stranger's.
        Some(Some(origin)) if origin.eq_ignore_ascii_case(host) => Ok(()),
        Some(_) => Err("pages of other sites may not drive the studio\n"),
    }
}

/// Whether `host` is a loopback name, or the address that the server listens at, with the right port.
fn names_this_machine(host: &str, ip: IpAddr, port: u16) -> bool {
    let Some(name) = host.strip_suffix(&format!(":{port}")).or((port == 80).then_some(host)) else {
        return false;
    };
    if name.eq_ignore_ascii_case("localhost") {
        return true;
    }
    let literal = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name);
    match literal.parse::<IpAddr>() {
        // Told to listen at every address: any of them, but still no names.
        Ok(_) if ip.is_unspecified() => true,
        Ok(named) => named.is_loopback() || named == ip,
        Err(_) => false,
    }
}

/// The same for a socket, which must have an `Origin`: browsers always send one.
pub(super) fn has_origin(headers: &HeaderMap) -> bool {
    headers.contains_key(header::ORIGIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;

    fn ask(host: &str, origin: Option<&str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        allowed(&headers, Ipv4Addr::LOCALHOST.into(), 7700).is_ok()
    }

    #[test]
    fn only_this_machines_names_and_pages() {
        assert!(ask("127.0.0.1:7700", None));
        assert!(ask("localhost:7700", Some("http://localhost:7700")));
        assert!(ask("[::1]:7700", Some("http://[::1]:7700")));
        assert!(ask("Localhost:7700", Some("http://localhost:7700")));
        assert!(!ask("[::1]:7700", Some("http://127.0.0.1:7700")));
        assert!(!ask("localhost:7700", Some("http://127.0.0.1:7700")));
        for host in
            ["evil.example:7700", "127.0.0.1:80", "127.0.0.1", "localhost.evil.example:7700", "10.0.0.1:7700"]
        {
            assert!(!ask(host, None), "{host}");
        }
        for origin in
            ["http://evil.example", "https://127.0.0.1:7700", "null", "http://localhost:7701", "http://"]
        {
            assert!(!ask("127.0.0.1:7700", Some(origin)), "{origin}");
        }
    }

    #[test]
    fn everywhere_means_addresses_and_no_names() {
        let everywhere: IpAddr = Ipv4Addr::UNSPECIFIED.into();
        assert!(names_this_machine("192.168.1.4:7700", everywhere, 7700));
        assert!(!names_this_machine("evil.example:7700", everywhere, 7700));
        // A page at another address, be it one of ours, is another site.
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, "192.168.1.4:7700".parse().unwrap());
        for (origin, fits) in [("http://192.168.1.4:7700", true), ("http://6.6.6.6:7700", false)] {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
            assert_eq!(allowed(&headers, everywhere, 7700).is_ok(), fits, "{origin}");
        }
    }
}
