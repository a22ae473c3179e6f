//! `.npz`: a zip archive of `.npy` files, as `numpy.savez` (stored) and `numpy.savez_compressed` (deflated) write them.
//!
//! Of zip only what numpy needs: files below 4 GiB, without encryption *(APPNOTE.TXT 6.3, sections 4.3.7, 4.3.12, 4.3.16)*.

use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use flate2::read::DeflateDecoder;

use super::{NpyArray, npy};
use crate::bytes::{open_file, u32_at, write_atomic};
use crate::error::shown;
use crate::{IoError, Result};

const LOCAL: &[u8; 4] = b"PK\x03\x04";
const CENTRAL: &[u8; 4] = b"PK\x01\x02";
const END: &[u8; 4] = b"PK\x05\x06";
/// The earliest date of zip, 1 January 1980: the bytes must not depend on the clock.
const DAY: [u8; 4] = [0, 0, 0x21, 0];
/// The most arrays of an archive.
const MOST_ARRAYS: usize = 1000;
/// The most that arrays take unpacked, together: what an archive of stored ones can hold.
const MOST_BYTES: u64 = 1 << 32;

/// Writes arrays with names, stored: `numpy.load(path)["name"]`.
///
/// # Errors
/// [`IoError::Unwritable`] where an array does not have one value per cell, a name is empty, repeated or not plain ASCII,
/// or the file would reach 4 GiB; else as [`write_atomic`].
pub fn write_npz(path: impl AsRef<Path>, arrays: &[(&str, &NpyArray)]) -> Result<()> {
    let path = path.as_ref();
    let refuse =
        |field: &str, value: String, advice: &str| Err(IoError::unwritable(path, field, value, advice));
    let mut entries = Vec::new();
    let mut offset = 0u64;
    for (k, (name, array)) in arrays.iter().enumerate() {
        npy::check(path, array)?;
        let plain = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
        if !plain || name.len() > 100 || arrays[..k].iter().any(|(other, _)| other == name) {
            return refuse("the name of an array", shown(name), "give each a unique name in ASCII");
        }
        let mut sum = Summed::default();
        npy::write(&mut sum, array).map_err(|e| IoError::os(path, "write it", e))?;
        let name = format!("{name}.npy");
        let next = offset + 30 + name.len() as u64 + sum.length;
        // Room is left for the directory.
        if next > u64::from(u32::MAX) - (1 << 20) || entries.len() == MOST_ARRAYS {
            return refuse("the size", format!("{next} bytes"), "stay below 4 GiB: hand over a smaller box");
        }
        entries.push((name, sum.crc.sum(), sum.length as u32, offset as u32));
        offset = next;
    }
    write_atomic(path, |w| {
        for ((_, array), (name, crc, length, _)) in arrays.iter().zip(&entries) {
            w.write_all(LOCAL)?;
            w.write_all(&common(*crc, *length, name))?;
            w.write_all(name.as_bytes())?;
            npy::write(w, array)?;
        }
        let mut directory = Vec::new();
        for (name, crc, length, at) in &entries {
            directory.extend(CENTRAL);
            directory.extend([20, 0]); // made by: version 2.0
            directory.extend(common(*crc, *length, name));
            // No comment, first disk, no attributes.
            directory.extend([0; 10]);
            directory.extend(at.to_le_bytes());
            directory.extend(name.as_bytes());
        }
        w.write_all(&directory)?;
        w.write_all(END)?;
        w.write_all(&[0; 4])?;
        let count = (entries.len() as u16).to_le_bytes();
        w.write_all(&[count, count].concat())?;
        w.write_all(&(directory.len() as u32).to_le_bytes())?;
        w.write_all(&(offset as u32).to_le_bytes())?;
        w.write_all(&[0; 2])
    })
}

/// What the header of a file and its entry in the directory share: version 2.0, stored.
fn common(crc: u32, length: u32, name: &str) -> Vec<u8> {
    let mut bytes = vec![20, 0, 0, 0, 0, 0];
    bytes.extend(DAY);
    for word in [crc, length, length] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend((name.len() as u16).to_le_bytes());
    bytes.extend([0; 2]); // no extra field
    bytes
}

/// A writer that keeps nothing but length and check sum.
#[derive(Default)]
struct Summed {
    crc: flate2::Crc,
    length: u64,
}

impl Write for Summed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.crc.update(bytes);
        self.length += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Reads all arrays with their names, in the order of the archive.
///
/// # Errors
/// [`IoError::Binary`] where the file is not a zip archive of arrays of numbers, is cut off, or damaged.
pub fn read_npz(path: impl AsRef<Path>) -> Result<Vec<(String, NpyArray)>> {
    let path = path.as_ref();
    parse_npz(BufReader::new(open_file(path)?), path)
}

fn word(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at))
}

fn short(bytes: &[u8], at: usize) -> usize {
    usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]))
}

/// [`read_npz`] from any source; errors name it `path`.
///
/// # Errors
/// As [`read_npz`].
pub fn parse_npz(mut file: impl Read + Seek, path: &Path) -> Result<Vec<(String, NpyArray)>> {
    let failed = |e| IoError::os(path, "read it", e);
    let bad = |at: u64, field: &str, value: String| {
        let advice = "give a .npz as numpy.savez writes it; this one is cut off, damaged or of another kind";
        IoError::binary(path, at, field, value, advice)
    };
    let length = file.seek(SeekFrom::End(0)).map_err(failed)?;
    let mut bytes_at = |at: u64, count: u64| {
        let mut bytes = Vec::new();
        if at.checked_add(count).is_none_or(|end| end > length) {
            return Err(bad(at.min(length), "the length", format!("{length} bytes")));
        }
        file.seek(SeekFrom::Start(at)).map_err(failed)?;
        file.by_ref().take(count).read_to_end(&mut bytes).map_err(failed)?;
        if bytes.len() as u64 == count { Ok(bytes) } else { Err(bad(at, "the length", "changing".into())) }
    };
    // The end record is the last that starts with its mark; a comment may follow.
    let tail_at = length.saturating_sub(22 + (1 << 16));
    let tail = bytes_at(tail_at, length - tail_at)?;
    let end = tail.windows(22).rposition(|w| &w[..4] == END);
    let Some(end) = end.map(|at| &tail[at..]) else {
        return Err(bad(tail_at, "the end record", "missing".into()));
    };
    let (count, size, start) = (short(end, 10), word(end, 12), word(end, 16));
    if count > MOST_ARRAYS {
        return Err(bad(tail_at, "the number of arrays", count.to_string()));
    }
    let directory = bytes_at(start, size)?;
    let mut arrays = Vec::new();
    let (mut at, mut total) = (0, 0);
    for _ in 0..count {
        let entry = directory.get(at..).filter(|e| e.len() >= 46 && &e[..4] == CENTRAL);
        let Some(entry) = entry else { return Err(bad(start + at as u64, "the directory", "broken".into())) };
        let (method, crc, packed, unpacked) =
            (short(entry, 10), word(entry, 16), word(entry, 20), word(entry, 24));
        let (name_length, offset) = (short(entry, 28), word(entry, 42));
        at += 46 + name_length + short(entry, 30) + short(entry, 32);
        let name = entry.get(46..46 + name_length).unwrap_or_default();
        let name = String::from_utf8_lossy(name).into_owned();
        total += unpacked;
        if total > MOST_BYTES {
            return Err(bad(offset, "the size of the arrays", format!("{total} bytes")));
        }
        let local = bytes_at(offset, 30)?;
        if &local[..4] != LOCAL || short(entry, 8) & 1 == 1 {
            return Err(bad(offset, "the header of an array", shown(&name)));
        }
        let data_at = offset + 30 + short(&local, 26) as u64 + short(&local, 28) as u64;
        let data = bytes_at(data_at, packed)?;
        let data = match method {
            0 => data,
            8 => {
                // One byte more than announced is enough to refuse it, without unpacking the rest.
                let mut out = Vec::new();
                let read = DeflateDecoder::new(&data[..]).take(unpacked + 1).read_to_end(&mut out);
                read.map_err(|_| bad(data_at, "the packed data", shown(&name)))?;
                out
            }
            m => return Err(bad(offset, "the method of packing", m.to_string())),
        };
        let mut sum = flate2::Crc::new();
        sum.update(&data);
        if data.len() as u64 != unpacked || u64::from(sum.sum()) != crc {
            return Err(bad(data_at, "the check sum of an array", shown(&name)));
        }
        let array = npy::parse_npy(&data[..], path)?;
        arrays.push((name.strip_suffix(".npy").unwrap_or(&name).to_owned(), array));
    }
    Ok(arrays)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::NpyValues;
    use crate::testing::{no_panic, python, says, temporary};

    fn arrays() -> Vec<(&'static str, NpyArray)> {
        vec![
            ("distance", NpyArray::fortran([2, 3], NpyValues::F32(vec![0.0, 1.0, 2.0, 3.0, f32::NAN, -5.5]))),
            ("status", NpyArray::c([3, 2], NpyValues::U8(vec![0, 1, 2, 3, 4, 5]))),
            ("half", NpyArray::c([2], NpyValues::F16(vec![0x3c00, 0xc000]))),
            ("origin", NpyArray::vector(&[1.0, 2.0])),
            ("resolution", NpyArray::number(0.05)),
            ("layout", NpyArray::text("plain")),
        ]
    }

    fn written(name: &Path) -> Vec<u8> {
        let arrays = arrays();
        let list: Vec<_> = arrays.iter().map(|(n, a)| (*n, a)).collect();
        write_npz(name, &list).unwrap();
        std::fs::read(name).unwrap()
    }

    /// NaN is not equal to itself.
    fn text(arrays: &[(impl AsRef<str>, NpyArray)]) -> String {
        arrays.iter().map(|(n, a)| format!("{} {a:?}\n", n.as_ref())).collect()
    }

    #[test]
    fn round_trips_with_the_same_bytes_every_time() {
        let (_folder, path) = temporary("a.npz");
        let bytes = written(&path);
        assert_eq!(text(&read_npz(&path).unwrap()), text(&arrays()));
        assert_eq!(bytes, written(&path));
        write_npz(&path, &[]).unwrap();
        assert_eq!(read_npz(&path).unwrap(), []);
    }

    #[test]
    fn numpy_reads_it_and_we_read_numpys() {
        let Some(python) = python("numpy") else { return };
        let (folder, path) = temporary("a.npz");
        written(&path);
        let script = "import sys, numpy as np\n\
            a = np.load(sys.argv[1])\n\
            d = a['distance']\n\
            assert d.dtype == np.float32 and d.shape == (2, 3) and d.flags.f_contiguous, d\n\
            assert d[1, 0] == 1 and d[0, 1] == 2 and np.isnan(d[0, 2]) and d[1, 2] == -5.5, d\n\
            assert a['status'].tolist() == [[0, 1], [2, 3], [4, 5]]\n\
            assert a['half'].dtype == np.float16 and a['half'].tolist() == [1, -2]\n\
            assert a['origin'].tolist() == [1, 2] and a['resolution'] == 0.05 and a['layout'] == 'plain'\n\
            np.savez(sys.argv[2], **a)\n\
            np.savez_compressed(sys.argv[3], **a)\n";
        let (plain, packed) = (folder.path().join("b.npz"), folder.path().join("c.npz"));
        let ran = python.run(script, &[&path, &plain, &packed]);
        assert!(ran.is_ok(), "{ran:?}");
        for theirs in [plain, packed] {
            assert_eq!(text(&read_npz(theirs).unwrap()), text(&arrays()));
        }
    }

    #[test]
    fn what_is_wrong_is_refused_and_no_bytes_make_it_panic() {
        let one = NpyArray::number(1.0);
        for names in [["a", "a"], ["", "b"], ["a/b", "b"], ["a.b", "b"]] {
            let list = names.map(|n| (n, &one));
            says(write_npz("never.npz", &list), "the name of an array");
        }
        let folder = tempfile::tempdir().unwrap();
        let good = written(&folder.path().join("a.npz"));
        let error = |bytes: &[u8]| parse_npz(Cursor::new(bytes), "a.npz".as_ref()).unwrap_err().to_string();
        assert!(error(b"").contains("the end record"));
        assert!(error(&good[..good.len() - 30]).contains("the end record"));
        let mut damaged = good.clone();
        let at = good.windows(4).position(|w| w == [0, 0, 0x80, 0x3f]).unwrap();
        damaged[at] ^= 1;
        assert!(error(&damaged).contains("the check sum of an array is \"distance.npy\""));
        no_panic(&good, 22, 3000, |bytes| parse_npz(Cursor::new(bytes), "a.npz".as_ref()));
    }
}
