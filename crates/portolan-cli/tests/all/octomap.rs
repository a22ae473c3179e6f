//! OctoMap files through the program.

use std::path::{Path, PathBuf};

use crate::support::{arg, fail, json, portolan, succeed};
use portolan::cell::{LogOdds8, LogOddsBrick, Planes};
use portolan::geom::{BlockKey, Lattice};
use portolan::store::{Bricks, Tree};
use portolan_io::{write_octomap_bt, write_octomap_ot};

/// Log odds of a unit of the tree.
const QUANTUM: f64 = 0.25;

/// A wall of 0.8 x 0.2 x 0.8 m from the world's zero on, with free space of 0.6 m before it, at 0.1 m.
fn wall() -> Tree<LogOdds8, 3> {
    let mut bricks = Bricks::new(Lattice::new([0.0; 3], 0.1));
    let mut brick = LogOddsBrick::unobserved(512);
    for (i, cell) in brick.cells_mut().iter_mut().enumerate() {
        *cell = LogOdds8(if i >> 3 & 7 < 2 { 6 } else { -4 });
    }
    bricks.insert(BlockKey([0; 3]), brick).unwrap();
    Tree::from_bricks(&bricks).unwrap()
}

fn written(folder: &Path) -> (PathBuf, PathBuf) {
    let (bt, ot) = (folder.join("wall.bt"), folder.join("wall.ot"));
    write_octomap_bt(&bt, &wall()).unwrap();
    write_octomap_ot(&ot, &wall(), QUANTUM).unwrap();
    (bt, ot)
}

#[test]
fn info_counts_leaves_and_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let (bt, ot) = written(folder.path());
    for (file, kind) in [(&bt, ".bt"), (&ot, ".ot")] {
        let about = json(["info", arg(file), "--json"]);
        assert!(about["kind"].as_str().unwrap().contains(kind));
        // 8 of 64 cubes of two cells are the wall; the upper four cells along y are four leaves of 4^3.
        assert_eq!(about["leaves"], serde_json::json!({ "total": 36, "free": 20, "occupied": 16 }));
        assert_eq!((&about["inner_nodes"], &about["class"]), (&18.into(), &"OcTree".into()));
        assert_eq!(
            (&about["resolution"], &about["inner_nodes_that_could_be_merged"]),
            (&0.1.into(), &0.into())
        );
        let [size, cells] =
            [&about["extent_of_occupied"]["size"][1], &about["observed_cells"]].map(|v| v.as_f64().unwrap());
        assert_eq!((size, cells), (0.2, 512.0));
    }
    let text = succeed(["info", arg(&bt)]);
    assert!(text.contains("  class: OcTree\n") && text.contains("    occupied: 16\n"), "{text}");
}

#[test]
fn convert_keeps_bytes_and_makes_free_and_occupied() {
    let folder = tempfile::tempdir().unwrap();
    let (bt, ot) = written(folder.path());
    let bytes = |path: &Path| std::fs::read(path).unwrap();
    for (from, to, same_as) in
        [(&bt, "a.bt", Some(&bt)), (&ot, "a.ot", Some(&ot)), (&ot, "b.bt", Some(&bt)), (&bt, "b.ot", None)]
    {
        let out = folder.path().join(to);
        succeed(["convert", arg(from), arg(&out)]);
        if let Some(expected) = same_as {
            assert_eq!(bytes(&out), bytes(expected), "{to}");
        }
    }
    let about = json(["info", arg(&folder.path().join("b.ot")), "--json"]);
    assert_eq!(about["leaves"]["occupied"], 16);
    let error = fail(1, ["convert", arg(&bt), arg(&folder.path().join("a.yaml"))]);
    assert!(error.contains("it can become .bt or .ot"), "{error}");
}

#[test]
fn query_answers_occupancy_in_3d() {
    let folder = tempfile::tempdir().unwrap();
    let (_, ot) = written(folder.path());
    let points = folder.path().join("p.csv");
    std::fs::write(&points, "0.05,0.15,0.75\n0.05,0.25,0.05\n-0.05,0.05,0.05\n9999,0,0\n").unwrap();
    let answers = json(["query", arg(&ot), "--points", arg(&points), "--json"]);
    let p = |i: usize| answers["answers"][i]["occupancy"].as_f64();
    let logistic = |l: f64| 1.0 / (1.0 + (-l).exp());
    assert!((p(0).unwrap() - logistic(6.0 * QUANTUM)).abs() < 1e-7);
    assert!((p(1).unwrap() - logistic(-4.0 * QUANTUM)).abs() < 1e-7);
    assert_eq!((p(2), p(3)), (None, None));
    assert_eq!(answers["answers"][3]["status"], "outside");
}

#[test]
fn damaged_trees_end_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let (bt, _) = written(folder.path());
    let bytes = std::fs::read(&bt).unwrap();
    let cut = folder.path().join("cut.bt");
    std::fs::write(&cut, &bytes[..bytes.len() - 3]).unwrap();
    for command in [vec!["info", arg(&cut)], vec!["convert", arg(&cut), "never.ot"]] {
        let error = fail(1, command);
        assert!(error.contains("cut.bt: byte") && error.contains("it is cut off"), "{error}");
    }
    std::fs::write(&cut, "").unwrap();
    assert!(!portolan(["info", arg(&cut)]).status.success());
}
