//! The ghost of the chair: how fast the map forgets it, beside how fast it should.

use portolan::cell::FusionEvent;
use portolan::geom::Aabb;
use portolan::map::Tsdf2;
use portolan_chapter::ghost::{GhostGroup, GhostWatch};
use serde_json::{Value, json};

use super::scans::Move;

/// A moved chair that the map remembers.
pub(super) struct Ghost {
    since: usize,
    old: Aabb<2>,
    watch: GhostWatch,
}

impl Ghost {
    pub(super) fn new(tsdf: &Tsdf2, moved: &Move) -> Self {
        Self {
            since: moved.scan,
            old: moved.places[0],
            watch: GhostWatch::new(tsdf, &moved.world, moved.places),
        }
    }

    pub(super) fn cells(&self) -> impl Iterator<Item = [i32; 2]> + '_ {
        self.watch.cells()
    }

    pub(super) fn observe(&mut self, events: &[([i32; 2], FusionEvent)]) {
        self.watch.observe(events);
    }

    /// How soon half of it is gone, over all cells left and by kind of cell, after `at` scans.
    pub(super) fn to_json(&self, tsdf: &Tsdf2, at: usize, lap: usize) -> Value {
        let laps = (at - self.since.min(at)) as f64 / lap.max(1) as f64;
        let [saturated, unclamped, tapered] = self.watch.groups(tsdf.rule(), laps);
        json!({
            "since": self.since,
            "old": { "min": self.old.min, "max": self.old.max },
            "laps": laps,
            "cells": self.watch.cells().count(),
            "left": group(&self.watch.left(tsdf.rule(), laps)),
            "saturated": group(&saturated),
            "unclamped": group(&unclamped),
            "tapered": group(&tapered),
        })
    }
}

/// The share of the error that is left after `n` observations, by the gain alone.
fn predicted(n: f64, half_life: f64) -> f64 {
    0.5f64.powf(n / half_life)
}

/// What is not finite becomes `null`: half of the cells have not halved their error yet.
fn group(g: &GhostGroup) -> Value {
    json!({
        "cells": g.cells,
        "halved": g.halved,
        "half_life_measured": g.half_life_measured,
        "half_life_predicted": g.half_life_predicted,
        "observations_per_lap": g.observations_per_lap,
        "curve": g.curve.iter().map(|[n, left]| [*n, *left, predicted(*n, g.half_life_predicted)]).collect::<Vec<_>>(),
    })
}
