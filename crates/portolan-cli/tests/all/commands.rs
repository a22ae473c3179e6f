//! Every command once, on a small log that the test writes itself.

use crate::support;

use std::io::Write;
use std::process::{Command, Stdio};

use crate::support::{arg, fail, json, log_lines, map, portolan, range, room, succeed};

const FILES: [&str; 10] = [
    "contour.geojson",
    "contour.svg",
    "esdf.bin",
    "manifest.json",
    "map.pgm",
    "map.png",
    "map.portolan",
    "map.yaml",
    "obstacles.csv",
    "summary.json",
];

fn files_in(folder: &std::path::Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn map_writes_everything_and_nothing_else() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    let text = map(&log, &out, &[]);
    assert!(text.contains("60 of 60 scans fused") && text.contains("540 beams without echo"), "{text}");
    assert_eq!(files_in(&out), FILES);
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["scans"]["fused"], 60);
    assert_eq!(summary["beams"]["hit"], 60 * 171);
    assert_eq!(summary["settings"]["truncation"], 0.15);
    // The room's walls are 20 m long, the pillar's sides 4 m.
    let length = summary["contour"]["length"].as_f64().unwrap();
    assert!((length - 24.0).abs() < 1.0, "{length}");
    assert!(summary["contour"]["doubled_share"].as_f64().unwrap() < 0.01);
    assert!(std::fs::read(out.join("map.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn fewer_maps_leave_fewer_files_and_no_stale_ones() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    map(&log, &out, &["--maps", "tree"]);
    assert_eq!(
        files_in(&out),
        ["manifest.json", "map.pgm", "map.png", "map.portolan", "map.yaml", "summary.json"]
    );
    map(&log, &out, &["--maps", "esdf"]);
    assert!(files_in(&out).contains(&"esdf.bin".to_owned()));
    assert!(!files_in(&out).contains(&"contour.svg".to_owned()));
}

#[test]
fn json_is_one_document_and_quiet_is_nothing() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    let common = ["map", arg(&log), "--resolution", "0.1", "--out", arg(&out)];
    let summary = json(common.iter().chain(&["--json"]));
    assert_eq!(summary["extent"]["resolution"], 0.1);
    assert_eq!(succeed(common.iter().chain(&["-q", "--overwrite"])), "");
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "1,1\n").unwrap();
    let (svg, out) = (folder.path().join("c.svg"), arg(&out));
    for arguments in [
        vec!["query", out, "--points", arg(&points), "--json"],
        vec!["info", out, "--json"],
        vec!["info", arg(&log), "--json"],
        vec!["mesh", out, arg(&svg), "--json"],
        vec!["convert", out, arg(&svg), "--json"],
        vec!["eval", out, "--scans", arg(&log), "--json"],
    ] {
        assert!(json(arguments).is_object());
    }
}

#[test]
fn queries_answer_with_distance_and_gradient() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    let points = folder.path().join("points.csv");
    // Free near the left wall, inside a wall, in the never observed pillar, outside.
    std::fs::write(&points, "x,y\n0.5,2.0 # left wall\n-0.06,2\n3,2\n100,100\n").unwrap();
    let text = succeed(["query", arg(&out), "--points", arg(&points)]);
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0].join(","), "x,y,status,occupancy,distance,lower,upper,gx,gy,unknown_as");
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
    assert_eq!(rows[1][2], "known");
    assert!(number(1, 3) < 0.2 && (number(1, 4) - 0.5).abs() < 0.06 && (number(1, 7) - 1.0).abs() < 0.1);
    assert!(number(2, 4) < 0.0 && rows[2][2] == "known");
    for row in [1, 2] {
        // Certified to within a tenth of a cell here, beside a straight wall; of one sign.
        let (distance, lower, upper) = (number(row, 4), number(row, 5), number(row, 6));
        assert!(upper - lower < 0.005 && lower.signum() == upper.signum(), "{lower} {upper}");
        assert!(lower <= distance && distance <= upper, "{distance} not within {lower} to {upper}");
        assert_eq!(rows[row][9], "obstacle");
    }
    let seeded = succeed(["query", arg(&out), "--points", arg(&points), "--esdf", "seeded"]);
    assert_eq!(seeded.lines().nth(1).unwrap().split(',').skip(5).take(2).collect::<String>(), "");
    // Near the pillar's corner, beside what was never seen inside of it, the nearest unknown cell counts as well.
    std::fs::write(&points, "2.2,2\n").unwrap();
    let lower = |unknown: &str| {
        let text = succeed(["query", arg(&out), "--points", arg(&points), "--unknown", unknown]);
        text.lines().nth(1).unwrap().split(',').nth(5).unwrap().parse::<f64>().unwrap()
    };
    assert!(lower("pessimistic") <= lower("optimistic") && lower("pessimistic") > 0.2);
    std::fs::write(&points, "x,y\n0.5,2.0\n-0.06,2\n3,2\n100,100\n").unwrap();
    assert_eq!(rows[3][2..], ["unknown", "", "", "", "", "", "", ""]);
    assert_eq!(rows[4][2..], ["outside", "", "", "", "", "", "", ""]);
    assert_eq!(rows.len(), 5);

    let mut child = Command::new(env!("CARGO_BIN_EXE_portolan"))
        .args(["query", arg(&out.join("map.yaml")), "--points", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"0.5,2.0\n").unwrap();
    let text = String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap();
    assert!(text.contains("\n0.5,2,known,"), "{text}");
    let text = succeed(["query", arg(&out.join("esdf.bin")), "--points", arg(&points)]);
    assert!(text.lines().nth(1).unwrap().starts_with("0.5,2,known,,0."), "{text}");
}

#[test]
fn saturated_cells_answer_at_least_so_far() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.esdf.bin");
    let mut bytes = b"PORTESDF".to_vec();
    for word in [1u32, 2, 4, 3, 1, 1] {
        bytes.extend(word.to_le_bytes());
    }
    for number in [0.0f64, 0.0, 0.0, 1.0] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend((0..12).flat_map(|i| (if i % 4 > 1 { -2.0f32 } else { 1.0 }).to_le_bytes()));
    bytes.extend([1, 1, 2, 2].repeat(3));
    std::fs::write(&path, bytes).unwrap();
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "1,1\n3,1\n").unwrap();
    let text = succeed(["query", arg(&path), "--points", arg(&points)]);
    let rows: Vec<_> = text.lines().skip(1).collect();
    assert_eq!(rows, ["1,1,known,,1,,,0,0,", "3,1,saturated,,-2,,-2,,,"]);
}

/// The only message of a topic of a bag.
fn message(path: &std::path::Path, topic: &str) -> Vec<u8> {
    let bag = portolan_ros::container::Bag::open(path, &Default::default()).unwrap();
    let number = bag.topics().iter().position(|t| t.name == topic).unwrap();
    let mut bytes = Vec::new();
    bag.read(&bag.messages(&[number as u32])[0], &mut bytes).unwrap();
    bytes
}

#[test]
fn conversions_agree_with_what_map_wrote() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &[]);
    let to = |name: &str| folder.path().join(name);
    let read = |path: &std::path::Path| std::fs::read(path).unwrap();
    for (name, original) in [
        ("a.bin", "esdf.bin"),
        ("a.geojson", "contour.geojson"),
        ("a.svg", "contour.svg"),
        ("a.portolan", "map.portolan"),
    ] {
        succeed(["convert", arg(&out), arg(&to(name))]);
        assert_eq!(read(&to(name)), read(&out.join(original)), "{name}");
    }
    succeed(["convert", arg(&out.join("map.portolan")), arg(&to("b.yaml"))]);
    assert_eq!(read(&to("b.pgm")), read(&out.join("map.pgm")));
    // The grid of the messages is the image, rows from below.
    for (input, name) in [(out.clone(), "a.mcap"), (out.join("map.yaml"), "b.mcap")] {
        succeed(["convert", arg(&input), arg(&to(name))]);
        let pgm = portolan_io::Pgm::read(out.join("map.pgm")).unwrap();
        let value = |v: &u16| {
            if *v == 254 {
                0
            } else if *v == 0 {
                100
            } else {
                255
            }
        };
        let cells: Vec<u8> = pgm.pixels.chunks(pgm.width).rev().flatten().map(value).collect();
        assert!(message(&to(name), "/map").ends_with(&cells), "{name}");
        assert!(message(&to(name), "/occupied").len() > 1000 && message(&to(name), "/contour").len() > 1000);
    }
    succeed(["mesh", arg(&out), arg(&to("m.geojson"))]);
    assert_eq!(read(&to("m.geojson")), read(&out.join("contour.geojson")));
    succeed(["convert", arg(&out.join("contour.geojson")), arg(&to("c.svg"))]);
    assert_eq!(read(&to("c.svg")), read(&out.join("contour.svg")));

    // A map_server map gets a distance field, a contour, and a map of its own.
    let yaml = out.join("map.yaml");
    for name in ["d.esdf.bin", "d.geojson", "d.portolan", "d.yaml"] {
        succeed(["convert", arg(&yaml), arg(&to(name))]);
        assert!(json(["info", arg(&to(name)), "--json"]).is_object());
    }
    assert_eq!(read(&to("d.pgm")), read(&out.join("map.pgm")));
    succeed(["convert", arg(&to("d.portolan")), arg(&to("e.yaml"))]);
    assert_eq!(read(&to("e.pgm")), read(&out.join("map.pgm")));
    for name in ["f.yaml", "f.svg", "f.bin"] {
        succeed(["convert", arg(&out.join("esdf.bin")), arg(&to(name))]);
    }
    assert_eq!(read(&to("f.bin")), read(&out.join("esdf.bin")));

    let output = portolan(["convert", arg(&out.join("contour.geojson")), arg(&to("x.bin"))]);
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && err.contains("it can become .geojson or .svg"), "{err}");
}

#[test]
fn info_tells_what_files_are() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &["--hold-out", "10"]);
    let about = json(["info", arg(&log), "--json"]);
    assert_eq!(about["scans"], 60);
    assert_eq!(about["readings_without_echo"], 540);
    let threshold = about["no_return"].as_f64().unwrap();
    assert!(threshold > 80.0 && threshold < 81.83);
    let about = json(["info", arg(&out), "--json"]);
    assert_eq!((&about["scans"], &about["hold_out"]), (&54.into(), &10.into()));
    assert!(about["maps"]["tsdf"]["observed"].as_u64().unwrap() > 1000);
    for name in ["esdf.bin", "map.yaml", "map.pgm", "contour.geojson", "contour.svg", "map.portolan"] {
        let text = succeed(["info", arg(&out.join(name))]);
        assert!(text.lines().count() >= 2, "{text}");
    }
}

#[test]
fn forgetting_is_asked_for_in_half_lives_too() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &["--half-life", "2"]);
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    // 1 / (2^(1/2) - 1) = 1 + sqrt(2).
    let settings = &summary["settings"];
    assert!((settings["w_max"].as_f64().unwrap() - (1.0 + 2f64.sqrt())).abs() < 1e-6);
    assert!((settings["half_life"].as_f64().unwrap() - 2.0).abs() < 1e-6);
    // The same number again agrees with the map's; another one does not.
    let append = |n: &'static str| {
        ["map", arg(&log), "--append", "--out", arg(&out), "--half-life", n].map(str::to_owned)
    };
    assert!(
        succeed(append("2")).contains("W_max 2.41: half of a stale distance is left after 2.00 observations")
    );
    assert!(fail(1, append("3")).contains("--half-life"));
}

#[test]
fn held_out_scans_are_predicted() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &["--hold-out", "10"]);
    let score = json(["eval", arg(&out), "--scans", arg(&log), "--json"]);
    let scans = &score["scans"];
    assert_eq!(
        (&scans["scans"], &scans["held_out"], &scans["beams"]),
        (&6.into(), &true.into(), &1026.into())
    );
    assert!(scans["median_error"].as_f64().unwrap() < 0.02, "{scans}");
    assert!(scans["within_two_cells_of_all"].as_f64().unwrap() > 0.95, "{scans}");

    // Against the walls themselves.
    let walls = folder.path().join("walls.geojson");
    let room = "[[0,0],[6,0],[6,4],[0,4],[0,0]],[[2.5,1.5],[3.5,1.5],[3.5,2.5],[2.5,2.5],[2.5,1.5]]";
    let text = format!("{{\"type\":\"MultiLineString\",\"coordinates\":[{room}]}}");
    std::fs::write(&walls, text).unwrap();
    let both = json(["eval", arg(&out), "--reference", arg(&walls), "--json"]);
    for way in ["from_map", "to_map"] {
        assert!(both["reference"][way]["median"].as_f64().unwrap() < 0.015, "{both}");
    }
    let own = out.join("contour.geojson");
    let same = json(["eval", arg(&out), "--reference", arg(&own), "--json"]);
    assert_eq!(same["reference"]["from_map"]["p95"].as_f64().map(|v| v < 1e-12), Some(true));
}

#[test]
fn threads_change_no_byte() {
    let (folder, log) = room();
    let run = |threads: &str| {
        let out = folder.path().join(threads);
        map(&log, &out, &["--threads", threads]);
        FILES
            .iter()
            .filter(|n| !["manifest.json", "summary.json"].contains(n))
            .map(|n| std::fs::read(out.join(n)).unwrap())
            .collect::<Vec<_>>()
    };
    let one = run("1");
    assert!(one == run("2") && one == run("8"));
}

#[test]
fn appending_equals_one_go_on_the_same_bounds() {
    let (folder, log) = room();
    let half = folder.path().join("half.log");
    // The same readings whatever the file says first; no-return is given, because a part might not show it.
    std::fs::write(&half, log_lines(0, 30)).unwrap();
    let rest = folder.path().join("rest.log");
    std::fs::write(&rest, log_lines(30, 60)).unwrap();
    let (once, twice) = (folder.path().join("once"), folder.path().join("twice"));
    let bounds = ["--bounds", "-1,-1,7,5"];
    map(&log, &once, &bounds);
    map(&half, &twice, &bounds);
    let rest_arguments =
        ["map", arg(&rest), "--append", "--out", arg(&twice), "--bounds", "-1,-1,7,5", "--json"];
    let summary = json(rest_arguments);
    assert_eq!((&summary["scans"]["fused"], &summary["scans"]["in_map"]), (&30.into(), &60.into()));
    for name in ["esdf.bin", "contour.geojson", "map.pgm", "map.yaml"] {
        assert!(
            std::fs::read(once.join(name)).unwrap() == std::fs::read(twice.join(name)).unwrap(),
            "{name}"
        );
    }
    let about = |folder: &std::path::Path| json(["info", arg(folder), "--json"]);
    let (a, b) = (about(&once), about(&twice));
    assert_eq!((&a["maps"], &a["statistics"]), (&b["maps"], &b["statistics"]));
    assert_eq!(b["logs"], serde_json::json!(["half.log", "rest.log"]));
}

#[test]
fn appending_grows_the_map() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &["--bounds", "1,1,3,3"]);
    let summary = json(["map", arg(&log), "--append", "--out", arg(&out), "--json"]);
    let size = |k: usize| summary["extent"]["size"][k].as_f64().unwrap();
    assert!(size(0) > 6.0 && size(1) > 4.0);
    // What has two laps in it is the pillar's left side, what has one is the rest.
    assert!((summary["contour"]["length"].as_f64().unwrap() - 24.0).abs() < 1.5);

    for (option, value, name) in [
        ("--resolution", "0.1", "resolution"),
        ("--truncation", "0.3", "truncation"),
        ("--weights", "range", "weights"),
        ("--sweep", "march", "sweep"),
        ("--w-max", "8", "w_max"),
    ] {
        let err = support::fail(1, ["map", arg(&log), "--append", "--out", arg(&out), option, value]);
        assert!(err.contains(&format!("{name} is")) && err.contains("in this call"), "{err}");
    }
}

#[test]
fn other_poses_and_every_second_scan() {
    let (folder, log) = room();
    let poses = folder.path().join("poses.txt");
    let shifted: String = (0..60)
        .map(|i| {
            let [x, y, theta] = support::pose(i);
            format!("{} {} {theta}\n", x + 500_000.0, y + 4_000_000.0)
        })
        .collect();
    std::fs::write(&poses, shifted).unwrap();
    let out = folder.path().join("out");
    map(&log, &out, &["--poses", arg(&poses), "--every", "2"]);
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["scans"]["fused"], 30);
    assert!(summary["extent"]["min"][1].as_f64().unwrap() > 3_999_998.0);
    assert!((summary["contour"]["length"].as_f64().unwrap() - 24.0).abs() < 1.0);
    std::fs::write(&poses, "0 0 0\n").unwrap();
    let arguments =
        ["map", arg(&log), "--resolution", "0.05", "--out", arg(&out), "--overwrite", "--poses", arg(&poses)];
    let err = support::fail(1, arguments);
    assert!(err.contains("the number of poses is 1; give one for each of the 60 scans"), "{err}");
}

#[test]
fn every_help_ends_with_an_example() {
    for command in ["map", "query", "info", "convert", "mesh", "eval", "man"] {
        let help = succeed([command, "--help"]);
        let last = help.trim_end().lines().last().unwrap();
        assert!(last.contains(&format!("portolan {command}")), "{help}");
    }
    assert_eq!(range([1.0, 1.0], 0.0), 5.0);
}

/// One scan is enough to know what it saw, whatever free space and distant beams weigh.
#[test]
fn what_was_seen_once_is_known_under_every_weighting() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("one.log");
    std::fs::write(&log, log_lines(0, 1)).unwrap();
    let [x, y, theta] = support::pose(0);
    let points = folder.path().join("points.csv");
    // Half a meter ahead of the sensor.
    std::fs::write(&points, format!("{},{}\n", x + 0.5 * theta.cos(), y + 0.5 * theta.sin())).unwrap();
    for weights in ["constant", "range", "incidence", "range-incidence"] {
        for carve_weight in ["1", "0.3", "0.05"] {
            let out = folder.path().join(format!("{weights}-{carve_weight}"));
            map(&log, &out, &["--weights", weights, "--carve-weight", carve_weight]);
            let answer = succeed(["query", arg(&out), "--points", arg(&points)]);
            assert!(answer.contains(",known,"), "{weights} {carve_weight}: {answer}");
            let summary: serde_json::Value =
                serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
            assert!(summary["contour"]["length"].as_f64().unwrap() > 2.0, "{weights} {carve_weight}");
        }
    }
}

/// A heading so small that its inverse overflows does not stop the walk through the cells.
#[test]
fn a_subnormal_heading_is_a_heading() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("subnormal.log");
    let readings: Vec<String> = (0..7).map(|i| format!("{:.2}", 1.0 + 0.01 * f64::from(i))).collect();
    std::fs::write(&log, format!("FLASER 7 {} 0 0 -1e-320 0 0 -1e-320 1.0 host 1.0\n", readings.join(" ")))
        .unwrap();
    for resolution in ["1", "0.5", "0.25"] {
        let out = folder.path().join(resolution);
        succeed(["map", arg(&log), "--resolution", resolution, "--no-return", "50", "--out", arg(&out)]);
    }
}

/// Appending goes on with the maps that are there.
#[test]
fn append_makes_the_maps_of_the_file() {
    let (folder, log) = room();
    let out = folder.path().join("out");
    map(&log, &out, &["--maps", "tsdf"]);
    let before = files_in(&out);
    succeed(["map", arg(&log), "--append", "--out", arg(&out)]);
    assert_eq!(files_in(&out), before);
}

/// Whatever is asked for, a map goes on in all that its file holds.
#[test]
fn append_keeps_maps_that_are_not_asked_for() {
    let (folder, log) = room();
    let all = folder.path().join("all");
    map(&log, &all, &["--every", "2"]);
    succeed(["map", arg(&log), "--append", "--out", arg(&all)]);
    let maps = |folder: &std::path::Path| json(["info", arg(folder), "--json"])["maps"].clone();
    for kind in ["grid", "tree", "tsdf", "contour"] {
        let out = folder.path().join(kind);
        map(&log, &out, &["--every", "2"]);
        succeed(["map", arg(&log), "--append", "--out", arg(&out), "--maps", kind]);
        assert_eq!(maps(&out), maps(&all), "--maps {kind}");
    }
}

/// A box means the same cells to every map.
#[test]
fn maps_agree_on_what_lies_outside_of_bounds() {
    let (folder, log) = room();
    let counts = ["grid", "tree", "tsdf", "attenuation"].map(|kind| {
        let out = folder.path().join(kind);
        let bounds = ["--resolution", "0.1", "--bounds", "1,1,3,3", "--maps", kind];
        json([&["map", arg(&log), "--out", arg(&out), "--json"][..], &bounds].concat())["beams"].clone()
    });
    assert!(counts[0]["hits_outside"].as_u64().unwrap() > 100);
    assert!(counts.iter().all(|beams| *beams == counts[0]), "{counts:?}");
}

/// Maps that the library alone works with are refused, not passed over: all answers would be "outside".
#[test]
fn maps_of_a_kind_that_no_command_reads_are_refused() {
    use portolan::geom::Lattice;
    use portolan::map::{OccupancyGrid, Tsdf, TsdfConfig};
    use portolan_io::{MapFile, TsdfBricks};
    let folder = tempfile::tempdir().unwrap();
    let (in_2d, in_3d) = (folder.path().join("2d.portolan"), folder.path().join("3d.portolan"));
    let map = Tsdf::<2>::new(TsdfConfig::textbook()).unwrap();
    let config = *map.config();
    let bricks = TsdfBricks {
        store: map.into_stores().0,
        truncation: config.truncation,
        w_max: config.w_max,
        carve_weight: config.carve_weight,
        weights: config.weights,
        more: Default::default(),
    };
    let mut file = MapFile::<2>::default();
    file.tsdf_bricks = Some(bricks);
    file.write(&in_2d).unwrap();
    let grid = portolan::geom::Grid { lattice: Lattice::new([0.0; 3], 0.1), shape: [8; 3] };
    let grid = OccupancyGrid::covering(&grid, Default::default()).unwrap();
    let mut file = MapFile::<3>::default();
    file.grid = Some(grid);
    file.write(&in_3d).unwrap();
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "0,0\n").unwrap();
    for file in [&in_2d, &in_3d] {
        for call in [&["info", arg(file)][..], &["query", arg(file), "--points", arg(&points)]] {
            let error = support::fail(1, call.to_vec());
            assert!(error.contains(arg(file)) && error.contains("only the library works with"), "{error}");
        }
    }
}

#[test]
fn distances_say_when_nothing_keeps_thin_things() {
    let (folder, log) = room();
    let (out, points) = (folder.path().join("out"), folder.path().join("points.csv"));
    std::fs::write(&points, "0.5,2.0\n").unwrap();
    let warned = |options: &[&str]| {
        map(&log, &out, options);
        let text = std::fs::read_to_string(out.join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        let warnings = summary["warnings"].to_string();
        let query = support::portolan(["query", arg(&out), "--points", arg(&points)]);
        let err = String::from_utf8_lossy(&query.stderr).into_owned();
        assert_eq!(warnings.contains("surfaces alone"), err.contains("surfaces alone"), "{warnings} {err}");
        (warnings.contains("surfaces alone"), summary["obstacles"].clone())
    };
    assert!(!warned(&[]).0);
    assert!(warned(&["--maps", "esdf"]).0);
    assert!(!warned(&["--maps", "esdf,attenuation"]).0);
    assert!(warned(&["--esdf", "mask"]).1.is_null());
    let thin = [
        "map",
        arg(&log),
        "--resolution",
        "0.05",
        "--overwrite",
        "--out",
        arg(&out),
        "--esdf",
        "mask",
        "--thin",
        "0.2",
    ];
    assert!(fail(2, thin).contains("--thin is only for --esdf accurate"));
    let thin = ["query", arg(&out), "--points", arg(&points), "--esdf", "seeded", "--thin", "0.2"];
    assert!(fail(2, thin).contains("--thin is only for --esdf accurate"));
}

/// Of cells that log odds call occupied and that were hit, and of cells that stop beams, the summary tells which both say.
#[test]
fn the_summary_counts_where_log_odds_and_counts_disagree() {
    use portolan::store::Store;
    let (folder, log) = room();
    let out = folder.path().join("out");
    let run = |options: &[&str]| {
        let text = map(&log, &out, options);
        let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        (text, summary)
    };
    let (text, summary) = run(&[]);
    let file = portolan_io::MapFile::<2>::read(out.join("map.portolan")).unwrap();
    let (occupancy, counts) = (file.grid.unwrap(), file.attenuation.unwrap().store);
    let share = summary["settings"]["thin"].as_f64().unwrap();
    let mut expected = [0; 3];
    let grid = *occupancy.store().grid();
    for i in 0..grid.len() {
        let counted = counts.cell(counts.lattice().cell_of(grid.lattice.center(grid.cell(i))).unwrap());
        let hit = counted.is_some_and(|c| c.hits > 0);
        let log_odds = hit && occupancy.store().at(i).is_some_and(|v| v.0 > 0);
        let stops = counted.is_some_and(|c| c.hits >= 3 && c.opacity::<2>() > share);
        match (log_odds, stops) {
            (true, false) => expected[0] += 1,
            (false, true) => expected[1] += 1,
            (true, true) => expected[2] += 1,
            (false, false) => {}
        }
    }
    let said = &summary["obstacles"]["occupied_by"];
    let [log_odds, by_counts, both] = expected;
    assert!(both > 100 && log_odds + by_counts > 0, "{expected:?}");
    assert_eq!(
        said,
        &serde_json::json!({ "log_odds_alone": log_odds, "counts_alone": by_counts, "both": both })
    );
    let words =
        format!("{both} by log odds and counts of hits, {log_odds} by log odds alone, {by_counts} by");
    assert!(text.contains(&words), "{text}");
    // Where one of them is not asked there is nothing to agree on.
    for options in [&["--thin", "0"][..], &["--maps", "esdf,grid"], &["--maps", "esdf,attenuation"]] {
        let (text, summary) = run(options);
        assert!(summary["obstacles"]["occupied_by"].is_null(), "{options:?}");
        assert!(!text.contains("by log odds alone"), "{text}");
    }
}

/// Drivers write the largest number for "no echo".
#[test]
fn readings_as_large_as_numbers_are_free_what_is_before_them() {
    let (folder, _) = room();
    let log = folder.path().join("max.log");
    let lines = support::log_lines(0, 20).replace(" 81.830", &format!(" {:.1}", f32::MAX));
    assert!(lines.contains("340282346638528"));
    std::fs::write(&log, lines).unwrap();
    for more in [&[][..], &["--no-return", "off"], &["--no-return", "off", "--max-range", "1e38"]] {
        let out = folder.path().join("out");
        let call = ["map", arg(&log), "--resolution", "0.1", "--bounds", "-1,-1,7,5", "--overwrite"];
        let text = succeed([&call[..], &["--out", arg(&out)], more].concat());
        assert!(text.contains("20 of 20 scans fused"), "{text}");
    }
}
