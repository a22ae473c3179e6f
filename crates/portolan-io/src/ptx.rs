//! PTX (Leica Cyclone): scans as text, each with its columns, rows and pose.
//!
//! ```text
//! columns                     0 0 0 is a pixel without a reading
//! rows
//! x y z                       where the scanner stood, and its axes:
//! 3 rows of 3                 they are read for the origin of rays alone
//! 4 rows of 4                 world from points, a row vector times the matrix: its last row is the translation
//! x y z intensity [r g b]     columns x rows lines, column by column
//! ```
//!
//! Further scans follow at once.

use crate::bytes::{Input, Lines, Scalar, fields, parse_f64};
use crate::error::shown;
use crate::points::{CloudBuilder, CloudGrid, PointFields, PosedCloud};
use crate::poses3::{PoseConvention, RawPose};
use crate::{IoError, Result};

/// The most columns, rows, and pixels of a scan.
const MOST_EDGE: usize = 1 << 24;
const MOST_PIXELS: usize = 1 << 30;
/// Lines of a header.
const HEADER: usize = 10;

/// Which scans of a file are wanted.
#[derive(Clone, Copy)]
pub(crate) enum Wanted {
    /// The first so many points of every scan.
    First(usize),
    /// All of one scan.
    Scan(usize),
    /// Everything.
    All,
}

/// The lines before the points.
struct Header {
    columns: usize,
    rows: usize,
    scanner: [f64; 3],
    matrix: RawPose,
}

/// Reads a file; of scans that are not wanted the points are passed over, and their clouds are empty.
///
/// # Errors
/// [`IoError::Text`] for a line that is none of a scan, and for a file that ends within one or has no points.
pub(crate) fn parse(input: Input, wanted: Wanted) -> Result<Vec<PosedCloud>> {
    let mut lines = Lines::of(input);
    let mut scans = Vec::new();
    let mut pixels = 0;
    while let Some(header) = header(&mut lines, scans.is_empty())? {
        pixels += header.columns * header.rows;
        let most = match wanted {
            Wanted::First(n) => n,
            Wanted::Scan(i) if i != scans.len() => 0,
            _ => usize::MAX,
        };
        scans.push(scan(&mut lines, header, most)?);
    }
    if pixels == 0 {
        let advice = "give a file with points";
        return Err(IoError::text(lines.path(), lines.number(), "the number of points", 0, advice));
    }
    Ok(scans)
}

/// The next header; `None` at the end of the file.
fn header(lines: &mut Lines<Input>, is_first: bool) -> Result<Option<Header>> {
    let mut numbers: Vec<Vec<f64>> = Vec::new();
    while numbers.len() < HEADER {
        let path = lines.path().to_owned();
        let words = [1, 1, 3, 3, 3, 3, 4, 4, 4, 4][numbers.len()];
        let Some((number, line)) = lines.next_numbered()? else {
            // Empty lines may stand at the end.
            if numbers.is_empty() && !is_first {
                return Ok(None);
            }
            let advice = "a scan begins with columns, rows, and eight lines of its pose: the file is cut off";
            return Err(IoError::text(&path, lines.number(), "the header of a scan", "missing", advice));
        };
        let line = line.trim_ascii();
        if line.is_empty() && numbers.is_empty() {
            continue;
        }
        let values: Option<Vec<f64>> = fields(line).map(parse_f64).collect();
        match values.filter(|v| v.len() == words) {
            Some(values) => numbers.push(values),
            None => {
                let advice =
                    format!("write {words} numbers in line {} of the header of a scan", numbers.len() + 1);
                return Err(IoError::text(&path, number, "the header", shown(line), advice));
            }
        }
    }
    let edge = |v: f64| (v.fract() == 0.0 && (0.0..=MOST_EDGE as f64).contains(&v)).then_some(v as usize);
    let size = edge(numbers[0][0]).zip(edge(numbers[1][0]));
    let size = size.filter(|(columns, rows)| columns.checked_mul(*rows).is_some_and(|n| n <= MOST_PIXELS));
    let Some((columns, rows)) = size else {
        let value = format!("{} x {}", numbers[0][0], numbers[1][0]);
        let advice = format!("write whole numbers, at most {MOST_PIXELS} pixels");
        return Err(IoError::text(lines.path(), lines.number() - 9, "columns x rows", value, advice));
    };
    // A row vector times the matrix: the rotation stands transposed.
    let m = &numbers[6..];
    let rotation = std::array::from_fn(|row| std::array::from_fn(|column| m[column][row]));
    let mut matrix = RawPose::new(rotation, std::array::from_fn(|k| m[3][k]), lines.number() - 3);
    matrix.matrix[3] = std::array::from_fn(|k| m[k][3]);
    let scanner = std::array::from_fn(|k| numbers[2][k]);
    Ok(Some(Header { columns, rows, scanner, matrix }))
}

/// The points behind a header, `most` of them.
fn scan(lines: &mut Lines<Input>, header: Header, most: usize) -> Result<PosedCloud> {
    let Header { columns, rows, scanner, matrix } = header;
    let count = columns * rows;
    let mut builder = CloudBuilder::new(true);
    let mut pixels = Vec::new();
    let mut words = None;
    for i in 0..count {
        let path = lines.path().to_owned();
        let Some((number, line)) = lines.next_numbered()? else {
            let value = format!("{i} of {count}");
            let advice = "columns x rows announce more: the file is cut off";
            return Err(IoError::text(&path, lines.number(), "the number of points", value, advice));
        };
        let mut values = [0.0; 7];
        let mut given = 0;
        for word in fields(line) {
            let value = parse_f64(word).filter(|_| given < 7);
            let Some(value) = value else {
                let advice = "write x y z intensity [r g b]";
                return Err(IoError::text(&path, number, "a point", shown(line), advice));
            };
            values[given] = value;
            given += 1;
        }
        if ![3, 4, 7].contains(&given) || *words.get_or_insert(given) != given {
            let advice = match words.filter(|w| *w != given) {
                Some(w) => format!("write {w} as above"),
                None => "write x y z, x y z intensity or x y z intensity r g b".to_owned(),
            };
            return Err(IoError::text(&path, number, "the number of columns of a point", given, advice));
        }
        if i >= most {
            continue;
        }
        if values[..3] == [0.0; 3] {
            builder.cloud.refused.no_reading += 1;
            continue;
        }
        let fields = PointFields {
            position: [0, 1, 2],
            intensity: (given > 3).then_some(3),
            color: (given == 7).then_some([4, 5, 6]),
            normal: None,
            ring: None,
            time: None,
        };
        if builder.push_fields(i, &fields, |k| (values[k], Scalar::U8)) {
            pixels.push((i % rows * columns + i / rows) as u32);
        }
    }
    let mut cloud = builder.finish();
    if columns > 1 && rows > 1 {
        cloud.grid = Some(CloudGrid { columns, rows, pixels });
    }
    let origin = origin(scanner, &matrix);
    Ok(PosedCloud { cloud, file_from_scan: Some(matrix), origin, name: None })
}

/// Where the scanner stood in the frame of the points: at their zero, unless the header says that it stood elsewhere than
/// where the matrix moves that zero. A scanner at zero that was never moved is what writers give that know of none.
fn origin(scanner: [f64; 3], matrix: &RawPose) -> Option<[f64; 3]> {
    let Ok((pose, _)) = matrix.resolve(PoseConvention::WorldFromSensor) else { return Some([0.0; 3]) };
    let stands = scanner != [0.0; 3];
    let moved = pose.translation != [0.0; 3] || (0..3).any(|k| (pose.rotation[k][k] - 1.0).abs() > 1e-9);
    match (stands, moved) {
        (false, false) => None,
        (true, _) if scanner.iter().all(|v| v.is_finite()) => {
            let at = pose.inverse().transform_point(scanner);
            // The digits of the text.
            let is_zero = at.iter().all(|v| v.abs() < 1e-3);
            Some(if is_zero { [0.0; 3] } else { at })
        }
        _ => Some([0.0; 3]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::PosedCloud;
    use crate::testing::{no_panic, real_data, says};

    fn read(text: impl Into<Vec<u8>>) -> Result<Vec<PosedCloud>> {
        parse(Input::from_reader(std::io::Cursor::new(text.into()), "a.ptx".as_ref())?, Wanted::All)
    }

    /// Two scans: 2 x 2 turned by 90 degrees about z and moved, and a column of two.
    const TWO: &str = "2\n2\n1 2 3\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n\
                       1 0 0 0.5 1 2 3\n0 0 0 0.5 0 0 0\n0 0 2 0.25 4 5 6\n0 3 0 1 7 8 9\n\
                       1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5 6 7\n8 9 10\n";

    #[test]
    fn scans_have_their_poses_and_pixels() {
        let scans = read(TWO).unwrap();
        assert_eq!(scans.len(), 2);
        let first = &scans[0];
        assert_eq!(first.cloud.points, [[1.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, 3.0, 0.0]]);
        assert_eq!((first.cloud.refused.no_reading, first.origin), (1, Some([0.0; 3])));
        assert_eq!(first.cloud.colors[2], [7, 8, 9]);
        // Column by column: the third point is the first of the second column.
        assert_eq!(first.cloud.grid.as_ref().unwrap().pixels, [0, 1, 3]);
        let moved = first.clone().in_file().unwrap();
        let at: Vec<[f64; 3]> = (0..3).map(|i| moved.position(i)).collect();
        assert_eq!(at, [[1.0, 3.0, 3.0], [1.0, 2.0, 5.0], [-2.0, 2.0, 3.0]]);
        // A scanner at zero that never moved says nothing.
        assert_eq!((scans[1].origin, scans[1].cloud.points.len()), (None, 2));
        let second =
            parse(Input::from_reader(TWO.as_bytes(), "a".as_ref()).unwrap(), Wanted::Scan(1)).unwrap();
        assert_eq!((second[0].cloud.points.len(), &second[1]), (0, &scans[1]));
    }

    #[test]
    fn a_scanner_elsewhere_than_the_zero_of_its_points_is_where_the_header_says() {
        let text = TWO.replacen("2\n2\n1 2 3\n", "2\n2\n1 2 4\n", 1);
        assert_eq!(read(text).unwrap()[0].origin, Some([0.0, 0.0, 1.0]));
    }

    #[test]
    fn errors_name_the_line_and_no_bytes_make_it_panic() {
        let line = |n: usize| TWO.split_inclusive('\n').take(n).collect::<String>();
        for (text, part) in [
            (String::new(), "the header of a scan is missing"),
            (line(7), "a.ptx: line 7: the header of a scan is missing"),
            (line(12), "a.ptx: line 12: the number of points is 2 of 4; columns x rows announce more"),
            (
                TWO.replacen("0 3 0 1 7 8 9", "0 3 0 1", 1),
                "line 14: the number of columns of a point is 4; write 7",
            ),
            (TWO.replacen("0 0 2 0.25", "0 x 2 0.25", 1), "line 13: a point is"),
            (TWO.replacen("2\n2\n", "2.5\n2\n", 1), "columns x rows is 2.5 x 2"),
            (TWO.replacen("2\n2\n", "16000000\n16000000\n", 1), "at most 1073741824 pixels"),
            (TWO.replacen("1 2 3\n", "1 2\n", 1), "line 3: the header is \"1 2\"; write 3 numbers in line 3"),
        ] {
            says(read(text), part);
        }
        no_panic(TWO, 23, 2000, read);
    }

    #[test]
    fn files_of_others() {
        if let Some(path) = real_data("e57_las_ptx/complex-transform.ptx") {
            let scans = parse(crate::open(path).unwrap(), Wanted::All).unwrap();
            // PDAL: the first return in the file's frame.
            let (cloud, moved) = (&scans[0].cloud, scans[0].clone().in_file().unwrap());
            assert_eq!(
                (cloud.points.len(), cloud.refused.no_reading, scans[0].origin),
                (4, 8, Some([0.0; 3]))
            );
            let want = [-3.034407, -3.173801, -1.823_751];
            for k in 0..3 {
                assert!((moved.position(0)[k] - want[k]).abs() < 2e-3, "{:?}", moved.position(0));
            }
        }
        for (name, points) in [("no-color.ptx", 15), ("1.2-with-color.ptx", 1065)] {
            let Some(path) = real_data(&format!("e57_las_ptx/{name}")) else { continue };
            let scans = parse(crate::open(path).unwrap(), Wanted::All).unwrap();
            assert_eq!((scans.len(), scans[0].cloud.points.len(), scans[0].origin), (1, points, None));
            assert!(scans[0].cloud.offset[0] > 6e5);
        }
    }
}
