//! A word that whoever may use the studio knows: it is in the address that is printed, and in a cookie from then on.
//!
//! The page asks for its files and its socket by plain names; so the address with the word gives a cookie and leads on to the
//! plain address.

use std::hash::{BuildHasher, RandomState};

use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// The word, and the cookie that holds it.
pub(super) struct Token {
    word: String,
    cookie: String,
}

impl Token {
    /// A new one, for a studio at this port: browsers do not tell ports apart when they send cookies.
    pub(super) fn random(port: u16) -> Self {
        // A keyed hash (SipHash) whose key is from the system's source of randomness: 128 bits.
        let keyed = RandomState::new();
        let word = format!("{:016x}{:016x}", keyed.hash_one(port), keyed.hash_one((port, "more")));
        Self { word, cookie: format!("portolan_{port}") }
    }

    /// What stands behind the address.
    pub(super) fn query(&self) -> String {
        format!("?token={}", self.word)
    }

    /// The answer to a request without the right cookie; `None`: it has it.
    pub(super) fn refusal(&self, request: &Request) -> Option<Response> {
        if self.is_in_cookies(request.headers()) {
            return None;
        }
        let given = request.uri().query().and_then(|query| query.strip_prefix("token="));
        if request.uri().path() == "/" && given.is_some_and(|word| same(word, &self.word)) {
            let cookie = format!("{}={}; HttpOnly; SameSite=Lax; Path=/", self.cookie, self.word);
            let headers = [(header::SET_COOKIE, cookie), (header::LOCATION, "/".to_owned())];
            return Some((StatusCode::SEE_OTHER, headers).into_response());
        }
        let why = "this studio is open to those who have its address with the token; it was printed when it started\n";
        Some((StatusCode::FORBIDDEN, why).into_response())
    }

    fn is_in_cookies(&self, headers: &HeaderMap) -> bool {
        let all = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        all.flat_map(|value| value.split(';')).any(|pair| {
            let word = pair.trim().strip_prefix(self.cookie.as_str()).and_then(|rest| rest.strip_prefix('='));
            word.is_some_and(|word| same(word, &self.word))
        })
    }
}

/// Whether two words are the same, in a time that does not tell where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_are_the_same() {
        let words: std::collections::HashSet<_> = (0..1000).map(|_| Token::random(7700).word).collect();
        assert_eq!(words.len(), 1000);
        assert!(words.iter().all(|word| word.len() == 32));
        assert!(same("ab", "ab") && !same("ab", "aB") && !same("ab", "abc"));
    }
}
