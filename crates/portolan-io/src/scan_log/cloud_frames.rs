//! The scans of a lidar: a cloud of points each.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use portolan::geom::Pose;
use portolan::scan::{Frame, OrganisedPoints, Origin, PointScan, orthographic_image};

use super::parts::FrameSource;
use crate::points::{CloudGrid, PointCloudFile, PointFormat, RefusedPoints, read_points_as};
use crate::poses3::TimedPoses;
use crate::{IoError, Result};

/// Where the rays of a log's clouds begin.
#[derive(Clone)]
pub(super) enum Rays {
    /// In one point a scan, in the frame of the files (meters).
    From(Vec<[f64; 3]>),
    /// Above each point: a scanner that looks along -z from far away.
    Parallel,
    /// Nobody knows where: there are no rays.
    Unknown,
    /// Where a scanner was at the time of each point, within so many seconds.
    Along(Arc<TimedPoses>, f64),
}

/// Reads clouds.
pub(super) struct CloudFrames {
    files: Vec<PathBuf>,
    format: Option<PointFormat>,
    rays: Rays,
    /// Whole meters that are taken off every point, so that an `f32` holds clouds far from zero.
    base: [f64; 3],
}

impl CloudFrames {
    /// `format`: of all files; `None`: each file's own. The first file with points is looked at where files may hold points
    /// far from their zero: all frames are about its offset, which is [`CloudFrames::files_from_frames`].
    pub(super) fn new(files: Vec<PathBuf>, format: Option<PointFormat>, rays: Rays) -> Result<Self> {
        // These are never far: they hold nothing but floats.
        let looked_at = if format == Some(PointFormat::KittiBin) { &[][..] } else { &files };
        let (mut base, mut damaged, mut read) = ([0.0; 3], None, 0);
        for file in looked_at {
            match read_points_as(file, format) {
                Ok(cloud) if !cloud.points.is_empty() => {
                    (base, damaged) = (cloud.offset, None);
                    break;
                }
                Ok(_) => read += 1,
                // A scan less: whoever asks for it is told.
                Err(error) => damaged = damaged.or(Some(error)),
            }
        }
        match damaged {
            Some(error) if read == 0 => Err(error),
            _ => Ok(Self { files, format, rays, base }),
        }
    }

    /// The same frames without rays.
    pub(super) fn without_rays(self) -> Self {
        Self { rays: Rays::Unknown, ..self }
    }

    /// Whole meters that are taken off every point.
    pub(super) fn base(&self) -> [f64; 3] {
        self.base
    }

    /// What leads from the frames' points to the files': the offset. `None` where they are the same.
    pub(super) fn files_from_frames(&self) -> Option<Pose<3>> {
        file_from_frames(self.base)
    }
}

/// What leads from points about `base` to those of the file. `None` where they are the same.
pub(crate) fn file_from_frames(base: [f64; 3]) -> Option<Pose<3>> {
    (base != [0.0; 3]).then_some(Pose { translation: base, ..Pose::IDENTITY })
}

impl FrameSource for CloudFrames {
    fn frame(&self, i: usize) -> Result<Frame> {
        let cloud = about(read_points_as(&self.files[i], self.format)?, self.base, &self.files[i])?;
        if cloud.points.is_empty() && cloud.refused == RefusedPoints::default() {
            let advice = "nothing was seen, or nothing was written; the scan is left out";
            return Err(IoError::layout(&self.files[i], "the number of points", "0", advice));
        }
        Ok(Frame::Points(match &self.rays {
            Rays::From(origins) => scan_from(cloud, origins[i]),
            Rays::Parallel => range_scan(cloud, &self.files[i])?,
            Rays::Unknown => without_rays(cloud),
            Rays::Along(poses, tolerance) => scan_along(cloud, poses, *tolerance, &self.files[i])?,
        }))
    }

    fn origin(&self, i: usize) -> [f64; 3] {
        match &self.rays {
            Rays::From(origins) => std::array::from_fn(|k| origins[i][k] - self.base[k]),
            Rays::Parallel | Rays::Unknown | Rays::Along(..) => [0.0; 3],
        }
    }

    fn knows_origins(&self) -> bool {
        !matches!(self.rays, Rays::Unknown)
    }
}

/// How far the offset of a scan may be from that of the first (meters): beyond, an `f32` is coarser than 4 mm.
const FARTHEST_APART: f64 = 65_536.0;

/// The cloud with another offset.
///
/// # Errors
/// [`IoError::Layout`] for a cloud so far from there that its shape would be lost.
pub(crate) fn about(mut cloud: PointCloudFile, base: [f64; 3], path: &Path) -> Result<PointCloudFile> {
    if cloud.offset != base {
        let apart = (0..3).any(|k| (cloud.offset[k] - base[k]).abs() > FARTHEST_APART);
        if apart && !cloud.points.is_empty() {
            let (value, advice) = (
                format!("about {:?} m", cloud.offset),
                format!("the first scan's are about {base:?} m; give scans of one place, within 65 km"),
            );
            return Err(IoError::layout(path, "the place of the points", value, advice));
        }
        let moved = (0..cloud.points.len()).map(|i| {
            let p = cloud.position(i);
            std::array::from_fn(|k| (p[k] - base[k]) as f32)
        });
        cloud.points = moved.collect();
        cloud.offset = base;
    }
    Ok(cloud)
}

/// A scan of rays from one point (in the file's frame), with an image about that point where the cloud has rows and columns
/// that a sensor can have.
pub(crate) fn scan_from(cloud: PointCloudFile, origin: [f64; 3]) -> PointScan {
    let image = cloud.grid.as_ref().and_then(|grid| {
        let about_origin = |i: usize| std::array::from_fn(|k| (cloud.position(i)[k] - origin[k]) as f32);
        let points: Vec<[f32; 3]> = (0..cloud.points.len()).map(about_origin).collect();
        let CloudGrid { columns, rows, ref pixels } = *grid;
        OrganisedPoints { points: &points, pixels, colors: &cloud.colors, columns, rows }.image()
    });
    PointScan { image, ..cloud.into_scan(origin) }
}

/// Points that nobody knows the origin of.
pub(super) fn without_rays(cloud: PointCloudFile) -> PointScan {
    // Nothing lies on this origin: it is replaced.
    PointScan { origin: Origin::Unknown, ..cloud.into_scan([f64::INFINITY; 3]) }
}

/// Points of a scanner on its way: rays begin where it was at the time of each. Points without a pose near in time have no
/// origin, so that maps refuse and count them.
///
/// # Errors
/// [`IoError::Layout`] for points without times, and where no pose is near any.
fn scan_along(cloud: PointCloudFile, poses: &TimedPoses, tolerance: f64, path: &Path) -> Result<PointScan> {
    if cloud.times.len() != cloud.points.len() {
        let advice = "leave --poses out to take the points without rays";
        return Err(IoError::layout(path, "the times of the points", "missing", advice));
    }
    let (start, base) = (cloud.start_time, cloud.offset);
    let origin = |time: &f32| match poses.at(start + f64::from(*time), tolerance) {
        Some(pose) => std::array::from_fn(|k| (pose.translation[k] - base[k]) as f32),
        None => [f32::NAN; 3],
    };
    let origins: Vec<[f32; 3]> = cloud.times.iter().map(origin).collect();
    if origins.iter().all(|o| o[0].is_nan()) {
        let last = cloud.times.iter().copied().fold(0.0, f32::max);
        let (first, end) = poses.span().unwrap_or_default();
        let value = format!("0 of {}", cloud.points.len());
        let advice = format!(
            "points have times from {start} to {} s, poses from {first} to {end} s: give poses of the same clock, or a larger \
             --time-tolerance",
            start + f64::from(last)
        );
        return Err(IoError::layout(path, "the number of points with a pose near in time", value, advice));
    }
    // Nothing lies on this origin: it is replaced.
    Ok(PointScan { origin: Origin::PerPoint(origins), ..cloud.into_scan([f64::INFINITY; 3]) })
}

/// A range scan of parallel rays: the points as they are, each with its own origin, and the image of them.
fn range_scan(cloud: PointCloudFile, path: &Path) -> Result<PointScan> {
    let grid = cloud.grid.clone();
    let highest = cloud.points.iter().map(|p| p[2]).fold(f32::NEG_INFINITY, f32::max);
    let image = grid.and_then(|g| orthographic_image(&cloud.points, &g.pixels, g.columns, g.rows));
    let top = match image.as_ref().map(|i| &i.projection) {
        Some(portolan::scan::Projection::Orthographic { top, .. }) => *top as f32,
        _ => highest + height_above(&cloud.points),
    };
    if cloud.points.is_empty() {
        return Err(IoError::layout(path, "the number of points", "0", "give a range scan with points"));
    }
    let origins = cloud.points.iter().map(|p| [p[0], p[1], top]).collect();
    // Nothing lies on this origin: it is replaced.
    let mut scan = cloud.into_scan([f64::INFINITY; 3]);
    scan.origin = Origin::PerPoint(origins);
    scan.image = image;
    Ok(scan)
}

/// How far above the highest point rays begin without an image: a hundredth of the scan's size.
fn height_above(points: &[[f32; 3]]) -> f32 {
    let extent = |k: usize| {
        let (low, high) = points.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        high - low
    };
    0.01 * extent(0).max(extent(1)).max(extent(2)).max(1e-6)
}
