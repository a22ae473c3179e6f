//! Files of terrestrial scanners (E57, PTX): scans that have their poses with them.

use std::path::{Path, PathBuf};

use portolan::scan::Frame;

use super::ScanLogOptions;
use super::cloud_frames::{about, file_from_frames, scan_from, without_rays};
use super::clouds::{Assumed, assumed};
use super::parts::{FrameSource, LayoutPoses, Parts, ScanId};
use crate::points::{PointFormat, posed_clouds, scan_of};
use crate::poses3::RawPose;
use crate::{IoError, Result};

/// Points of each scan that say where it is. As many as a cloud's offset is chosen by.
const LOOKED_AT: usize = 1024;

/// Where a scan is.
struct Place {
    file: PathBuf,
    /// Which of the file.
    number: usize,
    /// Whole meters that are taken off every point.
    base: [f64; 3],
    /// Where rays begin in the scan's frame; `None`: nobody knows.
    origin: Option<[f64; 3]>,
}

struct ScannerFrames {
    places: Vec<Place>,
    format: PointFormat,
}

/// Scans of files, in the order of the files.
///
/// # Errors
/// Those of the readers. [`IoError::Layout`] where poses are named for scans that lie far from each other's zero.
pub(super) fn open(
    path: &Path,
    files: &[PathBuf],
    format: PointFormat,
    options: &ScanLogOptions,
) -> Result<Parts> {
    let (mut places, mut scans, mut poses, mut notes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut damaged = Vec::new();
    for file in files {
        let clouds = match posed_clouds(file, format, LOOKED_AT) {
            Ok(clouds) => clouds,
            Err(error) => {
                damaged.push(error);
                continue;
            }
        };
        for (number, scan) in clouds.into_iter().enumerate() {
            let base = scan.cloud.offset;
            let stated = scan.origin.filter(|_| options.poses.is_none());
            // A name for a message: of several scans the first is enough.
            let origin = match options.origin.or(stated) {
                Some(origin) => Some(origin),
                None if options.poses.is_some() || options.points_only => Some([0.0; 3]),
                None => match assumed(file, || whole(file, format, number), base)? {
                    Assumed::Zero(note) => {
                        notes.extend(note);
                        Some([0.0; 3])
                    }
                    Assumed::Nowhere(note) => {
                        notes.push(note);
                        None
                    }
                },
            };
            let raw = scan.file_from_scan.unwrap_or_else(unmoved);
            // What is posed are the points less their base.
            let moved = |row: usize| (0..3).map(|k| raw.matrix[row][k] * base[k]).sum::<f64>();
            let mut about_base = raw.clone();
            (0..3).for_each(|row| about_base.matrix[row][3] += moved(row));
            poses.push(Some((file.clone(), about_base)));
            scans.push(ScanId { path: file.clone(), number: Some(number as u64), time: None });
            places.push(Place { file: file.clone(), number, base, origin });
        }
        if format == PointFormat::E57 {
            notes.extend(told(file, &crate::e57_about(file)?));
        }
    }
    let (lost, of) = (damaged.len(), files.len());
    if let Some(first) = damaged.into_iter().next() {
        if 2 * lost > of {
            return Err(first);
        }
        notes.push(format!("{lost} of {of} files could not be read and are left out (first: {first})"));
    }
    let mut posed_from_sensor = None;
    if options.poses.is_some() {
        // One transform for all: poses are those of the scans' own frames.
        let base = places.first().map_or([0.0; 3], |place| place.base);
        places.iter_mut().for_each(|place| place.base = base);
        posed_from_sensor = file_from_frames(base);
    }
    notes.dedup();
    let parts = Parts::new(path, ScannerFrames { places, format }, scans, LayoutPoses::PerScan(poses));
    Ok(Parts { posed_from_sensor, stats: super::ScanLogStats { warnings: notes, ..parts.stats }, ..parts })
}

/// What of a file is not used.
fn told(file: &Path, about: &crate::E57About) -> Vec<String> {
    let (shown, scans) = (file.display(), about.scans);
    let mut notes = Vec::new();
    if about.images > 0 {
        notes.push(format!("{} pictures in {shown} are not read", about.images));
    }
    if about.with_times > 0 {
        notes.push(format!(
            "{} of {scans} scans in {shown} have times, which are not used: each scan is of one place",
            about.with_times
        ));
    }
    if about.with_invalid_colors > 0 {
        let (some, all) = (about.with_invalid_colors, about.with_colors);
        notes.push(format!(
            "{some} of {all} scans with colors in {shown} have points without one, which count as black (--no-color leaves \
             colors out)"
        ));
    }
    notes
}

fn unmoved() -> RawPose {
    RawPose::new(portolan::geom::Pose::<3>::IDENTITY.rotation, [0.0; 3], 1)
}

fn whole(file: &Path, format: PointFormat, number: usize) -> Result<crate::PointCloudFile> {
    Ok(scan_of(file, format, number)?.cloud)
}

impl FrameSource for ScannerFrames {
    fn frame(&self, i: usize) -> Result<Frame> {
        let Some(Place { file, number, base, origin }) = self.places.get(i) else {
            return Err(IoError::layout(Path::new(""), "a scan", i, "give one of the log"));
        };
        let cloud = about(whole(file, self.format, *number)?, *base, file)?;
        Ok(Frame::Points(match origin {
            Some(origin) => scan_from(cloud, *origin),
            None => without_rays(cloud),
        }))
    }

    fn origin(&self, i: usize) -> [f64; 3] {
        let place = &self.places[i];
        let origin = place.origin.unwrap_or(place.base);
        std::array::from_fn(|k| origin[k] - place.base[k])
    }

    fn knows_origins(&self) -> bool {
        self.places.iter().all(|place| place.origin.is_some())
    }
}
