//! `docs/EXERCISES.md`, read as sections of tables.

use std::path::Path;

/// The rows `| what | value |` of the section of an exercise, headers left out.
fn rows_of(page: &str, exercise: u32) -> Vec<(String, String)> {
    let start =
        page.find(&format!("\n## {exercise}. ")).unwrap_or_else(|| panic!("no section {exercise}")) + 1;
    let section = page[start..].split("\n## ").next().unwrap();
    let cells = |line: &str| -> Option<(String, String)> {
        let (what, value) = line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | ")?;
        Some((what.trim().to_owned(), value.trim().to_owned()))
    };
    let lines: Vec<&str> = section.lines().collect();
    // A header is the line above a rule.
    let is_header = |i: usize| lines.get(i + 1).is_some_and(|next| next.starts_with("|-"));
    (0..lines.len()).filter(|&i| !is_header(i)).filter_map(|i| cells(lines[i])).collect()
}

/// Holds the page's tables of an exercise to what was computed: the same rows in the same order.
pub(crate) fn check(exercise: u32, computed: &[(impl ToString, String)]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/EXERCISES.md");
    let page = std::fs::read_to_string(path).unwrap();
    let computed: Vec<_> = computed.iter().map(|(what, value)| (what.to_string(), value.clone())).collect();
    if rows_of(&page, exercise) != computed {
        let lines: String = computed.iter().map(|(what, value)| format!("| {what} | {value} |\n")).collect();
        panic!("docs/EXERCISES.md, exercise {exercise}, is not what was computed, in this order:\n{lines}");
    }
}

pub(crate) fn mm(metres: f64) -> String {
    format!("{:.2} mm", 1e3 * metres)
}

pub(crate) fn cm(metres: f64) -> String {
    format!("{:.2} cm", 1e2 * metres)
}

#[test]
fn rows_are_those_of_their_own_section() {
    let page = "# Page\n\n## 1. One\n\n| a | b |\n|---|---|\n| x | 1 |\n\ntext | x\n\n## 2. Two\n\n| a | b |\n|---|---|\n| y | 2 | 3 |\n";
    assert_eq!(rows_of(page, 1), [("x".to_owned(), "1".to_owned())]);
    assert_eq!(rows_of(page, 2), [("y".to_owned(), "2 | 3".to_owned())]);
}
