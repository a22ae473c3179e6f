//! What the page gets is what the library builds and measures.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use portolan::field::EsdfSettings;
use portolan::geom::{Grid, Pose};
use portolan::map::{Tsdf2, TsdfConfig};
use portolan::scan::{Beam, BeamKind, Scan};
use portolan::surface::ContourSettings;
use portolan_chapter::gallery::{Gallery, GallerySettings, LEVEL, run};
use portolan_sim::{LapConfig, Truth, apartment, lap};
use serde_json::{Value, json};

use crate::engine::{Clock, Limits, Logs, Session, Source2d, Wire};

/// Scans that are fused, of the lap's 200.
const SCANS: usize = 40;

/// A session whose clock counts how often it was asked, with some scans fused.
fn session(limits: Limits) -> Session {
    let calls = AtomicU64::new(0);
    let clock = Clock::new(move || calls.fetch_add(1, Ordering::Relaxed) as f64);
    let mut session = Session::new(&Arc::new(Logs::default()), limits, &clock);
    let step = json!({ "id": 0, "view": "fusion", "ask": { "op": "step", "scans": SCANS } });
    session.answer(&step.to_string());
    session
}

fn said(session: &mut Session, question: Value) -> (Value, Vec<u8>) {
    match session.answer(&json!({ "id": 1, "view": "gallery", "ask": question }).to_string()) {
        Wire::Text(text) => (serde_json::from_str(&text).unwrap(), Vec::new()),
        Wire::Binary(bytes) => {
            let end = 8 + u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
            (serde_json::from_slice(&bytes[8..end]).unwrap(), bytes[end..].to_vec())
        }
    }
}

fn ask(session: &mut Session, question: Value) -> Value {
    let answer = said(session, question).0;
    assert!(answer.get("error").is_none(), "{answer}");
    answer["ok"].clone()
}

fn refusal(session: &mut Session, question: Value) -> String {
    said(session, question).0["error"].as_str().expect("a refusal").to_owned()
}

/// The same without a studio.
fn library() -> Gallery {
    let world = apartment().world;
    let scans: Vec<(Pose<2>, Scan<2>)> = lap(&world, &LapConfig::default()).into_iter().take(SCANS).collect();
    let grid = Grid::new([0.0; 2], 0.05, [240, 180]);
    let tsdf = Tsdf2::covering(&grid, TsdfConfig::textbook()).unwrap();
    let settings = GallerySettings {
        contour: ContourSettings::of(&tsdf),
        esdf: EsdfSettings::of(&tsdf),
        ..GallerySettings::new(grid, 10_000, Some(world.wall_length()))
    };
    let mut now = 0.0;
    let mut clock = || {
        now += 1.0;
        now
    };
    run(&scans, &settings, Some(&world as &dyn Truth<2>), &mut clock).unwrap()
}

#[test]
fn everything_that_no_clock_decides_is_the_librarys() {
    let gallery = library();
    let told = ask(&mut session(Limits::default()), json!({ "op": "open", "have": null }));
    let rows = told["costs"]["rows"].as_array().unwrap();
    assert_eq!(rows.len(), gallery.rows.len());
    for (told, row) in rows.iter().zip(&gallery.rows) {
        assert_eq!(told["name"], row.name);
        assert_eq!(told["memory_bytes"], row.memory_bytes, "{}", row.name);
        assert_eq!(told["derived"], row.derived);
        assert_eq!(told["occupancy_wrong"].as_f64(), row.occupancy_wrong);
        let errors =
            [(&told["distance_error"], row.distance_error), (&told["surface_error"], row.surface_error)];
        for (told, error) in errors {
            assert_eq!(told["median"].as_f64(), error.map(|e| e.median), "{}", row.name);
            assert_eq!(told["worst_over"].as_f64(), error.map(|e| e.worst_over));
        }
        let costs = [("occupancy", row.occupancy), ("distance", row.distance), ("surface", row.surface)];
        for (workload, cost) in costs {
            assert_eq!(told[workload].is_null(), cost.is_none(), "{workload} of {}", row.name);
        }
    }
    let trees = told["truth_and_trees"]["trees"].as_array().unwrap();
    for (told, tree) in trees.iter().zip(&gallery.trees) {
        assert_eq!(told["predicted_ratio"].as_f64(), Some(tree.predicted_ratio));
        assert_eq!(told["measured_ratio"].as_f64(), Some(tree.measured_ratio));
    }
    assert_eq!(told["truth_and_trees"]["tsdf_gradient"].as_f64(), Some(gallery.tsdf_gradient));
    assert_eq!(told["of"]["scans"], SCANS);
}

fn row_cost(row: &Value, workload: &str) -> f64 {
    row[workload]["seconds"].as_f64().unwrap_or(0.0)
}

#[test]
fn a_workload_is_measured_when_it_is_run_and_the_librarys_rule_says_who_wins() {
    let mut session = session(Limits::default());
    ask(&mut session, json!({ "op": "open", "have": null }));
    for (workload, probes) in [("occupancy", 300), ("distance", 700), ("surface", 100)] {
        let told = ask(&mut session, json!({ "op": "run", "workload": workload, "probes": probes }))["costs"]
            .clone();
        let rows = told["rows"].as_array().unwrap();
        if workload != "surface" {
            // The clock counts its calls: a round of n probes seems to take a second.
            let direct = if workload == "occupancy" { 0 } else { 6 };
            assert_eq!(row_cost(&rows[direct], workload), 1.0 / f64::from(probes));
        }
        let winner =
            told["winners"].as_array().unwrap().iter().find(|w| w["workload"] == workload).unwrap().clone();
        let best = row_cost(&rows[winner["row"].as_u64().unwrap() as usize], workload);
        let level = winner["level"].as_array().unwrap();
        for (i, row) in rows.iter().enumerate() {
            let Some(seconds) = row[workload]["seconds"].as_f64() else {
                assert!(winner["times"][i].is_null());
                continue;
            };
            assert!(seconds >= best);
            assert_eq!(level.contains(&json!(i)), seconds <= LEVEL * best, "{workload} of {}", row["name"]);
            assert_eq!(winner["times"][i].as_f64(), (best > 0.0).then(|| seconds / best));
        }
    }
}

#[test]
fn the_quadtrees_cells_hold_what_the_grids_cells_hold() {
    let mut session = session(Limits::default());
    let (answer, arrays) = said(&mut session, json!({ "op": "open", "have": null }));
    let bytes = |name: &str, width: usize| {
        let array = answer["arrays"].as_array().unwrap().iter().find(|a| a["name"] == name).unwrap().clone();
        let from = array["offset"].as_u64().unwrap() as usize;
        arrays[from..from + width * array["length"].as_u64().unwrap() as usize].to_vec()
    };
    let grid = bytes("occupancy", 1);
    let leaves: Vec<usize> =
        bytes("leaves", 4).chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()) as usize).collect();
    let of_leaves = bytes("leaf_occupancy", 1);
    assert_eq!(leaves.len(), 3 * of_leaves.len());
    let mut painted = vec![255; grid.len()];
    for (leaf, value) in leaves.chunks(3).zip(of_leaves) {
        for y in leaf[1]..leaf[1] + leaf[2] {
            painted[y * 240 + leaf[0]..y * 240 + leaf[0] + leaf[2]].fill(value);
        }
    }
    assert!(painted == grid);
    // A leaf of more than one cell is what pruning leaves behind.
    assert!(leaves.chunks(3).any(|leaf| leaf[2] > 1));
}

#[test]
fn answers_are_the_librarys() {
    let gallery = library();
    let mut session = session(Limits::default());
    for p in [[2.0, 2.0], [6.03, 4.51], [0.02, 8.9], [-3.0, 1.0]] {
        let told = ask(&mut session, json!({ "op": "answers", "at": p }));
        assert_eq!(told["esdf"]["distance"].as_f64(), gallery.distance().distance(p).known());
        assert_eq!(told["esdf"]["status"], gallery.distance().distance(p).status().word());
        assert_eq!(told["contour"]["distance"].as_f64(), gallery.contour.nearest_distance(p));
        assert_eq!(told["cloud"]["distance"].as_f64(), gallery.cloud.nearest_distance(p));
        assert_eq!(told["grid"]["occupied"].as_f64(), gallery.occupancy.probability(p).known());
        assert_eq!(told["tree"]["occupied"].as_f64(), gallery.tree.probability(p).known());
    }
}

#[test]
fn it_follows_the_map_of_fusion() {
    let mut session = session(Limits::default());
    let first = ask(&mut session, json!({ "op": "open", "have": null }));
    let again = ask(&mut session, json!({ "op": "open", "have": first["revision"] }));
    assert!(again.get("picture").is_none(), "nothing is sent twice");
    let step = json!({ "id": 0, "view": "fusion", "ask": { "op": "step", "scans": 1 } });
    session.answer(&step.to_string());
    let next = ask(&mut session, json!({ "op": "open", "have": first["revision"] }));
    assert_eq!(next["of"]["scans"], SCANS + 1);
    assert_ne!(next["revision"], first["revision"]);
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let mut session = session(Limits::default());
    for (question, words) in [
        (json!({ "op": "run", "workload": "surface", "probes": 5 }), "probes must be from 100 to 300000"),
        (json!({ "op": "run", "workload": "surface", "probes": 4_000_000_000u64 }), "probes must be"),
        (json!({ "op": "run", "workload": "meals", "probes": 500 }), "unknown variant `meals`"),
        (json!({ "op": "answers", "at": [1.0] }), "invalid length"),
        (json!({ "op": "open", "have": null, "more": 1 }), "unknown field"),
    ] {
        let told = refusal(&mut session, question);
        assert!(told.contains(words), "{told}");
    }
    let beams = [Beam { direction: [1.0, 0.0], range: 3.0, kind: BeamKind::MaxRange }];
    let scans = vec![(Pose::<2>::IDENTITY, Scan::from_beams(beams))];
    let plane = Source2d::Recorded { name: "nothing".into(), scans };
    let mut empty = Session::new(
        &Arc::new(Logs { source_2d: plane, ..Default::default() }),
        Limits::default(),
        &Clock::new(|| 0.0),
    );
    assert!(refusal(&mut empty, json!({ "op": "open", "have": null })).contains("hit anything"));
}

#[test]
fn maps_that_are_too_large_together_are_not_made() {
    let limits = Limits { memory: 8 << 20 };
    let mut session = session(limits);
    let told = refusal(&mut session, json!({ "op": "open", "have": null }));
    assert!(told.contains("all representations together need about"), "{told}");
    assert!(session.memory_bytes() < limits.memory);
}

#[test]
fn trees_of_other_leaves_follow_the_formula() {
    let mut session = session(Limits::default());
    let told = ask(&mut session, json!({ "op": "trees" }));
    let sizes = told["sizes"].as_array().unwrap();
    assert_eq!((sizes.len(), told["every"].as_u64()), (6, Some(1)));
    let ratio = |pair: &Value, which: &str| pair[1][which].as_f64().unwrap();
    // The formula is a straight line through zero; the measurement falls, too, if not in a straight line.
    let slope = |pair: &Value| ratio(pair, "predicted_ratio") / ratio(pair, "resolution");
    assert!(sizes.iter().all(|pair| (slope(pair) - slope(&sizes[0])).abs() < 1e-9));
    assert!(ratio(&sizes[5], "measured_ratio") < ratio(&sizes[0], "measured_ratio"));
    let gallery = library();
    assert_eq!(ratio(&sizes[2], "measured_ratio"), gallery.trees[1].measured_ratio);
}
