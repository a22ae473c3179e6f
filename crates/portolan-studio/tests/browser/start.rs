//! The first minute: what the studio was given is shown, things move, explain themselves, and a way leads back.

use portolan_studio::engine::{Logs, Source3d};
use portolan_studio::server::Settings;
use serde_json::json;

use super::view3d::gyroid;
use super::{Page, Screen, Studio};

/// A studio that was given a saved map whose up is -y.
fn with_map() -> Option<Studio> {
    let source_3d = Source3d::Map {
        name: "kitchen".into(),
        tsdf: Box::new(gyroid(48)),
        up: [0.0, -1.0, 0.0],
        beside: Box::default(),
    };
    Studio::with(Logs { source_3d, ..Logs::default() }, &Settings::default())
}

fn scan(page: &Page) -> usize {
    page.text("at").split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn what_was_given_is_what_is_shown_and_it_stands_upright() {
    let Some(studio) = with_map() else { return };
    let page = studio.open("");
    page.wait_shown("3d");
    page.wait_text("3d-name", "kitchen");
    page.wait_for("document.getElementById('3d-canvas').dataset.pending === '0'");
    assert_eq!(page.eval("document.getElementById('3d-canvas').up()"), json!([0, -1, 0]));
    // The other views say that they show something else.
    page.show("clearance");
    page.wait_for("document.querySelector('#view-clearance .lead').textContent.includes('kitchen is 3-D')");
    page.assert_no_errors();
}

#[test]
fn who_arrives_without_a_link_sees_scans_fused_and_a_link_stands_still() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("");
    page.wait_shown("fusion");
    page.wait_for("Number(document.getElementById('at').textContent.split(' ')[1]) > 10");
    page.assert_no_errors();
    let still = studio.open("view=fusion&scan=7");
    still.wait_text("at", "scan 7 of");
    std::thread::sleep(std::time::Duration::from_millis(400));
    assert_eq!(scan(&still), 7);
}

#[test]
fn every_picture_has_a_sentence_whose_words_explain_themselves() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=3");
    for view in page.views() {
        page.show(&view);
        let lead = page.eval(&format!("document.querySelector('#view-{view} .lead').textContent"));
        assert!(lead.as_str().unwrap().len() > 80, "{view}: {lead}");
        let term = format!("document.querySelector('#view-{view} .lead .term')");
        page.eval(&format!("{term}.focus()"));
        page.wait_for("document.getElementById('explained')?.checkVisibility()");
        let what = page.text("explained");
        assert!(what.len() > 20, "{view}: {what}");
        page.eval(&format!("{term}.blur()"));
        page.wait_for("!document.getElementById('explained').checkVisibility()");
    }
    page.assert_no_errors();
}

#[test]
fn the_start_offers_worlds_and_they_are_shown() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=3");
    page.click("welcome-open");
    page.wait_for("document.getElementById('welcome').open");
    page.screenshot("start");
    page.eval("[...document.querySelectorAll('#welcome-worlds a')].find((a) => a.href.includes('sensor=camera')).click()");
    page.wait_for("document.getElementById('tab-3d').ariaSelected === 'true'");
    page.wait_for("document.getElementById('3d-sensor')?.value === 'camera'");
    page.wait_for("document.getElementById('3d-canvas').coloredBy() === 'color'");
    page.wait_for("location.hash.includes('sensor=camera') && location.hash.includes('color=color')");
    page.assert_no_errors();
}

#[test]
fn a_file_that_is_dropped_gets_its_command() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=3");
    page.eval(
        "(() => {
            const dataTransfer = new DataTransfer();
            dataTransfer.items.add(new File(['x'], 'my run.bag'));
            document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
        })()",
    );
    page.wait_text("welcome-command", "portolan studio \"my run.bag\"");
    assert!(page.is_visible("welcome"));
    page.assert_no_errors();
}

#[test]
fn back_leads_to_the_view_before_as_it_was_left() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=5");
    page.wait_text("at", "scan 5 of");
    page.show("radiance");
    page.show("clearance");
    page.eval("history.back()");
    page.wait_shown("radiance");
    page.eval("history.back()");
    page.wait_shown("fusion");
    assert_eq!(scan(&page), 5);
    page.eval("history.forward()");
    page.wait_shown("radiance");
    page.assert_no_errors();
}

#[test]
fn what_a_link_cannot_show_is_told_in_words() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=plasma");
    page.wait_text("status", "a view \u{201c}plasma\u{201d}");
    let page = studio.open("view=3d&frame=1&color=plaid&slice=soup,1,2");
    page.wait_text("status", "colors by \u{201c}plaid\u{201d}");
    page.wait_text("status", "a slice \u{201c}soup,1,2\u{201d}");
    let page = studio.open("view=3d&frame=1&color=color");
    page.wait_text("status", "this sensor measures no color");
    page.assert_no_errors();
}

#[test]
fn the_tour_goes_through_the_views_and_can_be_left() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=3");
    page.click("welcome-open");
    page.click("welcome-tour");
    page.wait_text("tour-text", "Scans are fused");
    page.screenshot("tour");
    let mut seen = std::collections::BTreeSet::new();
    while page.is_visible("tour") {
        let toured = "document.querySelector('.toured')?.checkVisibility()";
        page.wait_for(toured);
        seen.insert(
            page.eval("document.querySelector('[role=tab][aria-selected=true]').textContent").to_string(),
        );
        page.click("tour-next");
        page.settle();
    }
    assert!(seen.len() >= 4, "{seen:?}");
    assert_eq!(page.eval("document.querySelector('.toured')"), json!(null));
    page.click("welcome-open");
    page.click("welcome-tour");
    page.wait_for("document.getElementById('tour').checkVisibility()");
    page.press("Escape");
    page.wait_for("!document.getElementById('tour').checkVisibility()");
    page.assert_no_errors();
}

#[test]
fn a_phones_header_is_one_row_with_its_tools_in_a_menu() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open_on("view=fusion&scan=3", Screen { size: [390, 844], ..Screen::LIGHT });
    let height = page.eval("document.querySelector('.bar').offsetHeight").as_f64().unwrap();
    assert!(height < 60.0, "the header is {height} pixels high");
    assert!(!page.is_visible("share"));
    page.click("menu");
    assert!(page.is_visible("share") && page.is_visible("welcome-open"));
    page.screenshot("phone-menu");
    page.click("theme");
    page.wait_text("status", "Theme:");
    assert!(!page.is_visible("share"));
    page.assert_no_errors();
}

#[test]
fn one_tab_too_many_says_so_in_its_middle() {
    let settings = Settings { sessions: 1, ..Settings::default() };
    let Some(studio) = Studio::with(Logs::default(), &settings) else { return };
    let _first = studio.open("view=fusion&scan=3");
    let late = studio.open("");
    late.wait_for("document.getElementById('stage').textContent.includes('too many tabs')");
    late.screenshot("too-many-tabs");
}
