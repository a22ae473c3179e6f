//! 2-D: the scans of planar lasers in a bag.

use std::path::Path;
use std::sync::Arc;

use portolan::geom::{Pose, Trajectory};
use portolan_ros::message::{EchoChoice, LaserScan, MessageKind};

use super::pose_source::{NoPose, PoseSource, SensorFrames};
use super::{BagLogStats, Contents};
use crate::laser_log::{Entry, FanShape, Fans, LaserLog, LaserLogStats, MOST_READINGS, MOST_SCANS};
use crate::scan_log::ScanLogOptions;
use crate::{IoError, Result, read_poses_2d};

/// More beams than any planar laser has.
const MOST_BEAMS: usize = 100_000;
/// Scans whose plane is tilted by more than this (radians) are refused: what they see is not at one height.
const MOST_TILT: f64 = 0.26;
/// Poses that are asked for while a scan goes on, beside that of its begin.
const KNOTS: u32 = 8;
/// No scan of a planar laser lasts longer (seconds).
const LONGEST_SCAN: f64 = 2.0;
/// Scans whose plane is tilted by more than this (radians) are counted.
const TOLD_TILT: f64 = 0.035;

impl LaserLog {
    /// Reads the planar lasers of a bag, each scan with its pose at its stamp. Of [`ScanLogOptions`] `poses` (of the laser
    /// itself: by stamp where they have stamps, else one for each scan), `time_tolerance` and `bag` count.
    ///
    /// Scans are as the sensor gave them ([`RawLaserScan::declared`](crate::RawLaserScan::declared) has its range), but for a
    /// laser that hangs upside down: its bearings are those seen from above. Of several echoes of a beam the first is taken.
    ///
    /// # Errors
    /// [`IoError::Bag`] for a bag that cannot be read; [`IoError::Layout`] where it has no planar laser, no poses, or no scan
    /// that can be used: with the first reason.
    pub fn read_bag(path: impl AsRef<Path>, options: &ScanLogOptions) -> Result<Self> {
        let path = path.as_ref();
        let advice = "they are 3-D; name a LaserScan with --topic for a map in 2-D";
        let (contents, names, mut stats) = Contents::of_scans(path, &options.bag, 2, advice)?;
        let mut scans = Vec::new();
        for name in &names {
            let mut of_topic = read_scans(&contents, name, &mut stats)?;
            // A file's poses have the stamps of the scans that they were made of.
            let guess = options.poses.is_none();
            move_in_time(&mut of_topic, name, options.bag.time_offset, guess, &mut stats);
            scans.append(&mut of_topic);
        }
        scans.sort_by_key(|s| s.log_time);
        let readings: usize = scans.iter().map(|s| s.scan.ranges.len()).sum();
        if readings > MOST_READINGS || scans.len() > MOST_SCANS {
            let value = format!("over {MOST_READINGS} readings or {MOST_SCANS} scans");
            return Err(IoError::layout(path, "the log", value, "split the bag into parts"));
        }
        let poses = Poses::new(&contents, options, scans.len(), &mut stats)?;
        stats.notes.extend(contents.note_of_longer());
        Reading::default().run(&contents, &scans, &poses, stats)
    }
}

/// A scan, and when it was recorded (nanoseconds).
struct Recorded {
    scan: LaserScan,
    log_time: i64,
}

/// All scans of a topic, in the order of their log times.
fn read_scans(contents: &Contents, name: &str, stats: &mut BagLogStats) -> Result<Vec<Recorded>> {
    let numbers = &contents.numbers(name)[..];
    let decoders = contents.decoders(numbers)?;
    decoders.notes(&mut stats.notes);
    let mut scans = Vec::new();
    let (mut readings, mut unstamped) = (0usize, 0u64);
    for message in contents.bag.messages(numbers) {
        stats.messages += 1;
        let kind = contents.kind(message.topic);
        let read = contents.read(&message, &decoders, |record| match kind {
            Some(MessageKind::MultiEchoLaserScan) => LaserScan::of_echoes(record, EchoChoice::First),
            _ => LaserScan::of(record),
        });
        let mut scan = match read {
            Ok(scan) => scan,
            Err(error) => {
                stats.refuse("cannot be read", || error.to_string());
                continue;
            }
        };
        if scan.header.stamp == 0 {
            unstamped += 1;
            scan.header.stamp = message.log_time;
        }
        if let Err((cause, text)) = check(&scan) {
            let number = stats.messages;
            stats.refuse(cause, || format!("message {number} of frame {}: {text}", scan.header.frame));
            continue;
        }
        if !stats.sensor_frames.contains(&scan.header.frame) {
            stats.sensor_frames.push(scan.header.frame.clone());
        }
        readings += scan.ranges.len();
        if readings > MOST_READINGS {
            let value = format!("over {MOST_READINGS} readings");
            return Err(IoError::layout(&contents.path, "the log so far", value, "split the bag into parts"));
        }
        scans.push(Recorded { scan, log_time: message.log_time });
    }
    if unstamped > 0 {
        stats.notes.push(format!("{unstamped} scans have the stamp 0: the time of their recording is taken"));
    }
    if contents.kind(numbers.first().copied().unwrap_or(0)) == Some(MessageKind::MultiEchoLaserScan) {
        stats.guesses.push("of several echoes of a beam the first is taken".into());
    }
    Ok(scans)
}

/// The earliest stamp that is of the world's clock and not of a simulation (nanoseconds): the year 2001.
const WORLD_CLOCK: i64 = 1_000_000_000_000_000_000;

/// Moves stamps by what was asked for, or by half a turn where they are of the end of one.
///
/// The stamp of a `LaserScan` is the time of its first ray. Drivers that make it of a turning lidar's cloud stamp it at the end, and
/// then it is recorded sooner after its stamp than the turn takes, which a turn that begins there cannot be. The pose in the
/// middle of the turn is the best single one. Simulated lasers have no such time: their stamps are of another clock.
fn move_in_time(
    scans: &mut [Recorded],
    name: &str,
    asked: Option<f64>,
    guess: bool,
    stats: &mut BagLogStats,
) {
    let offset = asked.or_else(|| {
        let offset = turn_before_stamp(scans).filter(|_| guess)?;
        stats.guesses.push(format!(
            "scans of {name} are recorded before a turn after their stamp could end: poses are those of {:.0} ms before it, \
             the middle of the turn (--time-offset)",
            -1e3 * offset
        ));
        Some(offset)
    });
    let nanoseconds = offset.map_or(0, |s| (s * 1e9).round() as i64);
    scans.iter_mut().for_each(|s| s.scan.header.stamp = s.scan.header.stamp.saturating_add(nanoseconds));
}

/// Minus half a turn (seconds), where stamps are of the end of a turn.
fn turn_before_stamp(scans: &[Recorded]) -> Option<f64> {
    let silent = |s: &LaserScan| {
        let whole = s.angle_increment.abs() * s.ranges.len() as f64 > 0.95 * std::f64::consts::TAU;
        s.time_increment == 0.0 && s.scan_time == 0.0 && s.header.stamp > WORLD_CLOCK && whole
    };
    if !scans.iter().all(|s| silent(&s.scan)) {
        return None;
    }
    let median = |mut all: Vec<i64>| {
        all.sort_unstable();
        all.get(all.len() / 2).map(|ns| *ns as f64 * 1e-9)
    };
    let period = median(scans.windows(2).map(|w| w[1].scan.header.stamp - w[0].scan.header.stamp).collect())?;
    let delay = median(scans.iter().map(|s| s.log_time - s.scan.header.stamp).collect())?;
    // Slower than once in a second no lidar turns: scans were left out.
    (period > 0.0 && period <= 1.0 && delay >= 0.0 && delay < 0.5 * period).then_some(-0.5 * period)
}

/// Whether the numbers of a scan can be.
fn check(scan: &LaserScan) -> Result<(), (&'static str, String)> {
    let (beams, step) = (scan.ranges.len(), scan.angle_increment);
    if beams == 0 {
        return Err(("zero beams", "it has no beams".into()));
    }
    if beams > MOST_BEAMS {
        return Err(("too many beams", format!("it has {beams} beams")));
    }
    let turns = step.abs() * (beams - 1) as f64 / std::f64::consts::TAU;
    if !(scan.angle_min.abs() <= 4.0 * std::f64::consts::TAU
        && (beams == 1 || (step != 0.0 && turns <= 1.01)))
    {
        let text = format!("its {beams} bearings begin at {} and step by {step}", scan.angle_min);
        return Err(("bad bearings", text));
    }
    Ok(())
}

/// Where the poses of the scans come from.
enum Poses {
    Bag(Box<PoseSource>),
    /// Of the laser, by stamp.
    Stamped(Trajectory<2>, f64, String),
    /// Of the laser, one for each scan.
    Counted(Vec<Pose<2>>),
}

impl Poses {
    fn new(
        contents: &Contents,
        options: &ScanLogOptions,
        scans: usize,
        stats: &mut BagLogStats,
    ) -> Result<Self> {
        let Some(file) = &options.poses else {
            let frames = stats.sensor_frames.clone();
            let sensors = SensorFrames { names: &frames, clouds: false };
            let source = PoseSource::choose(contents, &options.bag, options.time_tolerance, sensors, stats)?;
            return Ok(Self::Bag(Box::new(source)));
        };
        let poses = read_poses_2d(file)?;
        let stamped: Option<Vec<(f64, Pose<2>)>> = poses.iter().map(|p| Some((p.time?, p.pose))).collect();
        stats.poses = format!("{}", file.display());
        match stamped {
            Some(stamped) => {
                let track = Trajectory::new(stamped).map_err(|e| {
                    IoError::layout(file, "the poses", e, "give a file in which each time has one pose")
                })?;
                Ok(Self::Stamped(track, options.time_tolerance, stats.poses.clone()))
            }
            None if poses.len() == scans => Ok(Self::Counted(poses.iter().map(|p| p.pose).collect())),
            None => {
                let advice = format!("give stamps, or one pose for each of the {scans} scans");
                Err(IoError::layout(file, "the number of poses", poses.len(), advice))
            }
        }
    }
}

/// The log as far as it is read.
#[derive(Default)]
struct Reading {
    entries: Vec<Entry>,
    fans: Fans,
    readings: Vec<f64>,
    upside_down: u64,
    undeclared: u64,
    /// Stamped poses of each laser while it scans, by its frame.
    lasers: Vec<(String, Vec<(f64, Pose<2>)>)>,
}

impl Reading {
    fn run(
        mut self,
        contents: &Contents,
        scans: &[Recorded],
        poses: &Poses,
        mut stats: BagLogStats,
    ) -> Result<LaserLog> {
        for (i, Recorded { scan, .. }) in scans.iter().enumerate() {
            let frame = &scan.header.frame;
            let found = match poses {
                Poses::Counted(all) => Ok((all[i], false)),
                Poses::Stamped(track, tolerance, name) => {
                    let time = scan.header.stamp as f64 * 1e-9;
                    let pose = track.at(time, *tolerance).map_err(|cause| NoPose {
                        missing: name.clone(),
                        text: format!("{name}: {cause} (stamp {time:.3} s)"),
                    });
                    pose.map(|p| (p, false))
                }
                Poses::Bag(source) => match source.at(frame, scan.header.stamp) {
                    Ok(pose) => match level(&pose) {
                        Ok((pose, upside_down, tilt)) => {
                            stats.tilted += u64::from(tilt > TOLD_TILT);
                            stats.worst_tilt = stats.worst_tilt.max(tilt);
                            Ok((pose, upside_down))
                        }
                        Err(tilt) => {
                            let text = format!(
                                "scan {i} of {frame}: its plane is tilted by {:.1} degrees",
                                tilt.to_degrees()
                            );
                            stats.refuse("plane not level", || text);
                            continue;
                        }
                    },
                    Err(missing) => Err(missing),
                },
            };
            match found {
                Ok((pose, upside_down)) => {
                    self.push(scan, pose, upside_down, &contents.path)?;
                    if let Poses::Bag(source) = poses {
                        self.follow(scan, source);
                    }
                }
                Err(NoPose { missing, text }) => stats.no_pose(&missing, || text),
            }
        }
        if self.upside_down > 0 {
            stats.notes.push(format!(
                "{} scans are of a laser that hangs upside down: bearings are turned over",
                self.upside_down
            ));
        }
        if self.undeclared > 0 {
            stats.notes.push(format!("{} scans declare no range that can be", self.undeclared));
        }
        if self.entries.is_empty() {
            let value = format!("0 of {} messages of {}", stats.messages, stats.topics.join(", "));
            let reason = stats.first_refused.or(stats.first_without_pose);
            let advice = match reason {
                Some(reason) => format!("the first: {reason}; see info for the frames and times of the bag"),
                None => "name another topic with --topic".into(),
            };
            return Err(IoError::layout(
                &contents.path,
                "the number of scans that can be used",
                value,
                advice,
            ));
        }
        // Poses of one time come from one question, so that they agree.
        let trajectory =
            |(_, poses): (String, Vec<_>)| Trajectory::new(poses).or_else(|_| Trajectory::new([])).ok();
        Ok(LaserLog {
            trajectories: self.lasers.into_iter().filter_map(trajectory).collect(),
            fates: Some(Arc::default()),
            path: contents.path.clone(),
            entries: self.entries,
            fans: self.fans.into_all(),
            readings: self.readings,
            stats: LaserLogStats::Bag(Box::new(stats)),
        })
    }

    fn push(&mut self, scan: &LaserScan, pose: Pose<2>, upside_down: bool, path: &Path) -> Result<()> {
        self.upside_down += u64::from(upside_down);
        let turned = if upside_down { -1.0 } else { 1.0 };
        let (start, step) = (turned * scan.angle_min, turned * scan.angle_increment);
        let shape = FanShape { start, step, beams: scan.ranges.len() };
        let fan = self.fans.number(shape).ok_or_else(|| {
            let advice = "name topics of one laser with --topic";
            IoError::layout(path, "the number of different fans", "too large", advice)
        })?;
        let [least, most] = [scan.range_min, scan.range_max];
        // Infinity is a maximum: such sensors say "no echo" by infinity alone.
        let declared = (most > 0.0 && least < most).then_some([if least > 0.0 { least } else { 0.0 }, most]);
        self.undeclared += u64::from(declared.is_none());
        let laser = self.laser(&scan.header.frame);
        self.entries.push(Entry {
            world_from_laser: pose,
            first_reading: self.readings.len(),
            fan,
            time: Some(scan.header.stamp as f64 * 1e-9),
            laser: laser as u32,
            time_increment: (scan.time_increment > 0.0 && scan.time_increment.is_finite())
                .then_some(scan.time_increment),
            declared,
        });
        self.readings.extend(scan.ranges.iter().map(|r| f64::from(*r)));
        Ok(())
    }
}

impl Reading {
    /// The place of the laser of a frame.
    fn laser(&mut self, frame: &str) -> usize {
        let known = self.lasers.iter().position(|(name, _)| name == frame);
        known.unwrap_or_else(|| {
            self.lasers.push((frame.to_owned(), Vec::new()));
            self.lasers.len() - 1
        })
    }

    /// Asks for the poses while the scan goes on, where its beams have times.
    fn follow(&mut self, scan: &LaserScan, source: &PoseSource) {
        let long = scan.time_increment * scan.ranges.len() as f64;
        if !(long > 0.0 && long < LONGEST_SCAN) {
            return;
        }
        let laser = self.laser(&scan.header.frame);
        for k in 0..=KNOTS {
            let after = (long * 1e9 * f64::from(k) / f64::from(KNOTS)) as i64;
            let stamp = scan.header.stamp.saturating_add(after);
            if let Ok((pose, ..)) =
                source.at(&scan.header.frame, stamp).map_err(drop).and_then(|p| level(&p).map_err(drop))
            {
                self.lasers[laser].1.push((stamp as f64 * 1e-9, pose));
            }
        }
    }
}

/// The pose in the plane, whether the laser hangs upside down, and how far its plane is from level (radians); `Err` has the tilt
/// of a plane that is not level.
fn level(world_from_laser: &Pose<3>) -> Result<(Pose<2>, bool, f64), f64> {
    let r = &world_from_laser.rotation;
    let up = r[2][2];
    let tilt = r[2][0].hypot(r[2][1]).atan2(up.abs());
    if tilt > MOST_TILT {
        return Err(tilt);
    }
    let [x, y, _] = world_from_laser.translation;
    Ok((Pose::<2>::new(x, y, r[1][0].atan2(r[0][0])), up < 0.0, tilt))
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::geom::vector::distance;

    /// A laser in any level place sees in 2-D what it sees in 3-D from above.
    #[test]
    fn level_lasers_see_from_above_what_they_see() {
        for (roll, yaw) in [(0.0, 0.7), (std::f64::consts::PI, 0.7), (std::f64::consts::PI, -2.0), (0.0, 3.0)]
        {
            let about = |axis: usize, angle: f64| {
                let mut q = [0.0, 0.0, 0.0, f64::cos(angle / 2.0)];
                q[axis] = f64::sin(angle / 2.0);
                Pose::<3>::from_quaternion([0.0; 3], q).unwrap()
            };
            let pose = Pose { translation: [1.0, 2.0, 3.0], ..about(2, yaw) * about(0, roll) };
            let (flat, upside_down, tilt) = level(&pose).unwrap();
            assert!(tilt < 1e-12 && upside_down == (roll != 0.0));
            for bearing in [-1.5, 0.0, 0.3, 2.5f64] {
                let [x, y, _] = pose.transform_point([4.0 * bearing.cos(), 4.0 * bearing.sin(), 0.0]);
                let seen = if upside_down { -bearing } else { bearing };
                let found = flat.transform_point([4.0 * seen.cos(), 4.0 * seen.sin()]);
                assert!(distance(found, [x, y]) < 1e-12, "{roll} {yaw} {bearing}");
            }
        }
        let tilted = Pose::<3>::from_quaternion([0.0; 3], [0.15, 0.0, 0.0, 1.0]).unwrap();
        assert!((level(&tilted).unwrap_err() - 0.298).abs() < 0.01);
    }
}
