//! A log with its poses in memory, whose scans are read on request.

use std::fmt;
use std::path::{Path, PathBuf};

use portolan::geom::vector::distance;
use portolan::geom::{Aabb, Pose, Trajectory};
use portolan::scan::{BeamCounts, Frame, FrameFilter};

use super::deskew::{Deskew, MotionStats};
use super::matching::{Match, match_poses};
use super::parts::{FrameSource, LayoutPoses, Parts, ScanId};
use super::{Camera, RefusedPose, ScanLogKind, ScanLogOptions, ScanLogStats, UnreadColors};
use crate::poses3::{MENDED_FROM, PoseConvention, RawPose, TrackPose, read_poses_3d};
use crate::{BagLogStats, IoError, Result};

/// A scan that has a pose.
struct Entry {
    /// Its place in the source.
    place: usize,
    world_from_sensor: Pose<3>,
    time: Option<f64>,
}

/// A log of 3-D scans with their poses. Scans are read by index on request, from any thread; only the poses are in
/// memory.
pub struct ScanLog {
    path: PathBuf,
    kind: ScanLogKind,
    name: String,
    source: Box<dyn FrameSource>,
    entries: Vec<Entry>,
    camera: Option<Camera>,
    stats: ScanLogStats,
    bag: Option<Box<BagLogStats>>,
    /// Takes the motion out of scans; `None`: it stays.
    deskew: Option<Deskew>,
}

impl ScanLog {
    /// Opens a log: finds its scans, reads its poses, matches them.
    ///
    /// # Errors
    /// [`IoError::Layout`] where the kind is not recognized, files are missing or do not fit together, or no scan has a
    /// usable pose; the errors of reading what holds the poses and the camera.
    pub fn open(path: &Path, options: &ScanLogOptions) -> Result<Self> {
        // A missing path gets the system's own error.
        std::fs::metadata(path).map_err(|e| IoError::os(path, "open it", e))?;
        let kind = options.format.or_else(|| ScanLogKind::recognize(path)).ok_or_else(|| {
            let advice = format!(
                "the kinds are {}; choose one with --format",
                ScanLogKind::ALL.map(ScanLogKind::word).join(", ")
            );
            IoError::layout(path, "the kind of log", "not recognized", advice)
        })?;
        let parts = kind.parts(path, options)?;
        Self::assemble(path, kind, parts, options)
    }

    fn assemble(path: &Path, kind: ScanLogKind, parts: Parts, options: &ScanLogOptions) -> Result<Self> {
        let Parts {
            name,
            source,
            scans,
            poses,
            convention,
            posed_from_sensor,
            camera,
            mut stats,
            bag,
            uses_named_poses,
        } = parts;
        if scans.is_empty() {
            return Err(IoError::layout(path, "the number of scans", "0", "give a log with scans"));
        }
        // A file that the caller names has nothing to do with the oddities of the layout.
        let convention = match &options.poses {
            Some(_) => PoseConvention::WorldFromSensor,
            None => convention,
        };
        let convention = match uses_named_poses {
            true => PoseConvention::WorldFromSensor,
            false => options.pose_convention.unwrap_or(convention),
        };
        let mut resolver = Resolver { convention, posed_from_sensor, stats: &mut stats };
        let named = options.poses.as_ref().filter(|_| !uses_named_poses).map(read_poses_3d).transpose()?;
        let (matches, trajectory) = match (named, poses) {
            (Some(file), _) | (None, LayoutPoses::File(file)) => {
                let track: Vec<TrackPose> =
                    file.poses.iter().map(|raw| resolver.resolve(&file.path, raw)).collect();
                match_poses(&scans, &track, options.time_tolerance, &file.path, &mut stats)?
            }
            (None, LayoutPoses::PerScan(all)) => (resolver.per_scan(&all), None),
            (None, LayoutPoses::Missing(looked_for)) => {
                let advice = format!("looked for {looked_for}; name a file with --poses");
                return Err(IoError::layout(path, "the pose file", "missing", advice));
            }
        };
        stats.scans = scans.len() as u64;
        let entries = entries(&scans, &matches);
        if entries.is_empty() {
            let value = format!("0 of {}", scans.len());
            let advice = match stats.refused_poses.first() {
                Some(first) => format!("the first refused pose: {first}"),
                None => "give poses with --poses: no scan has one".into(),
            };
            return Err(IoError::layout(path, "the number of scans with a usable pose", value, advice));
        }
        let deskew = options.deskew.then(|| Deskew::new(trajectory.or_else(|| trajectory_of(&entries))));
        Ok(Self { path: path.into(), kind, name, source, entries, camera, stats, bag, deskew })
    }

    /// Only every `n`-th scan of it, from the first; 0 counts as 1. [`ScanLog::stats`] stays about all of it.
    pub fn every(mut self, n: usize) -> Self {
        self.entries = self.entries.into_iter().step_by(n.max(1)).collect();
        self
    }

    /// Where the log is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The kind of log; in words: [`ScanLogKind::label`].
    pub fn kind(&self) -> ScanLogKind {
        self.kind
    }

    /// The name of the log: of its folder or file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of scans with a usable pose, at least one.
    #[allow(clippy::len_without_is_empty)] // a log without scans is an error
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// The pose of scan `i`, `world_from_sensor`. Panics for an `i` beyond the last.
    pub fn pose(&self, i: usize) -> &Pose<3> {
        &self.entries[i].world_from_sensor
    }

    /// Where the sensor stood in the world when it took scan `i` (meters). Not always the pose's translation: clouds that are
    /// in the world's frame already have the identity as their pose. Panics for an `i` beyond the last.
    pub fn sensor_position(&self, i: usize) -> [f64; 3] {
        let entry = &self.entries[i];
        entry.world_from_sensor.transform_point(self.source.origin(entry.place))
    }

    /// Whether every scan says where it was seen from, or the caller did. Where not, its frames have
    /// [`Origin::Unknown`](portolan::scan::Origin::Unknown): they are points without rays, and free nothing.
    pub fn knows_origins(&self) -> bool {
        self.source.knows_origins()
    }

    /// The stamp of scan `i` (seconds of some clock), if there is one. Panics for an `i` beyond the last.
    pub fn time(&self, i: usize) -> Option<f64> {
        self.entries[i].time
    }

    /// Reads scan `i`. Panics for an `i` beyond the last.
    ///
    /// # Errors
    /// [`IoError`] where its file cannot be read or is damaged. A damaged color picture beside a depth image is not an error: the frame
    /// is without colors then, and [`ScanLog::unread_colors`] counts it.
    pub fn frame(&self, i: usize) -> Result<Frame> {
        self.source.frame(self.entries[i].place)
    }

    /// Reads scan `i`, leaves out what the filter does not use, and takes out the motion of the sensor while it scanned: where
    /// points have times and poses cover them, each is moved to where it is in the frame of the scan's pose and begins where the
    /// sensor was ([`portolan::scan::PointScan::deskew`]); [`ScanLog::motion`] says what became of it. Panics for an `i` beyond
    /// the last.
    ///
    /// # Errors
    /// As [`ScanLog::frame`].
    pub fn filtered_frame(&self, i: usize, filter: &FrameFilter) -> Result<(Frame, BeamCounts)> {
        // The robot's own body is where it is in the frame of the moment, so that it is left out first.
        let (frame, counts) = filter.apply(self.frame(i)?);
        let Some(deskew) = &self.deskew else { return Ok((frame, counts)) };
        let ends = || {
            let last = self.len() - 1;
            Some([(self.time(0)?, self.frame(0).ok()?), (self.time(last)?, self.frame(last).ok()?)])
        };
        Ok((deskew.apply(i, frame, (self.pose(i), self.time(i)), ends), counts))
    }

    /// What became of the motion within the scans that [`ScanLog::filtered_frame`] has read so far; `None` where it is left in
    /// ([`ScanLogOptions::deskew`]).
    pub fn motion(&self) -> Option<MotionStats> {
        self.deskew.as_ref().map(Deskew::stats)
    }

    /// The color pictures that could not be read, among the frames that were read so far: they are found only then, so that
    /// this is to be asked after the last. `None` where all could.
    pub fn unread_colors(&self) -> Option<UnreadColors> {
        self.source.unread_colors()
    }

    /// What was found, and what was left out.
    pub fn stats(&self) -> &ScanLogStats {
        &self.stats
    }

    /// What was chosen and left out, if the log is a bag.
    pub fn bag(&self) -> Option<&BagLogStats> {
        self.bag.as_deref()
    }

    /// The camera, if the log is of one: where its numbers come from.
    pub fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    /// The box of the sensor's positions (meters).
    pub fn extent(&self) -> Aabb<3> {
        let mut all = Aabb::EMPTY;
        (0..self.len()).for_each(|i| all.include(self.sensor_position(i)));
        all
    }

    /// The length of the way from scan to scan (meters).
    pub fn path_length(&self) -> f64 {
        (1..self.len()).map(|i| distance(self.sensor_position(i - 1), self.sensor_position(i))).sum()
    }

    /// The first and the last stamp (seconds), where every scan has one.
    pub fn time_span(&self) -> Option<(f64, f64)> {
        self.entries.iter().try_fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), entry| {
            entry.time.map(|t| (first.min(t), last.max(t)))
        })
    }
}

impl fmt::Debug for ScanLog {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ScanLog")
            .field("path", &self.path)
            .field("kind", &self.kind)
            .field("scans", &self.len())
            .finish_non_exhaustive()
    }
}

/// Makes poses of what files hold and counts.
struct Resolver<'a> {
    convention: PoseConvention,
    posed_from_sensor: Option<Pose<3>>,
    stats: &'a mut ScanLogStats,
}

impl Resolver<'_> {
    fn resolve(&mut self, path: &Path, raw: &RawPose) -> TrackPose {
        self.stats.poses += 1;
        let pose = match raw.resolve(self.convention) {
            Ok((pose, off)) => {
                self.stats.mended_poses += u64::from(off > MENDED_FROM);
                self.stats.worst_pose = self.stats.worst_pose.max(off);
                Some(self.posed_from_sensor.map_or(pose, |sensor| pose * sensor))
            }
            Err(fault) => {
                self.stats.refused_poses.push(RefusedPose { path: path.into(), line: raw.line, fault });
                None
            }
        };
        TrackPose { pose, time: raw.time, number: raw.number }
    }

    fn per_scan(&mut self, all: &[Option<(PathBuf, RawPose)>]) -> Vec<Match> {
        let one = |held: &Option<(PathBuf, RawPose)>| {
            let Some((path, raw)) = held else {
                self.stats.scans_without_pose += 1;
                return Match::LeftOut;
            };
            let entry = self.resolve(path, raw);
            entry.pose.map_or(Match::LeftOut, |pose| Match::Posed(pose, entry.time))
        };
        all.iter().map(one).collect()
    }
}

/// The trajectory that the scans' own poses and stamps are; `None` where they have no stamps, or these are none.
fn trajectory_of(entries: &[Entry]) -> Option<Trajectory<3>> {
    let stamped: Option<Vec<_>> = entries.iter().map(|e| Some((e.time?, e.world_from_sensor))).collect();
    Trajectory::new(stamped?).ok().filter(|poses| poses.len() > 1)
}

fn entries(scans: &[ScanId], matches: &[Match]) -> Vec<Entry> {
    let both = scans.iter().zip(matches).enumerate();
    both.filter_map(|(place, (scan, found))| match found {
        Match::Posed(pose, time) => {
            Some(Entry { place, world_from_sensor: *pose, time: scan.time.or(*time) })
        }
        Match::LeftOut => None,
    })
    .collect()
}
