//! The view as the page asks it.

use std::sync::Arc;

use portolan_chapter::radiance::{
    AMBIGUOUS, Channels, Experiment, Fit, NAMED_SEEDS, OPAQUE, PARKED, Scene, Settings, TWO_NOT_ENOUGH,
    transmittance,
};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::engine::{Clock, Limits, Logs, Session, Wire};

fn session() -> Session {
    Session::new(&Arc::new(Logs::default()), Limits::default(), &Clock::new(|| 0.0))
}

fn raw(session: &mut Session, ask: &Value) -> Wire {
    session.answer(&json!({ "id": 1, "view": "radiance", "ask": ask }).to_string())
}

/// An answer, taken apart again.
struct Told {
    body: Value,
    arrays: Value,
    bytes: Vec<u8>,
}

impl Told {
    fn array(&self, name: &str) -> Vec<f32> {
        let entry = self.arrays.as_array().unwrap().iter().find(|a| a["name"] == name).unwrap();
        let [at, n] = ["offset", "length"].map(|k| entry[k].as_u64().unwrap() as usize);
        let values = self.bytes[at..at + 4 * n].chunks(4);
        values.map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }
}

fn ask(session: &mut Session, ask: &Value) -> Told {
    let Wire::Binary(bytes) = raw(session, ask) else { panic!("no arrays: {ask}") };
    let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let header: Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
    let [body, arrays] = ["ok", "arrays"].map(|k| header[k].clone());
    Told { body, arrays, bytes: bytes[8 + length..].to_vec() }
}

fn refusal(session: &mut Session, ask: &Value) -> String {
    match raw(session, ask) {
        Wire::Text(text) => {
            let answer: Value = serde_json::from_str(&text).unwrap();
            answer["error"].as_str().unwrap_or_else(|| panic!("{ask} was answered: {text}")).to_owned()
        }
        Wire::Binary(_) => panic!("{ask} was answered"),
    }
}

fn start(seed: u64, channels: &str) -> Value {
    json!({ "op": "start", "seed": seed, "channels": channels, "optimizer": "descent" })
}

/// JSON numbers as they were before they were written: the reader of tests may be a unit in the last place off.
fn close(a: &Value, b: f64) -> bool {
    (a.as_f64().unwrap() - b).abs() <= 1e-15 * b.abs()
}

#[test]
fn the_page_sees_what_the_library_computes() {
    let mut session = session();
    let body = ask(&mut session, &json!({ "op": "open" })).body;
    assert_eq!((&body["seed"], &body["step"]), (&json!(PARKED.seed), &json!(0)));
    assert_eq!(body["all"]["rays"].as_array().unwrap().len(), 10);
    assert_eq!(body["all"]["named"].as_array().unwrap().len(), NAMED_SEEDS.len());

    ask(&mut session, &start(AMBIGUOUS.seed, "spread"));
    ask(&mut session, &json!({ "op": "look", "ray": 8, "bin": 30 }));
    let sent = ask(&mut session, &json!({ "op": "step", "steps": 120 }));
    let body = &sent.body;
    let experiment = Experiment { steps: 120, ..Experiment::default() };
    let outcome = experiment.run(AMBIGUOUS.seed, Channels::DepthReflectanceSpread).unwrap();
    let (line, last) = (outcome.fit.line(), outcome.last());
    let f32s = |v: &[f64]| v.iter().map(|x| *x as f32).collect::<Vec<_>>();
    assert_eq!(sent.array("density"), f32s(&line.density));
    assert_eq!(sent.array("reflectance"), f32s(&line.reflectance));
    assert_eq!(sent.array("gradient"), f32s(&outcome.fit.clone().gradient()[..80]));
    assert!(close(&body["objective"], last.objective));
    assert!(close(&body["training"]["depth"], last.training.depth));
    assert!(close(&body["held_out"]["depth"], last.held_out.depth));
    assert!(close(&body["misplaced"], outcome.misplaced(&experiment.scene, 0.3)));
    // Ray 8 is the second of those held out.
    let ray = outcome.held_out[1].ray;
    assert_eq!(sent.array("light"), f32s(&transmittance(line, &ray)));
    assert_eq!(sent.array("light").len(), sent.array("light_at").len());
    let all: f32 = sent.array("ends").iter().sum::<f32>() + sent.array("light").last().unwrap();
    assert!((all - 1.0).abs() < 1e-5, "all light ends somewhere, {all}");
    assert!(close(&body["rays"][8]["depth"], outcome.fit.render(&ray).depth));
    assert_eq!(sent.array("curve").len(), 8 * 120);
}

/// For every bin, step and set of channels: the terms that the page shows are factors of their pull, the pulls add up,
/// and what they add up to is the optimiser's own gradient.
#[test]
fn terms_add_up_to_the_gradient() {
    for (seed, channels, steps) in
        [(PARKED.seed, "depth", 0), (PARKED.seed, "reflectance", 40), (TWO_NOT_ENOUGH.seed, "spread", 300)]
    {
        let mut session = session();
        let body = ask(&mut session, &start(seed, channels)).body;
        let noise = body["all"]["noise"].clone();
        if steps > 0 {
            ask(&mut session, &json!({ "op": "step", "steps": steps }));
        }
        for bin in 0..80 {
            let body = ask(&mut session, &json!({ "op": "look", "bin": bin })).body;
            let sent = &body["bin"];
            let number = |v: &Value| v.as_f64().unwrap();
            let (mut sum, mut gross) = (0.0, 0.0);
            for t in sent["terms"].as_array().unwrap() {
                for (i, channel) in ["depth", "reflectance", "second_moment"].into_iter().enumerate() {
                    let measured = i == 0 || channels == "spread" || (i == 1 && channels == "reflectance");
                    let term = &t[channel];
                    let [residual, slope, pull] = ["residual", "slope", "pull"].map(|k| number(&term[k]));
                    let product = if measured { residual * slope / number(&noise[channel]) } else { 0.0 };
                    assert!((product - pull).abs() <= 1e-12 * pull.abs(), "bin {bin}: {term}");
                    sum += pull;
                    gross += pull.abs();
                }
            }
            let [pulls, chain, prior, gradient] =
                ["pulls", "chain", "prior", "gradient"].map(|k| number(&sent[k]));
            // Pulls may cancel: their sum is as precise as the largest of them.
            assert!((sum - pulls).abs() <= 1e-12 * gross, "bin {bin}: {sum} {pulls}");
            let tolerance = 1e-12 * (gross * chain + prior.abs());
            assert!((pulls * chain + prior - gradient).abs() <= tolerance, "bin {bin}: {sent}");
            assert!((number(&sent["sum"]) - gradient).abs() <= tolerance, "bin {bin}: {sent}");
        }
    }
}

/// The lesson of the text, through the session: what depth alone keeps parked leaves when reflectance arrives.
#[test]
fn parked_matter_leaves_when_reflectance_arrives() {
    let mut session = session();
    ask(&mut session, &start(PARKED.seed, "depth"));
    let mut last = Value::Null;
    let mut go = |session: &mut Session, thousands: usize| {
        for _ in 0..thousands {
            last = ask(session, &json!({ "op": "step", "steps": 1000 })).body;
        }
        last["misplaced"].as_f64().unwrap()
    };
    let parked = go(&mut session, 6);
    ask(&mut session, &json!({ "op": "go_on", "channels": "reflectance", "optimizer": "descent" }));
    let cleared = go(&mut session, 6);
    assert!(parked > 0.5 && cleared < 0.5 * parked, "{parked} {cleared}");
}

/// The words below the terms are those of the named seeds.
#[test]
fn words_say_what_the_terms_show() {
    for (named, says) in [(PARKED, "cancel"), (OPAQUE, "Next to no light passes")] {
        let mut session = session();
        ask(&mut session, &start(named.seed, "depth"));
        let mut worst = Value::Null;
        for _ in 0..10 {
            worst = ask(&mut session, &json!({ "op": "step", "steps": 2000 })).body["worst"].clone();
        }
        let body = ask(&mut session, &json!({ "op": "look", "bin": worst })).body;
        assert!(body["bin"]["hint"].as_str().unwrap().contains(says), "{}: {}", named.name, body["bin"]);
        assert_eq!(body["bin"]["by_reflectance"], 0.0, "depth alone does not move reflectance");
    }
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut session = session();
    ask(&mut session, &start(5, "depth"));
    let before = ask(&mut session, &json!({ "op": "step", "steps": 10 })).body;
    for (bad, says) in [
        (json!({ "op": "step", "steps": 0 }), "0 steps at once; 1 to 2000 are possible"),
        (json!({ "op": "step", "steps": 2001 }), "1 to 2000"),
        (json!({ "op": "step", "steps": 1_000_000_000 }), "1 to 2000"),
        (json!({ "op": "step", "steps": 1e9 }), "not a message"),
        (json!({ "op": "step", "steps": -1 }), "not a message"),
        (json!({ "op": "step", "steps": null }), "not a message"),
        (json!({ "op": "step", "steps": "NaN" }), "not a message"),
        (json!({ "op": "step" }), "not a message"),
        (json!({ "op": "step", "steps": 1, "also": 2 }), "not a message"),
        (json!({ "op": "look", "bin": 80 }), "there is no bin 80; they are 0 to 79"),
        (json!({ "op": "look", "bin": u64::MAX }), "there is no bin"),
        (json!({ "op": "look", "bin": -1 }), "not a message"),
        (json!({ "op": "look", "ray": 10 }), "there is no ray 10; they are 0 to 9"),
        (start(1 << 53, "depth"), "too large"),
        (start(1, "colour"), "not a message"),
        (json!({ "op": "start", "seed": 0.5, "channels": "depth", "optimizer": "adam" }), "not a message"),
        (json!({ "op": "go_on", "channels": "depth", "optimizer": "newton" }), "not a message"),
        (json!({ "op": "destroy" }), "not a message"),
        (json!(null), "not a message"),
    ] {
        let said = refusal(&mut session, &bad);
        assert!(said.contains(says), "{bad}: {said}");
    }
    // NaN is no JSON at all.
    let nan = r#"{"id":1,"view":"radiance","ask":{"op":"step","steps":NaN}}"#;
    assert!(matches!(session.answer(nan), Wire::Text(text) if text.contains("error")));
    let after = ask(&mut session, &json!({ "op": "look" })).body;
    for field in ["step", "objective", "phases", "look", "rays"] {
        assert_eq!(after[field], before[field], "{field}");
    }
}

#[test]
fn a_run_takes_little_memory_and_is_given_up() {
    let mut session = session();
    ask(&mut session, &start(5, "depth"));
    for _ in 0..3 {
        ask(&mut session, &json!({ "op": "step", "steps": 2000 }));
    }
    let held = session.memory_bytes();
    assert!(held > 0 && held < 300_000, "{held}");
    let small = Limits { memory: 1000 };
    let mut session = Session::new(&Arc::new(Logs::default()), small, &Clock::new(|| 0.0));
    assert!(refusal(&mut session, &start(5, "depth")).contains("given up"));
    assert_eq!(session.memory_bytes(), 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Any seed, from the page or from an enemy, gives a start, and steps of any kind leave numbers or `null`s.
    #[test]
    fn any_seed_can_be_run(seed in 0_u64..1 << 53, way in 0..6_usize, steps in 1..40_usize, bin in 0..80_usize) {
        let mut session = session();
        let channels = ["depth", "reflectance", "spread"][way % 3];
        let optimizer = ["descent", "adam"][way / 3];
        ask(&mut session, &json!({ "op": "start", "seed": seed, "channels": channels, "optimizer": optimizer }));
        ask(&mut session, &json!({ "op": "look", "bin": bin, "ray": bin % 10 }));
        let sent = ask(&mut session, &json!({ "op": "step", "steps": steps }));
    let body = &sent.body;
        prop_assert_eq!(body["step"].as_u64(), Some(steps as u64));
        prop_assert!(sent.array("opacity").iter().all(|a| (0.0..=1.0).contains(a)));
    }
}

/// The start that the page draws is the library's.
#[test]
fn seeds_are_those_of_the_library() {
    let mut session = session();
    for named in NAMED_SEEDS {
        let sent = ask(&mut session, &start(named.seed, "depth"));
        let scene = Scene::corridor();
        let (training, _) = scene.measure(&Settings::default().noise, named.seed);
        let fit = Fit::new(scene.random_start(named.seed), &training, Settings::default()).unwrap();
        let expected: Vec<f32> = fit.line().density.iter().map(|d| *d as f32).collect();
        assert_eq!(sent.array("density"), expected, "{}", named.name);
    }
}
