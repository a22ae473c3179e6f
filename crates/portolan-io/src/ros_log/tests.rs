//! Bags of planar lasers that are written here, and the real ones.

use std::path::Path;

use portolan::geom::vector::distance;
use portolan::scan::{BeamKind, RangeLimits};

use super::testing::*;
use super::*;
use crate::scan_log::{ScanLog, ScanLogOptions};
use crate::testing::{no_panic, real_data, says, temporary};
use crate::{FileKind, LaserLog, detect, detect_no_return};

#[test]
fn scans_have_poses_at_their_stamps_and_keep_what_the_sensor_says() {
    let mut run = robot();
    let readings = [1.0, f32::INFINITY, f32::NAN, 10.0, 12.0, 0.25, 0.5, 2.0];
    run.scan("/scan", "/laser", START + 0.525, [-0.5, 0.25], &readings);
    run.scan("/scan", "/laser", START + 0.9, [0.5, -0.25], &readings);
    run.scan("/scan", "/laser", START + 1.9, [0.5, -0.25], &readings);
    run.scan("/scan", "/laser", START + 1.0, [0.5, -0.25], &[]);
    // Static transforms hold for all time, however late they come.
    run.transform("/tf_static", ["base_link", "laser"], START + 2.0, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    assert_eq!(detect(&path).unwrap(), FileKind::Bag);
    assert_eq!(bag_dimension(&path, &BagChoice::default()).unwrap(), 2);
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    assert_eq!((log.len(), log.format(), log.declared_max_range()), (2, "bag", Some(10.0)));
    assert!(distance(log.raw(0).world_from_laser.translation, [0.725, 0.0]) < 1e-6);
    assert!(distance(log.raw(1).world_from_laser.translation, [1.1, 0.0]) < 1e-6);
    assert!((log.raw(0).time.unwrap() - START - 0.525).abs() < 1e-6);
    // A clockwise scanner is kept as it is, and its beams are neighbors all the same.
    assert_eq!(log.raw(1).bearings[..2], [0.5, 0.25]);
    assert_eq!(detect_no_return(&log), None, "what is declared needs no guess");
    let limits = RangeLimits { no_return_free: 4.0, ..RangeLimits::default() };
    for i in 0..2 {
        let scan = log.raw(i).to_scan(&limits);
        use BeamKind::*;
        let mut kinds: Vec<_> = scan.beams().map(|b| b.kind).collect();
        if i == 1 {
            kinds.reverse();
        }
        assert_eq!(kinds, [Hit, NoReturn, Dropped, NoReturn, NoReturn, Dropped, Hit, Hit]);
        assert_eq!((scan.refused().not_finite, scan.refused().too_near), (1, 1));
        assert_eq!(scan.next(0), Some(1));
    }
    // Each reading at its own bearing, whichever way the scanner turns.
    let hit = log.raw(1).to_scan(&limits).hits_world(&log.raw(1).world_from_laser).next().unwrap();
    let bearing = 0.5f64 - 7.0 * 0.25;
    assert!(distance(hit, [1.1 + 2.0 * bearing.cos(), 2.0 * bearing.sin()]) < 1e-6, "{hit:?}");
    // What the caller says stands instead of what is declared.
    let own = RangeLimits { no_return: 50.0, ..RangeLimits::default() };
    assert_eq!(log.raw(0).to_scan(&own).counts().hit, 5);
    let stats = stats(&log);
    assert_eq!((stats.messages, stats.scans_without_pose(), stats.refused_messages()), (4, 1, 1));
    assert_eq!(stats.without_pose.keys().collect::<Vec<_>>(), ["transform odom > base_link"]);
    assert!(stats.first_without_pose.as_ref().unwrap().contains("it is 0.400 s after the last pose"));
    assert_eq!((&*stats.fixed_frame, &*stats.poses), ("odom", "transforms odom > base_link > laser"));
    // A wider tolerance goes on with the motion.
    let wide = ScanLogOptions { time_tolerance: 0.5, ..ScanLogOptions::default() };
    let log = LaserLog::read_bag(&path, &wide).unwrap();
    assert!(distance(log.raw(2).world_from_laser.translation, [2.1, 0.0]) < 1e-6);
}

#[test]
fn lasers_that_hang_or_lean() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut run = robot();
    run.transform("/tf_static", ["base_link", "hanging"], START, at(0.0, 0.0, 1.0, [1.0, 0.0, 0.0, 0.0]));
    run.transform("/tf_static", ["base_link", "upright"], START, at(0.0, 0.0, 1.0, [half, 0.0, 0.0, half]));
    run.transform("/tf_static", ["base_link", "leaning"], START, at(0.0, 0.0, 1.0, [0.0, 0.05, 0.0, 1.0]));
    for frame in ["hanging", "upright", "leaning"] {
        run.scan(&format!("/{frame}"), frame, START + 0.5, [0.25, 0.25], &[1.0, 2.0]);
    }
    let (_folder, path) = run.save();
    let read = |names: &[&str]| {
        let topics = names.iter().map(|n| (*n).to_owned()).collect();
        LaserLog::read_bag(&path, &options(BagChoice { topics, ..BagChoice::default() }))
    };
    let log = read(&["/hanging"]).unwrap();
    assert_eq!(log.raw(0).bearings, [-0.25, -0.5]);
    assert!(stats(&log).notes.iter().any(|n| n.contains("hangs upside down")));
    says(
        read(&["/upright"]),
        "0 of 1 messages of /upright; the first: scan 0 of upright: its plane is tilted by 90.0 degrees",
    );
    let all = read(&["/hanging", "leaning", "/upright"]).unwrap();
    assert_eq!((all.len(), stats(&all).tilted, stats(&all).refused_messages()), (2, 1, 1));
    assert!((stats(&all).worst_tilt - 0.1).abs() < 1e-3);
}

#[test]
fn poses_of_a_topic_and_of_a_file() {
    let mut run = Run::new();
    for k in 0..31 {
        let t = 0.05 * f64::from(k);
        run.pose("/mocap", "/world", START + t, at(t, 0.0, 0.0, LEVEL));
        run.scan("/scan", "laser", START + t, [0.0, 0.1], &[1.0, 2.0, 3.0]);
    }
    let alone = run.save();
    let log = LaserLog::read_bag(&alone.1, &ScanLogOptions::default()).unwrap();
    let about = stats(&log);
    assert_eq!((log.len(), &*about.fixed_frame), (31, "world"));
    assert_eq!(about.poses, "topic /mocap, taken as poses of the sensor");
    assert!(
        about.guesses.iter().any(|g| g.contains("no transform leads from what /mocap poses to laser")),
        "{:?}",
        about.guesses
    );
    says(
        LaserLog::read_bag(
            &alone.1,
            &options(BagChoice { fixed_frame: Some("map".into()), ..BagChoice::default() }),
        ),
        "--fixed-frame is map; /mocap has poses in \"world\"",
    );
    // The same with what leads from the body to the laser.
    let mut run = robot();
    run.pose("/mocap", "world", START, at(5.0, 0.0, 0.0, LEVEL));
    run.pose("/mocap", "world", START + 0.1, at(5.5, 0.0, 0.0, LEVEL));
    run.scan("/scan", "laser", START + 0.1, [0.0, 0.1], &[1.0]);
    run.transform("/tf_static", ["base_link", "laser"], START, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [0.3, 0.0]) < 1e-6, "the tree comes first");
    assert!(stats(&log).guesses.iter().any(|g| g.contains("the bag has /mocap as well (--pose-topic)")));
    let topic = |base: Option<&str>| BagChoice {
        pose_topic: Some("mocap".into()),
        base_frame: base.map(str::to_owned),
        ..BagChoice::default()
    };
    let log = LaserLog::read_bag(&path, &options(topic(None))).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [5.7, 0.0]) < 1e-6);
    assert!(stats(&log).guesses.iter().any(|g| g.contains("taken as those of base_link (--base-frame)")));
    let log = LaserLog::read_bag(&path, &options(topic(Some("/laser")))).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [5.5, 0.0]) < 1e-6);
    says(LaserLog::read_bag(&path, &options(topic(Some("wheel")))), "no transform names the frame wheel");
    // A file of poses goes by stamp.
    let (_other, file) = temporary("poses.txt");
    std::fs::write(&file, format!("{} 7 1 0\n{} 7.2 1 0\n", START + 0.04, START + 0.24)).unwrap();
    let by_file = ScanLogOptions { poses: Some(file.clone()), ..ScanLogOptions::default() };
    let log = LaserLog::read_bag(&path, &by_file).unwrap();
    assert!(distance(log.raw(0).world_from_laser.translation, [7.06, 1.0]) < 1e-6);
    std::fs::write(&file, "1 2 3\n1 2 3\n").unwrap();
    says(
        LaserLog::read_bag(&path, &by_file),
        "the number of poses is 2; give stamps, or one pose for each of the 1 scans",
    );
}

#[test]
fn what_cannot_be_a_log_is_refused_with_its_reason() {
    let mut run = robot();
    run.scan("/scan", "laser", START + 0.1, [0.0, 0.1], &[1.0]);
    run.cloud("/points", "base_link", START + 0.1, &[[1.0, 2.0, 3.0]; 3]);
    let (folder, path) = run.save();
    let read = |choice: BagChoice| LaserLog::read_bag(&path, &options(choice));
    let topics = |names: &[&str]| BagChoice {
        topics: names.iter().map(|n| (*n).into()).collect(),
        ..BagChoice::default()
    };
    assert_eq!(bag_dimension(&path, &BagChoice::default()).unwrap(), 3, "clouds come before planar lasers");
    says(read(BagChoice::default()), "the topics of scans is /points; they are 3-D");
    says(
        read(topics(&["/lidar"])),
        "--topic is /lidar; the bag has no such topic; it has /points, /scan, /tf",
    );
    says(read(topics(&["/tf"])), "the type of /tf is tf2_msgs/TFMessage");
    says(
        read(topics(&["/scan", "/points"])),
        "the topics is /scan and /points; 2-D and 3-D scans make different maps",
    );
    says(
        read(topics(&["/scan"])),
        "where poses are is none of the sensor's frame; the scans are of frame \"laser\", transforms of base_link, odom",
    );
    says(
        read(BagChoice { pose_topic: Some("/odometry".into()), ..topics(&["/scan"]) }),
        "--pose-topic is /odometry; the bag has no such topic",
    );
    says(ScanLog::open(&path, &options(topics(&["/scan"]))), "they are 2-D; name clouds or depth images");
    // Cut and damaged bags; what can be read first is read where the caller says so.
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert!(LaserLog::read_bag(&path, &options(topics(&["/scan"]))).is_err());
    assert_eq!(detect(&path).unwrap(), FileKind::Bag);
    std::fs::write(&path, b"").unwrap();
    says(bag_dimension(&path, &BagChoice::default()), "is empty");
    says(LaserLog::read_bag(folder.path().join("gone.mcap"), &ScanLogOptions::default()), "cannot open it");
    // The file that describes a folder is the folder; a map_server yaml is none.
    std::fs::write(&path, &whole).unwrap();
    let yaml = folder.path().join("metadata.yaml");
    std::fs::write(&yaml, "rosbag2_bagfile_information:\n  relative_file_paths:\n  - run.mcap\n").unwrap();
    assert_eq!((detect(&yaml).unwrap(), detect(folder.path()).unwrap()), (FileKind::Bag, FileKind::Bag));
    std::fs::write(&yaml, "image: a.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n").unwrap();
    assert_eq!(detect(&yaml).unwrap(), FileKind::MapServerYaml);
}

#[test]
fn a_turn_that_ends_at_the_stamp_is_told() {
    let write = |delay: f64, start: f64| {
        let mut run = Run::new();
        for k in 0..40 {
            let t = 0.1 * f64::from(k);
            run.pose("/mocap", "world", start + t, at(t, 0.0, 0.0, LEVEL));
            if k > 2 && k < 38 {
                let readings = [1.0; 90];
                run.scan_at("/scan", "laser", start + t + delay, start + t, [-3.1, 0.0698], &readings);
            }
        }
        run.save()
    };
    let x = |path: &Path, choice: BagChoice| {
        let log = LaserLog::read_bag(path, &options(choice)).unwrap();
        (
            log.raw(0).world_from_laser.translation[0],
            stats(&log).guesses.iter().any(|g| g.contains("--time-offset")),
        )
    };
    let near = |found: (f64, bool), expected: f64, told: bool| {
        assert!((found.0 - expected).abs() < 1e-5 && found.1 == told, "{found:?}");
    };
    let own = BagChoice { time_offset: Some(0.0), ..BagChoice::default() };
    let (_a, early) = write(0.008, START);
    near(x(&early, BagChoice::default()), 0.25, true);
    near(x(&early, own), 0.3, false);
    let (_b, late) = write(0.108, START);
    near(x(&late, BagChoice::default()), 0.3, false);
    let (_c, simulated) = write(0.0, 100.0);
    near(x(&simulated, BagChoice::default()), 0.3, false);
}

#[test]
fn info_proposes_what_map_would_choose() {
    let mut run = robot();
    for k in 0..10 {
        run.scan_at(
            "/scan",
            "laser",
            START + 0.1 * f64::from(k) + 0.02,
            START + 0.1 * f64::from(k),
            [0.0, 0.1],
            &[1.0],
        );
    }
    run.transform("/tf_static", ["base_link", "laser"], START, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    let info = BagInfo::read(&path, &ScanLogOptions::default()).unwrap();
    assert_eq!(
        (&*info.container, info.dimension, &info.roots[..]),
        ("MCAP", Some(2), &["odom".to_owned()][..])
    );
    assert_eq!(info.map_options.unwrap(), ["--topic", "/scan", "--fixed-frame", "odom"]);
    let scan = &info.topics[0];
    assert_eq!(
        (&*scan.name, scan.messages, &scan.frames[..], scan.is_read),
        ("/scan", 10, &["laser".to_owned()][..], true)
    );
    assert!((scan.rate.unwrap() - 10.0).abs() < 0.1 && (scan.longest_gap - 0.1).abs() < 1e-3);
    assert!(scan.delay.unwrap().iter().all(|d| (d - 0.02).abs() < 1e-3));
    let edges: Vec<_> = info.edges.iter().map(|e| (&*e.parent, &*e.child, e.is_static, e.messages)).collect();
    assert_eq!(edges, [("base_link", "laser", true, 1), ("odom", "base_link", false, 31)]);
    assert!((info.edges[1].interval - 0.05).abs() < 1e-6);
}

/// No phantom walls: what reads the maximum or infinity is no surface.
#[test]
fn real_bags_of_planar_lasers() {
    let hits = |log: &LaserLog| {
        let limits = RangeLimits {
            no_return: detect_no_return(log).unwrap_or(f64::INFINITY),
            ..RangeLimits::default()
        };
        log.scans(&limits).fold([0u64; 3], |[h, n, d], (_, scan)| {
            let c = scan.counts();
            [h + c.hit, n + c.no_return, d + c.dropped]
        })
    };
    let read = |name: &str| {
        Some(LaserLog::read_bag(real_data(&format!("ros_bags/{name}"))?, &ScanLogOptions::default()).unwrap())
    };
    if let (Some(one), Some(two)) = (read("jackal/run.bag"), read("jackal/run_ros2")) {
        assert_eq!((one.len(), stats(&one).messages), (385, 414));
        assert_eq!(hits(&one), hits(&two));
        let same = |(a, b): (crate::RawLaserScan<'_>, crate::RawLaserScan<'_>)| {
            let bits = |all: &[f64]| all.iter().map(|r| r.to_bits()).collect::<Vec<_>>();
            a.world_from_laser == b.world_from_laser
                && a.time == b.time
                && bits(a.readings) == bits(b.readings)
        };
        assert!(one.raw_scans().zip(two.raw_scans()).all(same));
        assert!(
            stats(&one).guesses.iter().any(|g| g.contains("50 ms before it")),
            "{:?}",
            stats(&one).guesses
        );
    }
    if let Some(log) = read("fembots_hokuyo/mylaserdata.bag") {
        assert_eq!((log.len(), &*stats(&log).poses), (415, "transforms map > odom > base_link > laser"));
        let [hit, no_return, dropped] = hits(&log);
        assert!(
            no_return as f64 > 0.54 * (hit + no_return + dropped) as f64 && dropped < 200,
            "{hit} {no_return} {dropped}"
        );
    }
    if let Some(log) = read("pr2_gazebo/mylaserdata.bag") {
        let [hit, no_return, dropped] = hits(&log);
        assert!(
            no_return as f64 > 0.96 * (hit + no_return + dropped) as f64 && hit > 0,
            "{hit} {no_return} {dropped}"
        );
    }
    if let Some(log) = read("stage_truth/Mapping1.bag") {
        assert_eq!(log.len(), 1727);
    }
    if let Some(log) = read("turtlebot3_gazebo") {
        assert_eq!(log.len(), 99);
        assert!(stats(&log).notes.iter().any(|n| n.contains("no definition of sensor_msgs/LaserScan")));
    }
}

#[test]
fn no_bytes_of_a_bag_make_it_panic() {
    let mut run = robot();
    run.scan("/scan", "base_link", START + 0.1, [0.0, 0.1], &[1.0]);
    run.cloud("/points", "base_link", START + 0.1, &[[1.0, 2.0, 3.0]; 3]);
    let (_folder, path) = temporary("run.mcap");
    let topics =
        |name: &str| BagChoice { topics: vec![name.into()], allow_truncated: true, ..BagChoice::default() };
    no_panic(run.bytes(), 11, 400, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        let _ = LaserLog::read_bag(&path, &options(topics("/scan")));
        let _ = BagInfo::read(&path, &options(BagChoice::default()));
        ScanLog::open(&path, &options(topics("/points"))).and_then(|log| log.frame(0))
    });
}

#[test]
fn messages_that_are_longer_than_their_type_are_told() {
    let mut run = robot();
    let mut m = Message::header(START + 0.1, "base_link");
    m.f32(&[0.0, 0.0, 0.1, 0.0, 0.0, 0.5, 10.0]).u32(&[1]).f32(&[2.0]).u32(&[0]).u32(&[7]);
    run.put("/scan", "sensor_msgs/LaserScan", SCAN, START + 0.1, &m);
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    assert!(stats(&log).notes.iter().any(|n| n.contains("1 messages have bytes behind their end")));
}

#[test]
fn beams_have_times_and_the_laser_poses_at_them() {
    let mut run = robot();
    for (k, step) in [(0u32, 0.1f32), (1, -0.1)] {
        let mut m = Message::header(START + 0.25 + 0.5 * f64::from(k), "base_link");
        m.f32(&[0.0, 0.0, step, 0.01, 0.1, 0.5, 10.0]).u32(&[11]).f32(&[2.0; 11]).u32(&[0]);
        run.put("/scan", "sensor_msgs/LaserScan", SCAN, START + 0.5, &m);
    }
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    for i in 0..2 {
        let (scan, motion) = (log.raw(i), log.trajectory(i).unwrap());
        let times = scan.beam_times().unwrap();
        // The order is that of the beams of the scan, which is counter-clockwise.
        assert!((times[if i == 0 { 10 } else { 0 }] - 0.1).abs() < 1e-6, "{times:?}");
        for time in times {
            let at = motion.at(scan.time.unwrap() + f64::from(time), 0.02).unwrap();
            let x = scan.world_from_laser.translation[0] + f64::from(time);
            assert!((at.translation[0] - x).abs() < 1e-5, "{time}: {at:?}");
        }
    }
}

/// A laser that drives 1 m/s while it looks ahead, to the side and behind: what it sees is where it is in the frame of the stamp.
#[test]
fn the_motion_of_the_laser_is_taken_out_of_its_beams() {
    let mut run = robot();
    let mut m = Message::header(START + 0.5, "base_link");
    let quarter = std::f32::consts::FRAC_PI_2;
    m.f32(&[0.0, 0.0, quarter, 0.1, 0.3, 0.5, 10.0]).u32(&[4]).f32(&[2.0, 3.0, 4.0, f32::INFINITY]).u32(&[0]);
    run.put("/scan", "sensor_msgs/LaserScan", SCAN, START + 0.5, &m);
    let (_folder, path) = run.save();
    let log = LaserLog::read_bag(&path, &ScanLogOptions::default()).unwrap();
    let limits = RangeLimits::default();
    let ends = |log: &LaserLog| -> Vec<[f64; 2]> {
        log.scan(0, &limits).hits_world(&log.raw(0).world_from_laser).collect()
    };
    let near = |found: Vec<[f64; 2]>, expected: [[f64; 2]; 3]| {
        assert!(found.iter().zip(expected).all(|(a, b)| distance(*a, b) < 1e-5), "{found:?}");
    };
    near(ends(&log), [[2.5, 0.0], [0.6, 3.0], [-3.3, 0.0]]);
    let motion = log.motion().unwrap();
    assert!((motion.deskewed, motion.still, motion.not_covered.0) == (1, 0, 0), "{motion:?}");
    assert!((motion.largest - 0.2).abs() < 1e-5, "{motion:?}");
    let left = log.without_deskew();
    near(ends(&left), [[2.5, 0.0], [0.5, 3.0], [-3.5, 0.0]]);
    assert_eq!(left.motion(), None);
}
