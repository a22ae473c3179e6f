//! The view of radiance: what it shows is what the library's experiment comes to.

use portolan_chapter::radiance::{Channels, Experiment, PARKED};
use serde_json::json;

use super::Studio;

/// A number as the view writes it, to as many digits as it shows.
fn shown(text: &str) -> f64 {
    let number = text.split(' ').next().unwrap().replace('−', "-");
    number.parse().unwrap_or_else(|_| panic!("no number: {text}"))
}

fn assert_shown(text: &str, value: f64) {
    // Three digits, or two with an exponent: half of the last one at most.
    let half = if text.contains('e') { 0.05 } else { 0.005 };
    assert!((shown(text) - value).abs() <= half * value.abs(), "{text} is not {value}");
}

#[test]
fn a_link_makes_the_librarys_run_again_and_numbers_agree() {
    let Some(studio) = Studio::start() else { return };
    let page =
        studio.open("view=radiance&seed=41&run=depth-descent-900.reflectance-descent-300&ray=8&bin=26");
    page.wait_text("status", "was made again: 1200 steps");
    page.settle();
    let first = Experiment { steps: 900, ..Experiment::default() };
    let start = first.run(PARKED.seed, Channels::Depth).unwrap().fit.line().clone();
    let then = Experiment { steps: 300, ..Experiment::default() };
    let mut outcome = then.run_from(start, PARKED.seed, Channels::DepthReflectance).unwrap();
    let last = outcome.last();
    assert_shown(&page.text("radiance-training-depth"), last.training.depth);
    assert_shown(&page.text("radiance-held-out-depth"), last.held_out.depth);
    assert_shown(&page.text("radiance-held-out-reflectance"), last.held_out.reflectance);
    assert_shown(&page.text("radiance-j"), last.objective);
    assert_shown(&page.text("bin-gradient"), outcome.fit.gradient()[26]);
    assert_eq!(page.text("bin-sum"), page.text("bin-gradient"));
    page.screenshot("radiance-run");
    page.assert_no_errors();
}

#[test]
fn steps_changes_and_bins_by_keyboard_alone() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=radiance");
    page.wait_text("radiance-at", "step 0");
    page.focus("radiance-canvas");
    page.press(".");
    page.wait_text("radiance-at", "step 1 ");
    page.press(",");
    page.wait_text("radiance-at", "step 51 ");
    page.press("c");
    page.wait_for("document.getElementById('radiance-channels').value === 'reflectance'");
    page.press("Space");
    page.wait_text("radiance-play", "Pause");
    page.press("Space");
    page.wait_text("radiance-play", "Play");
    page.press("w");
    page.wait_text("radiance-bin", "Bin ");
    let before = page.text("radiance-bin");
    page.press("ArrowRight");
    page.press("Enter");
    page.wait_for(&format!("document.getElementById('radiance-bin').textContent !== {}", json!(before)));
    page.press("Escape");
    page.wait_text("radiance-bin", "Click a bin");
    page.press("r");
    page.wait_text("status", "Seed ");
    page.press("Home");
    page.wait_text("radiance-at", "step 0");
    page.assert_no_errors();
}

#[test]
fn a_click_explains_a_bin_and_a_row_is_a_ray() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=radiance");
    page.wait_text("radiance-at", "step 0");
    let [_, _, w, h] = page.area("radiance-canvas");
    // The line lies between margins of 58 pixels; the tenth ray in the lowest row.
    page.click_at("radiance-canvas", [58.0 + (w - 116.0) * 60.5 / 80.0, 0.2 * h]);
    page.wait_text("radiance-bin", "Bin 60, 6.0 to 6.1 m");
    page.click_at("radiance-canvas", [0.5 * w, h - 26.0]);
    page.wait_for("document.getElementById('radiance-ray').value === '9'");
    page.assert_no_errors();
}
