//! Answers held against the truth.

use portolan::geom::Grid;
use portolan::map::Tsdf2;
use portolan::surface::Contour;
use portolan_sim::{ErrorSummary, Truth};

use super::probes::points;
use crate::MapRepr;

/// Where answers are compared.
pub(super) struct Asker<'a> {
    pub(super) truth: Option<&'a dyn Truth<2>>,
    /// Points that were seen free.
    pub(super) free: Vec<[f64; 2]>,
    pub(super) everywhere: &'a [[f64; 2]],
    pub(super) grid: Grid<2>,
}

impl Asker<'_> {
    pub(super) fn occupancy_wrong(&self, map: &impl MapRepr<2>) -> Option<f64> {
        self.wrong(|p| map.occupancy(p))
    }

    /// Share of wrong answers among those given clearly on one side of a true surface.
    pub(super) fn wrong(&self, occupancy: impl Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
        let truth = self.truth?;
        let clear = 0.5 * self.grid.lattice.resolution;
        let (mut wrong, mut answered) = (0usize, 0usize);
        for &p in self.everywhere.iter().take(20_000) {
            let d = truth.signed_distance(p);
            if let Some(o) = occupancy(p).filter(|_| d.abs() > clear) {
                answered += 1;
                wrong += usize::from((o > 0.5) != (d < 0.0));
            }
        }
        (answered > 0).then(|| wrong as f64 / answered as f64)
    }

    pub(super) fn distance_error(&self, distance: impl Fn([f64; 2]) -> Option<f64>) -> Option<ErrorSummary> {
        let truth = self.truth?;
        let errors =
            self.free.iter().filter_map(|&p| Some(distance(p)?.abs() - truth.signed_distance(p).abs()));
        ErrorSummary::of(errors.collect())
    }

    /// Signed so that a surface in front of the true one is positive.
    pub(super) fn surface_error(&self, contour: &Contour) -> Option<ErrorSummary> {
        let truth = self.truth?;
        ErrorSummary::of(contour.vertices.iter().map(|&v| truth.signed_distance(v)).collect())
    }
}

/// Where free space is looked for: evenly in the box of a grid, a cell from its border.
pub(super) fn candidates(grid: &Grid<2>) -> Vec<[f64; 2]> {
    points(&grid.aabb().grown(-grid.lattice.resolution), 16_000)
}

/// Those of the candidates that were seen free, more than 5 cm from any surface.
pub(super) fn observed_free(
    tsdf: &Tsdf2,
    candidates: Vec<[f64; 2]>,
    min_weight: f32,
    truth: Option<&dyn Truth<2>>,
) -> Vec<[f64; 2]> {
    let free = |p: &[f64; 2]| {
        tsdf.grid()
            .index_of(*p)
            .and_then(|i| tsdf.store().at(i))
            .is_some_and(|c| c.weight >= min_weight && c.distance > 0.0)
    };
    candidates
        .into_iter()
        .filter(free)
        .filter(|&p| truth.is_none_or(|t| t.signed_distance(p) > 0.05))
        .take(4000)
        .collect()
}

/// Median gradient norm over probes around which the map was observed.
pub(super) fn gradient(tsdf: &Tsdf2, probes: &[[f64; 2]]) -> f64 {
    let h = tsdf.config().resolution;
    let value =
        |p: [f64; 2]| tsdf.grid().index_of(p).and_then(|i| tsdf.store().at(i)).map(|c| f64::from(c.distance));
    let slope = |p: [f64; 2], k: usize| {
        let (mut low, mut high) = (p, p);
        low[k] -= h;
        high[k] += h;
        Some((value(high)? - value(low)?) / (2.0 * h))
    };
    median(probes.iter().filter_map(|&p| Some(slope(p, 0)?.hypot(slope(p, 1)?))).collect())
}

/// NaN of nothing.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
