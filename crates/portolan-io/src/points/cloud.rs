//! What point-cloud files hold, as plain data.

use std::path::Path;

use portolan::geom::Pose;
use portolan::scan::{Origin, PointScan, RefusedBeams};

use crate::{IoError, Result};

/// A cloud of points as a file holds it. Lists beside `points` have one entry per point, or are empty where the file
/// does not have them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloudFile {
    /// What is to be added to every point (meters): zero unless the file holds doubles or text far from its zero, where an
    /// `f32` would lose millimeters. Whole meters.
    pub offset: [f64; 3],
    /// Points (meters) in the file's frame less `offset`. All are finite.
    pub points: Vec<[f32; 3]>,
    /// Strength of the echo, in the sensor's own unit.
    pub intensity: Vec<f32>,
    /// Seconds after `start_time`.
    pub times: Vec<f32>,
    /// The earliest time of a point (seconds, in the file's clock), where there are `times`.
    pub start_time: f64,
    /// Number of the laser that saw the point.
    pub rings: Vec<u16>,
    /// Red, green, blue.
    pub colors: Vec<[u8; 3]>,
    /// Normals as the file has them; not made unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Rows and columns, where the file has more than one row.
    pub grid: Option<CloudGrid>,
    /// Pose of the sensor by the file's header.
    pub viewpoint: Option<Viewpoint>,
    /// Points that were refused, by cause.
    pub refused: RefusedPoints,
}

/// The rows and columns of an organized cloud.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CloudGrid {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// The pixel of each point, `row * columns + column`. Pixels without a point had no reading.
    pub pixels: Vec<u32>,
}

/// Position and orientation of a sensor in a PCD header. It is **never applied** to points: some writers
/// store points that were moved already, others do not, and the file does not record which.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Position of the sensor (meters).
    pub position: [f64; 3],
    /// Orientation, `(x, y, z, w)`.
    pub quaternion: [f64; 4],
}

impl Viewpoint {
    /// The viewpoint of writers that do not have one.
    pub const NONE: Self = Self { position: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] };

    /// As a pose; `None` where the quaternion is zero or something is not finite.
    pub fn pose(&self) -> Option<Pose<3>> {
        let finite = self.position.iter().all(|v| v.is_finite());
        Pose::from_quaternion(self.position, self.quaternion).filter(|_| finite)
    }
}

/// Why points were left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefusedPoints {
    /// A coordinate is NaN or infinite, in a file without rows and columns.
    pub not_finite: u64,
    /// A coordinate is beyond 10^8 m, farther than any map on Earth reaches.
    pub too_far: u64,
    /// Pixels of an organized cloud that are NaN or empty: without a reading, which is not a fault.
    pub no_reading: u64,
}

impl PointCloudFile {
    /// The cloud as a scan, whose points are about [`PointCloudFile::offset`] and whose rays begin at `origin` (meters, in
    /// the file's frame, that is with the offset). A pose for the file's frame is to be moved by
    /// [`PointCloudFile::file_from_points`].
    ///
    /// Rows and columns are not looked at; points on the origin itself are refused and counted.
    pub fn into_scan(self, origin: [f64; 3]) -> PointScan {
        let origin: [f64; 3] = std::array::from_fn(|k| origin[k] - self.offset[k]);
        let at_origin = |p: &[f32; 3]| (0..3).all(|k| f64::from(p[k]) == origin[k]);
        let mut scan = PointScan {
            origin: Origin::Common(origin),
            points: self.points,
            free_ends: Vec::new(),
            times: self.times,
            start_time: self.start_time,
            colors: self.colors,
            image: None,
            delivered: None,
            refused: RefusedBeams {
                not_finite: self.refused.not_finite,
                too_far: self.refused.too_far,
                ..RefusedBeams::default()
            },
        };
        if scan.points.iter().any(at_origin) {
            let away: Vec<bool> = scan.points.iter().map(|p| !at_origin(p)).collect();
            scan.refused.too_near = away.iter().filter(|a| !**a).count() as u64;
            keep(&mut scan.points, &away);
            keep(&mut scan.times, &away);
            keep(&mut scan.colors, &away);
        }
        scan
    }

    /// Refuses lists that are neither empty nor as long as the points: those of all formats, and `more` of them.
    pub(crate) fn check_lists(&self, path: &Path, more: &[(&str, usize)]) -> Result<()> {
        let (n, intensities) = (self.points.len(), ("intensities", self.intensity.len()));
        let all = [intensities, ("colors", self.colors.len()), ("normals", self.normals.len())];
        match all.iter().chain(more).find(|(_, length)| *length != 0 && *length != n) {
            Some((name, length)) => {
                let (field, advice) =
                    (format!("the number of {name}"), format!("give {n}, or an empty list"));
                Err(IoError::unwritable(path, field, length, advice))
            }
            None => Ok(()),
        }
    }

    /// The transform from the frame of `points` to the file's frame: the offset.
    pub fn file_from_points(&self) -> Pose<3> {
        Pose { translation: self.offset, ..Pose::IDENTITY }
    }

    /// Point `i` in the file's frame (meters). Panics for an `i` beyond the last.
    pub fn position(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|k| f64::from(self.points[i][k]) + self.offset[k])
    }
}

/// Keeps the entries of a list that is as long as `which`; an empty list stays empty.
fn keep<T>(list: &mut Vec<T>, which: &[bool]) {
    let mut flags = which.iter();
    list.retain(|_| flags.next().is_none_or(|k| *k));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_leave_out_what_lies_on_the_origin() {
        let cloud = PointCloudFile {
            offset: [500_000.0, 0.0, 0.0],
            points: vec![[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]],
            times: vec![0.0, 0.1, 0.2],
            refused: RefusedPoints { not_finite: 1, too_far: 2, no_reading: 9 },
            ..PointCloudFile::default()
        };
        assert_eq!(cloud.position(2), [500_003.0, 0.0, 0.0]);
        assert_eq!(cloud.file_from_points().translation, cloud.offset);
        let scan = cloud.into_scan([500_002.0, 0.0, 0.0]);
        assert_eq!(scan.points, [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
        assert_eq!(scan.times, [0.0, 0.2]);
        assert_eq!(scan.origin, Origin::Common([2.0, 0.0, 0.0]));
        let refused = scan.refused;
        assert_eq!((refused.not_finite, refused.too_far, refused.too_near), (1, 2, 1));
    }

    #[test]
    fn broken_viewpoints_are_no_pose() {
        assert_eq!(Viewpoint::NONE.pose(), Some(Pose::IDENTITY));
        assert_eq!(Viewpoint { quaternion: [0.0; 4], ..Viewpoint::NONE }.pose(), None);
        assert_eq!(Viewpoint { position: [f64::NAN, 0.0, 0.0], ..Viewpoint::NONE }.pose(), None);
    }
}
