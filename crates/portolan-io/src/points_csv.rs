//! Points to ask at, as CSV.

use std::path::Path;

use crate::bytes::{Input, Lines, open, parse_f64};
use crate::error::shown;
use crate::{IoError, Result};

/// The most points of a file.
const MOST_POINTS: usize = 1 << 25;

/// Query points (meters), 2-D or 3-D as the file has them.
#[derive(Clone, Debug, PartialEq)]
pub enum QueryPoints {
    /// `x,y`
    Two(Vec<[f64; 2]>),
    /// `x,y,z`
    Three(Vec<[f64; 3]>),
}

impl QueryPoints {
    /// Reads a file: `x,y` or `x,y,z` per line, in meters; `#` starts a comment, blank lines are ignored, a
    /// first line `x,y` or `x,y,z` in letters is a header.
    ///
    /// # Errors
    /// [`IoError::Text`] with line, field and value.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::parse(open(path)?)
    }

    /// [`QueryPoints::read`] from any input (standard input).
    ///
    /// # Errors
    /// As [`QueryPoints::read`].
    pub fn parse(input: Input) -> Result<Self> {
        let mut lines = Lines::of(input);
        let path = lines.path().to_owned();
        let (mut two, mut three) = (Vec::new(), Vec::new());
        let mut columns = None;
        while let Some((number, line)) = lines.next_numbered()? {
            let content = line.split(|b| *b == b'#').next().unwrap_or(&[]);
            // A byte order mark, as spreadsheets write it.
            let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content).trim_ascii();
            if content.is_empty() {
                continue;
            }
            let (first, words) = (columns.is_none(), content.split(|b| *b == b',').map(<[u8]>::trim_ascii));
            let count = words.clone().take(9).count();
            if !(2..=3).contains(&count) || columns.is_some_and(|c| c != count) {
                let expected = columns.map_or("2 (x,y) or 3 (x,y,z)".to_owned(), |c| format!("{c} as above"));
                let advice = format!("write {expected}, separated by commas");
                return Err(IoError::text(&path, number, "the number of fields", count, advice));
            }
            columns = Some(count);
            let mut names = words.clone().zip([b"x", b"y", b"z"]);
            if first && names.all(|(w, name)| w.eq_ignore_ascii_case(name)) {
                continue;
            }
            let mut p = [0.0; 3];
            for ((value, word), name) in p.iter_mut().zip(words).zip(["x", "y", "z"]) {
                *value = parse_f64(word).filter(|v| v.is_finite()).ok_or_else(|| {
                    IoError::text(&path, number, name, shown(word), "write a finite number (metres)")
                })?;
            }
            match count {
                2 => two.push([p[0], p[1]]),
                _ => three.push(p),
            }
            if two.len().max(three.len()) > MOST_POINTS {
                let value = format!("more than {MOST_POINTS}");
                return Err(IoError::text(&path, number, "the number of points", value, "split the file"));
            }
        }
        match (two.len(), three.len()) {
            (0, 0) => {
                let advice = "write one point per line: x,y";
                Err(IoError::text(&path, lines.number(), "the number of points", "0", advice))
            }
            (_, 0) => Ok(Self::Two(two)),
            _ => Ok(Self::Three(three)),
        }
    }

    /// Number of points, at least one.
    #[allow(clippy::len_without_is_empty)] // a file without points is an error
    pub fn len(&self) -> usize {
        match self {
            Self::Two(points) => points.len(),
            Self::Three(points) => points.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, says};

    fn parse(text: impl Into<Vec<u8>>) -> Result<QueryPoints> {
        QueryPoints::parse(Input::from_reader(std::io::Cursor::new(text.into()), "q.csv".as_ref())?)
    }

    #[test]
    fn points_with_and_without_header() {
        let two = QueryPoints::Two(vec![[1.0, -2.5], [3.0, 4e3]]);
        assert_eq!(parse("1,-2.5\n3,4e3").unwrap(), two);
        assert_eq!(parse("\u{feff}X, y\r\n\r\n# c\r\n 1 , -2.5 # here\r\n3,4e3\r\n").unwrap(), two);
        assert_eq!(parse("x,y,z\n1,2,3\n").unwrap(), QueryPoints::Three(vec![[1.0, 2.0, 3.0]]));
    }

    #[test]
    fn errors_name_line_field_and_value_and_no_bytes_make_it_panic() {
        for (text, part) in [
            ("1,2\n3,abc\n", "q.csv: line 2: y is \"abc\"; write a finite number"),
            ("1,2\n3\n", "line 2: the number of fields is 1; write 2 as above"),
            ("1 2\n", "line 1: the number of fields is 1; write 2 (x,y) or 3"),
            ("1,2,3,4\n", "the number of fields is 4"),
            ("x,y\n1,2,3\n", "line 2: the number of fields is 3"),
            ("1,\n", "line 1: y is missing"),
            ("nan,1\n", "x is \"nan\""),
            ("lon,lat\n1,2\n", "x is \"lon\""),
            ("1,2\nx,y\n", "line 2: x is \"x\""),
            ("# none\n", "the number of points is 0"),
        ] {
            says(parse(text), part);
        }
        no_panic(b"x,y\n1,2\n# c\n3.5,-4e1\n", 13, 3000, parse);
    }
}
