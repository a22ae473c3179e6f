//! Cells followed from re-observation to re-observation, and what those that share a fate have in common.

use portolan::cell::{FusionEvent, TsdfRule};
use serde::Serialize;

/// Cells that share a fate. As JSON what is not finite is `null`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct GhostGroup {
    /// Number of cells.
    pub cells: usize,
    /// Those that have lost half of their error when the run ends.
    pub halved: usize,
    /// Re-observations until half of the error was lost: the median over the cells, those that never do included as
    /// infinite. NaN without cells. Of cells that are saturated and only ever told +tau it follows from the gain alone.
    #[serde(rename = "half_life")]
    pub half_life_measured: f64,
    /// `ln 2 / ln(1 + max(w, 1) / W_max)` for the median weight of a full observation. NaN without cells.
    pub half_life_predicted: f64,
    /// The same for the gains that the cells really had: the median over the cells. What differs from the half-life above
    /// is what they were told. NaN without cells.
    pub half_life_of_gains: f64,
    /// Median weight that a re-observation carried. NaN without cells.
    pub weight: f64,
    /// Median number of re-observations of a cell in one lap. NaN without cells.
    pub observations_per_lap: f64,
    /// Median weight that the cells had when the chair moved. NaN without cells.
    pub weight_at_move: f64,
    /// `[re-observations, median of the error as a part of the error when the chair moved]`.
    pub curve: Vec<[f64; 2]>,
}

/// A followed cell.
#[derive(Clone, Debug)]
pub(crate) struct Followed {
    /// Distance of the new world (meters), clamped to the truncation.
    pub(crate) truth: f64,
    /// In the place where the chair comes to stand.
    pub(crate) appears: bool,
    pub(crate) distance_at_move: f64,
    pub(crate) weight_at_move: f64,
    pub(crate) events: Vec<FusionEvent>,
}

/// How a followed cell counts.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    Saturated,
    Unclamped,
    Tapered,
    /// Never seen again, or at the new place never behind a surface: left out.
    Silent,
}

impl Followed {
    /// What became of it, with the clamp of its map.
    pub(crate) fn fate(&self, w_max: f32) -> Fate {
        let behind = self.events.iter().any(|e| e.observation < 0.0);
        if self.events.is_empty() || (self.appears && !behind) {
            Fate::Silent
        } else if behind {
            Fate::Tapered
        } else if self.events[0].gain > (1.0 + 1e-6) * clamped_gain(&self.events[0], w_max) {
            Fate::Unclamped
        } else {
            Fate::Saturated
        }
    }

    /// Median weight of its re-observations.
    pub(crate) fn weight(&self) -> f64 {
        median(self.events.iter().map(|e| e.weight).collect())
    }

    /// Error after `n` re-observations as a part of the error when the chair moved.
    fn error(&self, n: usize) -> Option<f64> {
        let distance = if n == 0 { self.distance_at_move } else { self.events.get(n - 1)?.after };
        Some((distance - self.truth).abs() / (self.distance_at_move - self.truth).abs())
    }

    /// Re-observations until half of the error was lost, interpolated in the logarithm; infinite where never.
    fn half_life(&self) -> f64 {
        let mut last = 1.0;
        for n in 1..=self.events.len() {
            let Some(error) = self.error(n) else { break };
            if error <= 0.5 {
                let part = if error > 0.0 { libm::log(2.0 * last) / libm::log(last / error) } else { 1.0 };
                return (n - 1) as f64 + part;
            }
            last = error;
        }
        f64::INFINITY
    }

    /// Observations until the product of `1 - K` is one half: what the filter must do, whatever is observed.
    fn half_life_of_gains(&self) -> f64 {
        let mut kept = 1.0;
        for (n, e) in self.events.iter().enumerate() {
            let next = kept * (1.0 - e.gain);
            if next <= 0.5 {
                return n as f64 + libm::log(2.0 * kept) / libm::log(kept / next);
            }
            kept = next;
        }
        f64::INFINITY
    }
}

/// The gain that an observation has at the clamp.
fn clamped_gain(event: &FusionEvent, w_max: f32) -> f64 {
    let unit = event.weight.max(1.0);
    unit / (f64::from(w_max) + unit)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        _ => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

impl GhostGroup {
    /// What these cells have in common.
    pub(crate) fn of(cells: &[&Followed], rule: &TsdfRule, laps: f64) -> Self {
        let of = |f: &dyn Fn(&Followed) -> f64| median(cells.iter().map(|c| f(c)).collect());
        let full: Vec<f64> = cells
            .iter()
            .flat_map(|c| c.events.iter().filter(|e| e.observation >= 0.0).map(|e| e.weight))
            .collect();
        let longest = cells.iter().map(|c| c.events.len()).max().unwrap_or(0);
        // Only as far as at least half of the cells were followed.
        let curve = (0..=longest).map_while(|n| {
            let errors: Vec<f64> = cells.iter().filter_map(|c| c.error(n)).collect();
            (2 * errors.len() >= cells.len() && !errors.is_empty()).then(|| [n as f64, median(errors)])
        });
        let full = median(full);
        Self {
            cells: cells.len(),
            halved: cells.iter().filter(|c| c.half_life().is_finite()).count(),
            half_life_measured: of(&Followed::half_life),
            // Cells that never saw a full observation are compared with unit weight.
            half_life_predicted: match cells.len() {
                0 => f64::NAN,
                _ => rule.half_life(if full.is_nan() { 1.0 } else { full }),
            },
            half_life_of_gains: of(&Followed::half_life_of_gains),
            weight: median(cells.iter().flat_map(|c| c.events.iter().map(|e| e.weight)).collect()),
            observations_per_lap: of(&|c| c.events.len() as f64) / laps,
            weight_at_move: of(&|c| c.weight_at_move),
            curve: curve.collect(),
        }
    }
}
