//! The corrected Intel log against relations that people verified.

use portolan_chapter::poses::{parse_relations, score_relations};
use portolan_io::CarmenLog;
use std::collections::HashMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

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
    let corrected = CarmenLog::read(folder.join("intel-corrected.log.gz")).unwrap();
    let raw = CarmenLog::read(folder.join("intel.clf.bz2")).unwrap();
    // The corrected log has a clock of its own; its readings are those of the raw log, to the centimetre.
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
