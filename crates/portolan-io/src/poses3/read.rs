//! Reading pose files: the layout follows from the number of columns.

use std::path::{Path, PathBuf};

use super::RawPose;
use super::convention::CORNER_OFF;
use crate::bytes::{Input, Lines, columns, open, parse_f64};
use crate::error::shown;
use crate::{IoError, Result};

/// The most poses of a file.
const MOST_POSES: usize = 1 << 20;

/// How a pose file is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PoseLayout {
    /// Rows of 4x4 matrices.
    Matrices,
    /// Lines of three integers, each followed by a 4x4 matrix (Redwood, Open3D).
    RedwoodLog,
    /// Translation and quaternion.
    Quaternions,
    /// Time, translation and quaternion (TUM).
    Tum,
    /// Twelve numbers of a 3x4 matrix (KITTI).
    Kitti,
    /// Sixteen numbers of a 4x4 matrix.
    MatrixRows,
}

impl PoseLayout {
    fn of_columns(columns: usize) -> Option<Self> {
        Some(match columns {
            3 => Self::RedwoodLog,
            4 => Self::Matrices,
            7 => Self::Quaternions,
            8 => Self::Tum,
            12 => Self::Kitti,
            16 => Self::MatrixRows,
            _ => return None,
        })
    }

    /// The layout in words.
    pub fn label(self) -> &'static str {
        match self {
            Self::Matrices => "4x4 matrices",
            Self::RedwoodLog => "Redwood log",
            Self::Quaternions => "positions and quaternions",
            Self::Tum => "TUM lines",
            Self::Kitti => "KITTI rows",
            Self::MatrixRows => "rows of 16",
        }
    }
}

/// The poses of a file, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseFile {
    /// The file.
    pub path: PathBuf,
    /// How it is laid out.
    pub layout: PoseLayout,
    /// At least one pose.
    pub poses: Vec<RawPose>,
}

/// Reads a file of 3-D poses; see [`crate::poses3`] for the layouts. Linear in its length.
///
/// # Errors
/// [`IoError::Text`] for a line that fits no layout, or another than the lines before, for a word that is not a number, a
/// matrix that ends early, and a file without poses. A pose that is not rigid is read; [`RawPose::resolve`] refuses it.
pub fn read_poses_3d(path: impl AsRef<Path>) -> Result<PoseFile> {
    parse_poses_3d(open(path)?)
}

/// [`read_poses_3d`] from any input.
///
/// # Errors
/// As [`read_poses_3d`].
pub fn parse_poses_3d(input: Input) -> Result<PoseFile> {
    let mut lines = Lines::of(input);
    let path = lines.path().to_owned();
    let mut reading: Option<Reading> = None;
    while let Some((number, line)) = lines.next_numbered()? {
        // NaN and infinity are numbers here.
        let row = columns::<MOST_COLUMNS>(line, parse_f64);
        let (row, count) = row.map_err(|(word, column)| {
            let advice = "write a number with a decimal point, or begin a comment with #";
            IoError::text(&path, number, column, shown(word), advice)
        })?;
        if count == 0 {
            continue;
        }
        let state = match &mut reading {
            Some(state) => state,
            None => {
                let Some(layout) = PoseLayout::of_columns(count) else {
                    return Err(IoError::text(
                        &path,
                        number,
                        "the number of columns",
                        count,
                        "write 4 (rows of matrices), 7 or 8 (TUM), 12 (KITTI) or 16",
                    ));
                };
                reading.insert(Reading { layout, poses: Vec::new(), open: None })
            }
        };
        state.take(&row[..count], number, &path)?;
    }
    let Some(state) = reading else {
        let advice = "give a file with poses, one 4x4 matrix or one line of 8, 12 or 16 numbers each";
        return Err(IoError::text(&path, lines.number(), "the number of poses", "0", advice));
    };
    state.finish(path)
}

/// Of a line with more columns, so many are counted.
const MOST_COLUMNS: usize = 17;

struct Reading {
    layout: PoseLayout,
    poses: Vec<RawPose>,
    /// A matrix whose rows are still to come, and how many it has.
    open: Option<(RawPose, usize)>,
}

impl Reading {
    fn take(&mut self, row: &[f64], line: u64, path: &Path) -> Result<()> {
        let wrong = |expected: &str| {
            let advice = format!("give {expected}, as the lines before");
            Err(IoError::text(path, line, "the number of columns", row.len(), advice))
        };
        IoError::unless_full(path, line, self.poses.len(), MOST_POSES, "poses", "file")?;
        match self.layout {
            PoseLayout::Matrices | PoseLayout::RedwoodLog => return self.take_row(row, line, path),
            PoseLayout::Quaternions => {
                let &[x, y, z, a, b, c, d] = row else { return wrong("7 columns") };
                self.poses.push(RawPose::from_quaternion([x, y, z], [a, b, c, d], line));
            }
            PoseLayout::Tum => {
                let &[t, x, y, z, a, b, c, d] = row else { return wrong("8 columns") };
                if !t.is_finite() {
                    return Err(IoError::text(path, line, "the time", t, "write seconds"));
                }
                let pose = RawPose::from_quaternion([x, y, z], [a, b, c, d], line);
                self.poses.push(RawPose { time: Some(t), ..pose });
            }
            PoseLayout::Kitti | PoseLayout::MatrixRows => {
                let expected = if self.layout == PoseLayout::Kitti { 12 } else { 16 };
                if row.len() != expected {
                    return wrong(&format!("{expected} columns"));
                }
                let mut pose = RawPose::new([[0.0; 3]; 3], [0.0; 3], line);
                for (i, v) in row.iter().enumerate() {
                    pose.matrix[i / 4][i % 4] = *v;
                }
                self.poses.push(pose);
            }
        }
        Ok(())
    }

    /// A row of a matrix, or the line of integers before one.
    fn take_row(&mut self, row: &[f64], line: u64, path: &Path) -> Result<()> {
        let (mut pose, rows) = match (self.open.take(), row.len(), self.layout) {
            (None, 3, PoseLayout::RedwoodLog) => {
                let whole = |v: &f64| v.fract() == 0.0 && v.abs() < 1e15;
                if let Some(k) = row.iter().position(|v| !whole(v)) {
                    let field = format!("column {}", k + 1);
                    let advice = "write three integers before each matrix, or four columns in every line";
                    return Err(IoError::text(path, line, field, row[k], advice));
                }
                let number = (row[0] >= 0.0).then_some(row[0] as u64);
                self.open = Some((RawPose { number, ..RawPose::new([[0.0; 3]; 3], [0.0; 3], line) }, 0));
                return Ok(());
            }
            (None, 4, PoseLayout::Matrices) => (RawPose::new([[0.0; 3]; 3], [0.0; 3], line), 0),
            (Some(open), 4, _) => open,
            (open, columns, _) => {
                let place = match open {
                    Some((_, rows)) => format!("give row {} of a matrix: four columns", rows + 1),
                    None if self.layout == PoseLayout::RedwoodLog => {
                        "give three integers, then a matrix, as before".into()
                    }
                    None => "give four columns in every line, as before".into(),
                };
                return Err(IoError::text(path, line, "the number of columns", columns, place));
            }
        };
        pose.matrix[rows].copy_from_slice(row);
        match rows {
            3 => self.poses.push(pose),
            _ => self.open = Some((pose, rows + 1)),
        }
        Ok(())
    }

    fn finish(mut self, path: PathBuf) -> Result<PoseFile> {
        match self.open.take() {
            // One 3x4 matrix: its last row is what it was made with.
            Some((pose, 3)) if self.poses.is_empty() && self.layout == PoseLayout::Matrices => {
                self.poses.push(pose);
            }
            Some((pose, rows)) => {
                let advice = "give all four rows (a file cut off while it was written?)";
                let field = "the number of rows of the last matrix";
                return Err(IoError::text(&path, pose.line, field, rows, advice));
            }
            None => {}
        }
        stamps_out_of_corners(&mut self.poses);
        Ok(PoseFile { path, layout: self.layout, poses: self.poses })
    }
}

/// Where `[3][3]` ascends from pose to pose, it holds time stamps. Anything else that is not 1 (another scale of the matrix,
/// one number in all of them, noise) stays there, and such poses are refused when they are resolved.
fn stamps_out_of_corners(poses: &mut [RawPose]) {
    let corners: Vec<f64> = poses.iter().map(|p| p.matrix[3][3]).filter(|v| v.is_finite()).collect();
    let ascends = corners.windows(2).all(|w| w[0] <= w[1]) && corners.first() < corners.last();
    // A 1 that was rounded.
    let all_one = corners.iter().all(|v| (v - 1.0).abs() <= CORNER_OFF);
    if ascends && !all_one {
        for pose in poses.iter_mut().filter(|p| p.matrix[3][3].is_finite()) {
            pose.time = Some(pose.matrix[3][3]);
            pose.matrix[3][3] = 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses3::{PoseConvention, PoseFault};
    use crate::testing::{bad_bytes, real_data, says};
    use portolan::geom::Pose;
    use portolan::geom::vector::distance;

    fn parse(text: impl Into<Vec<u8>>) -> Result<PoseFile> {
        parse_poses_3d(Input::from_reader(std::io::Cursor::new(text.into()), "p.txt".as_ref())?)
    }

    /// A turn of 0.6 about z.
    const TURN: &str = "0.825335615 -0.564642473 0";
    const ROWS: [&str; 3] = ["0.825335615 -0.564642473 0 1", "0.564642473 0.825335615 0 -2", "0 0 1 3"];
    const QUATERNION: &str = "0 0 0.295520207 0.955336489";

    #[test]
    fn every_layout_is_the_same_pose() {
        let [a, b, c] = ROWS;
        let expected =
            Pose::<3>::from_quaternion([1.0, -2.0, 3.0], [0.0, 0.0, 0.3f64.sin(), 0.3f64.cos()]).unwrap();
        let commas = |row: &str| row.replace(' ', ",") + ",";
        for (text, layout, count) in [
            (format!("{a}\n{b}\n{c}\n0 0 0 1\n"), PoseLayout::Matrices, 1),
            (format!("{a}\n{b}\n{c}"), PoseLayout::Matrices, 1),
            (format!("\n{a}\n{b}\n{c}\n0 0 0 1\n\n{a}\n{b}\n{c}\n0 0 0 1\n"), PoseLayout::Matrices, 2),
            ([a, b, c, "0 0 0 1\n"].map(commas).join("\n"), PoseLayout::Matrices, 1),
            (format!("0 0 1\n{a}\n{b}\n{c}\n0 0 0 1\n").repeat(3), PoseLayout::RedwoodLog, 3),
            (format!("1 -2 3 {QUATERNION}"), PoseLayout::Quaternions, 1),
            (format!("# t\n7.5 1 -2 3 {QUATERNION} # here\n"), PoseLayout::Tum, 1),
            (format!("{a} {b} {c}\n"), PoseLayout::Kitti, 1),
            (format!("{a};{b};{c};0;0;0;1").replace(' ', ";"), PoseLayout::MatrixRows, 1),
        ] {
            let file = parse(text.clone()).unwrap();
            assert_eq!((file.layout, file.poses.len()), (layout, count), "{text}");
            for raw in &file.poses {
                let (pose, off) = raw.resolve(PoseConvention::WorldFromSensor).unwrap();
                assert!(off < 1e-8, "{off}");
                assert_eq!(raw.time, (layout == PoseLayout::Tum).then_some(7.5));
                assert_eq!(raw.number, (layout == PoseLayout::RedwoodLog).then_some(0));
                let p = [0.2, 0.7, -0.4];
                assert!(distance(pose.transform_point(p), expected.transform_point(p)) < 1e-8, "{text}");
            }
        }
    }

    #[test]
    fn corners_that_are_not_one_are_stamps() {
        let block = |stamp: &str| format!("1,0,0,1,\n0,1,0,2,\n0,0,1,3,\n0,0,0,{stamp},\n");
        let file = parse(block("0.5") + &block("1") + &block("1") + &block("1630577758.569490")).unwrap();
        let times: Vec<_> = file.poses.iter().map(|p| p.time.unwrap()).collect();
        assert_eq!(times, [0.5, 1.0, 1.0, 1_630_577_758.569_49]);
        assert!(file.poses.iter().all(|p| p.resolve(PoseConvention::WorldFromSensor).is_ok()));
        assert_eq!(parse(block("1") + &block("1.000000")).unwrap().poses[1].time, None);
        let lost = parse(block("5") + &block("nan") + &block("6")).unwrap();
        assert_eq!(lost.poses[1].resolve(PoseConvention::default()), Err(PoseFault::NotFinite));
        assert_eq!((lost.poses[0].time, lost.poses[2].time), (Some(5.0), Some(6.0)));
    }

    #[test]
    fn corners_that_are_no_times_are_faults() {
        let block = |corner: &str| format!("1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 {corner}\n");
        let faults = |corners: &[&str]| {
            let file = parse(corners.iter().map(|c| block(c)).collect::<String>()).unwrap();
            assert!(file.poses.iter().all(|p| p.time.is_none()), "{corners:?}");
            let resolved = file.poses.iter().map(|p| p.resolve(PoseConvention::default()).err());
            resolved.collect::<Vec<_>>()
        };
        let fault = |corner: f64| Some(PoseFault::LastRow([0.0, 0.0, 0.0, corner]));
        // One number in all of them is a scale, not a time; a single pose cannot show it; times do not descend.
        assert_eq!(faults(&["2", "2", "2"]), [fault(2.0); 3]);
        assert_eq!(faults(&["1630577758.5"]), [fault(1_630_577_758.5)]);
        assert_eq!(faults(&["5", "7", "6"]), [fault(5.0), fault(7.0), fault(6.0)]);
        assert_eq!(faults(&["1", "0.5"]), [None, fault(0.5)]);
        assert_eq!(faults(&["7", "nan"]), [fault(7.0), Some(PoseFault::NotFinite)]);
        assert_eq!(faults(&["0.99999", "1.00001"]), [None; 2]);
        let text = fault(2.0).unwrap().to_string();
        assert!(text.contains("0 0 0 2, not 0 0 0 1 (time stamps there ascend"), "{text}");
    }

    #[test]
    fn what_is_no_pose_is_refused_when_it_is_resolved() {
        let fault =
            |text: &str| parse(text).unwrap().poses[0].resolve(PoseConvention::default()).unwrap_err();
        assert!(matches!(fault("2 0 0 0 0 2 0 0 0 0 2 0"), PoseFault::NotRigid(off) if off == 3.0));
        assert!(matches!(fault("1 0 0 0 0 1 0 0 0 0 -1 0"), PoseFault::NotRigid(2.0)));
        assert_eq!(fault("1 0 0 inf 0 1 0 0 0 0 1 0"), PoseFault::NotFinite);
        assert_eq!(fault("1 0 0 3e12 0 1 0 0 0 0 1 0"), PoseFault::TooFar(3e12));
        assert_eq!(fault("1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1"), PoseFault::LastRow([1.0, 2.0, 3.0, 1.0]));
        assert!(matches!(fault("0 0 0 0 0 0 0"), PoseFault::NotRigid(1.0)));
        assert!(matches!(fault("0 0 0 0 0 0 0.9"), PoseFault::NotRigid(_)));
        let rounded = parse("0 0 0 0 0 0 0.9995").unwrap();
        let (pose, off) = rounded.poses[0].resolve(PoseConvention::default()).unwrap();
        assert!(pose.is_rigid() && (off - 2e-3).abs() < 1e-5);
    }

    #[test]
    fn errors_name_the_place() {
        let row = format!("{TURN} 1\n");
        for (text, part) in [
            ("1 2\n".to_owned(), "p.txt: line 1: the number of columns is 2; write 4"),
            ("1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18".into(), "the number of columns is 17"),
            ("# nothing\n\n".into(), "line 2: the number of poses is 0"),
            ("a b c d\n".into(), "line 1: column 1 is \"a\"; write a number"),
            (format!("{row}1 2 3\n"), "line 2: the number of columns is 3; give row 2 of a matrix"),
            (row.repeat(6), "line 5: the number of rows of the last matrix is 2; give all four rows"),
            (
                format!("0 0 1\n{row}{row}{row}{row}{row}"),
                "line 6: the number of columns is 4; give three integers",
            ),
            ("0.5 0 1\n".into(), "line 1: column 1 is 0.5; write three integers"),
            ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n".into(), "line 2: the number of columns is 7; give 8 columns"),
            ("nan 1 2 3 0 0 0 1\n".into(), "line 1: the time is NaN"),
        ] {
            says(parse(text), part);
        }
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let [a, b, c] = ROWS;
        for good in [
            format!("0 0 1\n{a}\n{b}\n{c}\n0 0 0 1\n"),
            format!("{a}\n{b}\n{c}\n0 0 0 1630577758.5\n"),
            format!("7.5 1 -2 3 {QUATERNION}\n8 1 -2 3 {QUATERNION}\n"),
        ] {
            for bytes in bad_bytes(good.as_bytes(), 5, 2000) {
                for raw in parse(bytes).iter().flat_map(|file| &file.poses) {
                    for convention in PoseConvention::ALL {
                        assert!(raw.resolve(convention).map_or(true, |(pose, _)| pose.is_rigid()));
                    }
                }
            }
        }
    }

    #[test]
    fn the_stamps_of_the_real_hall_are_in_the_corner() {
        let Some(path) = real_data("lidar3d_balm_hall/alidarPose.csv") else { return };
        let file = read_poses_3d(path).unwrap();
        assert_eq!((file.layout, file.poses.len()), (PoseLayout::Matrices, 96));
        let times: Vec<f64> = file.poses.iter().map(|p| p.time.unwrap()).collect();
        assert!(times.windows(2).all(|w| (w[1] - w[0] - 0.5).abs() < 0.01));
        assert_eq!(times[0], 1_630_577_758.569_49);
        assert!(file.poses.iter().all(|p| p.resolve(PoseConvention::default()).unwrap().1 < 1e-5));
    }
}
