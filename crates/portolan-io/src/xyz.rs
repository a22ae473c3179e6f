//! Points as text: one per line, `x y z` and perhaps more, between spaces, tabs, commas or semicolons.
//!
//! | columns without a header | meaning |
//! |---|---|
//! | 3 | `x y z` |
//! | 4 | `x y z intensity` |
//! | 6 | `x y z r g b` where the first line has whole numbers up to 255 there, else `x y z nx ny nz` |
//! | 7 | `x y z intensity r g b` (PTS) |
//!
//! A first line of names (`x,y,z,intensity,r,g,b,nx,ny,nz,ring,time`, in any order; columns of other names are passed over)
//! overrules this. `#` and `//` start comments; a first line that is one whole number is a count, and is not trusted.

use std::path::Path;

use crate::bytes::{Input, Lines, Scalar, number_words, open, parse_f64};
use crate::error::shown;
use crate::points::{CloudBuilder, PointCloudFile, PointFields, is_time};
use crate::{IoError, Result};

/// The most columns of a line.
const MOST_COLUMNS: usize = 64;
/// The most points of a file.
const MOST_POINTS: usize = 1 << 30;

/// Reads a text file of points (meters), plain or packed by gzip or bzip2. Memory grows with the points, not with the text.
///
/// # Errors
/// [`IoError::Text`] for a line that is not a point, for lines with different numbers of columns, and for a file without
/// points. `nan` is a number: such points are refused and counted.
pub fn read_xyz(path: impl AsRef<Path>) -> Result<PointCloudFile> {
    parse(open(path)?)
}

pub(crate) fn parse(input: Input) -> Result<PointCloudFile> {
    let mut lines = Lines::of(input);
    let path = lines.path().to_owned();
    let mut builder = CloudBuilder::new(true);
    let mut columns: Option<Columns> = None;
    let (mut row, mut first) = (0, true);
    while let Some((number, line)) = lines.next_numbered()? {
        // A header may be a comment: "//X,Y,Z" is what CloudCompare writes.
        let (content, comment) = split_comment(line);
        let content = if first && content.is_empty() { comment } else { content };
        let mut values = [0.0; MOST_COLUMNS];
        let (mut count, mut failed) = (0, None);
        for word in number_words(content) {
            if count == MOST_COLUMNS {
                let advice = format!("give at most {MOST_COLUMNS} columns");
                return Err(IoError::text(&path, number, "the number of columns", "too large", advice));
            }
            match parse_f64(word) {
                Some(v) => values[count] = v,
                None => failed = failed.or(Some((count, word))),
            }
            count += 1;
        }
        if count == 0 {
            continue;
        }
        if columns.is_none() {
            if let Some(named) = Columns::named(content) {
                (columns, first) = (Some(named), false);
                continue;
            }
            let is_count = count == 1 && failed.is_none() && values[0].fract() == 0.0;
            if (first && is_count) || split_comment(line).0.is_empty() {
                first &= !is_count;
                continue;
            }
        }
        first = false;
        if let Some((k, word)) = failed {
            let advice = "write numbers with a decimal point, or a first line of names: x,y,z";
            return Err(IoError::text(&path, number, format!("column {}", k + 1), shown(word), advice));
        }
        let values = &values[..count];
        let columns = match &columns {
            Some(columns) => columns,
            None => columns.insert(Columns::guessed(values).ok_or_else(|| {
                let advice =
                    "write 3 (x y z), 4 (x y z intensity), 6 (x y z r g b) or 7, or a first line of names";
                IoError::text(&path, number, "the number of columns", count, advice)
            })?),
        };
        if count != columns.count {
            let advice = format!("write {} as above", columns.count);
            return Err(IoError::text(&path, number, "the number of columns", count, advice));
        }
        IoError::unless_full(&path, number, row, MOST_POINTS, "points", "file")?;
        // Colors are bytes, and times seconds.
        let scalar = |k| if columns.fields.time == Some(k) { Scalar::F64 } else { Scalar::U8 };
        builder.push_fields(row, &columns.fields, |k| (values[k], scalar(k)));
        row += 1;
    }
    if row == 0 {
        let advice = "write one point per line: x y z";
        return Err(IoError::text(&path, lines.number(), "the number of points", "0", advice));
    }
    Ok(builder.finish())
}

/// Whether the first lines of a file are points: at least two.
pub(crate) fn may_be_points(path: &Path) -> bool {
    let head = open(path).and_then(|mut input| input.read_up_to(4096)).unwrap_or_default();
    // The last line may be cut.
    let whole =
        if head.len() < 4096 { head.len() } else { head.iter().rposition(|b| *b == b'\n').unwrap_or(0) };
    let lines = std::io::Cursor::new(head[..whole].to_vec());
    Input::from_reader(lines, path).and_then(parse).is_ok_and(|cloud| cloud.points.len() >= 2)
}

/// What stands before a comment, and the comment without its mark.
fn split_comment(line: &[u8]) -> (&[u8], &[u8]) {
    let hash = line.iter().position(|b| *b == b'#').map(|at| (at, at + 1));
    let slashes = line.windows(2).position(|w| w == b"//").map(|at| (at, at + 2));
    match hash.into_iter().chain(slashes).min() {
        Some((end, start)) => (line[..end].trim_ascii(), line[start..].trim_ascii()),
        None => (line.trim_ascii(), &[]),
    }
}

/// Which column holds what.
struct Columns {
    count: usize,
    fields: PointFields<usize>,
}

impl Columns {
    /// From a line of names; `None` where it does not name x, y and z.
    fn named(content: &[u8]) -> Option<Self> {
        let names: Vec<String> = number_words(content)
            .map(|w| String::from_utf8_lossy(w).trim_matches('"').to_ascii_lowercase())
            .collect();
        let find = |wanted: &[&str]| names.iter().position(|n| wanted.contains(&n.as_str()));
        let three = |a: &[&str], b: &[&str], c: &[&str]| Some([find(a)?, find(b)?, find(c)?]);
        let fields = PointFields {
            position: three(&["x"], &["y"], &["z"])?,
            intensity: find(&["intensity", "i", "reflectivity", "reflectance", "scalar_intensity"]),
            color: three(&["r", "red"], &["g", "green"], &["b", "blue"]),
            normal: three(&["nx", "normal_x"], &["ny", "normal_y"], &["nz", "normal_z"]),
            ring: find(&["ring"]),
            time: names.iter().position(|n| is_time(n)),
        };
        Some(Self { count: names.len(), fields })
    }

    /// From the first line of numbers.
    fn guessed(values: &[f64]) -> Option<Self> {
        let bytes = |v: &[f64]| v.iter().all(|v| v.fract() == 0.0 && (0.0..=255.0).contains(v));
        let (intensity, color, normal) = match values.len() {
            3 => (None, None, None),
            4 => (Some(3), None, None),
            6 if bytes(&values[3..]) => (None, Some([3, 4, 5]), None),
            6 => (None, None, Some([3, 4, 5])),
            7 => (Some(3), Some([4, 5, 6]), None),
            _ => return None,
        };
        let fields = PointFields { position: [0, 1, 2], intensity, color, normal, ring: None, time: None };
        Some(Self { count: values.len(), fields })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, real_data, says};

    fn read(text: impl Into<Vec<u8>>) -> Result<PointCloudFile> {
        parse(Input::from_reader(std::io::Cursor::new(text.into()), "a.xyz".as_ref())?)
    }

    #[test]
    fn separators_comments_and_counts() {
        let points = vec![[1.0, -2.0, 0.5], [4.0, 5.0, 6.0]];
        for text in [
            "1 -2 0.5\n4 5 6\n",
            "# c\n\n1,-2,0.5 # here\r\n4, 5, 6\r\n",
            "1;-2;0.5\n4; 5; 6",
            "2\n1\t-2\t5e-1\n4\t5\t6\n",
            "\u{feff}x,y,z\n1,-2,.5\n4,5,6 // there\n",
            "//X Y Z\n1 -2 .5\n4 5 6\n",
            "\"z\",other,\"y\",\"x\"\n.5,9,-2,1\n6,9,5,4\n",
        ] {
            assert_eq!(read(text).unwrap().points, points, "{text}");
        }
    }

    #[test]
    fn decimal_commas_are_no_separators() {
        for text in ["2,010 -1,000 0,250\n", "2,010\t-1,000\t0,250\n", "1 2 3\n2,0 1,0 3\n", "2,5;1,0;3,5\n"]
        {
            says(read(text), "write numbers with a decimal point");
        }
    }

    #[test]
    fn columns_are_told_by_number_or_name() {
        assert_eq!(read("1 2 3 0.5").unwrap().intensity, [0.5]);
        assert_eq!(read("1 2 3 255 0 7\n1 2 3 1 2 3").unwrap().colors, [[255, 0, 7], [1, 2, 3]]);
        assert_eq!(read("1 2 3 0 -1 0").unwrap().normals, [[0.0, -1.0, 0.0]]);
        let seven = read("1 2 3 12.5 1 2 3").unwrap();
        assert_eq!((seven.intensity, seven.colors), (vec![12.5], vec![[1, 2, 3]]));
        let named = read("time,x,y,z,ring\n10,1,2,3,4\n10.25,nan,0,0,5\n10.5,1,2,3,6\n").unwrap();
        assert_eq!((named.times, named.start_time, named.rings), (vec![0.0, 0.5], 10.0, vec![4, 6]));
        assert_eq!(named.refused.not_finite, 1);
    }

    #[test]
    fn far_points_get_an_offset() {
        let cloud = read("500000.125 4000000.001 3\n500001 4000000 3").unwrap();
        assert_eq!(cloud.offset, [500_001.0, 4_000_000.0, 3.0]);
        assert!((cloud.position(0)[1] - 4_000_000.001).abs() < 1e-6);
    }

    #[test]
    fn errors_name_the_place_and_no_bytes_make_it_panic() {
        for (text, part) in [
            ("1 2 3\n1 2\n", "a.xyz: line 2: the number of columns is 2; write 3 as above"),
            ("1 2\n", "line 1: the number of columns is 2; write 3 (x y z)"),
            ("1 2 a\n", "line 1: column 3 is \"a\"; write numbers"),
            ("1,5;2,0;3,5\n", "line 1: column 1 is \"1,5\""),
            ("lon lat h\n1 2 3\n", "line 1: column 1 is \"lon\""),
            ("# nothing\n", "the number of points is 0"),
        ] {
            says(read(text), part);
        }
        no_panic(b"x,y,z,r,g,b\n1,2,3,4,5,6\n#c\n7,8,9,1,2,3\n", 17, 3000, read);
    }

    #[test]
    fn the_scan_of_octomap() {
        let Some(path) = real_data("maps_octomap/scan.dat.bz2") else { return };
        let cloud = read_xyz(path).unwrap();
        assert_eq!(cloud.points.len(), 88_206);
        let ranges = cloud.points.iter().map(|p| p.iter().map(|v| v * v).sum::<f32>().sqrt());
        let (low, high) = ranges.fold((f32::MAX, 0f32), |(l, h), r| (l.min(r), h.max(r)));
        assert!((0.45..0.55).contains(&low) && (28.5..29.5).contains(&high), "{low} {high}");
    }
}
