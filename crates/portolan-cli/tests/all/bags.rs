//! Bags of ROS, mapped as they are.
//!
//! Needs the real data: at `PORTOLAN_DATA`, else `../shared/data` beside the workspace.

use crate::support;

use crate::support::{arg, fail, json, map, real_data, succeed};

/// Measured: 23.7 mm and 0.8 % of the contour doubled. With the poses of the stamps, which are of the end of a turn, 27.3 mm.
#[test]
fn a_robot_under_motion_capture() {
    let (Some(one), Some(two)) =
        (real_data("ros_bags/jackal/run.bag"), real_data("ros_bags/jackal/run_ros2"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    map(&one, folder.path(), &["--hold-out", "10"]);
    let summary = std::fs::read(folder.path().join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    let input = &summary["input"];
    assert_eq!((input["format"].as_str(), input["fixed_frame"].as_str()), (Some("bag"), Some("world")));
    assert_eq!(input["topics"], serde_json::json!(["/scan"]));
    assert!(input["guesses"].as_array().unwrap().len() >= 3, "{input:#}");
    assert!(summary["contour"]["doubled_share"].as_f64().unwrap() <= 0.02, "{:#}", summary["contour"]);
    let left_out = input["scans_without_pose"]["first"].as_str().unwrap();
    assert!(
        left_out.contains("/vrpn_client_node/jackal/pose: the poses around it are 0.520 s apart"),
        "{left_out}"
    );
    // The same run as ROS 2 has it.
    let score = json(["eval", arg(folder.path()), "--scans", arg(&two), "--json"]);
    assert!(score["scans"]["median_error"].as_f64().unwrap() <= 0.025, "{score:#}");
    assert_eq!(score["scans"]["held_out"], true);
}

#[test]
fn info_lists_a_bag_and_its_line_maps_it() {
    let Some(bag) = real_data("ros_bags/fembots_hokuyo/mylaserdata.bag") else { return };
    let about = json(["info", arg(&bag), "--json"]);
    assert_eq!((about["kind"].as_str(), about["dimension"].as_u64()), (Some("a bag of ROS"), Some(2)));
    let text = succeed(["info", arg(&bag)]);
    for part in ["/scan (sensor_msgs/LaserScan): 417 messages", "map > odom: ", "roots: center_wheel, map"] {
        assert!(text.contains(part), "{text}");
    }
    let folder = tempfile::tempdir().unwrap();
    let line = about["map"].as_str().unwrap().replace("DIR", arg(folder.path()));
    let words: Vec<&str> = line.split(' ').skip(1).collect();
    succeed(words.into_iter().chain(["--resolution", "0.1", "--quiet"]));
    assert!(folder.path().join("map.portolan").is_file());
}

#[test]
fn options_of_bags_are_for_bags() {
    let (_folder, log) = support::room();
    let out = tempfile::tempdir().unwrap();
    let error =
        fail(2, ["map", arg(&log), "--resolution", "0.05", "--out", arg(out.path()), "--topic", "/scan"]);
    assert!(error.contains("--topic is only for bags"), "{error}");
}
