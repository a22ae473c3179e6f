//! The gallery: panels that move together, workloads that are measured when they are run, frames by the library's rule.

use serde_json::{Value, json};

use super::{Page, Studio};

const PANELS: [&str; 6] = ["grid", "tree", "tsdf", "esdf", "contour", "cloud"];

/// A page of some scans, for which everything is built sooner than for a lap.
fn gallery(studio: &Studio, state: &str) -> Page {
    let page = studio.open("view=fusion&scan=30");
    page.wait_text("at", "scan 30 of");
    page.eval(&format!("location.hash = 'view=gallery{state}'"));
    page.wait_shown("gallery");
    page.wait_text("gallery-scans", "30 of 200");
    page
}

fn idle(page: &Page) {
    page.wait_for("document.querySelector('#view-gallery button:disabled') === null");
    page.settle();
}

/// What the engine has measured, without measuring again.
fn costs(page: &Page) -> Value {
    page.ask("gallery", json!({ "op": "open", "have": null }))["costs"].take()
}

fn panels_of(rows: &Value, indices: &[Value]) -> Vec<String> {
    let panel =
        |i: &Value| rows[i.as_u64().unwrap() as usize]["panel"].as_str().unwrap_or_default().to_owned();
    indices.iter().map(panel).collect()
}

#[test]
fn the_winner_has_the_frame_and_the_meters_are_the_engines() {
    let Some(studio) = Studio::start() else { return };
    let page = gallery(&studio, "");
    for (key, workload) in [("o", "occupancy"), ("d", "distance"), ("s", "surface")] {
        idle(&page);
        page.press(key);
        page.wait_for(&format!("document.getElementById('gallery-run-{workload}').ariaPressed === 'true'"));
        idle(&page);
        let costs = costs(&page);
        let rows = &costs["rows"];
        let winner = costs["winners"].as_array().unwrap().iter().find(|w| w["workload"] == workload).unwrap();
        let wins = &panels_of(rows, std::slice::from_ref(&winner["row"]))[0];
        let level = panels_of(rows, winner["level"].as_array().unwrap());
        for panel in PANELS {
            let is = |class: &str| {
                page.eval(&format!(
                    "document.getElementById('gallery-panel-{panel}').classList.contains('{class}')"
                ))
            };
            assert_eq!(is("winner"), panel == wins, "{workload}: {panel}");
            assert_eq!(is("level"), panel != wins && level.iter().any(|p| p == panel), "{workload}: {panel}");
            let row = rows.as_array().unwrap().iter().find(|r| r["panel"] == panel).unwrap();
            let told = page.text(&format!("gallery-{panel}-{workload}"));
            assert_eq!(told == "–", row[workload].is_null(), "{workload}: {panel} says {told}");
            let badge = page.text(&format!("gallery-{panel}-badge"));
            assert_eq!(badge.contains("cannot answer"), row[workload].is_null(), "{panel} says {badge}");
        }
    }
    let memory = |page: &Page| costs(page)["rows"][0]["memory_bytes"].as_f64().unwrap();
    assert_eq!(page.text("gallery-grid-memory"), format!("{:.1} kB", memory(&page) / 1000.0));
    page.screenshot("gallery-surface");
    page.assert_no_errors();
}

#[test]
fn a_link_shows_the_same_part_and_runs_the_same_workload() {
    let Some(studio) = Studio::start() else { return };
    let page = gallery(&studio, "&run=distance&probes=10000&at=4.000,3.000,3.000");
    page.wait_for("document.getElementById('gallery-panel-esdf').classList.contains('winner')");
    page.wait_text("gallery-measured", "10,000 points (200 for searches)");
    page.press("+");
    for part in ["run=distance", "probes=10000", "3.750"] {
        page.wait_for(&format!("location.hash.includes('{part}')"));
    }
    page.press("0");
    page.wait_for("!location.hash.includes('at=')");
    page.assert_no_errors();
}

#[test]
fn every_representation_answers_for_the_middle_and_under_the_pointer() {
    let Some(studio) = Studio::start() else { return };
    let page = gallery(&studio, "");
    idle(&page);
    // Where the robot is, everything is known.
    let pose = page.ask("fusion", json!({ "op": "step", "scans": 0 }))["pose"].take();
    let at = [0, 1].map(|k| (1000.0 * pose[k].as_f64().unwrap()).round() / 1000.0);
    page.eval(&format!("location.hash = 'view=gallery&at={:.3},{:.3},2.000'", at[0], at[1]));
    page.wait_for("location.hash.includes('2.000')");
    idle(&page);
    page.press("x");
    page.wait_for("document.getElementById('gallery-esdf-answer').textContent !== ''");
    let told = page.ask("gallery", json!({ "op": "answers", "at": at }));
    let length = |v: &Value| {
        let v = v.as_f64().unwrap();
        if v.abs() < 1.0 { format!("{:.1} cm", 100.0 * v) } else { format!("{v:.3} m") }
    };
    let esdf = format!("d {}; true {}", length(&told["esdf"]["distance"]), length(&told["truth"]));
    assert_eq!(page.text("gallery-esdf-answer"), esdf);
    assert!(page.text("gallery-contour-answer").contains(&length(&told["contour"]["distance"])));
    assert_eq!(
        page.text("gallery-cloud-answer"),
        format!("nearest point {}", length(&told["cloud"]["distance"]))
    );
    page.press("x");
    page.wait_for("document.getElementById('gallery-esdf-answer').textContent === ''");
    page.point_at("gallery-tree", [80.0, 60.0]);
    page.wait_for("document.getElementById('gallery-tree-answer').textContent !== ''");
    page.assert_no_errors();
}

#[test]
fn trees_of_other_leaves_are_drawn_beside_the_formula() {
    let Some(studio) = Studio::start() else { return };
    let page = gallery(&studio, "");
    idle(&page);
    page.click("gallery-trees-run");
    page.wait_text("gallery-trees-note", "fused just now");
    assert!(page.is_visible("gallery-tree-plot"));
    page.assert_no_errors();
}
