//! The ghost of the chair: three maps that forget at different rates, and what forgetting costs them.

use crate::ghost::{Ghost, GhostSettings, ghost, static_noise};
use portolan::map::MapError;
use portolan_sim::LapConfig;
use serde_json::{Value, json};

/// What the maps remembered.
pub struct Forgetting {
    /// How it was done.
    pub settings: GhostSettings,
    /// What came of it.
    pub ghost: Ghost,
}

impl Forgetting {
    /// Does the experiment, with whole laps of its own. Ghost and noise share nothing, so each has a thread.
    ///
    /// # Errors
    /// Where a map cannot be made.
    pub fn run(seed: u64) -> Result<Self, MapError> {
        let lap = LapConfig { seed, ..Default::default() };
        let settings = GhostSettings { lap, ..Default::default() };
        let only_ghost = GhostSettings { noise_laps: 0, ..settings.clone() };
        let (told, noise) = std::thread::scope(|scope| {
            let noise = scope.spawn(|| static_noise(&settings, settings.noise_laps / 2, settings.noise_laps));
            (ghost(&only_ghost), noise.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        });
        let mut ghost = told?;
        ghost.per_w_max.iter_mut().zip(noise?).for_each(|(run, noise)| run.static_noise = Some(noise));
        Ok(Self { settings, ghost })
    }

    /// `ghost.json`; meters, and re-observations where nothing else is said.
    pub fn to_json(&self) -> Value {
        json!({
            "seed": self.settings.lap.seed,
            "scans_per_lap": self.settings.lap.scans,
            "resolution": self.settings.resolution,
            "truncation": self.settings.truncation,
            "prediction": "ln 2 / ln(1 + max(w, 1) / W_max)",
            "runs": self.ghost.per_w_max,
        })
    }

    /// The same for people.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for run in &self.ghost.per_w_max {
            let (left, m) = (&run.left, &run.saturated);
            let noise = run.static_noise.map_or(String::new(), |n| {
                format!("; static noise {:.2} mm, predicted {:.2}", 1e3 * n.measured, 1e3 * n.predicted)
            });
            lines.push(format!(
                "ghost at W_max {}: half of it gone after {} re-observations ({} cells), by the gain of saturated cells {}{noise}",
                run.w_max,
                shown(left.half_life_measured),
                left.cells,
                shown(m.half_life_predicted),
            ));
            let others = [("saturated", m), ("not yet clamped", &run.unclamped), ("tapered", &run.tapered)];
            let others: Vec<_> = others
                .into_iter()
                .filter(|(_, g)| g.cells > 0)
                .map(|(name, g)| format!("{name} {} ({} cells)", shown(g.half_life_measured), g.cells))
                .collect();
            if !others.is_empty() {
                lines.push(format!("  by kind of cell: {}", others.join(", ")));
            }
        }
        let restless = self.ghost.per_w_max.iter().filter(|r| r.laps_until_saturated.is_none());
        let restless: Vec<_> = restless.map(|r| r.w_max.to_string()).collect();
        if !restless.is_empty() {
            lines.push(format!(
                "  at W_max {} the chair was moved after {} laps, before all of its cells were saturated",
                restless.join(", "),
                self.settings.max_laps_before
            ));
        }
        lines
    }
}

/// A number of observations; what never halves is infinite, what has no cells is a dash.
pub fn shown(half_life: f64) -> String {
    match half_life {
        h if h.is_nan() => "–".to_owned(),
        h if h.is_infinite() => "never".to_owned(),
        h => format!("{h:.2}"),
    }
}
