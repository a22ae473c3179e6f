//! The files of a bag that is a folder: rosbag2's, with its `metadata.yaml`, or a split one of any kind.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

use crate::{BagError, Result};

/// The file that describes a folder of rosbag2.
const METADATA: &str = "metadata.yaml";

/// The files of a bag.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Files {
    /// In the order in which they were recorded.
    pub(super) paths: Vec<PathBuf>,
    /// What the user should know.
    pub(super) notes: Vec<String>,
    /// Whether a description says that they belong together.
    pub(super) described: bool,
}

/// The files of a bag at `path`, which may be a file, a folder, or the `metadata.yaml` of a folder.
pub(super) fn files(path: &Path) -> Result<Files> {
    let metadata = path.file_name().is_some_and(|n| n == METADATA);
    let folder = match path.parent() {
        _ if path.is_dir() => path,
        Some(parent) if metadata => parent,
        _ => return Ok(Files { paths: vec![path.to_owned()], ..Files::default() }),
    };
    let there = bag_files(folder)?;
    let name = folder.display().to_string();
    if there.is_empty() {
        let reason = "holds no file .mcap, .db3 or .bag".to_owned();
        return Err(BagError::Refused { name, reason, advice: "name a bag, or the folder of one".into() });
    }
    let described = folder.join(METADATA);
    let Ok(text) = fs::read_to_string(&described) else {
        return without_description(name, there);
    };
    let named = relative_file_paths(&text);
    // rosbag2 names the files as they were before it compressed them in some versions.
    let find = |file: &String| there.iter().find(|p| belongs(p, file)).cloned();
    let found: Vec<Option<PathBuf>> = named.iter().map(find).collect();
    let missing: Vec<&str> =
        named.iter().zip(&found).filter(|(_, f)| f.is_none()).map(|(n, _)| n.as_str()).collect();
    let mut files = Files { described: true, ..Files::default() };
    files.paths = found.iter().flatten().cloned().collect();
    let described = described.display();
    if files.paths.is_empty() {
        let why = if named.is_empty() {
            format!("{described} names no files")
        } else {
            format!("{described} names {}, which is not there", missing.join(", "))
        };
        let mut files = without_description(name, there)?;
        let taken: Vec<String> = files.paths.iter().map(|p| file_name(p)).collect();
        files.notes.insert(0, format!("{why}: {} taken instead", taken.join(", ")));
        return Ok(files);
    }
    if !missing.is_empty() {
        files.notes.push(format!("{described} names {}, which is not there", missing.join(", ")));
    }
    let unnamed: Vec<String> =
        there.iter().filter(|p| !files.paths.contains(p)).map(|p| file_name(p)).collect();
    if !unnamed.is_empty() {
        files.notes.push(format!("{described} does not name {}: left out", unnamed.join(", ")));
    }
    Ok(files)
}

/// Whether a folder holds files with the names of bags, at least one; what they are is seen when they are opened.
pub fn holds_bags(folder: &Path) -> bool {
    bag_files(folder).is_ok_and(|files| !files.is_empty())
}

/// All bags of the folder, as one that was split.
fn without_description(name: String, paths: Vec<PathBuf>) -> Result<Files> {
    let mut kinds: Vec<String> = paths.iter().filter_map(|p| bag_ending(&file_name(p))).collect();
    kinds.sort();
    kinds.dedup();
    if kinds.len() > 1 {
        let reason = format!("holds bags of several kinds (.{})", kinds.join(", ."));
        let advice = "they may be one run twice: name one of the files".into();
        return Err(BagError::Refused { name, reason, advice });
    }
    let mut notes = Vec::new();
    if paths.len() > 1 {
        notes.push(format!("{name}: its {} bags are read as one that was split", paths.len()));
    }
    Ok(Files { paths, notes, described: false })
}

/// The bags in a folder, in the order of their names and the numbers in them; hidden files are not looked at.
fn bag_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |cause| BagError::Os { name: folder.display().to_string(), action: "list it", cause };
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = file_name(&path);
        if !name.starts_with('.') && bag_ending(&name).is_some() && path.is_file() {
            paths.push(path);
        }
    }
    paths.sort_by(|a, b| natural(&file_name(a), &file_name(b)));
    Ok(paths)
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The ending that a bag's name has, without that of its compression.
fn bag_ending(name: &str) -> Option<String> {
    let lower = name.to_ascii_lowercase();
    let lower = lower.strip_suffix(".zstd").or(lower.strip_suffix(".zst")).unwrap_or(&lower);
    let (_, ending) = lower.rsplit_once('.')?;
    ["mcap", "db3", "bag"].contains(&ending).then(|| ending.to_owned())
}

/// Whether the file is the one that the description names: by its last part, with or without the ending of compression.
fn belongs(path: &Path, named: &str) -> bool {
    let plain = |name: &str| name.strip_suffix(".zstd").unwrap_or(name).to_owned();
    let named = named.rsplit(['/', '\\']).next().unwrap_or(named);
    plain(&file_name(path)) == plain(named)
}

/// The list `relative_file_paths` of a description: the only part that is needed, for files tell the rest themselves.
fn relative_file_paths(text: &str) -> Vec<String> {
    let clean = |item: &str| item.trim().trim_matches(|c| c == '"' || c == '\'').to_owned();
    let mut lines = text.lines().map(str::trim);
    let Some(rest) = lines.find_map(|line| line.strip_prefix("relative_file_paths:")) else {
        return Vec::new();
    };
    if let Some(inline) = rest.trim().strip_prefix('[') {
        let items = inline.trim_end().trim_end_matches(']').split(',');
        return items.map(clean).filter(|item| !item.is_empty()).collect();
    }
    let items = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    items.map_while(|line| line.strip_prefix("- ").map(clean)).collect()
}

/// The order of names with numbers: `run_2` before `run_10`.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a.chars().peekable(), b.chars().peekable());
    loop {
        match (x.peek().copied(), y.peek().copied()) {
            (Some(c), Some(d)) if c.is_ascii_digit() && d.is_ascii_digit() => {
                let (m, n) = (digits(&mut x), digits(&mut y));
                match m.len().cmp(&n.len()).then(m.cmp(&n)) {
                    Ordering::Equal => {}
                    order => return order,
                }
            }
            (Some(c), Some(d)) if c == d => drop((x.next(), y.next())),
            (c, d) => return c.cmp(&d).then(a.cmp(b)),
        }
    }
}

/// The number at the front, without leading zeros.
fn digits(characters: &mut std::iter::Peekable<std::str::Chars<'_>>) -> String {
    let mut number = String::new();
    while let Some(c) = characters.next_if(char::is_ascii_digit) {
        if c != '0' || !number.is_empty() {
            number.push(c);
        }
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str], metadata: Option<&str>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        names.iter().for_each(|n| fs::write(folder.path().join(n), b"x").unwrap());
        metadata.iter().for_each(|text| fs::write(folder.path().join(METADATA), text).unwrap());
        folder
    }

    fn found(folder: &tempfile::TempDir) -> (Vec<String>, usize) {
        let files = files(folder.path()).unwrap();
        (files.paths.iter().map(|p| file_name(p)).collect(), files.notes.len())
    }

    const HEAD: &str = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n";

    #[test]
    fn files_come_in_the_order_of_their_numbers() {
        let all = folder(&["r_10.bag", "r_9.bag", "r_009b.bag", ".r_1.bag", "notes.txt"], None);
        assert_eq!(found(&all), (vec!["r_9.bag".into(), "r_009b.bag".into(), "r_10.bag".into()], 1));
        assert_eq!(natural("a_02", "a_2"), Ordering::Less);
        assert_eq!(natural("a", "a"), Ordering::Equal);
    }

    #[test]
    fn the_description_decides_and_what_differs_is_told() {
        let text = format!("{HEAD}    - b_1.db3\n    - \"old/b_0.db3\"\n  duration:\n    nanoseconds: 1\n");
        assert_eq!(
            found(&folder(&["b_0.db3.zstd", "b_1.db3"], Some(&text))),
            (vec!["b_1.db3".into(), "b_0.db3.zstd".into()], 0)
        );
        // One is missing and another one is not named.
        assert_eq!(found(&folder(&["b_1.db3", "c.mcap"], Some(&text))), (vec!["b_1.db3".into()], 2));
        // None is there: what is there is taken.
        assert_eq!(found(&folder(&["mine.db3"], Some(&text))), (vec!["mine.db3".into()], 1));
        assert_eq!(found(&folder(&["mine.db3"], Some("a: 1\n"))), (vec!["mine.db3".into()], 1));
        let inline = "  relative_file_paths: [b_1.db3, 'b_0.db3']\n";
        let both = folder(&["b_0.db3", "b_1.db3"], Some(inline));
        assert_eq!(found(&both), (vec!["b_1.db3".into(), "b_0.db3".into()], 0));
        assert!(files(&both.path().join(METADATA)).unwrap().described);
        assert!(holds_bags(both.path()) && !holds_bags(folder(&["a.txt"], Some(inline)).path()));
        assert!(!holds_bags(&both.path().join("b_0.db3")));
    }

    #[test]
    fn a_run_is_not_taken_twice_and_nothing_is_an_error() {
        let error = files(folder(&["run.bag", "run.mcap"], None).path()).unwrap_err().to_string();
        assert!(error.contains("several kinds (.bag, .mcap)"), "{error}");
        let error = files(folder(&["run.txt"], None).path()).unwrap_err().to_string();
        assert!(error.contains("holds no file"), "{error}");
    }
}
