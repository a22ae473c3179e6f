//! Every citation in code and documents is in `docs/REFERENCES.md`, and every work listed there is cited.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Surnames and year, as in `["Curless", "Levoy", "1996"]`; `["Hornung", "et al.", "2013"]` for more than three authors.
type Work = Vec<String>;

const LIST: &str = "docs/REFERENCES.md";
const MONTHS: [&str; 12] = [
    "January",
    "February",
    "March",
    "April",
    "May",
    "June",
    "July",
    "August",
    "September",
    "October",
    "November",
    "December",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Source files and documents under a folder, without build outputs and vendored files.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !(name.starts_with('.') || matches!(&*name, "target" | "vendor" | "node_modules" | "record")) {
                files(&path, found);
            }
        } else if name != "references.rs" && [".rs", ".md"].iter().any(|end| name.ends_with(end)) {
            found.push(path);
        }
    }
}

/// The prose of a file on one line: of code the comments, of documents everything.
fn prose(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    if path.extension().is_some_and(|e| e == "md") {
        return text.replace('\n', " ");
    }
    let comment =
        |line: &str| Some(line.split_once("//")?.1.trim_start_matches(['/', '!']).trim().to_owned());
    text.lines().filter_map(comment).collect::<Vec<_>>().join(" ")
}

fn is_year(word: &str) -> bool {
    word.len() == 4 && word.parse().is_ok_and(|year: u32| (1900..2100).contains(&year))
}

fn is_name(word: &str) -> bool {
    let mut letters = word.chars();
    letters.next().is_some_and(char::is_uppercase)
        && letters.next().is_some_and(char::is_lowercase)
        && letters.all(|c| c.is_alphabetic() || c == '-')
        && !MONTHS.contains(&word)
}

/// All works cited in a text: a year directly after a name, "et al." or the last of several names.
fn citations(text: &str) -> BTreeSet<Work> {
    let spaced = text.replace(',', " , ").replace(['(', ')', '*', ';', ':', '|', '`', '"'], " ");
    let words: Vec<&str> = spaced.split_whitespace().map(|w| w.trim_end_matches('.')).collect();
    (0..words.len()).filter(|&i| is_year(words[i])).filter_map(|i| authors(&words[..i], words[i])).collect()
}

/// The authors whose names end a list of words.
fn authors(words: &[&str], year: &str) -> Option<Work> {
    if let [.., name, "et", "al"] = words {
        return is_name(name).then(|| vec![(*name).into(), "et al.".into(), year.into()]);
    }
    let (last, mut rest) = words.split_last()?;
    let mut work = vec![(*last).to_owned(), year.to_owned()];
    if !is_name(last) {
        return None;
    }
    while let [before @ .., name, "&" | "and" | ","] = rest {
        if !is_name(name) {
            break;
        }
        work.insert(0, (*name).to_owned());
        rest = before;
    }
    Some(work)
}

/// The works of the list, each by its bold key; the rest of the list is prose that cites.
fn listed() -> (BTreeSet<Work>, String) {
    let text = std::fs::read_to_string(root().join(LIST)).unwrap();
    let (entries, other): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with("- **"));
    let keys: Vec<&str> = entries.iter().map(|line| line.split("**").nth(1).unwrap()).collect();
    assert!(keys.is_sorted(), "{LIST} is not in alphabetical order");
    let works: BTreeSet<Work> = keys.iter().flat_map(|key| citations(key)).collect();
    assert_eq!(works.len(), keys.len(), "{LIST} has a key that is no citation, or the same one twice");
    (works, other.join(" "))
}

/// Where each work is cited first.
fn cited(prose_of_list: &str) -> BTreeMap<Work, PathBuf> {
    let mut found = Vec::new();
    for folder in ["crates", "docs"] {
        files(&root().join(folder), &mut found);
    }
    found.extend(["README.md", "ARCHITECTURE.md", "BENCHMARK.md"].map(|name| root().join(name)));
    found.retain(|path| !path.ends_with(LIST));
    found.sort();
    let mut cited = BTreeMap::new();
    for path in found {
        for work in citations(&prose(&path)) {
            cited.entry(work).or_insert_with(|| path.clone());
        }
    }
    for work in citations(prose_of_list) {
        cited.entry(work).or_insert_with(|| LIST.into());
    }
    cited
}

#[test]
fn the_scanner_finds_the_forms_in_use() {
    let text = "A filter (Curless & Levoy 1996, section 3) *(Mildenhall et al. 2020; Max 1995)*, after Felzenszwalb & \
                Huttenlocher (2012), *(Steele, Lea, Flood 2014)*; Nguyen, Izadi and Lovell 2012. No citation: rustc 1.95, \
                November 2026, 1 January 1980, range 2000.0, OOPSLA 2014, the 2012 paper.";
    let found: Vec<String> = citations(text).iter().map(|work| work.join(" ")).collect();
    let expected = [
        "Curless Levoy 1996",
        "Felzenszwalb Huttenlocher 2012",
        "Max 1995",
        "Mildenhall et al. 2020",
        "Nguyen Izadi Lovell 2012",
        "Steele Lea Flood 2014",
    ];
    assert_eq!(found, expected);
}

#[test]
fn every_citation_is_listed_and_every_listed_work_is_cited() {
    let (listed, prose) = listed();
    let cited = cited(&prose);
    assert!(cited.len() > 50, "the scanner finds only {} works", cited.len());
    let missing: Vec<_> = cited.iter().filter(|(work, _)| !listed.contains(*work)).collect();
    assert!(missing.is_empty(), "cited, but not in {LIST}: {missing:#?}");
    let unused: Vec<_> = listed.iter().filter(|work| !cited.contains_key(*work)).collect();
    assert!(unused.is_empty(), "in {LIST}, but cited nowhere: {unused:#?}");
}
