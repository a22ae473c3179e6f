//! `map` and what comes after it, on logs of the simulated Building.

use crate::support;

use std::path::Path;

use crate::support::logs_3d::{camera_log, lidar_log, lidar_log_of_camera_poses};
use crate::support::{arg, fail, json, succeed};

fn map(log: &Path, out: &Path, more: &[&str]) -> String {
    let call = ["map", arg(log), "--out", arg(out), "--resolution", "0.1", "--overwrite"];
    succeed(call.iter().copied().chain(more.iter().copied()))
}

fn files_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn summary(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap()
}

/// What the summary says of where log odds and counts agree, from the cells of the file.
fn occupied_by(out: &Path) -> serde_json::Value {
    use portolan::store::Store;
    let file = portolan_io::MapFile::<3>::read(out.join("map.portolan")).unwrap();
    let (occupancy, counts) = (file.occupancy_bricks.unwrap().store, file.attenuation.unwrap().store);
    let share = summary(out)["settings"]["thin"].as_f64().unwrap();
    let mut seen: std::collections::BTreeSet<_> = occupancy.keys().into_iter().collect();
    seen.extend(counts.keys());
    let mut found = [0; 3];
    for cell in seen.iter().flat_map(|key| (0..512).map(|i| key.cell(i))) {
        let Some(counted) = counts.cell(cell).filter(|c| c.hits > 0) else { continue };
        let log_odds = occupancy.cell(cell).is_some_and(|v| v.0 > 0);
        let stops = counted.hits >= 3 && counted.opacity::<3>() > share;
        let said = [log_odds && !stops, stops && !log_odds, log_odds && stops];
        found.iter_mut().zip(said).for_each(|(n, said)| *n += usize::from(said));
    }
    // Six scans are few for cells to have three hits.
    assert!(found[0] > 0 && found[2] > 0, "{found:?}");
    serde_json::json!({ "log_odds_alone": found[0], "counts_alone": found[1], "both": found[2] })
}

#[test]
fn a_lidar_log_becomes_all_maps() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    let text = map(&log, &out, &[]);
    assert!(text.contains("6 of 6 scans fused (kitti)"), "{text}");
    assert_eq!(
        files_in(&out),
        [
            "esdf.bin",
            "manifest.json",
            "map.portolan",
            "mesh.ply",
            "obstacles.csv",
            "octree.bt",
            "octree.ot",
            "preview.png",
            "summary.json"
        ]
    );
    let summary = summary(&out);
    assert_eq!(summary["scans"]["fused"], 6);
    assert!(summary["beams"]["hit"].as_u64().unwrap() > 20_000);
    assert!(summary["mesh"]["triangles"].as_u64().unwrap() > 5000);
    assert!(summary["mesh"]["area"].as_f64().unwrap() > 50.0);
    assert_eq!(summary["warnings"], serde_json::json!([]));
    assert_eq!(summary["obstacles"]["occupied_by"], occupied_by(&out));

    // Where the sensor was is free. What it saw cannot be nearer than the truth, up to a cell and a half; what it did not
    // see, the floor right below, may be missing.
    let poses = std::fs::read_to_string(log.join("poses.txt")).unwrap();
    let row: Vec<f64> =
        poses.lines().next().unwrap().split_whitespace().map(|v| v.parse().unwrap()).collect();
    let points = folder.path().join("points.csv");
    std::fs::write(&points, format!("{},{},{}\n", row[3], row[7], row[11])).unwrap();
    let near = json(["query", arg(&out), "--points", arg(&points), "--json", "--max-distance", "0.2"]);
    assert_eq!(near["answers"][0]["status"], "saturated");
    assert_eq!(near["answers"][0]["lower"], near["answers"][0]["distance"]);
    let answers = json(["query", arg(&out), "--points", arg(&points), "--json", "--max-distance", "4"]);
    let answer = &answers["answers"][0];
    assert_eq!(answer["status"], "known");
    assert!(answer["occupancy"].as_f64().unwrap() < 0.3);
    let world = portolan_sim::building::building_world(portolan_sim::SEED).world;
    let truth = world.signed_distance([row[3], row[7], row[11]]);
    let distance = answer["distance"].as_f64().unwrap();
    assert!(distance > truth - 0.15 && distance < truth + 1.0, "{answer} {truth}");
    let info = json(["info", arg(&out), "--json"]);
    assert_eq!(info["dimension"], 3);
    assert!(info["maps"]["tree"]["observed"].as_u64().unwrap() > 10_000);
    let octree = json(["info", arg(&out.join("octree.bt")), "--json"]);
    assert!(octree["kind"].as_str().unwrap().contains("OctoMap"), "{octree}");
}

#[test]
fn a_camera_log_becomes_a_coloured_mesh() {
    let (folder, log) = camera_log();
    let out = folder.path().join("out");
    map(&log, &out, &["--maps", "mesh", "--max-range", "6"]);
    let summary = summary(&out);
    assert_eq!(summary["input"]["format"], "seven-scenes");
    assert_eq!(summary["mesh"]["colors"], true);
    assert!(summary["beams"]["max_range"].as_u64().unwrap() > 0);
    assert!(!out.join("octree.bt").exists());
    map(&log, &out, &["--maps", "mesh", "--no-color"]);
    assert_eq!(self::summary(&out)["mesh"]["colors"], false);
}

/// Poses of another body and depths of another unit: what scans hit is where others saw nothing, and the likely cure is named.
#[test]
fn scans_that_do_not_fit_their_poses_are_told() {
    let agreement = |log: &Path, more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        map(log, &out, more);
        let summary = summary(&out);
        let of = |what: &str| summary["agreement"][what].as_f64().unwrap();
        let warnings = summary["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap().to_owned());
        let warning = warnings.filter(|w| w.contains("earlier scans saw free")).collect::<String>();
        (of("hits"), of("in_free_space") / of("hits"), warning)
    };
    let (folder, log) = lidar_log_of_camera_poses();
    let (hits, share, warning) = agreement(&log, &[]);
    assert!(hits > 200.0 && share < 0.01 && warning.is_empty(), "{hits} {share} {warning}");
    let camera_poses = folder.path().join("poses-of-the-camera.txt");
    std::fs::copy(log.join("poses.txt"), &camera_poses).unwrap();
    // By occupancy, where there are no distances.
    let (_, share, warning) = agreement(&log, &["--maps", "tree"]);
    assert!(share < 0.01 && warning.is_empty(), "{share} {warning}");
    for more in [&[][..], &["--ledger"], &["--maps", "tree"], &["--maps", "tree", "--ledger"]] {
        let (_, share, warning) = agreement(&log, &[&["--poses", arg(&camera_poses)], more].concat());
        assert!(warning.contains("the Tr of calib.txt"), "{share} {warning}");
    }
    let (_folder, log) = camera_log();
    let (hits, share, warning) = agreement(&log, &[]);
    assert!(hits > 200.0 && share < 0.01 && warning.is_empty(), "{hits} {share} {warning}");
    let (_, share, warning) = agreement(&log, &["--depth-scale", "200"]);
    assert!(warning.contains("--depth-scale"), "{share} {warning}");
}

#[test]
fn appending_is_fusing_in_one_go_and_threads_do_not_matter() {
    let (folder, log) = lidar_log();
    let at = |name: &str| folder.path().join(name);
    map(&log, &at("all"), &["--threads", "1"]);
    map(&log, &at("two"), &["--threads", "2"]);
    for file in ["map.portolan", "mesh.ply", "octree.bt", "octree.ot", "esdf.bin"] {
        let bytes = |name: &str| std::fs::read(at(name).join(file)).unwrap();
        assert!(bytes("all") == bytes("two"), "{file} depends on the number of threads");
    }

    // The same scans in two logs, one after the other. (Rows and columns are found in the first scan of each run: with
    // them the two would differ by rounding.)
    map(&log, &at("all"), &["--sweep", "exact"]);
    let rows: Vec<String> =
        std::fs::read_to_string(log.join("poses.txt")).unwrap().lines().map(str::to_owned).collect();
    for (name, range) in [("first", 0..2), ("second", 2..6)] {
        std::fs::create_dir_all(at(name).join("velodyne")).unwrap();
        for (k, i) in range.clone().enumerate() {
            let scan = |i: usize| format!("velodyne/{i:06}.bin");
            std::fs::copy(log.join(scan(i)), at(name).join(scan(k))).unwrap();
        }
        std::fs::write(at(name).join("poses.txt"), rows[range].join("\n")).unwrap();
        std::fs::copy(log.join("calib.txt"), at(name).join("calib.txt")).unwrap();
    }
    map(&at("first"), &at("parts"), &["--sweep", "exact"]);
    succeed(["map", arg(&at("second")), "--out", arg(&at("parts")), "--append"]);
    for file in ["mesh.ply", "octree.bt", "octree.ot", "esdf.bin"] {
        let bytes = |name: &str| std::fs::read(at(name).join(file)).unwrap();
        assert!(bytes("all") == bytes("parts"), "{file} depends on how the log was cut");
    }
    let (all, parts) = (summary(&at("all")), summary(&at("parts")));
    assert_eq!(parts["scans"]["in_map"], 6);
    assert_eq!(all["extent"], parts["extent"]);

    let other =
        fail(1, ["map", arg(&at("second")), "--out", arg(&at("parts")), "--append", "--resolution", "0.2"]);
    assert!(other.contains("resolution is 0.1 in the map and 0.2 in this call"), "{other}");
}

#[test]
fn the_memory_limit_saves_what_fits() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    let call = ["map", arg(&log), "--out", arg(&out), "--resolution", "0.05", "--memory", "8M"];
    let output = support::portolan(call);
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(error.contains("the map needs more than") && error.contains("fused and saved"), "{error}");
    let summary = summary(&out);
    let total: u64 =
        ["tree", "tsdf", "attenuation"].iter().map(|m| summary["bytes"][m].as_u64().unwrap()).sum();
    assert!(total <= 8 << 20, "{total}");
    assert!(json(["info", arg(&out), "--json"])["maps"]["tsdf"]["bricks"].as_u64().unwrap() > 100);
}

#[test]
fn bounds_ranges_and_the_robots_body() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    map(&log, &out, &["--bounds", "-1,-1,0,3,3,2", "--maps", "tree"]);
    let summary_of = summary(&out);
    assert!(summary_of["beams"]["hits_outside"].as_u64().unwrap() > 0);
    let size = summary_of["extent"]["size"].as_array().unwrap();
    assert!(size.iter().all(|v| v.as_f64().unwrap() <= 5.6), "{size:?}");

    map(&log, &out, &["--self-filter", "0,0,0,1.6", "--min-range", "0.5", "--maps", "tree"]);
    assert!(summary(&out)["beams"]["self_hit"].as_u64().unwrap() > 0);

    let again = ["map", arg(&log), "--out", arg(&out), "--resolution", "0.1", "--overwrite"];
    let refused = fail(2, [&again[..], &["--bounds", "0,0,1,1"]].concat());
    assert!(refused.contains("six numbers"), "{refused}");
    let refused = fail(2, [&again[..], &["--maps", "contour"]].concat());
    assert!(refused.contains("--maps contour is only for 2-D; the log is 3-D"), "{refused}");
}

#[test]
fn a_broken_scan_is_counted_and_a_broken_log_refused() {
    let (folder, log) = camera_log();
    let out = folder.path().join("out");
    std::fs::write(log.join("frame-000002.depth.png"), b"\x89PNG\r\n\x1a\nnothing").unwrap();
    let text = map(&log, &out, &["--maps", "tsdf"]);
    assert!(
        text.contains("4 of 5 scans fused") && text.contains("1 scans could not be read (first: "),
        "{text}"
    );
    assert!(text.contains("frame-000002.depth.png"), "{text}");
    for i in 0..5 {
        std::fs::write(log.join(format!("frame-{i:06}.depth.png")), b"none").unwrap();
    }
    let other = folder.path().join("other");
    let error = fail(1, ["map", arg(&log), "--out", arg(&other), "--resolution", "0.1"]);
    assert!(error.contains("frame-000000.depth.png"), "{error}");
    assert!(!other.exists());
}

#[test]
fn a_folder_keeps_what_is_not_of_an_earlier_run() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("mesh.ply"), "mine").unwrap();
    map(&log, &out, &["--maps", "tree"]);
    assert_eq!(std::fs::read(out.join("mesh.ply")).unwrap(), b"mine");
    map(&log, &out, &["--maps", "mesh"]);
    map(&log, &out, &["--maps", "tree"]);
    assert_eq!(files_in(&out), ["manifest.json", "map.portolan", "octree.bt", "octree.ot", "summary.json"]);
    let refused = fail(2, ["map", arg(&log), "--out", arg(&log), "--resolution", "0.1"]);
    assert!(refused.contains("the log's own folder"), "{refused}");
}

#[test]
fn appending_keeps_settings_and_names_what_differs() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    map(&log, &out, &["--max-distance", "0.5", "--hold-out", "3"]);
    let before = summary(&out);
    succeed(["map", arg(&log), "--out", arg(&out), "--append"]);
    let after = summary(&out);
    for key in ["max_distance", "hold_out", "carve_weight"] {
        assert_eq!(before["settings"][key], after["settings"][key], "{key}");
    }
    for (option, value, word) in [
        ("--every", "2", "--every"),
        ("--w-max", "5", "--half-life"),
        ("--truncation", "0.5", "--truncation"),
    ] {
        let error = fail(1, ["map", arg(&log), "--out", arg(&out), "--append", option, value]);
        assert!(error.contains(word), "{error}");
    }
    let error = fail(1, ["map", arg(&log), "--out", arg(&out), "--append", "--no-color"]);
    assert!(error.contains("leave out --no-color"), "{error}");
}

#[test]
fn held_out_scans_are_predicted_and_meshes_compared() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    map(&log, &out, &["--hold-out", "3"]);
    let prediction = json(["eval", arg(&out), "--scans", arg(&log), "--json"]);
    let scans = &prediction["scans"];
    assert_eq!((&scans["scans"], &scans["held_out"]), (&2.into(), &true.into()));
    // 24 rings of a moving lidar: most of what a held-out scan sees, another has seen from nearby.
    assert!(scans["median_error"].as_f64().unwrap() < 0.05, "{scans}");
    assert!(scans["within_one_cell"].as_f64().unwrap() > 0.6, "{scans}");
    for name in ["again.ply", "again.glb", "again.obj"] {
        let made = json(["mesh", arg(&out), arg(&folder.path().join(name)), "--json"]);
        assert!(made["triangles"].as_u64().unwrap() > 1000);
    }
    let same = folder.path().join("again.ply");
    let compared = json(["eval", arg(&out), "--reference", arg(&same), "--json"]);
    assert!(compared["reference"]["accuracy"]["p95"].as_f64().unwrap() < 1e-4, "{compared}");
    assert!(compared["reference"]["f_scores"][0].as_f64().unwrap() > 0.999, "{compared}");
    for name in ["a.bt", "a.ot", "a.bin", "a.ply", "a.mcap", "a.portolan"] {
        let to = folder.path().join(name);
        succeed(["convert", arg(&out), arg(&to)]);
        assert!(to.metadata().unwrap().len() > 100, "{name}");
    }
    let bytes = |path: &Path| std::fs::read(path).unwrap();
    assert!(bytes(&out.join("octree.bt")) == bytes(&folder.path().join("a.bt")));
    assert!(bytes(&out.join("map.portolan")) == bytes(&folder.path().join("a.portolan")));
}

#[test]
fn the_box_that_would_fit_fits() {
    let (folder, log) = lidar_log();
    // One far return makes the box of everything too large for an array.
    let far: Vec<u8> = [90.0f32, 80.0, 70.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let scan = log.join("velodyne/000000.bin");
    let mut bytes = std::fs::read(&scan).unwrap();
    bytes.extend(far);
    std::fs::write(&scan, bytes).unwrap();
    let out = folder.path().join("out");
    let text = map(&log, &out, &["--maps", "esdf", "--sweep", "exact"]);
    assert!(!out.join("esdf.bin").exists(), "{text}");
    let start = text.find("--dense ").unwrap() + "--dense ".len();
    let fitting = text[start..].split(' ').next().unwrap();
    map(&log, &out, &["--maps", "esdf", "--sweep", "exact", "--dense", fitting]);
    let size = out.join("esdf.bin").metadata().unwrap().len();
    assert!(size <= 256 << 20 && size > 200 << 20, "{size}");
}

/// A lidar that drives and turns while it scans, with the time of every point.
#[test]
fn the_motion_of_a_lidar_is_taken_out_and_said() {
    use portolan::geom::Pose;
    use portolan::scan::Frame;
    use portolan_io::{PointCloudFile, write_pcd};
    use portolan_sim::building::{SpinningLidar, building_world, moving_lidar_frame};

    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    std::fs::create_dir_all(&log).unwrap();
    let building = building_world(1);
    let [x, y] = building.path[0];
    let lidar = SpinningLidar { rings: 24, columns: 360, organized: false, ..SpinningLidar::default() };
    let directions = lidar.directions();
    let (sin, cos) = (std::f64::consts::FRAC_PI_4.sin(), std::f64::consts::FRAC_PI_4.cos());
    let second = Pose::<3>::from_quaternion([0.3, 0.0, 0.0], [0.0, 0.0, sin, cos]).unwrap();
    let start = Pose { translation: [x, y, 1.2], ..Pose::IDENTITY };
    let pose = |time: f64| start * Pose::IDENTITY.toward(&second, time);
    let mut poses = String::new();
    for i in 0..6 {
        let stamp = 0.1 * f64::from(i);
        let frame =
            moving_lidar_frame(&building.world, |t| pose(stamp + t), &lidar, &directions, 0.1, (1, i as u64));
        let Frame::Points(scan) = frame else { panic!("a lidar delivers points") };
        let hits = scan.points.len();
        let cloud = PointCloudFile {
            points: scan.points,
            times: scan.times[..hits].to_vec(),
            start_time: 1000.0 + stamp,
            ..PointCloudFile::default()
        };
        write_pcd(log.join(format!("{:.3}.pcd", 1000.0 + stamp)), &cloud).unwrap();
        let ([a, b, c], half) =
            (pose(stamp).translation, 0.5 * pose(stamp).rotation[1][0].atan2(pose(stamp).rotation[0][0]));
        poses += &format!("{:.3} {a} {b} {c} 0 0 {} {}\n", 1000.0 + stamp, half.sin(), half.cos());
    }
    std::fs::write(log.join("poses.txt"), poses).unwrap();

    let (with, without) = (folder.path().join("with"), folder.path().join("without"));
    let text = map(&log, &with, &[]);
    assert!(text.contains("motion taken out of 6 scans (points moved by up to "), "{text}");
    assert!(text.contains("their times are taken to be of the clock of the stamps"), "{text}");
    let motion = summary(&with)["motion"].clone();
    assert_eq!((&motion["taken_out"], &motion["not_covered"]), (&6.into(), &0.into()));
    assert!(motion["largest"].as_f64().unwrap() > 0.3, "{motion}");
    map(&log, &without, &["--no-deskew"]);
    assert_eq!(summary(&without)["motion"], serde_json::Value::Null);
    let error = |out: &Path| {
        let mesh = portolan_io::read_ply_mesh(out.join("mesh.ply")).unwrap();
        let mut all: Vec<f64> = (0..mesh.vertices.len())
            .map(|i| building.world.signed_distance(mesh.vertices[i]).abs())
            .collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (with, without) = (error(&with), error(&without));
    assert!(with < 0.5 * without, "{with} {without}");
}
