//! The cells of a map that a moved thing concerns, watched from scan to scan.

use super::followed::{Fate, Followed, GhostGroup};
use super::run::{cells_in, old_place, state};
use portolan::cell::{FusionEvent, TsdfRule};
use portolan::geom::Aabb;
use portolan::map::Tsdf2;
use portolan_sim::World;

/// Cells where a thing stood and where it stands now, and what scans did to them since it moved.
#[derive(Clone, Debug)]
pub struct GhostWatch {
    w_max: f32,
    /// Ascending.
    cells: Vec<([i32; 2], Followed)>,
}

impl GhostWatch {
    /// Chooses the cells at the moment of the move: those of the old place that the map takes for the thing, and
    /// those of the new place that it has seen. `after` is the world after the move, `places` are where the thing was
    /// and is.
    pub fn new(tsdf: &Tsdf2, after: &World, [old, new]: [Aabb<2>; 2]) -> Self {
        let tau = tsdf.config().truncation;
        let mut chosen: Vec<_> = old_place(tsdf, old).into_iter().map(|c| (c, false)).collect();
        // At the new place all that was free and comes to lie in the thing.
        chosen.extend(cells_in(tsdf, new).map(|c| (c, true)));
        chosen.sort_unstable();
        // A cell of both places is one that the thing has left.
        chosen.dedup_by_key(|c| c.0);
        let mut cells = Vec::new();
        for (cell, appears) in chosen {
            let Some(state) = state(tsdf, cell) else { continue };
            let truth = after.signed_distance(tsdf.grid().lattice.center(cell)).clamp(-tau, tau);
            let (distance_at_move, weight_at_move) = (state.distance.into(), state.weight.into());
            cells.push((
                cell,
                Followed { truth, appears, distance_at_move, weight_at_move, events: Vec::new() },
            ));
        }
        Self { w_max: tsdf.config().w_max, cells }
    }

    /// The cells, ascending: what [`Tsdf::watch`](portolan::map::Tsdf::watch) wants.
    pub fn cells(&self) -> impl Iterator<Item = [i32; 2]> + '_ {
        self.cells.iter().map(|c| c.0)
    }

    /// Takes in what a scan did; events of other cells are passed over.
    pub fn observe(&mut self, events: &[([i32; 2], FusionEvent)]) {
        for (cell, event) in events {
            if let Ok(i) = self.cells.binary_search_by_key(cell, |c| c.0) {
                self.cells[i].1.events.push(*event);
            }
        }
    }

    /// What the cells have in common: those for which the prediction should hold (saturated when the thing moved, and
    /// only ever seen as free since), those that had not reached the clamp, and those of which some re-observation lay
    /// behind a surface. `laps` have gone by since the move.
    pub fn groups(&self, rule: &TsdfRule, laps: f64) -> [GhostGroup; 3] {
        [Fate::Saturated, Fate::Unclamped, Fate::Tapered].map(|fate| {
            let cells = self.cells.iter().map(|c| &c.1).filter(|c| c.fate(self.w_max) == fate);
            GhostGroup::of(&cells.collect::<Vec<_>>(), rule, laps)
        })
    }

    /// All cells of the old place that were seen again since the thing moved, whatever their weight was and whatever they
    /// were told.
    pub fn left(&self, rule: &TsdfRule, laps: f64) -> GhostGroup {
        let cells = self.cells.iter().map(|c| &c.1);
        let left = cells.filter(|c| !c.appears && c.fate(self.w_max) != Fate::Silent);
        GhostGroup::of(&left.collect::<Vec<_>>(), rule, laps)
    }

    /// Whether there are cells for which the prediction should hold, and all were seen for `half_lives` of it.
    pub(crate) fn is_measured(&self, rule: &TsdfRule, half_lives: f64) -> bool {
        let mut measured = self.cells.iter().filter(|c| c.1.fate(self.w_max) == Fate::Saturated).peekable();
        // Without a cell that is seen again the run goes on to its last lap.
        measured.peek().is_some()
            && measured.all(|(_, c)| c.events.len() as f64 >= half_lives * rule.half_life(c.weight()))
    }
}
