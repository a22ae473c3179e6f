//! Which pose belongs to which scan.

use std::path::Path;

use portolan::geom::Pose;

use super::parts::ScanId;
use super::stats::SpaceLogStats;
use crate::IoError;
use crate::poses3::{TimedPoses, TrackPose};

/// What became of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Match {
    /// Its pose, and the pose's own stamp.
    Posed(Pose<3>, Option<f64>),
    /// Left out, and counted.
    LeftOut,
}

/// Finds the pose of every scan in a trajectory:
///
/// 1. by time, where scans and poses have stamps;
/// 2. by the number that the pose file gives each pose (Redwood), where no number is beyond the scans: the scan's place
///    in the log;
/// 3. in order, where there are as many poses as scans;
/// 4. by the number in the scan's file name, which is its pose's place in the file, where no number is beyond the poses.
///
/// # Errors
/// [`IoError::Layout`] where none of these fits, or no time does.
pub(super) fn match_poses(
    scans: &[ScanId],
    track: &[TrackPose],
    tolerance: f64,
    path: &Path,
    stats: &mut SpaceLogStats,
) -> Result<Vec<Match>, IoError> {
    if let (Some(times), Some(timed)) = (times_of(scans), TimedPoses::new(track)) {
        return by_time(&times, &timed, tolerance, path, stats);
    }
    let places = if let Some(places) = by_pose_number(scans.len(), track) {
        places
    } else if scans.len() == track.len() {
        (0..scans.len()).map(Some).collect()
    } else if let Some(places) = by_scan_number(scans, track.len()) {
        places
    } else {
        let advice = format!(
            "give one pose for each of the {} scans, or stamps for both, or scans whose file names are numbered like the poses",
            scans.len()
        );
        return Err(IoError::layout(path, "the number of poses", track.len().to_string(), advice));
    };
    let mut used = vec![false; track.len()];
    let matches = places.iter().map(|place| match place.and_then(|i| Some((i, track.get(i)?))) {
        Some((i, entry)) => {
            used[i] = true;
            // A refused pose is counted where it was refused.
            entry.pose.map_or(Match::LeftOut, |pose| Match::Posed(pose, entry.time))
        }
        None => {
            stats.scans_without_pose += 1;
            Match::LeftOut
        }
    });
    let matches = matches.collect();
    stats.poses_without_scan += used.iter().filter(|u| !**u).count() as u64;
    Ok(matches)
}

/// The times of the scans, where all have one and they are not all one (zero, in logs that have none).
fn times_of(scans: &[ScanId]) -> Option<Vec<f64>> {
    let times: Vec<f64> = scans.iter().map(|s| s.time).collect::<Option<_>>()?;
    (times.len() == 1 || times.iter().any(|t| *t != times[0])).then_some(times)
}

fn by_time(
    times: &[f64],
    poses: &TimedPoses,
    tolerance: f64,
    path: &Path,
    stats: &mut SpaceLogStats,
) -> Result<Vec<Match>, IoError> {
    let matches: Vec<Match> = times
        .iter()
        .map(|t| poses.at(*t, tolerance).map_or(Match::LeftOut, |pose| Match::Posed(pose, None)))
        .collect();
    let unmatched = matches.iter().filter(|m| **m == Match::LeftOut).count();
    if let Some((first, last)) = poses.span()
        && unmatched == times.len()
    {
        let (from, to) =
            times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
        let value = format!("{first:.3} to {last:.3} s");
        let advice = format!(
            "no pose is within {tolerance} s of a scan, whose times are {from:.3} to {to:.3} s; give poses of the same clock"
        );
        return Err(IoError::layout(path, "the time of the poses", value, advice));
    }
    stats.unmatched_times += unmatched as u64;
    Ok(matches)
}

/// Places of the poses by the numbers that they bring; `None` where a number is missing, double or beyond the scans.
fn by_pose_number(scans: usize, track: &[TrackPose]) -> Option<Vec<Option<usize>>> {
    let mut places = vec![None; scans];
    for (i, entry) in track.iter().enumerate() {
        let place = places.get_mut(usize::try_from(entry.number?).ok()?)?;
        if place.replace(i).is_some() {
            return None;
        }
    }
    Some(places)
}

/// Places of the poses by the numbers of the scans; `None` where one is missing, not ascending or beyond the poses.
fn by_scan_number(scans: &[ScanId], poses: usize) -> Option<Vec<Option<usize>>> {
    let numbers: Vec<u64> = scans.iter().map(|s| s.number).collect::<Option<_>>()?;
    let ascending = numbers.windows(2).all(|w| w[0] < w[1]);
    let fits = numbers.last().is_some_and(|last| *last < poses as u64);
    (ascending && fits).then(|| numbers.iter().map(|n| Some(*n as usize)).collect())
}
