//! The files of a folder in the order of their numbers.

use std::cmp::Ordering;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::{IoError, Result};

/// The most files of a folder that are looked at.
const MOST_FILES: usize = 1 << 21;

/// The names in a folder for which `wanted` is true, in natural order (`scan2` before `scan10`). Hidden files are passed over:
/// file managers leave `._NAME` beside every `NAME`.
///
/// # Errors
/// [`IoError::Os`] where the folder cannot be read, [`IoError::Layout`] for one with millions of files.
pub(crate) fn names_in(folder: &Path, wanted: impl Fn(&str) -> bool) -> Result<Vec<String>> {
    let mut names = Vec::new();
    let entries = std::fs::read_dir(folder).map_err(|e| IoError::os(folder, "list it", e))?;
    for (i, entry) in entries.enumerate() {
        if i == MOST_FILES {
            let value = format!("more than {MOST_FILES}");
            return Err(IoError::layout(folder, "the number of files", value, "split the folder"));
        }
        let entry = entry.map_err(|e| IoError::os(folder, "list it", e))?;
        // The names of all formats are Unicode.
        if let Ok(name) = entry.file_name().into_string()
            && is_shown(&name)
            && wanted(&name)
        {
            names.push(name);
        }
    }
    names.sort_by(|a, b| natural_order(a, b));
    Ok(names)
}

/// Whether a folder has a name for which `wanted` is true. `false` for a path that is not a folder.
pub(crate) fn has_name(folder: &Path, wanted: impl Fn(&str) -> bool) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    let is_it = |name: &str| is_shown(name) && wanted(name);
    entries.take(MOST_FILES).flatten().any(|entry| entry.file_name().to_str().is_some_and(is_it))
}

fn is_shown(name: &str) -> bool {
    !name.starts_with('.')
}

/// Whether a name ends like this, in capitals or not.
pub(crate) fn has_extension(name: &str, extension: &str) -> bool {
    let at = name.len().checked_sub(extension.len() + 1);
    at.and_then(|at| name.get(at..))
        .is_some_and(|end| end.starts_with('.') && end[1..].eq_ignore_ascii_case(extension))
}

/// The last run of digits before the first dot of a name: `frame-000003.depth.png` has 3.
pub(crate) fn number_in(name: &str) -> Option<u64> {
    let stem = name.split('.').next()?;
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |i| {
        // The character before the digits may have several bytes.
        i + stem[i..].chars().next().map_or(1, char::len_utf8)
    });
    stem[start..end].parse().ok()
}

/// The name of a log for people: of its folder or file.
pub(crate) fn name_of(path: &Path) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| PathBuf::from(path));
    absolute.file_name().unwrap_or(OsStr::new("log")).to_string_lossy().into_owned()
}

/// Runs of digits compare as numbers, the rest as bytes.
fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a.as_bytes(), b.as_bytes());
    while let (Some(p), Some(q)) = (x.first(), y.first()) {
        let order = if p.is_ascii_digit() && q.is_ascii_digit() {
            let (m, n) = (digits(&mut x), digits(&mut y));
            m.len().cmp(&n.len()).then(m.cmp(n))
        } else {
            (x, y) = (&x[1..], &y[1..]);
            p.cmp(q)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    // Names that differ only in leading zeros still need an order.
    x.len().cmp(&y.len()).then(a.cmp(b))
}

/// Takes the digits at the start, and returns them without leading zeros.
fn digits<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let end = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    let (run, rest) = text.split_at(end);
    *text = rest;
    let zeros = run.iter().take_while(|b| **b == b'0').count();
    &run[zeros..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_files_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["0.bin", "._0.bin", ".DS_Store"] {
            std::fs::write(folder.path().join(name), b"").unwrap();
        }
        assert_eq!(names_in(folder.path(), |_| true).unwrap(), ["0.bin"]);
        assert!(!has_name(folder.path(), |name| name.contains("DS")) && has_name(folder.path(), |_| true));
    }

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names = ["full10.pcd", "full2.pcd", "full010.pcd", "a", "full.pcd", "full2b.pcd", "full02"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(
            names,
            ["a", "full.pcd", "full02", "full2.pcd", "full2b.pcd", "full010.pcd", "full10.pcd"]
        );
        for (name, number) in [
            ("frame-000003.depth.png", Some(3)),
            ("full10.pcd", Some(10)),
            ("é7ü.x9", Some(7)),
            ("é7", Some(7)),
            ("none.9", None),
            ("99999999999999999999999.png", None),
            ("", None),
        ] {
            assert_eq!(number_in(name), number, "{name}");
        }
        assert!(has_extension("a.PNG", "png") && !has_extension("png", "png") && !has_extension("é", "png"));
    }
}
