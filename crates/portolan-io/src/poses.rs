//! Pose files beside a log: one pose per scan, in order.
//!
//! | columns | meaning |
//! |---|---|
//! | 3 | `x y theta` |
//! | 4 | `t x y theta` |
//! | 8 | `t tx ty tz qx qy qz qw` (TUM); must turn about z only, `tz` is ignored |
//!
//! Separated by spaces, tabs, semicolons or commas (decimal commas are refused); `#` starts a comment; a comma at the end of a line is tolerated.

use std::path::Path;

use portolan::geom::Pose;

use crate::bytes::{Input, Lines, columns, open, parse_f64};
use crate::error::shown;
use crate::{IoError, Result};

/// The most poses of a file.
const MOST_POSES: usize = 1 << 23;

/// How far a rotation of a 2-D pose may tilt (sine of the angle).
const MOST_TILT: f64 = 0.1;

/// A pose of a pose file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedPose<const D: usize> {
    /// The stamp (seconds of the file's clock), if the file has stamps.
    pub time: Option<f64>,
    /// The pose, `world_from_sensor`.
    pub pose: Pose<D>,
}

/// Reads 2-D poses.
///
/// # Errors
/// [`IoError::Text`] for a line that is not a pose, for lines with different numbers of columns, for poses that
/// are not finite or not 2-D, and for a file without poses.
pub fn read_poses_2d(path: impl AsRef<Path>) -> Result<Vec<TimedPose<2>>> {
    parse_poses_2d(open(path)?)
}

/// [`read_poses_2d`] from any input.
///
/// # Errors
/// As [`read_poses_2d`].
pub fn parse_poses_2d(input: Input) -> Result<Vec<TimedPose<2>>> {
    let mut lines = Lines::of(input);
    let path = lines.path().to_owned();
    let mut poses = Vec::new();
    let mut width = None;
    let finite = |word: &[u8]| parse_f64(word).filter(|v| v.is_finite());
    while let Some((number, line)) = lines.next_numbered()? {
        let (values, count) = columns::<9>(line, finite).map_err(|(word, column)| {
            IoError::text(&path, number, column, shown(word), "write a finite number, with a decimal point")
        })?;
        let values = &values[..count];
        if values.is_empty() {
            continue;
        }
        if *width.get_or_insert(count) != count {
            let advice = "give every line the same columns";
            return Err(IoError::text(&path, number, "the number of columns", count, advice));
        }
        let pose = match *values {
            [x, y, theta] => TimedPose { time: None, pose: Pose::<2>::new(x, y, theta) },
            [t, x, y, theta] => TimedPose { time: Some(t), pose: Pose::<2>::new(x, y, theta) },
            [t, x, y, _, qx, qy, qz, qw] => {
                let pose = pose_2d(x, y, [qx, qy, qz, qw]).map_err(|advice| {
                    IoError::text(&path, number, "the quaternion", format!("{qx} {qy} {qz} {qw}"), advice)
                })?;
                TimedPose { time: Some(t), pose }
            }
            _ => {
                let advice = "write 3 (x y theta), 4 (t x y theta) or 8 (t tx ty tz qx qy qz qw)";
                return Err(IoError::text(&path, number, "the number of columns", count, advice));
            }
        };
        IoError::unless_full(&path, number, poses.len(), MOST_POSES, "poses", "file")?;
        poses.push(pose);
    }
    if poses.is_empty() {
        let advice = "write one pose per line: x y theta";
        return Err(IoError::text(&path, lines.number(), "the number of poses", "0", advice));
    }
    Ok(poses)
}

fn pose_2d(x: f64, y: f64, xyzw: [f64; 4]) -> Result<Pose<2>, &'static str> {
    let pose = Pose::<3>::from_quaternion([x, y, 0.0], xyzw).ok_or("write a quaternion that is not zero")?;
    let r = pose.rotation;
    let tilt = r[2][0].hypot(r[2][1]);
    if tilt > MOST_TILT || r[2][2] < 0.0 {
        return Err("a 2-D log needs poses that turn about z only");
    }
    let theta = (r[1][0] - r[0][1]).atan2(r[0][0] + r[1][1]);
    Ok(Pose::<2>::new(x, y, theta))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, says};

    fn parse(text: impl Into<Vec<u8>>) -> Result<Vec<TimedPose<2>>> {
        parse_poses_2d(Input::from_reader(std::io::Cursor::new(text.into()), "p.txt".as_ref())?)
    }

    #[test]
    fn the_three_layouts() {
        let expected = Pose::<2>::new(1.0, -2.0, 0.5);
        let three = parse("# x y theta\n1 -2 0.5\n\n1,-2,0.5,\n").unwrap();
        assert_eq!(three, [TimedPose { time: None, pose: expected }; 2]);
        assert_eq!(parse("7.5, 1, -2, 0.5 # here").unwrap(), [TimedPose { time: Some(7.5), pose: expected }]);
        let tum = parse(format!("3 1 -2 9 0 0 {} {}", 0.25f64.sin(), 0.25f64.cos())).unwrap();
        assert!((tum[0].pose.theta() - 0.5).abs() < 1e-12 && tum[0].time == Some(3.0));
    }

    #[test]
    fn errors_name_the_place_and_no_bytes_make_it_panic() {
        for (text, part) in [
            ("1 2 3\n1 2\n", "p.txt: line 2: the number of columns is 2; give every line"),
            ("1 2\n", "line 1: the number of columns is 2; write 3"),
            ("1 2 nan\n", "line 1: column 3 is \"nan\"; write a finite number"),
            ("1 2 3 4 5 6 7 8 9 10\n", "line 1: the number of columns is 9"),
            ("0 0 0 0 0 0 0 0\n", "line 1: the quaternion is 0 0 0 0; write"),
            ("0 0 0 0 0.5 0.5 0.5 0.5\n", "turn about z only"),
            ("1,5 2,0 0,5\n", "line 1: column 1 is \"1,5\"; write a finite number, with a decimal point"),
            ("1,5;2,0;0,5\n", "line 1: column 1 is \"1,5\""),
            ("# nothing\n", "the number of poses is 0"),
        ] {
            says(parse(text), part);
        }
        no_panic(b"1 2 3 # c\n4 5 6\n7,8,9,\n", 5, 3000, parse);
    }
}
