//! One cell's filter, step by step.

use portolan::cell::FusionEvent;
use portolan::map::Tsdf2;
use portolan_sim::World;
use serde_json::{Value, json};

use super::scans::Move;

/// A cell and everything that scans did to it.
pub(super) struct Inspected {
    cell: [i32; 2],
    /// The scan that did it, and what it did.
    events: Vec<(usize, FusionEvent)>,
    /// Events that the page has.
    sent: std::cell::Cell<usize>,
}

impl Inspected {
    pub(super) fn new(cell: [i32; 2]) -> Self {
        Self { cell, events: Vec::new(), sent: 0.into() }
    }

    pub(super) fn cell(&self) -> [i32; 2] {
        self.cell
    }

    pub(super) fn forget_events(&mut self) {
        self.events.clear();
        self.sent.set(0);
    }

    pub(super) fn observe(&mut self, scan: usize, events: &[([i32; 2], FusionEvent)]) {
        let of_cell = events.iter().filter(|e| e.0 == self.cell);
        self.events.extend(of_cell.map(|e| (scan, e.1)));
    }

    /// What is new to the page; the page forgets what it has of event `from` and those after it.
    pub(super) fn news(&self, tsdf: &Tsdf2, moved: Option<&Move>) -> Value {
        self.to_json(self.sent.get().min(self.events.len()), tsdf, moved)
    }

    /// All of it.
    pub(super) fn all(&self, tsdf: &Tsdf2, moved: Option<&Move>) -> Value {
        self.to_json(0, tsdf, moved)
    }

    fn to_json(&self, from: usize, tsdf: &Tsdf2, moved: Option<&Move>) -> Value {
        self.sent.set(self.events.len());
        let state = tsdf.grid().index(self.cell).and_then(|i| tsdf.store().at(i));
        json!({
            "cell": self.cell,
            "center": tsdf.grid().lattice.center(self.cell),
            "distance": state.map(|s| s.distance),
            "weight": state.map(|s| s.weight),
            "from": from,
            "events": self.events[from..].iter().map(row).collect::<Vec<_>>(),
            "decay": self.decay(tsdf, moved),
        })
    }

    /// The closed form `D_n = m + (D_0 - m) lambda^n` with `lambda = W_max / (W_max + max(w, 1))`, from the observation before
    /// the chair was moved: `m` is the new truth, clamped, `w` the median weight of the observations since. `null` where
    /// the truth at this cell did not change, nothing was seen before or since, or nothing is forgotten.
    fn decay(&self, tsdf: &Tsdf2, moved: Option<&Move>) -> Value {
        let rule = tsdf.rule();
        let (Some(moved), true) = (moved, rule.w_max.is_finite()) else { return Value::Null };
        let since = self.events.partition_point(|e| e.0 < moved.scan);
        let after = &self.events[since..];
        // What was never seen before has nothing to forget.
        let Some((_, first)) = after.first().filter(|(_, e)| e.weight_before > 0.0) else {
            return Value::Null;
        };
        let mut weights: Vec<f64> = after.iter().map(|(_, e)| e.weight).collect();
        weights.sort_by(f64::total_cmp);
        let (w, w_max) = (weights[weights.len() / 2], f64::from(rule.w_max));
        let tau = f64::from(rule.truncation);
        let center = tsdf.grid().lattice.center(self.cell);
        let truth = |world: &World| world.signed_distance(center).clamp(-tau, tau);
        let target = truth(&moved.world);
        if truth(&moved.before) == target {
            return Value::Null;
        }
        let lambda = w_max / (w_max + w.max(1.0));
        let values: Vec<f64> =
            (0..=after.len()).map(|n| target + (first.before - target) * lambda.powi(n as i32)).collect();
        json!({ "since": since, "target": target, "weight": w, "lambda": lambda, "half_life": rule.half_life(w), "values": values })
    }
}

/// `[scan, D before, W before, d, K, D after, W after]`; `D before` is `null` where nothing was known.
pub(in crate::engine) fn row((scan, e): &(usize, FusionEvent)) -> Value {
    let before = (e.weight_before > 0.0).then_some(e.before);
    json!([scan, before, e.weight_before, e.observation, e.gain, e.after, e.weight_after])
}
