//! What every view must do, whatever it shows: the tests go through all tabs that the page has.

use std::collections::BTreeSet;
use std::time::Duration;

use portolan_studio::engine::Logs;
use portolan_studio::server::Settings;
use serde_json::{Value, json};

use super::{Page, Screen, Studio};

/// What a laptop, half of its screen and a phone show, by day and by night.
const SCREENS: [Screen; 6] = [
    Screen::LIGHT,
    Screen::DARK,
    Screen { size: [800, 900], ..Screen::LIGHT },
    Screen { size: [800, 900], ..Screen::DARK },
    Screen { size: [390, 844], ..Screen::LIGHT },
    Screen { size: [1000, 700], ..Screen::DARK },
];

fn audit(page: &Page, what: &str) -> Value {
    page.eval(&format!("({}).{what}()", include_str!("audit.js").trim_end().trim_end_matches(';')))
}

fn complaints(page: &Page, what: &str) -> Vec<String> {
    serde_json::from_value(audit(page, what)).unwrap()
}

#[test]
fn opens_without_errors_and_can_be_read_on_every_screen() {
    let Some(studio) = Studio::start() else { return };
    for screen in SCREENS {
        let page = studio.open_on("view=fusion", screen);
        for view in page.views() {
            let at = format!("{view} on {}", screen.name());
            page.show(&view);
            assert_eq!(complaints(&page, "contrast"), [""; 0], "text of {at} has too little contrast");
            assert_eq!(complaints(&page, "nameless"), [""; 0], "{at} has controls without a name");
            assert_eq!(audit(&page, "overflow"), 0, "{at} is wider than the screen");
            assert_eq!(complaints(&page, "clipped"), [""; 0], "{at} has no room for its numbers");
            page.screenshot(&format!("{view}-{}", screen.name()));
        }
        page.assert_no_errors();
    }
}

#[test]
fn follows_the_systems_theme_and_the_button() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open_on("", Screen::LIGHT);
    let ground = || page.eval("getComputedStyle(document.body).backgroundColor");
    let light = ground();
    page.show_on(Screen::DARK);
    let dark = ground();
    assert_ne!(light, dark);
    page.show_on(Screen::LIGHT);
    assert_eq!(ground(), light);
    // The button goes through all of them, whatever the system has.
    let mut seen = BTreeSet::new();
    for _ in 0..3 {
        page.press("t");
        page.settle();
        seen.insert(ground().to_string());
    }
    assert_eq!(seen, BTreeSet::from([light.to_string(), dark.to_string()]));
    page.assert_no_errors();
}

#[test]
fn number_keys_and_arrows_switch_views() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion");
    let views = page.views();
    for (i, view) in views.iter().enumerate() {
        page.press(&(i + 1).to_string());
        page.wait_shown(view);
        // The address follows, and a reload would show the same.
        page.wait_for(&format!("location.hash.includes({})", json!(format!("view={view}"))));
    }
    page.focus(&format!("tab-{}", views.last().unwrap()));
    page.press("ArrowRight");
    page.wait_shown(&views[0]);
    page.press("ArrowLeft");
    page.wait_shown(views.last().unwrap());
    page.press("?");
    page.wait_for("document.getElementById('keys').open");
    page.press("Escape");
    page.wait_for("!document.getElementById('keys').open");
    page.assert_no_errors();
}

#[test]
fn the_keyboard_reaches_every_control_and_gets_away_again() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion");
    for view in page.views() {
        page.show(&view);
        page.eval("document.activeElement?.blur()");
        let stops = complaints(&page, "stops");
        let mut missed: BTreeSet<usize> = (0..stops.len()).collect();
        // Twice around would be enough wherever it begins.
        for _ in 0..2 * stops.len() + 4 {
            page.press("Tab");
            let focused = audit(&page, "focused");
            let Some(stop) = focused["stop"].as_u64() else { continue };
            assert_eq!(
                focused["seen"], true,
                "{view}: one does not see that {} has the focus",
                stops[stop as usize]
            );
            missed.remove(&(stop as usize));
            if missed.is_empty() {
                break;
            }
        }
        let usable: BTreeSet<usize> = serde_json::from_value(audit(&page, "usable")).unwrap();
        let missed: Vec<_> = missed.into_iter().filter(|i| usable.contains(i)).map(|i| &stops[i]).collect();
        assert!(missed.is_empty(), "{view}: Tab does not reach {missed:?}");
    }
    page.assert_no_errors();
}

#[test]
fn canvases_stay_sharp() {
    let Some(studio) = Studio::start() else { return };
    for ratio in [1.0, 1.5, 2.0] {
        let page = studio.open_on("view=fusion", Screen { ratio, ..Screen::LIGHT });
        for view in page.views() {
            page.show(&view);
            for size in [[1440, 900], [1000, 700], [700, 900], [1440, 900]] {
                page.show_on(Screen { size, ratio, ..Screen::LIGHT });
                page.settle();
                assert_eq!(
                    complaints(&page, "blurred"),
                    [""; 0],
                    "{view} at {size:?}, {ratio} pixels per pixel"
                );
            }
        }
        page.assert_no_errors();
    }
}

#[test]
fn tabs_are_sessions_of_their_own_and_free_them() {
    let Some(studio) = Studio::start() else { return };
    let first = studio.open("view=fusion&scan=12");
    first.wait_text("at", "scan 12 of");
    let second = studio.open("view=fusion");
    second.wait_text("at", "scan 0 of");
    assert_eq!(studio.server.sessions(), 2);
    second.click("step");
    second.wait_text("at", "scan 1 of");
    assert_eq!(first.ask("fusion", json!({ "op": "step", "scans": 0 }))["at"], 12);
    first.assert_no_errors();
    second.assert_no_errors();

    let held = studio.server.memory_bytes();
    drop(second);
    for _ in 0..600 {
        if studio.server.sessions() == 1 {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert_eq!(studio.server.sessions(), 1);
    assert!(studio.server.memory_bytes() < held);
    assert_eq!(first.ask("fusion", json!({ "op": "step", "scans": 1 }))["at"], 13);
}

#[test]
fn says_why_when_the_studio_is_full_or_gone() {
    let Some(studio) = Studio::with(Logs::default(), &Settings { sessions: 1, ..Settings::default() }) else {
        return;
    };
    let page = studio.open("");
    let late = studio.open("");
    late.wait_text("status", "too many tabs are open");
    let Studio { server, .. } = studio;
    drop(server);
    page.wait_text("status", "start it again");
}
