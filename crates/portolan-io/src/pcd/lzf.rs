//! LZF, the packing of `binary_compressed`, after the format's description in liblzf (Lehmann 2000).
//!
//! A byte below 32 announces that many literals and one more. Any other repeats earlier output: its upper three bits are
//! the length less two (seven: a byte to add follows), its lower five bits and the next byte the distance less one.

/// Unpacks exactly `size` bytes. `Err` is the packed byte where it failed. Memory is bounded by what so many packed
/// bytes can unpack to.
pub(super) fn unpack(packed: &[u8], size: usize) -> Result<Vec<u8>, usize> {
    // Three bytes repeat 264 at the most.
    let mut out = Vec::with_capacity(size.min(packed.len().saturating_mul(88)));
    let mut at = 0;
    while at < packed.len() {
        let control = usize::from(packed[at]);
        let start = at;
        at += 1;
        if control < 32 {
            let literals = packed.get(at..at + control + 1).ok_or(start)?;
            out.extend_from_slice(literals);
            at += control + 1;
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*packed.get(at).ok_or(start)?);
                at += 1;
            }
            let low = usize::from(*packed.get(at).ok_or(start)?);
            at += 1;
            let distance = ((control & 31) << 8) + low + 1;
            let from = out.len().checked_sub(distance).ok_or(start)?;
            repeat(&mut out, from, length + 2);
        }
        if out.len() > size {
            return Err(start);
        }
    }
    if out.len() == size { Ok(out) } else { Err(packed.len()) }
}

/// Appends `length` bytes of the output itself; what is appended may be repeated in turn.
fn repeat(out: &mut Vec<u8>, from: usize, length: usize) {
    let distance = out.len() - from;
    if distance >= length {
        out.extend_from_within(from..from + length);
    } else {
        for i in 0..length {
            out.push(out[from + i]);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::testing::{Random, bad_bytes};

    /// A plain packer: the nearest of the last repeats of three bytes, else literals.
    pub(in crate::pcd) fn pack(bytes: &[u8]) -> Vec<u8> {
        let (mut out, mut literals, mut at) = (Vec::new(), Vec::new(), 0);
        let flush = |out: &mut Vec<u8>, literals: &mut Vec<u8>| {
            for chunk in literals.chunks(32) {
                out.push(chunk.len() as u8 - 1);
                out.extend_from_slice(chunk);
            }
            literals.clear();
        };
        let mut seen = std::collections::HashMap::new();
        while at < bytes.len() {
            let found = bytes.get(at..at + 3).and_then(|key| seen.insert(key, at)).filter(|f| at - f <= 8192);
            let Some(from) = found else {
                literals.push(bytes[at]);
                at += 1;
                continue;
            };
            flush(&mut out, &mut literals);
            let length =
                (3..=264).take_while(|n| bytes.get(at + n - 1) == Some(&bytes[from + n - 1])).count() + 2;
            let (code, distance) = (length - 2, at - from - 1);
            out.push(((code.min(7) << 5) | (distance >> 8)) as u8);
            if code >= 7 {
                out.push((code - 7) as u8);
            }
            out.push(distance as u8);
            at += length;
        }
        flush(&mut out, &mut literals);
        out
    }

    #[test]
    fn unpacks_what_was_packed() {
        let mut random = Random(4);
        let noise: Vec<u8> = (0..5000).map(|_| random.next() as u8).collect();
        let words: Vec<u8> = (0..9000).map(|i: u32| (i / 7 % 5) as u8 * (i % 3) as u8).collect();
        for text in [&b""[..], b"a", &[7; 10_000], &noise, &words] {
            let packed = pack(text);
            assert_eq!(unpack(&packed, text.len()).unwrap(), text);
            assert!(unpack(&packed, text.len() + 1).is_err());
            assert!(text.is_empty() || unpack(&packed, text.len() - 1).is_err());
        }
        assert!(pack(&words).len() < words.len() / 4);
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let packed = pack(&(0..2000u32).map(|i| (i % 50) as u8).collect::<Vec<_>>());
        for bytes in bad_bytes(&packed, 9, 3000) {
            if let Ok(out) = unpack(&bytes, 2000) {
                assert_eq!(out.len(), 2000);
            }
        }
        assert!(unpack(&[0xff; 30], usize::MAX).is_err());
    }
}
