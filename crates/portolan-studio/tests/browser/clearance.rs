//! The view of clearance: the probe's numbers are the engine's, paths have verdicts, keys alone do all of it.

use serde_json::json;

use super::{Page, Studio};

const CANVAS: &str = "clearance-canvas";

/// What the page says of the probe, and what the engine does.
fn probe_is_the_engines(page: &Page, at: [f64; 2], unknown: &str) {
    page.wait_text("probe-at", &format!("{:.3}, {:.3} m", at[0], at[1]));
    let want = page.ask("clearance", json!({ "op": "probe", "at": at, "unknown": unknown }));
    assert_eq!(page.text("probe-row"), want["row"].as_str().unwrap());
    assert_eq!(page.text("probe-euclidean-status"), want["euclidean"]["status"].as_str().unwrap());
    let number = |id: &str, name: &str| {
        let want = want["euclidean"][name].as_f64().map_or("–".into(), |v| format!("{v:.4}"));
        assert_eq!(page.text(id), want, "{name} at {at:?}");
    };
    number("probe-euclidean-distance", "distance");
    number("probe-euclidean-lower", "lower");
}

#[test]
fn the_probe_says_what_the_engine_says() {
    let Some(studio) = Studio::start() else { return };
    for unknown in ["optimistic", "pessimistic"] {
        // In the open, inside of a wall, where nothing was seen, outside of the map.
        for at in [[6.5, 4.5], [3.1, 5.25], [2.675, 6.0], [15.0, 2.0]] {
            let page = studio.open(&format!("view=clearance&unknown={unknown}&probe={},{}", at[0], at[1]));
            probe_is_the_engines(&page, at, unknown);
            page.assert_no_errors();
        }
    }
}

#[test]
fn the_probe_follows_the_pointer() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=clearance");
    page.wait_text("probe-euclidean-status", "known");
    let before = page.text("probe-row");
    let [_, _, width, height] = page.area(CANVAS);
    page.point_at(CANVAS, [0.4 * width, 0.5 * height]);
    page.wait_for(&format!("document.getElementById('probe-row').textContent !== {}", json!(before)));
    page.assert_no_errors();
}

#[test]
fn keys_alone_make_a_path_and_test_it() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=clearance&probe=6.5,4.5");
    page.wait_text("probe-at", "6.500, 4.500");
    page.press("Enter");
    for _ in 0..3 {
        page.press("Shift+ArrowRight");
    }
    page.press("ArrowRight");
    page.wait_text("probe-at", "8.050, 4.500");
    page.press("Enter");
    // One waypoint alone is certified, too: the answer about both of them is waited for.
    page.wait_text("path-length", "1.550 m");
    assert_eq!(page.text("path-certified"), "1.550 m");
    assert!(page.text("path-verdict").contains("Certified"));
    // No robot of a meter fits into the corridor.
    page.set_slider("robot-radius", 1.0);
    page.wait_text("path-verdict", "Not certified from 0.00 m");
    page.press("Backspace");
    page.wait_text("path-hint", "One waypoint");
    page.press("Escape");
    page.wait_text("path-hint", "Click to set waypoints");
    page.press("u");
    page.wait_text("probe-command", "optimistic");
    page.press("f");
    page.wait_text("ring-note", "the field ends 0.15 m");
    page.assert_no_errors();
}

#[test]
fn clicks_make_a_path_and_a_link_holds_it() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=clearance");
    page.wait_text("probe-euclidean-status", "known");
    let [_, _, width, height] = page.area(CANVAS);
    // From the corridor through walls.
    page.click_at(CANVAS, [0.5 * width, 0.5 * height]);
    page.click_at(CANVAS, [0.5 * width, 0.9 * height]);
    page.wait_text("path-verdict", "Not certified");
    // Of both waypoints: the first alone was in the address for a moment.
    page.wait_for("/path=[^&]*;/.test(decodeURIComponent(location.hash))");
    let state = page.eval("location.hash.slice(1)");
    let again = studio.open(state.as_str().unwrap());
    again.wait_text("path-hint", "2 waypoints");
    again.wait_text("path-verdict", "Not certified");
    assert_eq!(again.text("path-violated"), page.text("path-violated"));
    again.assert_no_errors();
    page.assert_no_errors();
}

#[test]
fn the_driven_way_is_certified_and_the_meter_tells_the_fields_apart() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=clearance&path=driven");
    page.wait_text("path-verdict", "Certified");
    assert_eq!(page.text("path-violated"), "0.000 m");
    let median = |id: &str| page.text(id).parse::<f64>().unwrap();
    assert!((0.95..1.02).contains(&median("median-euclidean")) && median("median-truncated") < 0.05);
    page.assert_no_errors();
}
