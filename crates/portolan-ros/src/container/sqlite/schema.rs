//! The tables of a database and the order of their columns.

use std::collections::HashMap;

use super::super::reader::FileReader;
use super::pages::Pages;
use super::record::{Value, columns, value};
use crate::{BagError, Result};

/// A table.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// Its first page.
    pub(super) root: u64,
    /// Its columns in the order of its rows, in small letters.
    pub(super) columns: Vec<String>,
    /// The column that is the row's number, which rows leave empty.
    rowid: Option<usize>,
}

impl Table {
    /// The place of a column in rows.
    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }

    /// Whether the column is the row's number.
    pub(super) fn is_rowid(&self, column: usize) -> bool {
        self.rowid == Some(column)
    }
}

/// The tables by name; `damage` as in [`Pages::leaves`].
pub(super) fn tables(
    pages: &Pages,
    reader: &mut FileReader,
    damage: impl FnMut(BagError) -> Result<()>,
) -> Result<HashMap<String, Table>> {
    let mut tables = HashMap::new();
    pages.leaves(reader, 1, damage, |reader, leaf, rows| {
        for row in 0..rows {
            let cell = pages.cell(reader, leaf, row)?;
            let found = columns(pages, reader, leaf, &cell)?;
            let mut get = |i: usize| value(pages, reader, leaf, &cell, found.get(i));
            let (kind, name, root, sql) = (get(0)?, get(1)?, get(3)?, get(4)?);
            let (Value::Text(kind), Value::Text(name), Value::Integer(root), Value::Text(sql)) =
                (kind, name, root, sql)
            else {
                continue;
            };
            if kind == "table"
                && let Ok(root) = u64::try_from(root)
                && let Some((columns, rowid)) = column_names(&sql)
            {
                tables.insert(name.to_ascii_lowercase(), Table { root, columns, rowid });
            }
        }
        Ok(())
    })?;
    Ok(tables)
}

/// The columns that `CREATE TABLE` names and which of them is the row's number; `None`: not understood, or with computed
/// columns, which rows do not hold.
fn column_names(sql: &str) -> Option<(Vec<String>, Option<usize>)> {
    let (mut names, mut rowid) = (Vec::new(), None);
    for words in definitions(sql)? {
        let first = words.first()?;
        let upper: Vec<String> = words.iter().map(|w| w.to_ascii_uppercase()).collect();
        if ["CONSTRAINT", "PRIMARY", "UNIQUE", "CHECK", "FOREIGN"].contains(&upper[0].as_str()) {
            if upper[0] == "PRIMARY" || upper.get(2).is_some_and(|w| w == "PRIMARY") {
                // PRIMARY KEY(id) of an INTEGER column is the row's number as well: rosbag2 writes it at the column.
                return None;
            }
            continue;
        }
        if upper.iter().any(|w| w == "GENERATED" || w == "AS") {
            return None;
        }
        if upper.get(1).is_some_and(|w| w == "INTEGER") && upper.windows(2).any(|w| w == ["PRIMARY", "KEY"]) {
            rowid = Some(names.len());
        }
        names.push(first.trim_matches(|c| "\"`'[]".contains(c)).to_ascii_lowercase());
    }
    Some((names, rowid))
}

/// The words of each definition between the outer parentheses; those in inner ones are left out.
fn definitions(sql: &str) -> Option<Vec<Vec<String>>> {
    let (mut all, mut words, mut word) = (Vec::new(), Vec::new(), String::new());
    let (mut depth, mut characters) = (0usize, sql.chars().peekable());
    while let Some(c) = characters.next() {
        let mut ends = true;
        match c {
            '-' if characters.peek() == Some(&'-') => {
                characters.by_ref().find(|c| *c == '\n');
            }
            '/' if characters.peek() == Some(&'*') => {
                characters.next();
                let mut last = ' ';
                characters.by_ref().find(|c| std::mem::replace(&mut last, *c) == '*' && *c == '/')?;
            }
            '"' | '`' | '\'' | '[' => {
                let close = if c == '[' { ']' } else { c };
                let text: String = characters.by_ref().take_while(|c| *c != close).collect();
                if depth == 1 {
                    word.push(c);
                    word.push_str(&text);
                }
                ends = false;
            }
            '(' => depth += 1,
            ')' if depth <= 1 => {
                if !word.is_empty() {
                    words.push(word);
                }
                all.push(words);
                return Some(all);
            }
            ')' => depth -= 1,
            c if c.is_whitespace() || (c == ',' && depth == 1) => {}
            c => {
                if depth == 1 {
                    word.push(c);
                }
                ends = false;
            }
        }
        if ends && !word.is_empty() {
            words.push(std::mem::take(&mut word));
        }
        if c == ',' && depth == 1 {
            all.push(std::mem::take(&mut words));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_in_any_spelling() {
        let names = |sql: &str| column_names(sql).map(|(n, r)| (n.join(" "), r));
        let is = |sql: &str, columns: &str, rowid| {
            assert_eq!(names(sql), Some((columns.to_owned(), rowid)), "{sql}")
        };
        is(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL)",
            "id topic_id timestamp data",
            Some(0),
        );
        is(
            "CREATE TABLE \"m s\" ( -- a comment, with a comma\n [Data] BLOB, \"topic_id\" INTEGER /* ( */, x DECIMAL(10,5) DEFAULT (1,2), `Id` integer primary key autoincrement, CHECK (x > 0), UNIQUE (x, data))",
            "data topic_id x id",
            Some(3),
        );
        is("CREATE TABLE t(id INT PRIMARY KEY, b)", "id b", None);
        for refused in [
            "CREATE TABLE t(a INTEGER, b INTEGER GENERATED ALWAYS AS (a + 1))",
            "CREATE TABLE t(a INTEGER, PRIMARY KEY(a))",
            "CREATE TABLE t(a /* never closed",
            "CREATE TABLE t",
            "",
        ] {
            assert_eq!(names(refused), None, "{refused}");
        }
    }
}
