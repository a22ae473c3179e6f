//! The corrected Intel log against relations, relative poses that people verified.

use portolan::geom::Pose;
use portolan_chapter::poses::PoseErrors;
use portolan_io::LaserLog;
use portolan_sim::planar;
use std::collections::HashMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A verified relative pose between the robot at two times.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Relation {
    /// Time of the first pose (seconds, clock of the log).
    first_time: f64,
    /// Time of the second pose.
    second_time: f64,
    /// The second pose in the frame of the first.
    first_from_second: Pose<2>,
}

/// A line of a relations file that is not a relation.
#[derive(Debug)]
struct RelationError {
    /// Number of the line, from 1.
    line: usize,
    /// The beginning of the line.
    found: String,
}

/// Reads the text of a relations file (Kümmerle et al. 2009): `t1 t2 x y z roll pitch yaw` on a line, seconds,
/// meters and radians; `#` starts a comment. `z`, `roll` and `pitch` are ignored: poses are 2-D.
///
/// # Errors
/// [`RelationError`] for the first line that is not a relation.
fn parse_relations(text: &str) -> Result<Vec<Relation>, RelationError> {
    let mut relations = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            content.split_whitespace().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[first_time, second_time, x, y, _, _, _, yaw]) => {
                relations.push(Relation { first_time, second_time, first_from_second: planar(x, y, yaw) });
            }
            _ => {
                return Err(RelationError { line: k + 1, found: content.chars().take(60).collect() });
            }
        }
    }
    Ok(relations)
}

/// Scores poses `(seconds, world_from_robot)` against relations: for each relation with a pose within `tolerance` seconds of
/// both ends, the error of the relative pose between the poses nearest in time. `count` is the number of these relations.
/// The result is independent of the world frame. O((poses + relations) log poses).
fn score_relations(relations: &[Relation], poses: &[(f64, Pose<2>)], tolerance: f64) -> PoseErrors {
    let mut sorted: Vec<_> = poses.iter().filter(|p| p.0.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = |time: f64| {
        let next = sorted.partition_point(|p| p.0 < time);
        let around = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| sorted.get(i));
        let nearest = around.min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs()))?;
        ((nearest.0 - time).abs() <= tolerance).then_some(nearest.1)
    };
    PoseErrors::of(relations.iter().filter_map(|r| {
        let first_from_second = at(r.first_time)?.inverse() * at(r.second_time)?;
        Some(r.first_from_second.inverse() * first_from_second)
    }))
}

#[test]
fn lines_that_are_no_relations_are_refused_with_their_number() {
    let good = "# a comment\n\n1.0 2.0 0.5 0 0 0 0 1.5\n2 3 0 0 0 0 0 0 # and one more\n";
    assert_eq!(parse_relations(good).unwrap().len(), 2);
    for bad in ["1 2 3", "1 2 0 0 0 0 0 NaN", "1 2 0 0 0 0 0 0 0", "a b c d e f g h"] {
        let error = parse_relations(&format!("{good}{bad}\n")).unwrap_err();
        assert_eq!((error.line, error.found.as_str()), (5, bad));
    }
}

#[test]
fn poses_that_agree_score_zero_wherever_the_world_is() {
    let poses: Vec<_> =
        (0..20).map(|k| (f64::from(k), planar(f64::from(k), 0.3, 0.2 * f64::from(k)))).collect();
    let relation = |a: usize, b: usize| Relation {
        first_time: poses[a].0 + 0.01,
        second_time: poses[b].0,
        first_from_second: poses[a].1.inverse() * poses[b].1,
    };
    let mut relations = vec![relation(3, 11), relation(19, 0)];
    relations.push(Relation { first_time: 40.0, ..relations[0] });
    let moved: Vec<_> = poses.iter().rev().map(|p| (p.0, planar(5.0, -7.0, 2.0) * p.1)).collect();
    let score = score_relations(&relations, &moved, 0.05);
    assert_eq!(score.count, 2);
    assert!(score.translation.max < 1e-12 && score.rotation.max < 1e-12);
    assert_eq!(score_relations(&relations, &[], 0.05).count, 0);
}

/// The folder of real data; `None` and a loud note where it is not there.
fn data(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("PORTOLAN_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let path = root.join(name);
    if !path.exists() {
        // Past the capture of test output, so that it is seen.
        let note = format!("SKIPPED: {} is not there; set PORTOLAN_DATA\n", path.display());
        let _ = std::io::stderr().write_all(note.as_bytes());
        return None;
    }
    Some(path)
}

#[test]
fn corrected_intel_poses_agree_with_the_verified_relations() {
    let Some(folder) = data("lidar2d_carmen") else { return };
    let relations =
        parse_relations(&std::fs::read_to_string(folder.join("intel.relations")).unwrap()).unwrap();
    assert_eq!(relations.len(), 2984);
    let corrected = LaserLog::read_carmen(folder.join("intel-corrected.log.gz")).unwrap();
    let raw = LaserLog::read_carmen(folder.join("intel.clf.bz2")).unwrap();
    // The corrected log has a clock of its own; its readings are those of the raw log, to the centimeter.
    let key = |readings: &[f64]| readings.iter().map(|z| (100.0 * z).round() as i64).collect::<Vec<_>>();
    let stamps: HashMap<_, _> = raw.raw_scans().filter_map(|s| Some((key(s.readings), s.time?))).collect();
    let poses: Vec<_> = corrected
        .raw_scans()
        .filter_map(|s| Some((*stamps.get(&key(s.readings))?, s.world_from_laser)))
        .collect();
    let score = score_relations(&relations, &poses, 0.05);
    println!(
        "{} of {} scans found in the raw log, {} relations: {score}",
        poses.len(),
        corrected.len(),
        score.count
    );
    assert_eq!(poses.len(), 910);
    assert_eq!(score.count, 164);
    assert!((score.translation.median - 0.05).abs() < 0.01);
    assert!((score.rotation.median.to_degrees() - 0.6).abs() < 0.1);

    // Odometry, for comparison: the same relations, and all of them.
    let odometry: Vec<_> = raw.raw_scans().filter_map(|s| Some((s.time?, s.world_from_laser))).collect();
    let all = score_relations(&relations, &odometry, 0.05);
    println!("raw odometry, {} relations: {all}", all.count);
    // Most relations are between neighbors, where odometry is good: the mean tells, not the median.
    assert!(all.count == 2984 && all.translation.mean > 10.0 * score.translation.mean);
}
