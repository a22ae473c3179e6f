//! A scan that is damaged or empty costs itself and not the log.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::support::logs_3d::{camera_log, lidar_log};
use crate::support::{arg, fail, succeed};

fn summary(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap()
}

fn call<'a>(log: &'a Path, out: &'a Path) -> [&'a str; 7] {
    ["map", arg(log), "--resolution", "0.1", "--overwrite", "--out", arg(out)]
}

/// A wall 3 m before the viewpoint, as PCD in the world's frame.
fn pcd(viewpoint: f64, points: usize) -> String {
    let mut text = format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT \
         {viewpoint} 0 0 1 0 0 0\nPOINTS {points}\nDATA ascii\n"
    );
    for i in 0..points {
        let (y, z) = (0.05 * (i % 40) as f64 - 1.0, 0.05 * (i / 40) as f64 - 0.5);
        writeln!(text, "3 {y:.3} {z:.3}").unwrap();
    }
    text
}

#[test]
fn clouds_without_poses() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("log"), folder.path().join("out"));
    fs::create_dir(&log).unwrap();
    let write = |i: usize, text: &[u8]| fs::write(log.join(format!("{i}.pcd")), text).unwrap();
    (0..6).for_each(|i| write(i, pcd(0.1 * i as f64, 800).as_bytes()));
    let whole = succeed(call(&log, &out));
    assert!(whole.contains("6 of 6 scans fused"), "{whole}");
    // The first one, which says where all are; and one without a point.
    write(0, b"no cloud at all");
    write(3, pcd(0.3, 0).as_bytes());
    let text = succeed(call(&log, &out));
    assert!(text.contains("4 of 6 scans fused"), "{text}");
    assert!(text.contains("2 scans could not be read (first: ") && text.contains("0.pcd"), "{text}");
    assert_eq!(summary(&out)["input"]["unreadable_scans"], 2);
    let held = fs::read(out.join("map.portolan")).unwrap();
    // Half of them may be lost, and no more.
    write(1, b"");
    assert!(succeed(call(&log, &out)).contains("3 of 6 scans fused"));
    fs::write(out.join("map.portolan"), &held).unwrap();
    write(2, &pcd(0.2, 800).as_bytes()[..200]);
    let refused = fail(1, call(&log, &out));
    assert!(refused.contains("4 of 6 scans cannot be read, more than half (first: "), "{refused}");
    assert!(refused.contains("map.portolan is as it was"), "{refused}");
    assert!(fs::read(out.join("map.portolan")).unwrap() == held);
}

#[test]
fn the_first_picture_and_a_sweep_of_a_lidar() {
    let (folder, log) = camera_log();
    let out = folder.path().join("out");
    let picture = fs::read_dir(&log).unwrap().map(|e| e.unwrap().path());
    let first = picture.filter(|p| p.to_str().unwrap().ends_with("0.depth.png")).min().unwrap();
    let whole = fs::read(&first).unwrap();
    for damaged in [&whole[..0], &whole[..20], &whole[..whole.len() / 2]] {
        fs::write(&first, damaged).unwrap();
        let text = succeed(call(&log, &out));
        assert!(text.contains("4 of 5 scans fused"), "{text}");
        assert!(text.contains("1 scans could not be read") && text.contains(".depth.png"), "{text}");
    }

    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    let sweep = log.join("velodyne/000002.bin");
    let bytes = fs::read(&sweep).unwrap();
    for damaged in [&bytes[..0], &bytes[..bytes.len() - 7]] {
        fs::write(&sweep, damaged).unwrap();
        let text = succeed(call(&log, &out));
        assert!(text.contains("5 of 6 scans fused") && text.contains("000002.bin"), "{text}");
    }
}
