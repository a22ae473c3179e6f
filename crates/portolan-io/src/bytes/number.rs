//! Words and numbers of a line.

/// The words of a line between spaces and tabs.
pub(crate) fn fields(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty())
}

/// A word that is not a number, and its column.
pub(crate) type BadWord<'a> = (&'a [u8], String);

/// The numbers of a line before its comment, at most `N` of them, and how many.
///
/// # Errors
/// The first word that is not a number.
pub(crate) fn columns<const N: usize>(
    line: &[u8],
    separates: impl Fn(u8) -> bool,
    number: impl Fn(&[u8]) -> Option<f64>,
) -> Result<([f64; N], usize), BadWord<'_>> {
    let content = line.split(|b| *b == b'#').next().unwrap_or(&[]);
    let words = content.split(|b| b.is_ascii_whitespace() || separates(*b));
    let (mut values, mut count) = ([0.0; N], 0);
    for word in words.filter(|w| !w.is_empty()).take(N) {
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
