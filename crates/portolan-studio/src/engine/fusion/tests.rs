//! What the page gets is what the library computes.

use std::sync::Arc;

use portolan::cell::FusionEvent;
use portolan::geom::{Grid, Pose};
use portolan::map::{BeamSweep, Tsdf2, TsdfConfig};
use portolan::scan::Scan;
use portolan_sim::{LapConfig, apartment, lap};
use serde_json::{Value, json};

use crate::engine::{Clock, Limits, Logs, Session, Source2d, Wire};

fn session(logs: Logs) -> Session {
    Session::new(&Arc::new(logs), Limits::default(), &Clock::new(|| 0.0))
}

/// The header of an answer; panics where it is a refusal.
fn ask(session: &mut Session, question: Value) -> Value {
    let answer = said(session, question);
    assert!(answer.get("error").is_none(), "{answer}");
    answer["ok"].clone()
}

fn refusal(session: &mut Session, question: Value) -> String {
    said(session, question)["error"].as_str().expect("a refusal").to_owned()
}

fn said(session: &mut Session, question: Value) -> Value {
    match session.answer(&json!({ "id": 1, "view": "fusion", "ask": question }).to_string()) {
        Wire::Text(text) => serde_json::from_str(&text).unwrap(),
        Wire::Binary(bytes) => {
            let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
            serde_json::from_slice(&bytes[8..8 + length]).unwrap()
        }
    }
}

/// The events of a cell as the library has them, fused without a studio.
fn events(scans: &[(Pose<2>, Scan<2>)], config: TsdfConfig<2>, cell: [i32; 2]) -> Vec<(usize, FusionEvent)> {
    let mut tsdf = Tsdf2::covering(&Grid::new([0.0; 2], 0.05, [240, 180]), config).unwrap();
    tsdf.watch([cell]);
    let mut events = Vec::new();
    for (i, (pose, scan)) in scans.iter().enumerate() {
        tsdf.integrate(pose, scan).unwrap();
        events.extend(tsdf.events().iter().map(|e| (i, e.1)));
    }
    events
}

fn same(told: &Value, events: &[(usize, FusionEvent)]) {
    let told = told.as_array().unwrap();
    assert_eq!(told.len(), events.len());
    for (row, (scan, e)) in told.iter().zip(events) {
        let numbers = [e.weight_before, e.observation, e.gain, e.after, e.weight_after];
        assert_eq!(row[0], *scan);
        assert_eq!(row[1].as_f64(), (e.weight_before > 0.0).then_some(e.before));
        for (k, number) in numbers.iter().enumerate() {
            assert_eq!(row[2 + k].as_f64().unwrap().to_bits(), number.to_bits(), "{row} against {e:?}");
        }
    }
}

#[test]
fn a_cells_history_is_what_the_library_says() {
    let scans = lap(&apartment().world, &LapConfig::default());
    for (word, sweep) in [("cell-centre", BeamSweep::CellCentre), ("march", BeamSweep::March)] {
        let mut session = session(Logs::default());
        let mut settings = ask(&mut session, json!({ "op": "open" }))["all"]["settings"].clone();
        settings["sweep"] = json!(word);
        settings["w_max"] = json!(8);
        ask(&mut session, json!({ "op": "set", "settings": settings }));
        ask(&mut session, json!({ "op": "seek", "scan": 150 }));
        let config = TsdfConfig { beams: sweep, w_max: 8.0, ..TsdfConfig::textbook() };
        for cell in [[31, 60], [100, 90], [37, 70], [20, 50]] {
            let told = ask(&mut session, json!({ "op": "watch", "cell": cell }));
            let expected = events(&scans, config, cell);
            let before = expected.partition_point(|e| e.0 < 150);
            assert!(before > 3, "{cell:?} was seen {before} times");
            same(&told["events"], &expected[..before]);
        }
        // What comes while it is watched is told as news.
        let told = ask(&mut session, json!({ "op": "step", "scans": 50 }));
        let expected = events(&scans, config, [20, 50]);
        let before = expected.partition_point(|e| e.0 < 150);
        assert_eq!(told["inspected"]["from"], before);
        same(&told["inspected"]["events"], &expected[before..]);
    }
}

#[test]
fn laps_are_those_of_the_simulator() {
    let mut lap_of = super::scans::Scans::new(&Arc::default(), 0.01);
    let world = apartment().world;
    for k in [0, 1] {
        let expected = lap(&world, &LapConfig { first_index: 200 * k, ..Default::default() });
        for (i, scan) in expected.iter().enumerate() {
            assert_eq!(lap_of.scan(200 * k as usize + i), scan);
        }
    }
}

#[test]
fn going_back_and_setting_back_gives_the_same_map() {
    let mut session = session(Logs::default());
    let settings = ask(&mut session, json!({ "op": "open" }))["all"]["settings"].clone();
    let export = json!({ "op": "export", "file": "map" });
    ask(&mut session, json!({ "op": "seek", "scan": 40 }));
    let map = |session: &mut Session| {
        let question = json!({ "id": 1, "view": "fusion", "ask": export }).to_string();
        session.answer(&question)
    };
    let before = map(&mut session);
    assert!(matches!(before, Wire::Binary(_)));
    ask(&mut session, json!({ "op": "step", "scans": 60 }));
    assert_ne!(map(&mut session), before);
    assert_eq!(ask(&mut session, json!({ "op": "seek", "scan": 40 }))["fresh"], true);
    assert_eq!(map(&mut session), before);
    let mut other = settings.clone();
    (other["noise"], other["w_max"], other["resolution"]) = (json!(0.05), json!(null), json!(0.1));
    assert_eq!(ask(&mut session, json!({ "op": "set", "settings": other }))["at"], 40);
    assert_ne!(map(&mut session), before);
    ask(&mut session, json!({ "op": "set", "settings": settings }));
    assert_eq!(map(&mut session), before);
}

#[test]
fn the_ghost_fades_as_predicted() {
    let mut session = session(Logs::default());
    let mut settings = ask(&mut session, json!({ "op": "open" }))["all"]["settings"].clone();
    settings["w_max"] = json!(4);
    ask(&mut session, json!({ "op": "set", "settings": settings }));
    ask(&mut session, json!({ "op": "seek", "scan": 400 }));
    let chair = [1.645 + 1.38, 2.825 - 1.62];
    let moved = ask(&mut session, json!({ "op": "move_chair", "to": chair }));
    assert_eq!(moved["ghost"]["since"], 400);
    let told = ask(&mut session, json!({ "op": "seek", "scan": 600 }));
    let measured = &told["ghost"]["saturated"];
    let of = |name: &str| measured[name].as_f64().unwrap();
    assert!(of("cells") > 30.0, "{measured}");
    // All cells left: among them some that had less to forget, and some that are told less.
    let left = &told["ghost"]["left"];
    assert!(left["cells"].as_u64() > measured["cells"].as_u64(), "{left}");
    assert!((2.0..4.0).contains(&left["half_life_measured"].as_f64().unwrap()), "{left}");
    let apart = (of("half_life_measured") / of("half_life_predicted") - 1.0).abs();
    assert!(apart < 0.1, "{measured}");
    // Back before the move and on again: the chair moves again at the same scan.
    ask(&mut session, json!({ "op": "seek", "scan": 10 }));
    assert_eq!(ask(&mut session, json!({ "op": "seek", "scan": 600 }))["ghost"], told["ghost"]);
    // A cell of the old place: its decay is the closed form.
    let cell = ask(&mut session, json!({ "op": "watch", "cell": [29, 59] }));
    let (events, decay) = (cell["events"].as_array().unwrap(), &cell["decay"]);
    let since = decay["since"].as_u64().unwrap() as usize;
    let values = decay["values"].as_array().unwrap();
    assert_eq!((values.len(), &values[0]), (events.len() - since + 1, &events[since][1]));
    for (event, value) in events[since..].iter().zip(&values[1..]) {
        let (after, closed) = (event[5].as_f64().unwrap(), value.as_f64().unwrap());
        assert!((after - closed).abs() < 1e-6, "{event} against {closed}");
    }
    // In the middle of the chair nothing was ever seen before: nothing to forget.
    assert!(ask(&mut session, json!({ "op": "watch", "cell": [32, 55] }))["decay"].is_null());
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut session = session(Logs::default());
    let settings = ask(&mut session, json!({ "op": "open" }))["all"]["settings"].clone();
    ask(&mut session, json!({ "op": "seek", "scan": 20 }));
    for (name, value) in [
        ("resolution", json!(0.0)),
        ("resolution", json!(-1)),
        ("resolution", json!(1e300)),
        ("truncation", json!(0.01)),
        ("w_max", json!(0)),
        ("noise", json!(9)),
        ("carve_weight", json!(0)),
        ("sweep", json!("broom")),
        ("weights", json!("")),
    ] {
        let mut wrong = settings.clone();
        wrong[name] = value;
        let why = refusal(&mut session, json!({ "op": "set", "settings": wrong }));
        assert!(why.contains(name) || why.contains("there is no"), "{name}: {why}");
    }
    for to in [[1e300, 0.0], [0.1, 0.1], [6.0, 4.5]] {
        refusal(&mut session, json!({ "op": "move_chair", "to": to }));
    }
    refusal(&mut session, json!({ "op": "watch", "cell": [240, 0] }));
    refusal(&mut session, json!({ "op": "watch", "cell": [-1, i32::MIN] }));
    let last = ask(&mut session, json!({ "op": "step", "scans": 0 }));
    assert_eq!((last["at"].as_u64(), last["ghost"].is_null()), (Some(20), true));
    let end = ask(&mut session, json!({ "op": "seek", "scan": usize::MAX }));
    assert_eq!(end["at"], end["most"]);
}

#[test]
fn a_recorded_log_has_no_truth_and_an_end() {
    let scans: Vec<_> = lap(&apartment().world, &LapConfig { scans: 12, ..Default::default() });
    let recorded = Source2d::Recorded { name: "twelve".into(), scans };
    let mut session = session(Logs { source_2d: recorded, ..Logs::default() });
    let all = ask(&mut session, json!({ "op": "open" }))["all"].clone();
    assert_eq!((all["name"].as_str(), all["truth"].is_null()), (Some("twelve"), true));
    assert_eq!(ask(&mut session, json!({ "op": "step", "scans": 100 }))["at"], 12);
    refusal(&mut session, json!({ "op": "move_chair", "to": [3.0, 3.0] }));
}

#[test]
fn a_map_that_is_too_large_is_refused_before_it_is_made() {
    let limits = Limits { memory: 8 << 20 };
    let mut session = Session::new(&Arc::default(), limits, &Clock::new(|| 0.0));
    let mut settings = ask(&mut session, json!({ "op": "open" }))["all"]["settings"].clone();
    settings["resolution"] = json!(0.01);
    let why = refusal(&mut session, json!({ "op": "set", "settings": settings }));
    assert!(why.contains("choose larger cells"), "{why}");
    assert_eq!(ask(&mut session, json!({ "op": "step", "scans": 3 }))["at"], 3);
}
