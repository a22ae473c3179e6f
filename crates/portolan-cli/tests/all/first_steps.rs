//! What a new user meets first: the name alone, a folder too high, files that are asked about, shells and manuals.

use crate::support::logs_3d::lidar_log;
use crate::support::{arg, fail, json, portolan, succeed};

#[test]
fn the_name_alone_says_what_to_do_first() {
    let output = portolan::<&str>([]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    for part in ["portolan studio", "portolan map LOG", "portolan --help"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn a_folder_above_logs_names_them_and_an_empty_one_says_so() {
    let (folder, _log) = lidar_log();
    let out = folder.path().join("out");
    let error = fail(1, ["map", arg(folder.path()), "--resolution", "0.1", "--out", arg(&out)]);
    assert!(error.contains("a folder above logs or maps") && error.contains("log"), "{error}");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    for call in
        [vec!["map", arg(&empty), "--resolution", "0.1", "--out", arg(&out)], vec!["info", arg(&empty)]]
    {
        let error = fail(1, call);
        assert!(error.contains("an empty folder; give the folder"), "{error}");
    }
}

#[test]
fn info_reads_what_runs_leave_rounds_and_has_units() {
    let (folder, log) = lidar_log();
    let out = folder.path().join("out");
    succeed(["map", arg(&log), "--resolution", "0.1", "--out", arg(&out)]);
    let text = succeed(["info", arg(&out)]);
    assert!(text.contains("resolution: 0.1 m\n") && text.contains("truncation: 0.3 m\n"), "{text}");
    let digits = |word: &str| {
        word.split('.').nth(1).is_some_and(|d| d.len() > 6 && d.chars().all(|c| c.is_ascii_digit()))
    };
    assert!(!text.split([' ', ',', '\n']).any(digits), "a number is not rounded: {text}");
    let mesh = succeed(["info", arg(&out.join("mesh.ply"))]);
    assert!(mesh.contains(" m²\n"), "{mesh}");
    let summary = json(["info", arg(&out.join("summary.json")), "--json"]);
    assert_eq!(summary["kind"], "what a run did and refused (summary.json)");
    assert_eq!(summary["scans"]["fused"], 6);
    let graph = folder.path().join("graph.g2o");
    std::fs::write(
        &graph,
        "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\nEDGE_SE2 0 2 2 0 0 1 0 0 1 0 1\n",
    )
    .unwrap();
    let about = json(["info", arg(&graph), "--json"]);
    assert_eq!((&about["poses"], &about["edges"]["closures"]), (&3.into(), &1.into()));
    std::fs::write(&graph, "EDGE_SE2 0 1 tea\n").unwrap();
    let error = fail(1, ["info", arg(&graph)]);
    assert!(error.contains("graph.g2o") && error.contains("tea"), "{error}");
}

#[test]
fn shells_and_manuals_know_all_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let script = succeed(["completions", shell]);
        assert!(script.contains("portolan") && script.contains("reference"), "{shell}");
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("man1");
    succeed(["man", "--out", arg(&out)]);
    let page = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    assert!(page("portolan.1").contains("portolan\\-map"), "{}", page("portolan.1"));
    assert!(page("portolan-map.1").contains("resolution"));
}
