//! Bags of clouds and depth images that are written here.

use portolan::geom::vector::distance;
use portolan::scan::{Frame, FrameFilter};

use super::BagChoice;
use super::testing::*;
use crate::scan_log::{ScanLog, ScanLogOptions};
use crate::testing::{says, temporary};

#[test]
fn clouds_are_read_by_index_with_colors_and_times() {
    let mut run = robot();
    for k in 0..5 {
        let points = [[1.0, 2.0, 3.0], [f32::NAN; 3], [4.0 + k as f32, 5.0, 6.0]];
        run.cloud("/points", "lidar", START + 0.25 * f64::from(k), &points);
    }
    run.transform("/tf_static", ["base_link", "lidar"], START, at(0.2, 0.0, 0.3, LEVEL));
    let (_folder, path) = run.save();
    let log =
        ScanLog::open(&path, &ScanLogOptions { time_tolerance: 0.0, ..ScanLogOptions::default() }).unwrap();
    assert_eq!((log.len(), log.kind().word()), (5, "bag"));
    assert!(distance(log.pose(2).translation, [0.7, 0.0, 0.3]) < 1e-6);
    assert!((log.time(2).unwrap() - START - 0.5).abs() < 1e-6);
    for i in [3, 0] {
        let Frame::Points(scan) = log.frame(i).unwrap() else { panic!("points") };
        assert_eq!(scan.points, [[1.0, 2.0, 3.0], [4.0 + i as f32, 5.0, 6.0]]);
        assert_eq!(scan.colors, [[0xff, 0x80, 0], [0xff, 0x80, 2]]);
        assert_eq!(scan.refused.not_finite, 1);
        assert!((scan.times[1] - 0.002).abs() < 1e-6 && scan.times[0] == 0.0, "{:?}", scan.times);
    }
    let about = log.bag().unwrap();
    assert_eq!(about.point_times.as_deref(), Some("/points: t in nanoseconds after the stamp"));
    // Without colors, by other poses.
    let (_other, file) = temporary("poses.txt");
    let rows: String =
        (0..5).map(|k| format!("{:.3} {k} 0 0 0 0 0 1\n", START + 0.25 * f64::from(k))).collect();
    std::fs::write(&file, rows).unwrap();
    let own = ScanLogOptions { poses: Some(file), color: false, ..ScanLogOptions::default() };
    let log = ScanLog::open(&path, &own).unwrap();
    assert!((log.pose(3).translation[0] - 3.0).abs() < 1e-6);
    let Frame::Points(scan) = log.frame(0).unwrap() else { panic!("points") };
    assert!(scan.colors.is_empty());
}

#[test]
fn depth_has_its_camera_and_the_colors_of_its_frame() {
    let depth = [1000u16, 0, 2000, 500, 1500, 3000].map(u16::to_le_bytes).concat();
    let write = |color_frame: &str, size: [u32; 2]| {
        let mut run = robot();
        run.transform(
            "/tf_static",
            ["base_link", "optical"],
            START,
            at(0.1, 0.0, 1.0, [-0.5, 0.5, -0.5, 0.5]),
        );
        for k in 0..3 {
            let t = START + 0.1 * f64::from(k);
            run.image("/camera/depth/image_rect_raw", "optical", t, "16UC1", &depth);
            run.image("/camera/color/image_raw", color_frame, t + 0.001, "bgr8", &[7; 18]);
            let mut m = Message::header(t, "optical");
            m.u32(&[size[1], size[0]]).text("plumb_bob").u32(&[1]).f64(&[0.1]);
            m.f64(&[2.0, 0.0, 1.5, 0.0, 2.5, 1.0, 0.0, 0.0, 1.0]).f64(&[0.0; 9]);
            m.f64(&[3.0, 0.0, 1.25, 0.0, 0.0, 3.5, 0.75, 0.0, 0.0, 0.0, 1.0, 0.0]).u32(&[0, 0]);
            run.put("/camera/depth/camera_info", "sensor_msgs/CameraInfo", INFO, t, &m);
        }
        run.save()
    };
    let (_a, path) = write("optical", [3, 2]);
    let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
    let pinhole = log.camera().unwrap().pinhole;
    // Rectified pictures have the camera of P.
    assert_eq!([pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy], [3.0, 3.5, 1.25, 0.75]);
    let Frame::Image(image) = log.frame(1).unwrap() else { panic!("an image") };
    assert_eq!(image.values, [1.0, 0.0, 2.0, 0.5, 1.5, 3.0]);
    assert_eq!((image.columns, image.rows, &*image.colors), (3, 2, &[[7; 3]; 6][..]));
    assert!(distance(log.pose(1).translation, [0.2, 0.0, 1.0]) < 1e-6);
    let (_b, path) = write("color_optical", [3, 2]);
    let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
    let Frame::Image(image) = log.frame(0).unwrap() else { panic!("an image") };
    assert!(image.colors.is_empty());
    assert!(
        log.bag()
            .unwrap()
            .notes
            .iter()
            .any(|n| n.contains("/camera/color/image_raw (frame color_optical) is not registered"))
    );
    let (_c, path) = write("optical", [640, 480]);
    says(
        ScanLog::open(&path, &ScanLogOptions::default()),
        "the size of the picture is 3 x 2; the camera is for 640 x 480",
    );
}

/// The robot drives 1 m/s, the last point comes 2 ms after the stamp.
#[test]
fn the_motion_of_the_sensor_is_taken_out_of_clouds() {
    let mut run = robot();
    for k in 0..3 {
        let points = [[1.0, 2.0, 3.0], [4.0, 0.0, 0.0], [4.0, 5.0, 6.0]];
        run.cloud("/points", "base_link", START + 0.25 * f64::from(k), &points);
    }
    let (_folder, path) = run.save();
    let x = |deskew: bool| {
        let options = ScanLogOptions { deskew, ..ScanLogOptions::default() };
        let log = ScanLog::open(&path, &options).unwrap();
        let (Frame::Points(scan), _) = log.filtered_frame(1, &FrameFilter::default()).unwrap() else {
            panic!("points")
        };
        (scan.points.iter().map(|p| p[0]).collect::<Vec<_>>(), log.motion())
    };
    let (moved, motion) = x(true);
    assert!(
        moved.iter().zip([1.0, 4.001, 4.002]).all(|(a, b): (&f32, f32)| (a - b).abs() < 2e-5),
        "{moved:?}"
    );
    assert_eq!(motion.unwrap().deskewed, 1);
    assert_eq!(x(false), (vec![1.0, 4.0, 4.0], None));
}

/// What a SLAM publishes: clouds in the map's frame, and where it was. They are seen from there and not from zero.
#[test]
fn clouds_that_were_moved_into_the_maps_frame_are_seen_from_the_robot() {
    let points = [[1.0, 2.0, 3.0], [4.0, 0.0, 0.0]];
    let write = |tree: bool, topic: bool| {
        let mut run = Run::new();
        for k in 0..11 {
            let t = 0.1 * f64::from(k);
            let pose = at(2.0 * t, 1.0, 0.5, [0.0, 0.0, 1.0, 0.0]);
            if tree {
                run.transform("/tf", ["camera_init", "body"], START + t, pose);
            }
            if topic {
                run.pose("/pose", "camera_init", START + t, pose);
            }
            run.cloud("/cloud_registered", "camera_init", START + t, &points);
        }
        run.save()
    };
    for (tree, topic) in [(false, true), (true, true), (true, false)] {
        let (_folder, path) = write(tree, topic);
        let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
        let guesses = &log.bag().unwrap().guesses;
        assert!(guesses.iter().any(|g| g.contains("were moved into the map's frame")), "{guesses:?}");
        assert_eq!(*log.pose(5), portolan::geom::Pose::IDENTITY);
        assert!(distance(log.sensor_position(5), [1.0, 1.0, 0.5]) < 1e-5, "{tree} {topic}");
        let Frame::Points(scan) = log.frame(5).unwrap() else { panic!("points") };
        assert_eq!(scan.points, points);
        assert!(distance(scan.origin_of(0).unwrap(), [1.0, 1.0, 0.5]) < 1e-5);
    }
    // Where the frame of the scans moves, or nothing does, they are a sensor's.
    let (_folder, path) = write(true, false);
    let named = BagChoice { base_frame: Some("body".into()), ..BagChoice::default() };
    let log = ScanLog::open(&path, &options(named)).unwrap();
    assert!(distance(log.sensor_position(5), [1.0, 1.0, 0.5]) < 1e-5);
    let mut still = Run::new();
    still.transform("/tf_static", ["camera_init", "body"], START, at(1.0, 0.0, 0.0, LEVEL));
    still.cloud("/points", "camera_init", START, &points);
    let (_folder, path) = still.save();
    let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
    assert_eq!(log.sensor_position(0), [0.0; 3]);
}

#[test]
fn the_lens_that_a_bag_declares_is_undone() {
    let depth = [1000u16, 1100, 1200, 1300, 1400, 1500].map(u16::to_le_bytes).concat();
    let image = |model: &str, d: &[f64]| {
        let mut run = robot();
        run.transform("/tf_static", ["base_link", "optical"], START, at(0.0, 0.0, 1.0, LEVEL));
        run.image("/camera/depth/image_raw", "optical", START + 0.1, "16UC1", &depth);
        let mut m = Message::header(START + 0.1, "optical");
        m.u32(&[2, 3]).text(model).u32(&[d.len() as u32]).f64(d);
        m.f64(&[2.0, 0.0, 1.0, 0.0, 2.0, 0.5, 0.0, 0.0, 1.0]).f64(&[0.0; 9]).f64(&[0.0; 12]).u32(&[0, 0]);
        run.put("/camera/depth/camera_info", "sensor_msgs/CameraInfo", INFO, START + 0.1, &m);
        let (_folder, path) = run.save();
        let log = ScanLog::open(&path, &ScanLogOptions::default()).unwrap();
        let Frame::Image(image) = log.frame(0).unwrap() else { panic!("an image") };
        (image.values, log.bag().unwrap().notes.clone())
    };
    let (plain, _) = image("plumb_bob", &[0.0; 5]);
    assert_eq!(plain, [1.0, 1.1, 1.2, 1.3, 1.4, 1.5]);
    // The outer columns are half a pixel and more further out in the picture: 0.5 (1 + 2.8 * 0.3125) * 2 = 1.9 pixels from the middle.
    let (undone, notes) = image("plumb_bob", &[2.8, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(undone, [0.0, 1.1, 0.0, 0.0, 1.4, 0.0], "{notes:?}");
    let (left, notes) = image("unheard_of", &[2.8, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(left, plain);
    assert!(
        notes.iter().any(|n| n.contains("is not undone: the model \"unheard_of\" is not known")),
        "{notes:?}"
    );
}
