//! What moved, through the program: not in the maps, listed, and the same in parts.

use std::path::{Path, PathBuf};

use portolan_io::{LogLayout, LogWriter, read_ply_cloud};
use portolan_sim::building::{
    Body, BuildingConfig, BuildingSensor, Shape, SpinningLidar, World3, building_log,
};

use crate::support::{arg, fail, flaser, json, pose, range, room, succeed};

/// Where somebody stands while some of the scans are taken (meters).
const PERSON: [f64; 2] = [1.9, 2.0];
const RADIUS: f64 = 0.2;

/// The range to a circle.
fn to_person(p: [f64; 2], angle: f64) -> f64 {
    let [x, y] = [PERSON[0] - p[0], PERSON[1] - p[1]];
    let along = x * angle.cos() + y * angle.sin();
    let beside = x * x + y * y - along * along;
    match RADIUS * RADIUS - beside {
        inside if inside > 0.0 && along > 0.0 => along - inside.sqrt(),
        _ => f64::INFINITY,
    }
}

/// Three laps of the room; somebody stands there during some scans of the last.
fn walked(folder: &Path, there: std::ops::Range<usize>) -> (PathBuf, usize) {
    let (mut log, mut on_person) = (String::new(), 0);
    for i in 0..180 {
        let at = pose(i);
        let p = [at[0], at[1]];
        let ranges: Vec<f64> = (0..360)
            .map(|b| {
                let angle = at[2] + (f64::from(b) / 2.0 - 90.0).to_radians();
                let (wall, person) = (range(p, angle), to_person(p, angle));
                let seen = there.contains(&i) && person < wall;
                on_person += usize::from(seen);
                if seen { person } else { wall }
            })
            .collect();
        log.push_str(&flaser(&ranges, at, i as f64 * 0.1));
        log.push('\n');
    }
    let path = folder.join("walked.log");
    std::fs::write(&path, log).unwrap();
    (path, on_person)
}

fn map(log: &Path, out: &Path, more: &[&str]) -> serde_json::Value {
    let call = ["map", arg(log), "--resolution", "0.05", "--out", arg(out), "--json"];
    json(call.iter().copied().chain(more.iter().copied()))
}

#[test]
fn somebody_who_stood_there_is_not_in_the_map_2d() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    // Nobody looks there again after he came: clamped cells alone would keep him.
    let (log, on_person) = walked(folder.path(), 120..180);
    assert!(on_person > 500, "{on_person}");
    let with = map(&log, &out("with"), &[]);
    let found = map(&log, &out("without"), &["--movers"]);
    assert_eq!((&with["movers"], &with["beams"]["mover"]), (&serde_json::Value::Null, &0.into()));
    let returns = found["movers"]["returns"].as_u64().unwrap() as usize;
    assert!(20 * returns >= 19 * on_person && returns <= on_person + 20, "{returns} of {on_person}");
    assert_eq!(found["beams"]["mover"], returns);
    assert_eq!(
        found["beams"]["hit"].as_u64().unwrap() as usize + returns,
        with["beams"]["hit"].as_u64().unwrap() as usize
    );
    let point = folder.path().join("point.csv");
    std::fs::write(&point, "1.9,2.19\n").unwrap();
    let occupancy = |name: &str| -> f64 {
        let text = succeed(["query", arg(&out(name)), "--points", arg(&point)]);
        let [head, row] = [0, 1].map(|i| text.lines().nth(i).unwrap().split(',').collect::<Vec<_>>());
        row[head.iter().position(|name| *name == "occupancy").unwrap()].parse().unwrap()
    };
    assert!(occupancy("with") > 0.5 && occupancy("without") < 0.5);
    let listed = read_ply_cloud(out("without").join("movers.ply")).unwrap();
    assert_eq!(listed.points.len(), returns);
    let away = |p: &[f32; 3]| (f64::from(p[0]) - PERSON[0]).hypot(f64::from(p[1]) - PERSON[1]) - RADIUS;
    let stray = listed.points.iter().filter(|p| away(p).abs() > 0.05).count();
    assert!(stray <= 20, "{stray}");
}

#[test]
fn a_log_in_which_nothing_moves_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let (log, _) = walked(folder.path(), 0..0);
    let plain = map(&log, &out("plain"), &[]);
    let looked = map(&log, &out("looked"), &["--movers"]);
    let (returns, hits) =
        (looked["movers"]["returns"].as_f64().unwrap(), plain["beams"]["hit"].as_f64().unwrap());
    assert!(returns <= 0.003 * hits, "{returns} of {hits}");
}

/// Cells that are too coarse, or beams that lie too far apart, tell nothing: said, for the map looks as if nothing had moved.
#[test]
fn where_nothing_can_be_told_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let (log, _) = walked(folder.path(), 120..180);
    let said = |summary: &serde_json::Value| {
        summary["warnings"].to_string().contains("nothing can be told to have moved")
    };
    assert!(!said(&map(&log, &out("fine"), &["--movers"])));
    let coarse = map(&log, &out("coarse"), &["--movers=2"]);
    assert!(
        said(&coarse) && coarse["movers"]["returns"] == 0 && coarse["movers"]["open_cells"] == 0,
        "{coarse}"
    );
    let error = fail(
        1,
        ["map", arg(&log), "--resolution", "0.05", "--movers", "--memory", "3K", "--out", arg(&out("x"))],
    );
    assert!(error.contains("--memory") && !out("x").exists(), "{error}");
}

/// Parts of a log add up to the map of the whole: each looks at all scans.
#[test]
fn parts_take_out_what_the_whole_does() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let (log, _) = walked(folder.path(), 130..150);
    map(&log, &out("whole"), &["--movers", "--ledger", "--threads", "1"]);
    for part in ["1/3", "2/3", "3/3"] {
        map(&log, &out(&part.replace('/', "of")), &["--movers", "--shard", part, "--threads", "2"]);
    }
    let parts = ["3of3", "1of3", "2of3"].map(out);
    let call = ["merge", "--quiet", "--out"].map(str::to_owned).into_iter();
    succeed(call.chain([arg(&out("sum")).to_owned()]).chain(parts.iter().map(|p| arg(p).to_owned())));
    let bytes = |name: &str| std::fs::read(out(name).join("map.portolan")).unwrap();
    assert!(bytes("sum") == bytes("whole"));
    // What moved is another thing with other poses.
    let error = fail(1, ["map", arg(&log), "--repose", arg(&log), "--out", arg(&out("whole"))]);
    assert!(error.contains("--movers"), "{error}");
    let plain = ["map", arg(&log), "--resolution", "0.05", "--shard", "1/3", "--out"].map(str::to_owned);
    succeed(plain.into_iter().chain([arg(&out("plain")).to_owned(), "--quiet".to_owned()]));
    let error = fail(1, ["merge", arg(&out("2of3")), arg(&out("plain")), "--out", arg(&out("x"))]);
    assert!(error.contains("movers"), "{error}");
}

#[test]
fn a_box_that_was_carried_away_is_not_in_the_map_3d() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    let lidar = SpinningLidar { rings: 24, columns: 360, ..SpinningLidar::default() };
    let sensor = BuildingSensor::Lidar(lidar);
    let empty = building_log(&BuildingConfig { scans: 48, sensor, ..BuildingConfig::default() });
    let near = empty.scans[10].0.translation;
    let [low, high] = [[0.9, -0.3, -1.0], [1.5, 0.3, 0.4]].map(|d| std::array::from_fn(|k| near[k] + d[k]));
    let mut bodies = empty.world.bodies().to_vec();
    bodies.push(Body { name: "box".into(), shape: Shape::between(low, high), color: [200; 3] });
    let world = World3::new(bodies);
    let layout = LogLayout::Kitti { camera_from_lidar: portolan::geom::Pose::IDENTITY };
    let mut writer = LogWriter::create(&path, layout).unwrap();
    let directions = sensor.directions();
    for (i, (pose, frame)) in empty.scans.iter().enumerate().take(16) {
        let there = sensor.frame(&world, pose, &directions, (1, i as u64));
        writer.push(pose, i as f64, if (9..12).contains(&i) { &there } else { frame }).unwrap();
    }
    writer.finish().unwrap();
    let call = |out: &str, more: &[&str]| {
        let out = folder.path().join(out);
        let call = ["map", arg(&path), "--resolution", "0.1", "--out", arg(&out), "--json"];
        json(call.iter().copied().chain(more.iter().copied()))
    };
    let found = call("out", &["--movers"]);
    let listed = read_ply_cloud(folder.path().join("out").join("movers.ply")).unwrap();
    let on_box = |p: &&[f32; 3]| (0..3).all(|k| (low[k] - 0.06..high[k] + 0.06).contains(&f64::from(p[k])));
    let good = listed.points.iter().filter(on_box).count();
    assert!(good > 400 && 10 * good > 9 * listed.points.len(), "{good} of {}", listed.points.len());
    assert!(found["movers"]["scans"].as_u64() >= Some(3), "{}", found["movers"]);
}

#[test]
fn points_without_rays_have_no_movers() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    let error = fail(2, ["map", arg(&log), "--resolution", "0.05", "--movers=0", "--out", arg(&out)]);
    assert!(error.contains("--movers"), "{error}");
    let cloud = folder.path().join("cloud.xyz");
    std::fs::write(&cloud, "0 0 0\n1 0 0\n1 1 0\n").unwrap();
    let call = ["map", arg(&cloud), "--resolution", "0.1", "--points-only", "--movers", "--out", arg(&out)];
    let error = fail(2, call);
    assert!(error.contains("--movers needs rays"), "{error}");
}
