//! The fields of one map.

use portolan::field::{
    ClearanceField, Esdf, EsdfError, EsdfGrid, FieldSlots, Interpolation, ObstacleCells, UnknownSpace,
};
use portolan::geom::vector::norm;
use portolan::geom::{Aabb, Grid};
use portolan::map::Tsdf2;
use portolan::{Answer, Status};

use super::ask::Which;
use crate::engine::exports;

/// Distance and gradient.
pub(super) type Sample = (f64, [f64; 2]);

/// All fields, over the cells of the map.
pub(super) struct Fields {
    /// As `query` makes it, with distances to unknown cells.
    pub(super) euclidean: Esdf<2>,
    /// The same at the cells' centers.
    pub(super) dense: EsdfGrid<2>,
    /// What the filter keeps, read as if it were a distance field: bilinear between the centers of the same cells that the
    /// Euclidean field knows.
    truncated: EsdfGrid<2>,
    /// At the cells' centers, how far anything is at least, if unknown space is an obstacle; behind surfaces, the distance.
    pessimistic: EsdfGrid<2>,
    /// From here on (meters) the truncated field is a constant.
    pub(super) limit: f64,
}

impl Fields {
    pub(super) fn of(tsdf: &Tsdf2, cells: &ObstacleCells<2>) -> Result<Self, EsdfError> {
        let euclidean = exports::field(tsdf, cells, true);
        // A probe must not wait for bricks that were not read yet.
        euclidean.measure();
        let dense = euclidean.dense(tsdf.grid());
        let pessimistic = EsdfGrid::from_samples(*tsdf.grid(), certified(&euclidean, &dense))?;
        let planes = tsdf.store().planes();
        let least = tsdf.min_weight();
        let cells = planes.distances().iter().zip(planes.weights());
        let kept = cells.map(|(&d, &w)| if w > 0.0 && w >= least { d } else { f32::NAN });
        Ok(Self {
            euclidean,
            dense,
            pessimistic,
            truncated: EsdfGrid::from_samples(*tsdf.grid(), kept.collect())?,
            // As the map itself decides which cells are saturated.
            limit: f64::from(tsdf.rule().truncation) * (1.0 - 1e-4),
        })
    }

    pub(super) fn grid(&self) -> &Grid<2> {
        self.truncated.grid()
    }

    pub(super) fn bounds(&self) -> Aabb<2> {
        self.grid().aabb()
    }

    /// At the cells' centers, x fastest; NaN where nothing is known.
    pub(super) fn samples(&self, which: Which) -> &[f32] {
        match which {
            Which::Truncated => self.truncated.samples(),
            Which::Euclidean => self.dense.samples(),
            Which::Pessimistic => self.pessimistic.samples(),
        }
    }

    /// Centers of the cells that are obstacles without a surface: x, y pairs.
    pub(super) fn obstacles(&self) -> Vec<f32> {
        let lattice = self.euclidean.lattice();
        let centers = self.euclidean.point_obstacles().map(|(cell, _)| lattice.center(cell));
        centers.flatten().map(|v| v as f32).collect()
    }

    /// Whether a cell's sample is a distance, and not what a distance is at least.
    pub(super) fn is_known(&self, which: Which, i: usize) -> bool {
        match which {
            Which::Truncated => self.truncated.samples()[i].abs() < self.limit as f32,
            Which::Euclidean => self.dense.status(i) == Status::Known,
            Which::Pessimistic => self.pessimistic.status(i) == Status::Known,
        }
    }

    /// The truncated field at a point; saturated where it is a constant.
    pub(super) fn truncated(&self, p: [f64; 2]) -> Answer<Sample> {
        match self.truncated.distance_and_gradient(p) {
            Answer::Known(sample) if sample.0.abs() >= self.limit => Answer::Saturated(sample),
            answer => answer,
        }
    }

    /// Gradients of many points; `None` where a field has no answer.
    pub(super) fn gradients(&self, which: Which, points: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
        let n = points.len();
        let (mut distance, mut gradient) = (vec![0.0; n], vec![[0.0; 2]; n]);
        let mut status = vec![Status::Unknown; n];
        let out = FieldSlots { distance: &mut distance, gradient: &mut gradient, status: &mut status };
        match which {
            Which::Truncated => self.truncated.distances_and_gradients(points, Interpolation::Linear, out),
            Which::Pessimistic => {
                self.pessimistic.distances_and_gradients(points, Interpolation::Linear, out);
            }
            Which::Euclidean => self.euclidean.distances_and_gradients(points, Interpolation::Linear, out),
        }
        gradient.into_iter().zip(status).map(|(g, s)| s.has_value().then_some(g)).collect()
    }

    /// The length (meters) that all but the longest hundredth of the known distances stay within, the sign aside: what a
    /// ramp should show, though some beam saw far through a window. 0 where nothing is known.
    pub(super) fn usual_length(&self) -> f32 {
        let known =
            self.dense.samples().iter().enumerate().filter(|(i, _)| self.dense.status(*i) == Status::Known);
        let mut lengths: Vec<f32> = known.map(|(_, d)| d.abs()).collect();
        let at = lengths.len() * 99 / 100;
        if lengths.is_empty() { 0.0 } else { *lengths.select_nth_unstable_by(at, f32::total_cmp).1 }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let cells = self.grid().len();
        // Samples of all, and a status.
        self.euclidean.memory_bytes() + 13 * cells
    }
}

/// What is certified at the centers of cells where unknown space is an obstacle; NaN where nothing is known.
fn certified(field: &Esdf<2>, dense: &EsdfGrid<2>) -> Vec<f32> {
    let grid = dense.grid();
    let at = |(i, &distance): (usize, &f32)| {
        if distance.is_nan() || distance <= 0.0 {
            return distance;
        }
        let center = grid.lattice.center(grid.cell(i));
        let clearance = field.clearance(center, UnknownSpace::Pessimistic).value();
        clearance.map_or(0.0, |c| c.lower as f32).min(distance)
    };
    dense.samples().iter().enumerate().map(at).collect()
}

/// Length of a gradient, where there is one.
pub(super) fn length(gradient: Option<[f64; 2]>) -> Option<f64> {
    gradient.map(norm)
}
