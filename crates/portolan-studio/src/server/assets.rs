//! The page: its files are in the binary. Debug builds read them from the folder, so that a reload shows an edit.

use std::borrow::Cow;

use axum::http::{Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};

/// Paths in `page/` with the content of each file, in the order of their paths; `build.rs` makes the table.
const FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// A file of the page.
pub(super) async fn serve(method: Method, uri: Uri) -> Response {
    if method != Method::GET && method != Method::HEAD {
        return StatusCode::METHOD_NOT_ALLOWED.into_response();
    }
    let path = match uri.path().trim_start_matches('/') {
        "" => "index.html",
        path => path,
    };
    match read(path) {
        Some(bytes) => ([(header::CONTENT_TYPE, kind(path))], bytes).into_response(),
        None => (StatusCode::NOT_FOUND, "the studio has no such file\n").into_response(),
    }
}

/// The content of a file; `None` for a path that is not in the table.
fn read(path: &str) -> Option<Cow<'static, [u8]>> {
    let (_, bytes) = FILES.iter().find(|(p, _)| *p == path)?;
    #[cfg(debug_assertions)]
    if let Ok(edited) = std::fs::read(folder().join(path)) {
        return Some(edited.into());
    }
    Some((*bytes).into())
}

#[cfg(any(debug_assertions, test))]
fn folder() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("page")
}

fn kind(path: &str) -> &'static str {
    match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        _ => "text/plain; charset=utf-8",
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn walk(folder: &Path, prefix: &str, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
            if entry.file_type().unwrap().is_dir() {
                walk(&entry.path(), &format!("{name}/"), found);
            } else {
                found.push(name);
            }
        }
    }

    #[test]
    fn the_table_holds_every_file_of_the_page() {
        let mut found = Vec::new();
        walk(&folder(), "", &mut found);
        found.sort();
        let listed: Vec<_> = FILES.iter().map(|(path, _)| path.to_string()).collect();
        assert_eq!(listed, found, "the files of page/ in order");
        for (path, bytes) in FILES {
            assert_eq!(read(path).as_deref(), Some(*bytes), "{path}");
        }
    }

    #[test]
    fn paths_out_of_the_page_are_not_found() {
        for path in ["../Cargo.toml", "page/index.html", "/etc/passwd", ""] {
            assert!(read(path).is_none(), "{path}");
        }
    }
}
