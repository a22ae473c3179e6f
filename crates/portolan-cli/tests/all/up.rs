//! Which way is up: found when a map is made, kept, told otherwise, and refused where it is not what is needed.

use std::path::{Path, PathBuf};

use portolan::geom::Pose;
use tempfile::TempDir;

use crate::support::logs_3d::{camera_log, lidar_log, lidar_log_in};
use crate::support::{arg, fail, json, succeed};

fn map(log: &Path, more: &[&str]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let call = ["map", arg(log), "--out", arg(&out), "--resolution", "0.1"];
    succeed(call.iter().copied().chain(more.iter().copied()));
    (folder, out)
}

fn up(map: &Path) -> String {
    json(["info", arg(map), "--json"])["up"].as_str().unwrap().to_owned()
}

#[test]
fn up_is_found_by_sensors_and_floor() {
    let (_folder, lidar) = lidar_log();
    let (_a, out) = map(&lidar, &[]);
    assert_eq!(up(&out), "+z");
    let (_folder, camera) = camera_log();
    let (_b, out) = map(&camera, &[]);
    assert_eq!(up(&out), "+z");
    // The world of a camera, as KITTI's poses have it: y points down.
    let turned = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    let (_folder, lying) = lidar_log_in(&Pose::from_matrix(turned, [0.0; 3]).unwrap().0);
    let (_c, out) = map(&lying, &[]);
    assert_eq!(up(&out), "-y");
    let yaml = out.join("floor.yaml");
    let error = fail(1, ["convert", arg(&out), arg(&yaml), "--z", "0.1:1.2"]);
    assert!(error.contains("up is -y") && error.contains("slab across z"), "{error}");
    assert!(!yaml.exists());
    succeed(["convert", arg(&out), arg(&yaml), "--z", "0.1:1.2", "--up", "+z", "--unknown", "optimistic"]);
}

#[test]
fn up_is_the_callers_where_it_is_told_and_stays_when_a_map_is_gone_on_with() {
    let (_folder, lidar) = lidar_log();
    let (_a, out) = map(&lidar, &["--up", "-x"]);
    assert_eq!(up(&out), "-x");
    succeed(["map", arg(&lidar), "--out", arg(&out), "--append"]);
    assert_eq!(up(&out), "-x");
    assert!(
        fail(2, ["map", "log", "--resolution", "1", "--out", "out", "--up", "w"]).contains("axis like +z")
    );
}

/// What depends on the part that was read must not be in the header of sums.
#[test]
fn ledgers_keep_only_what_they_were_told() {
    let (_folder, lidar) = lidar_log();
    let (_a, out) = map(&lidar, &["--ledger"]);
    let about = json(["info", arg(&out), "--json"]);
    assert_eq!((&about["settings"]["up"], &about["up_is_assumed"]), (&serde_json::Value::Null, &true.into()));
    let (_b, out) = map(&lidar, &["--ledger", "--up", "+y"]);
    assert_eq!(up(&out), "+y");
}
