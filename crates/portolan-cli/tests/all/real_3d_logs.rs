//! The real 3-D logs, mapped and measured.

use std::path::Path;

use crate::support::{arg, json, real_data};
use serde_json::Value;

fn map(log: &Path, out: &Path, more: &[&str]) -> Value {
    json(["map", arg(log), "--out", arg(out), "--json"].into_iter().chain(more.iter().copied()))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_bunny_is_a_quarter_of_a_millimetre_from_the_zippered_mesh() {
    let Some(bunny) = real_data("rangescan_stanford_bunny") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let made = map(&bunny.join("data"), &out, &["--resolution", "0.0005", "--maps", "mesh"]);
    assert_eq!((&made["scans"]["fused"], &made["beams"]["hit"]), (&10.into(), &362_272.into()));
    let reference = bunny.join("reconstruction/bun_zipper.ply");
    let eval = json(["eval", arg(&out), "--reference", arg(&reference), "--crop", "--json"]);
    let (accuracy, completeness) = (&eval["reference"]["accuracy"], &eval["reference"]["completeness"]);
    // Measured 0.04 mm each; 95 % within 0.16.
    assert!(number(&accuracy["median"]) < 0.25e-3 && number(&completeness["median"]) < 0.25e-3, "{eval}");
    assert!(number(&accuracy["p95"]) < 0.5e-3 && number(&completeness["p95"]) < 0.5e-3, "{eval}");
}

#[test]
fn the_kitchen_predicts_the_frames_that_were_left_out() {
    let Some(kitchen) = real_data("rgbd_redkitchen") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let how = ["--resolution", "0.02", "--every", "4", "--hold-out", "5", "--maps", "tree,mesh"];
    let made = map(&kitchen, &out, &how);
    assert_eq!((&made["scans"]["fused"], &made["scans"]["held_out"]), (&40.into(), &10.into()));
    assert_eq!(
        (&made["input"]["poses"]["mended_poses"], &made["mesh"]["colors"]),
        (&200.into(), &true.into())
    );
    assert!(number(&made["mesh"]["area"]) > 15.0, "{}", made["mesh"]);
    let scans = &json(["eval", arg(&out), "--scans", arg(&kitchen), "--json"])["scans"];
    assert!(number(&scans["median_error"]) < 0.012, "{scans}");
    assert!(number(&scans["within_one_cell"]) > 0.7, "{scans}");
}

#[test]
fn the_hall_predicts_the_scans_that_were_left_out() {
    let Some(hall) = real_data("lidar3d_balm_hall") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let how = ["--resolution", "0.1", "--every", "4", "--hold-out", "4", "--max-range", "60"];
    let made = map(&hall, &out, &how);
    assert_eq!((&made["scans"]["fused"], &made["scans"]["held_out"]), (&9.into(), &3.into()));
    for file in ["mesh.ply", "octree.bt", "octree.ot", "preview.png"] {
        assert!(out.join(file).metadata().unwrap().len() > 10_000, "{file}");
    }
    let scans = &json(["eval", arg(&out), "--scans", arg(&hall), "--json"])["scans"];
    // The poses drift by 4 to 7 cm.
    assert!(number(&scans["median_error"]) < 0.05, "{scans}");
    assert!(number(&scans["within_one_cell"]) > 0.8, "{scans}");
}
