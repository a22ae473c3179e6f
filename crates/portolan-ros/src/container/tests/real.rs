//! The bags that users keep; counts and checksums by the Python package rosbags.

use super::super::{Bag, BagOptions, ContainerKind};
use super::support::real_data;

/// Name, publisher, messages, first and last time, checksum of times, lengths and bytes; in the order of names.
fn digest(bag: &Bag) -> Vec<String> {
    let topics: Vec<u32> = (0..bag.topics().len() as u32).collect();
    let mut hashes = vec![crc32fast::Hasher::new(); topics.len()];
    let mut data = Vec::new();
    for message in bag.messages(&topics) {
        bag.read(&message, &mut data).unwrap();
        let hash = &mut hashes[message.topic as usize];
        hash.update(&message.log_time.to_le_bytes());
        hash.update(&(data.len() as u64).to_le_bytes());
        hash.update(&data);
    }
    let mut lines: Vec<String> = Vec::new();
    for ((topic, count), hash) in bag.topics().iter().zip(bag.counts()).zip(hashes) {
        let Some((first, last)) = count.log_times else { continue };
        let (name, messages, hash) = (&topic.name, count.messages, hash.finalize());
        lines.push(format!("{name} {messages} {first} {last} {hash:08x}"));
    }
    lines.sort();
    lines
}

fn check(name: &str, kind: ContainerKind, expected: &[&str]) {
    let Some(path) = real_data(&format!("ros_bags/{name}")) else { return };
    let bag = Bag::open(path, &BagOptions::default()).unwrap();
    assert_eq!(bag.kind(), Some(kind));
    assert_eq!(digest(&bag), expected, "{name}");
}

#[test]
fn messages_are_those_that_rosbags_reads() {
    check(
        "jackal/run.bag",
        ContainerKind::RosBag,
        &[
            "/scan 414 1771361671858635403 1771361713514218644 61474409",
            "/vrpn_client_node/jackal/pose 4734 1771361671784279464 1771361713544203437 f66231e1",
        ],
    );
    check(
        "jackal/run_ros2",
        ContainerKind::Sqlite3,
        &[
            "/scan 414 1771361671858635403 1771361713514218644 e89a35e1",
            "/vrpn_client_node/jackal/pose 4734 1771361671784279464 1771361713544203437 dffd2fba",
        ],
    );
    check(
        "fembots_hokuyo",
        ContainerKind::RosBag,
        &[
            "/scan 417 316953356099 358369074468 8401967d",
            "/tf 2285 316870078078 358416433947 7209c2a2",
            "/tf 415 316921130057 358402644364 7e8ecde7",
            "/tf 415 316945445213 358363389729 324eab5e",
            "/tf 832 316870171307 358419915301 acf59c49",
        ],
    );
    check(
        "stage_truth/Mapping1.bag",
        ContainerKind::RosBag,
        &[
            "/base_pose_ground_truth 1727 60200000000 232800000000 cd389ab8",
            "/base_scan 1727 60200000000 232800000000 b6db4335",
        ],
    );
    check(
        "pr2_gazebo",
        ContainerKind::RosBag,
        &[
            "/base_scan 32 16491000000 18041000000 e54f109e",
            "/tf 152 16479000000 18039000000 0837e81c",
            "/tf 188 16483000000 18033000000 3d3e0899",
            "/tf 47 16512000000 18042000000 5164296a",
            "/tf 79 16483000000 18044000000 bfdcfb90",
            "/tf 94 16491000000 18024000000 eb14b9d8",
        ],
    );
    check(
        "turtlebot3_gazebo",
        ContainerKind::Sqlite3,
        &[
            "/clock 197 1732489182701097897 1732489202402992510 d3b636c6",
            "/cmd_vel 99 1732489182684920961 1732489202398269842 4c109016",
            "/imu 3938 1732489182658480351 1732489202457346059 bbc6937c",
            "/joint_states 579 1732489182665611313 1732489202431200143 18eb8de2",
            "/odom 579 1732489182665531762 1732489202431211478 1dfa34d6",
            "/performance_metrics 99 1732489182702375291 1732489202359131168 148c13df",
            "/robot_description 1 1732489182656163559 1732489182656163559 0df48479",
            "/rosout 12 1732489182661329994 1732489182721120158 b52dd5f5",
            "/scan 99 1732489182684859235 1732489202398094129 bfa3c047",
            "/tf 961 1732489182665568953 1732489202431215613 bfac6238",
            "/tf_static 1 1732489182656143007 1732489182656143007 86a24e75",
        ],
    );
}

#[test]
fn the_file_that_is_there_is_taken_and_told() {
    let Some(path) = real_data("ros_bags/turtlebot3_gazebo") else { return };
    let bag = Bag::open(path, &BagOptions::default()).unwrap();
    let note = "names rosbag2_2024_11_24-17_59_42_0.db3, which is not there: my_bag.db3 taken instead";
    assert!(bag.notes().len() == 1 && bag.notes()[0].ends_with(note), "{:?}", bag.notes());
    let latched: Vec<_> = bag.topics().iter().filter(|t| t.latched).map(|t| t.name.as_str()).collect();
    assert!(latched.contains(&"/tf_static") && !latched.contains(&"/tf"), "{latched:?}");
}

#[test]
fn rates_are_those_of_the_sensors() {
    let Some(path) = real_data("ros_bags/jackal/run_ros2") else { return };
    let bag = Bag::open(path, &BagOptions::default()).unwrap();
    let summary = bag.summary().unwrap();
    let topic = |name: &str| {
        let topic = bag.topics().iter().position(|t| t.name == name).unwrap();
        summary.topics[topic]
    };
    let (scan, pose) = (topic("/scan"), topic("/vrpn_client_node/jackal/pose"));
    let rates = [scan, pose].map(|t| (t.rate.unwrap() * 1000.0).round() / 1000.0);
    // By Python's sqlite3 from the same rows.
    assert_eq!(rates, [9.915, 100.108]);
    assert_eq!([scan, pose].map(|t| t.largest_gap.unwrap().1), [104_811_610, 520_031_218]);
    assert!(summary.chunks.is_empty() && summary.messages == 414 + 4734);
    assert_eq!(summary.log_times, Some((1_771_361_671_784_279_464, 1_771_361_713_544_203_437)));
}
