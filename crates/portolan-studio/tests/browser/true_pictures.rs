//! What is on the screen is true at every moment: while colors change, while meshes come in, in every lap.

use portolan_studio::engine::BesideMap;

use super::Studio;
use super::view3d::studio_of_gyroid;

#[test]
fn old_colors_stay_until_all_of_the_new_ones_are_there() {
    let Some(studio) = studio_of_gyroid(120, BesideMap::default()) else { return };
    let page = studio.open("view=3d");
    page.wait_for("document.getElementById('3d-canvas').dataset.pending === '0'");
    page.rest();
    page.eval(
        "(() => {
            const byId = (id) => document.getElementById(id);
            window.seen = [];
            const look = () => {
                const text = byId('3d-recoloring').textContent;
                if (text) seen.push([text, byId('3d-canvas').coloredBy(), byId('3d-legend').textContent.trim()]);
            };
            // Of every change, drawn or not: a busy machine draws few pictures.
            new MutationObserver(look).observe(byId('3d-recoloring'), { subtree: true, childList: true, characterData: true });
        })()",
    );
    page.choose("3d-color", "weight");
    page.wait_for("document.getElementById('3d-canvas').coloredBy() === 'weight'");
    page.wait_text("3d-legend", "Weight");
    let seen = page.eval("seen");
    let seen = seen.as_array().unwrap();
    assert!(!seen.is_empty(), "no progress was shown");
    for moment in seen {
        assert!(moment[0].as_str().unwrap().starts_with("Next by weight:"), "{moment}");
        assert_eq!((moment[1].as_str(), moment[2].as_str()), (Some("height"), Some("Height")), "{moment}");
    }
    assert!(!page.is_visible("3d-recoloring"));
    page.assert_no_errors();
}

#[test]
fn all_frames_are_said_to_be_there_when_all_of_the_mesh_is() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=3d&frame=0");
    page.rest();
    page.eval(
        "(() => {
            window.early = 0;
            const at = document.getElementById('3d-at');
            const look = () => {
                const pending = Number(document.getElementById('3d-canvas').dataset.pending);
                if (at.textContent.includes('12 of 40') && pending > 0) early++;
            };
            new MutationObserver(look).observe(document.getElementById('view-3d'), { subtree: true, childList: true, characterData: true, attributes: true });
        })()",
    );
    page.set_slider("3d-frame", 12.0);
    page.wait_text("3d-at", "12 of 40");
    assert_eq!(page.eval("early"), 0);
    page.assert_no_errors();
}

#[test]
fn the_scrub_bar_is_the_lap_that_its_text_names() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=210");
    page.wait_text("at", "scan 10 of 200, lap 2");
    let bar = page
        .eval("(({ min, max, value }) => [min, max, value].map(Number))(document.getElementById('scrub'))");
    assert_eq!(bar, serde_json::json!([200, 400, 210]));
    page.set_slider("scrub", 250.0);
    page.wait_text("at", "scan 50 of 200, lap 2");
    page.assert_no_errors();
}

#[test]
fn the_picture_of_clearance_has_what_is_certified_where_unknown_space_is_an_obstacle() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=clearance&rings=0.5");
    page.wait_text("ramp-reach", "certified:");
    page.screenshot("clearance-pessimistic");
    page.press("u");
    page.wait_text("ramp-reach", "distance:");
    page.screenshot("clearance-optimistic");
    page.press("f");
    page.wait_text("ramp-reach", "along beams");
    page.assert_no_errors();
}

#[test]
fn the_ghosts_plot_has_the_prediction_beside_what_was_measured() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&w_max=8&scan=200");
    page.wait_text("at", "scan 200 of");
    page.click("move-chair");
    page.wait_text("status", "The chair was moved");
    page.press("End");
    page.wait_text("at", "lap 2");
    let ghost = page.ask("fusion", serde_json::json!({ "op": "step", "scans": 0 }))["ghost"].take();
    let group = &ghost["saturated"];
    let half = group["half_life_predicted"].as_f64().unwrap();
    let curve = group["curve"].as_array().unwrap();
    assert!(curve.len() > 2, "{curve:?}");
    for point in curve {
        let [n, predicted] = [0, 2].map(|k| point[k].as_f64().unwrap());
        assert!((predicted - 0.5f64.powf(n / half)).abs() < 1e-9, "{point}");
    }
    page.wait_for("document.querySelectorAll('#view-fusion .legend li').length > 6");
    page.screenshot("ghost");
    page.assert_no_errors();
}
