//! Messages that a page would never send, straight to the engine: each gets an answer, whatever it is.

use std::sync::Arc;

use portolan_sim::{LapConfig, apartment, lap};
use portolan_studio::engine::{Clock, Limits, Logs, Session, Source2d, Wire};
use proptest::prelude::*;
use serde_json::{Value, json};

/// What pages ask. Mutations begin here: a new op belongs into this list.
const QUESTIONS: &[&str] = &[
    r#"{"id":1,"view":"fusion","ask":{"op":"open"}}"#,
    r#"{"id":2,"view":"fusion","ask":{"op":"step","scans":2}}"#,
    r#"{"id":3,"view":"fusion","ask":{"op":"seek","scan":3}}"#,
    r#"{"id":4,"view":"fusion","ask":{"op":"move_chair","to":[9.2,2.1]}}"#,
    r#"{"id":5,"view":"fusion","ask":{"op":"watch","cell":[40,60]}}"#,
    r#"{"id":6,"view":"fusion","ask":{"op":"watch","cell":null}}"#,
    r#"{"id":7,"view":"fusion","ask":{"op":"export","file":"contour"}}"#,
    r#"{"id":8,"view":"fusion","ask":{"op":"set","settings":{"resolution":0.1,"truncation":0.3,"w_max":16,"noise":0.01,"carve":true,"carve_weight":1,"weights":"constant","sweep":"march"}}}"#,
    r#"{"id":9,"view":"clearance","ask":{"op":"open","have":null}}"#,
    r#"{"id":10,"view":"clearance","ask":{"op":"rings","field":"truncated","spacing":0.25}}"#,
    r#"{"id":11,"view":"clearance","ask":{"op":"arrows","field":"euclidean","bounds":[[0,0],[12,9]],"spacing":0.5}}"#,
    r#"{"id":12,"view":"clearance","ask":{"op":"probe","at":[2.2,4.5],"unknown":"optimistic"}}"#,
    r#"{"id":13,"view":"clearance","ask":{"op":"path","points":[[2.2,4.5],[6,4.5]],"clearance":0.2,"unknown":"pessimistic"}}"#,
    r#"{"id":14,"view":"radiance","ask":{"op":"open"}}"#,
    r#"{"id":15,"view":"radiance","ask":{"op":"start","seed":7,"channels":"depth","optimizer":"adam"}}"#,
    r#"{"id":16,"view":"radiance","ask":{"op":"go_on","channels":"spread","optimizer":"descent"}}"#,
    r#"{"id":17,"view":"radiance","ask":{"op":"step","steps":3}}"#,
    r#"{"id":18,"view":"radiance","ask":{"op":"look","ray":1,"bin":20}}"#,
    r#"{"id":19,"view":"gallery","ask":{"op":"open","have":null}}"#,
    r#"{"id":20,"view":"gallery","ask":{"op":"run","workload":"distance","probes":100}}"#,
    r#"{"id":21,"view":"gallery","ask":{"op":"answers","at":[2.2,4.5]}}"#,
    r#"{"id":22,"view":"gallery","ask":{"op":"trees"}}"#,
    r#"{"id":23,"view":"3d","ask":{"op":"open"}}"#,
    r#"{"id":24,"view":"3d","ask":{"op":"step","frames":1}}"#,
    r#"{"id":25,"view":"3d","ask":{"op":"color","by":"error"}}"#,
    r#"{"id":26,"view":"3d","ask":{"op":"slice","slice":{"field":"tsdf","axis":2,"at":1.0}}}"#,
    r#"{"id":27,"view":"3d","ask":{"op":"pick","origin":[1,1,1],"direction":[1,0,0],"slice":{"field":"occupancy","axis":0,"at":2.0}}}"#,
    r#"{"id":28,"view":"3d","ask":{"op":"voxel","cell":[10,10,10]}}"#,
    r#"{"id":29,"view":"3d","ask":{"op":"history"}}"#,
];

/// Values that numbers, words and lists are replaced with.
fn hostile() -> impl Strategy<Value = Value> {
    let values = [
        json!(null),
        json!(true),
        json!(-1),
        json!(0),
        json!(-0.0),
        json!(1),
        json!(0.5),
        json!(1e308),
        json!(-1e308),
        json!(5e-324),
        json!(u32::MAX),
        json!(u64::MAX),
        json!(i64::MIN),
        json!(9_007_199_254_740_993_u64),
        json!(""),
        json!("x"),
        json!("NaN"),
        json!([]),
        json!({}),
        json!([1, 2]),
        json!([1e300, -1e300]),
        json!([i32::MAX, i32::MIN]),
        json!([[0, 0], [1, 1]]),
        json!(vec![0; 5000]),
        json!("\u{0}\u{202e}"),
        json!("a".repeat(5000)),
    ];
    prop_oneof![
        prop::sample::select(values.to_vec()),
        any::<f64>().prop_map(|v| json!(v)),
        any::<i32>().prop_map(|v| json!(v))
    ]
}

/// What is done to a message.
#[derive(Clone, Debug)]
enum Change {
    /// The n-th value in it becomes another.
    Replace(usize, Value),
    /// The n-th member of an object is missing.
    Remove(usize),
    /// Its text is cut.
    Cut(usize),
    /// A byte of its text is another.
    Byte(usize, u8),
}

fn change() -> impl Strategy<Value = Change> {
    prop_oneof![
        6 => (any::<usize>(), hostile()).prop_map(|(n, v)| Change::Replace(n, v)),
        1 => any::<usize>().prop_map(Change::Remove),
        1 => any::<usize>().prop_map(Change::Cut),
        1 => (any::<usize>(), any::<u8>()).prop_map(|(n, b)| Change::Byte(n, b)),
    ]
}

/// Pointers to all values of a document.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Object(members) => members.iter().for_each(|(k, v)| places(v, &format!("{at}/{k}"), found)),
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(i, v)| places(v, &format!("{at}/{i}"), found))
        }
        _ => {}
    }
}

fn changed(question: &str, change: &Change) -> String {
    let mut value: Value = serde_json::from_str(question).unwrap();
    let mut all = Vec::new();
    places(&value, "", &mut all);
    match change {
        Change::Replace(n, new) => *value.pointer_mut(&all[n % all.len()]).unwrap() = new.clone(),
        Change::Remove(n) => {
            let (parent, name) = all[n % all.len()].rsplit_once('/').unwrap_or_default();
            if let Some(Value::Object(members)) = value.pointer_mut(parent) {
                members.remove(name);
            }
        }
        Change::Cut(n) => return question.chars().take(n % question.len()).collect(),
        Change::Byte(n, byte) => {
            let mut bytes = question.as_bytes().to_vec();
            bytes[n % question.len()] = *byte;
            return String::from_utf8_lossy(&bytes).into_owned();
        }
    }
    value.to_string()
}

/// Thousands of scans are allowed and take seconds: nothing to be learnt from them here.
fn takes_long(message: &str) -> bool {
    let Ok(message) = serde_json::from_str::<Value>(message) else { return false };
    ["scan", "scans", "steps", "frame", "frames"]
        .iter()
        .any(|k| message["ask"][k].as_f64().is_some_and(|n| n > 20.0))
}

fn logs() -> [Arc<Logs>; 2] {
    let scans = lap(&apartment().world, &LapConfig { scans: 5, ..LapConfig::default() });
    let recorded = Source2d::Recorded { name: "five scans".into(), scans };
    [Arc::new(Logs::default()), Arc::new(Logs { source_2d: recorded, ..Logs::default() })]
}

/// An answer is whole: its number, `ok` or `error`, and arrays inside of the message.
fn check(message: &str, answer: &Wire) {
    let id = serde_json::from_str::<Value>(message)
        .ok()
        .and_then(|m| m["id"].as_u64())
        .filter(|id| *id <= u32::MAX.into());
    let header: Value = match answer {
        Wire::Text(text) => serde_json::from_str(text).unwrap(),
        Wire::Binary(bytes) => {
            let end = 8 + u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
            let header: Value = serde_json::from_slice(&bytes[8..end]).unwrap();
            for array in header["arrays"].as_array().unwrap() {
                let size = match array["type"].as_str().unwrap() {
                    "f32" | "u32" => 4,
                    _ => 1,
                };
                let last = array["offset"].as_u64().unwrap() + size * array["length"].as_u64().unwrap();
                assert!(end as u64 + last <= bytes.len() as u64, "{header}");
            }
            header
        }
    };
    assert_eq!(header["id"].as_u64(), id, "{message}: {header}");
    let refused = header["error"].as_str().is_some_and(|e| !e.is_empty() && !e.contains('\n'));
    assert!(refused != header.get("ok").is_some(), "{message}: {header}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn every_message_is_answered(
        recorded in any::<bool>(),
        asked in prop::collection::vec((prop::sample::select(QUESTIONS), prop::option::weighted(0.7, change())), 1..16),
    ) {
        let limits = Limits { memory: 64 << 20 };
        let mut session = Session::new(&logs()[usize::from(recorded)], limits, &Clock::new(|| 0.0));
        for (question, change) in &asked {
            let message = change.as_ref().map_or_else(|| (*question).to_owned(), |c| changed(question, c));
            if takes_long(&message) {
                continue;
            }
            let answer = session.answer(&message);
            check(&message, &answer);
            prop_assert!(session.memory_bytes() <= limits.memory);
        }
        // And it still works.
        check(QUESTIONS[0], &session.answer(QUESTIONS[0]));
    }

    #[test]
    fn whatever_is_no_message_is_refused(text in "\\PC{0,200}") {
        let mut session = Session::new(&logs()[0], Limits::default(), &Clock::new(|| 0.0));
        check(&text, &session.answer(&text));
    }
}
