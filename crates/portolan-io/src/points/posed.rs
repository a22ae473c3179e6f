//! Clouds that say where they were seen from: scans in the files of terrestrial scanners.

use portolan::geom::Pose;

use super::PointCloudFile;
use crate::poses3::RawPose;

/// A scan of a file with several.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedCloud {
    /// The points in the scan's own frame.
    pub cloud: PointCloudFile,
    /// What leads from there to the file's frame, as the file has it; `None`: it has none, and the frames are the same.
    pub file_from_scan: Option<RawPose>,
    /// Where the scanner stood in the scan's own frame (meters); `None`: the file does not say.
    pub origin: Option<[f64; 3]>,
    /// The scan's name, if it has one.
    pub name: Option<String>,
}

impl PosedCloud {
    /// The points in the file's frame, without rows and columns; `None` where the pose is none.
    pub fn in_file(mut self) -> Option<PointCloudFile> {
        let Some(raw) = &self.file_from_scan else { return Some(self.cloud) };
        let (pose, _) = raw.resolve(crate::poses3::PoseConvention::WorldFromSensor).ok()?;
        let cloud = &mut self.cloud;
        let turned = |v: &[f32; 3]| pose.rotate(v.map(f64::from)).map(|c| c as f32);
        cloud.normals.iter_mut().for_each(|n| *n = turned(n));
        let moved = pose * cloud.file_from_points();
        let offset = if moved.translation.iter().any(|v| v.abs() > super::builder::FAR) {
            moved.translation.map(f64::round)
        } else {
            [0.0; 3]
        };
        let about = Pose { translation: std::array::from_fn(|k| moved.translation[k] - offset[k]), ..moved };
        for p in &mut cloud.points {
            *p = about.transform_point(p.map(f64::from)).map(|c| c as f32);
        }
        (cloud.offset, cloud.grid) = (offset, None);
        Some(self.cloud)
    }
}

/// Scans joined into one cloud. Lists that not all have are left out.
pub(super) fn joined(clouds: Vec<PointCloudFile>) -> PointCloudFile {
    let mut parts = clouds.into_iter();
    let Some(mut all) = parts.next() else { return PointCloudFile::default() };
    for part in parts {
        let n = all.points.len();
        for i in 0..part.points.len() {
            let p = part.position(i);
            all.points.push(std::array::from_fn(|k| (p[k] - all.offset[k]) as f32));
        }
        append(&mut all.intensity, part.intensity, n);
        append(&mut all.colors, part.colors, n);
        append(&mut all.normals, part.normals, n);
        append(&mut all.rings, part.rings, n);
        // Times of scans begin anew.
        all.times.clear();
        all.grid = None;
        all.refused.not_finite += part.refused.not_finite;
        all.refused.too_far += part.refused.too_far;
        all.refused.no_reading += part.refused.no_reading;
    }
    let n = all.points.len();
    if all.intensity.len() != n {
        all.intensity.clear();
    }
    if all.colors.len() != n {
        all.colors.clear();
    }
    if all.normals.len() != n {
        all.normals.clear();
    }
    if all.rings.len() != n {
        all.rings.clear();
    }
    all
}

/// Only behind a list that is whole.
fn append<T>(all: &mut Vec<T>, part: Vec<T>, points: usize) {
    if all.len() == points {
        all.extend(part);
    }
}
