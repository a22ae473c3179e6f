//! Which pose belongs to which scan.

use std::path::Path;

use portolan::geom::{Pose, Trajectory, TrajectoryError};

use super::parts::ScanId;
use super::stats::ScanLogStats;
use crate::poses3::{TimedPoses, TrackPose};
use crate::{IoError, Result};

/// The result of matching a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Match {
    /// Its pose, and the pose's own stamp.
    Posed(Pose<3>, Option<f64>),
    /// Left out, and counted.
    LeftOut,
}

/// Finds the pose of every scan in a trajectory, and returns that trajectory where times decided:
///
/// 1. by time, where scans and poses have stamps;
/// 2. by the number that the pose file gives each pose (Redwood), where no number is beyond the scans: the scan's place
///    in the log;
/// 3. in order, where there are as many poses as scans;
/// 4. by the number in the scan's file name, which is its pose's place in the file, where no number is beyond the poses.
///
/// # Errors
/// [`IoError::Layout`] where no rule applies, no time fits, or poses of one time contradict each other.
pub(super) fn match_poses(
    scans: &[ScanId],
    track: &[TrackPose],
    tolerance: f64,
    path: &Path,
    stats: &mut ScanLogStats,
) -> Result<(Vec<Match>, Option<Trajectory<3>>)> {
    let timed = TimedPoses::new(track).map_err(|error| contradiction(path, &error));
    if let Some(times) = times_of(scans)
        && let Some(timed) = timed?
    {
        let matches = by_time(&times, &timed, tolerance, path, stats)?;
        return Ok((matches, Some(timed.trajectory().clone())));
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
        return Err(IoError::layout(path, "the number of poses", track.len(), advice));
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
    Ok((matches, None))
}

/// Stamped poses that are no trajectory.
pub(super) fn contradiction(path: &Path, error: &TrajectoryError) -> IoError {
    let advice = "give the poses of one run: two trajectories in one file are not mixed";
    IoError::layout(path, "the time of the poses", format!("not usable ({error})"), advice)
}

/// Of what is in order of time, the nearest to a time, if it is within the tolerance (seconds).
pub(crate) fn nearest_in_time<T>(sorted: &[(f64, T)], time: f64, tolerance: f64) -> Option<&T> {
    let after = sorted.partition_point(|(t, _)| *t < time);
    let around = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| sorted.get(i));
    let off = |entry: &&(f64, T)| (entry.0 - time).abs();
    let best = around.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    (off(&best) <= tolerance).then_some(&best.1)
}

/// The times of the scans, where all have one and they differ (logs without times may have all zero).
fn times_of(scans: &[ScanId]) -> Option<Vec<f64>> {
    let times: Vec<f64> = scans.iter().map(|s| s.time).collect::<Option<_>>()?;
    (times.len() == 1 || times.iter().any(|t| *t != times[0])).then_some(times)
}

fn by_time(
    times: &[f64],
    poses: &TimedPoses,
    tolerance: f64,
    path: &Path,
    stats: &mut ScanLogStats,
) -> Result<Vec<Match>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(x: f64) -> Pose<3> {
        Pose { translation: [x, 0.0, 0.0], ..Pose::IDENTITY }
    }

    fn scans(numbers: &[u64], times: Option<&[f64]>) -> Vec<ScanId> {
        let scan = |(i, n): (usize, &u64)| ScanId {
            number: Some(*n),
            time: times.map(|t| t[i]),
            ..ScanId::default()
        };
        numbers.iter().enumerate().map(scan).collect()
    }

    fn track(poses: usize, times: Option<&[f64]>) -> Vec<TrackPose> {
        let one =
            |i: usize| TrackPose { pose: Some(pose(i as f64)), time: times.map(|t| t[i]), number: None };
        (0..poses).map(one).collect()
    }

    /// The x of each scan's pose, and the counts.
    fn found(scans: &[ScanId], track: &[TrackPose]) -> Result<(Vec<Option<f64>>, ScanLogStats)> {
        let mut stats = ScanLogStats::default();
        let (matches, _) = match_poses(scans, track, 0.02, "p".as_ref(), &mut stats)?;
        let x = |m: &Match| match m {
            Match::Posed(pose, _) => Some(pose.translation[0]),
            Match::LeftOut => None,
        };
        Ok((matches.iter().map(x).collect(), stats))
    }

    #[test]
    fn scans_that_are_a_part_find_their_poses_by_number() {
        let (x, stats) =
            found(&scans(&[0, 2, 5], None), &track(6, Some(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))).unwrap();
        assert_eq!(x, [Some(0.0), Some(2.0), Some(5.0)]);
        assert_eq!((stats.poses_without_scan, stats.scans_without_pose), (3, 0));
        // Numbers beyond the poses, and repeated ones, are not used.
        assert!(found(&scans(&[0, 2, 6], None), &track(6, None)).is_err());
        assert!(found(&scans(&[0, 2, 2], None), &track(6, None)).is_err());
        // As many: in order, whatever the numbers.
        let (x, _) = found(&scans(&[4, 9, 7], None), &track(3, None)).unwrap();
        assert_eq!(x, [Some(0.0), Some(1.0), Some(2.0)]);
    }

    #[test]
    fn times_come_first_unless_they_are_none() {
        let times = [1.0, 2.0, 3.0];
        let (x, stats) = found(&scans(&[0, 1, 2], Some(&times)), &track(3, Some(&[3.0, 9.0, 1.01]))).unwrap();
        assert_eq!((x, stats.unmatched_times), (vec![Some(2.0), None, Some(0.0)], 1));
        let (x, _) = found(&scans(&[0, 1, 2], Some(&[0.0; 3])), &track(3, Some(&times))).unwrap();
        assert_eq!(x, [Some(0.0), Some(1.0), Some(2.0)], "zero is no time");
        let error = found(&scans(&[0, 1, 2], Some(&times)), &track(3, Some(&[7.0, 8.0, 9.0]))).unwrap_err();
        assert!(error.to_string().contains("the time of the poses is 7.000 to 9.000 s; no pose is within"));
    }

    #[test]
    fn two_trajectories_in_one_file_are_no_trajectory() {
        let times = [1.0, 1.1];
        let error = found(&scans(&[0, 1], Some(&times)), &track(4, Some(&[1.0, 1.1, 1.0, 1.1]))).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("two poses of the time 1 contradict each other: they are 2.000 m"), "{text}");
        // Where times do not decide, they may be anything.
        assert!(found(&scans(&[0, 1, 2, 3], None), &track(4, Some(&[1.0, 1.1, 1.0, 1.1]))).is_ok());
    }

    #[test]
    fn refused_poses_keep_their_place() {
        let mut poses = track(3, None);
        poses[1].pose = None;
        let (x, stats) = found(&scans(&[0, 1, 2], None), &poses).unwrap();
        assert_eq!(x, [Some(0.0), None, Some(2.0)]);
        assert_eq!((stats.scans_without_pose, stats.poses_without_scan), (0, 0));
    }

    #[test]
    fn the_nearest_in_time() {
        let sorted = [(1.0, 'a'), (2.0, 'b')];
        for (time, expected) in
            [(0.0, None), (0.9, Some('a')), (1.4, None), (1.9, Some('b')), (2.1, Some('b'))]
        {
            assert_eq!(nearest_in_time(&sorted, time, 0.11).copied(), expected, "{time}");
        }
        assert_eq!(nearest_in_time(&sorted, f64::NAN, 1.0), None);
        assert_eq!(nearest_in_time::<()>(&[], 1.0, 1.0), None);
    }
}
