//! Words and numbers of a line, and what may follow the data.

use std::path::Path;

use crate::{IoError, Result};

/// The words of a line between spaces and tabs.
pub(crate) fn fields(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty())
}

/// The words of a line of numbers. Where it has semicolons, these separate; else commas do, unless white space does already: then
/// commas are part of words, so that decimal commas (`2,010 -1,000`) are refused and not taken for separators.
pub(crate) fn number_words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    let mark = if line.contains(&b';') { b';' } else { b',' };
    let spaced = mark == b',' && separates_by_space(line);
    line.split(move |b| b.is_ascii_whitespace() || *b == mark && !spaced).filter(|w| !w.is_empty())
}

/// Whether white space stands between two words without a comma beside it.
fn separates_by_space(line: &[u8]) -> bool {
    let mut before = None;
    let mut space = false;
    for &b in line.trim_ascii() {
        if b.is_ascii_whitespace() {
            space = true;
            continue;
        }
        if space && before.is_some_and(|last| last != b',') && b != b',' {
            return true;
        }
        (before, space) = (Some(b), false);
    }
    false
}

/// A word that is not a number, and its column.
pub(crate) type BadWord<'a> = (&'a [u8], String);

/// The numbers of a line before its comment, at most `N` of them, and how many.
///
/// # Errors
/// The first word that is not a number.
pub(crate) fn columns<const N: usize>(
    line: &[u8],
    number: impl Fn(&[u8]) -> Option<f64>,
) -> Result<([f64; N], usize), BadWord<'_>> {
    let content = line.split(|b| *b == b'#').next().unwrap_or(&[]);
    let (mut values, mut count) = ([0.0; N], 0);
    for word in number_words(content).take(N) {
        values[count] = number(word).ok_or_else(|| (word, format!("column {}", count + 1)))?;
        count += 1;
    }
    Ok((values, count))
}

/// The whole number that a word spells.
pub(crate) fn whole<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The line of a header that begins at `at`, which moves behind it; `None` where none ends within 64 KiB.
pub(crate) fn header_line<'a>(bytes: &'a [u8], at: &mut usize) -> Option<&'a [u8]> {
    let length = bytes[*at..].iter().take(1 << 16).position(|b| *b == b'\n')?;
    let line = &bytes[*at..*at + length];
    *at += length + 1;
    Some(line)
}

/// Refuses bytes behind what the header announced (`what`), at this place: then header and data do not fit together, and what was read
/// may be moved or cut. Padding (zeros, the ends of lines) is none.
///
/// # Errors
/// [`IoError::Binary`].
pub(crate) fn check_padding(rest: &[u8], at: u64, what: &str, path: &Path) -> Result<()> {
    let is_padding = |b: &u8| *b == 0 || b.is_ascii_whitespace();
    if rest.iter().all(is_padding) {
        return Ok(());
    }
    let advice = format!("the header announces {what} and no more: check its sizes, or copy the file again");
    Err(IoError::binary(path, at, "the rest of the file", format!("{} bytes", rest.len()), advice))
}

const POWERS_OF_TEN: [f64; 19] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18];

/// The number that a word spells, `nan` and `inf` included; `None` for any other word. The result is the
/// double nearest to the decimal, as with [`str::parse`].
///
/// Plain decimals whose digits fit 53 bits take one division of two exact doubles, which rounds correctly
/// *(Clinger 1990, "How to read floating point numbers accurately")*; the rest goes through [`str::parse`].
pub(crate) fn parse_f64(word: &[u8]) -> Option<f64> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, word),
    };
    if digits.is_empty() || digits.len() > 18 {
        return slow(word);
    }
    let (mut mantissa, mut decimals, mut dot, mut any) = (0u64, 0, false, false);
    for &b in digits {
        match b {
            b'0'..=b'9' => {
                mantissa = mantissa * 10 + u64::from(b - b'0');
                decimals += usize::from(dot);
                any = true;
            }
            b'.' if !dot => dot = true,
            _ => return slow(word),
        }
    }
    if !any || mantissa >= 1 << 53 {
        return slow(word);
    }
    let magnitude = mantissa as f64 / POWERS_OF_TEN[decimals];
    Some(if negative { -magnitude } else { magnitude })
}

#[cold]
fn slow(word: &[u8]) -> Option<f64> {
    whole(word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn a_comma_separates_only_where_nothing_else_does() {
        for (line, expected) in [
            ("1 2\t3", &["1", "2", "3"][..]),
            ("1,2,3,", &["1", "2", "3"]),
            ("7.5, 1 , -2,0.5", &["7.5", "1", "-2", "0.5"]),
            (" 1;2,5; 3", &["1", "2,5", "3"]),
            ("2,010 -1,000 0,250", &["2,010", "-1,000", "0,250"]),
            ("1,2 3", &["1,2", "3"]),
            ("1 2 3,", &["1", "2", "3,"]),
            ("", &[]),
        ] {
            let words: Vec<_> = number_words(line.as_bytes()).map(|w| str::from_utf8(w).unwrap()).collect();
            assert_eq!(words, expected, "{line}");
        }
    }

    #[test]
    fn equals_the_standard_library() {
        let mut random = Random(7);
        let mut words: Vec<String> =
            ["0", "-0", "-0.0", ".5", "5.", ".", "-", "", "+1", "1e3", "nan", "-inf", "1..2"]
                .map(String::from)
                .into();
        for _ in 0..20_000 {
            let value = random.next() as i64 >> (random.next() % 60);
            let decimals = (random.next() % 18) as usize;
            words.push(format!("{:.*}", decimals, value as f64 * 1e-6));
            words.push(format!("{}", f64::from_bits(random.next())));
        }
        for word in words {
            let expected = word.parse::<f64>().ok();
            let read = parse_f64(word.as_bytes());
            assert_eq!(read.map(f64::to_bits), expected.map(f64::to_bits), "{word}");
        }
    }
}
