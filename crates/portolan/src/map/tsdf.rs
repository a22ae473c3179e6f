//! Truncated signed distance fields.

use super::error::check_grid;
use super::integrate::integrate;
use super::{Abilities, MapError, MapRepr};
use crate::answer::Answer;
use crate::cell::{
    Cell, DistanceObservation, Distances, Evidence, FusionEvent, Planes, SignedDistance, TsdfRule,
};
use crate::geom::{Aabb, Grid, Pose, block_cells};
use crate::scan::{Scan, ScanStats};
use crate::store::{Dense, Store};
use crate::sweep::{CellCentre, March, WeightModel};

/// How a scan becomes observations of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SweepKind {
    /// At cell centres, with the range interpolated between neighbouring beams.
    #[default]
    CellCentre,
    /// The textbook's march along every beam; puts surfaces about a quarter of a cell too far away.
    March,
}

/// Settings of a [`Tsdf`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TsdfConfig<const D: usize> {
    /// Number of cells along each axis.
    pub cells: [usize; D],
    /// Edge of a cell (metres).
    pub resolution: f64,
    /// World position of the lower corner of the first cell (metres).
    pub origin: [f64; D],
    /// Truncation tau (metres): two to four cells, and less than half of the thinnest wall that is seen from
    /// both sides.
    pub truncation: f64,
    /// Clamp of the weight. Infinity: never forget.
    pub w_max: f32,
    /// How scans become observations.
    pub sweep: SweepKind,
    /// How much each beam is trusted.
    pub weights: WeightModel,
}

impl<const D: usize> Default for TsdfConfig<D> {
    /// The chapter's parameters (r 5 cm, tau 15 cm, W_max 64) and no cells.
    fn default() -> Self {
        Self {
            cells: [0; D],
            resolution: 0.05,
            origin: [0.0; D],
            truncation: 0.15,
            w_max: 64.0,
            sweep: SweepKind::default(),
            weights: WeightModel::default(),
        }
    }
}

impl<const D: usize> TsdfConfig<D> {
    /// These settings for the cells of a grid.
    pub fn with_grid(self, grid: &Grid<D>) -> Self {
        Self { cells: grid.shape, resolution: grid.lattice.resolution, origin: grid.lattice.origin, ..self }
    }

    /// The box of cells.
    pub fn grid(&self) -> Grid<D> {
        Grid::new(self.origin, self.resolution, self.cells)
    }
}

/// A truncated signed distance field: per cell a scalar information filter of the signed distance to the
/// nearest surface (Curless & Levoy 1996), in two `f32` planes.
///
/// Its values are projective (measured along beams) and kept only within the truncation: it answers *where is
/// the surface*, not *how far is it*; the ESDF derived from it does that.
#[derive(Clone, Debug)]
pub struct Tsdf<const D: usize> {
    store: Dense<SignedDistance, D>,
    config: TsdfConfig<D>,
    rule: TsdfRule,
    bounds: Aabb<D>,
    carving: CellCentreOrMarch<D>,
    banded: CellCentreOrMarch<D>,
    scratch: Distances,
}

#[derive(Clone, Debug)]
enum CellCentreOrMarch<const D: usize> {
    CellCentre(Box<CellCentre<D>>),
    March(Box<March<D>>),
}

impl<const D: usize> CellCentreOrMarch<D> {
    fn new(config: &TsdfConfig<D>, carve: bool) -> Self {
        match config.sweep {
            SweepKind::CellCentre => {
                Self::CellCentre(Box::new(CellCentre::new(config.truncation, carve, config.weights)))
            }
            SweepKind::March => Self::March(Box::new(March::new(config.truncation, carve, config.weights))),
        }
    }
}

impl<const D: usize> Tsdf<D> {
    /// A field in which nothing was observed.
    ///
    /// # Errors
    /// Where the grid or the filter's settings are not possible.
    pub fn new(config: TsdfConfig<D>) -> Result<Self, MapError> {
        check_grid(&config.grid())?;
        Self::from_store(Dense::new(config.grid()), config)
    }

    /// A field of stored cells; the grid of `config` is taken from the store.
    ///
    /// # Errors
    /// Where the grid or the filter's settings are not possible.
    pub fn from_store(store: Dense<SignedDistance, D>, config: TsdfConfig<D>) -> Result<Self, MapError> {
        check_grid(store.grid())?;
        let config = config.with_grid(store.grid());
        let rule = TsdfRule { truncation: config.truncation as f32, w_max: config.w_max };
        rule.validate()?;
        Ok(Self {
            bounds: store.grid().aabb(),
            carving: CellCentreOrMarch::new(&config, true),
            banded: CellCentreOrMarch::new(&config, false),
            scratch: Distances::silent(block_cells::<D>()),
            store,
            config,
            rule,
        })
    }

    /// One step of one cell's filter, as if a scan had observed it: `d` metres with weight `w`. Cells outside
    /// of the map compute the step from nothing and keep nothing.
    pub fn fuse(&mut self, cell: [i32; D], d: f64, w: f64) -> FusionEvent {
        let index = self.store.grid().index(cell);
        let prior = index.and_then(|i| self.store.at(i));
        let state = prior.unwrap_or(SignedDistance { distance: 0.0, weight: 0.0 });
        let event = self.rule.step(state.distance.into(), state.weight.into(), d, w);
        if let Some(i) = index {
            let after = SignedDistance { distance: event.after as f32, weight: event.weight_after as f32 };
            self.store.planes_mut().set(i, Some(after));
        }
        event
    }

    /// Fuses a scan taken at a known pose. With `carve` the free space up to the surfaces is fused too: that
    /// costs several times as much and buys the difference between free and unknown.
    pub fn integrate(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>, carve: bool) -> ScanStats {
        let sweep = if carve { &mut self.carving } else { &mut self.banded };
        let (store, scratch, at) = (&mut self.store, &mut self.scratch, (world_from_sensor, scan));
        match sweep {
            CellCentreOrMarch::CellCentre(s) => {
                integrate::<SignedDistance, _, _, D>(store, &mut **s, scratch, &self.rule, &self.bounds, at)
            }
            CellCentreOrMarch::March(s) => {
                integrate::<SignedDistance, _, _, D>(store, &mut **s, scratch, &self.rule, &self.bounds, at)
            }
        }
    }

    /// What the filter of a cell would do with an observation, without doing it; for inspectors.
    pub fn preview(&self, cell: [i32; D], observation: DistanceObservation) -> FusionEvent {
        SignedDistance::fuse(self.store.cell(cell), observation, &self.rule).1
    }

    /// The estimate of the cell that holds a point; saturated at the truncation, where the field is a constant.
    /// Projective, not Euclidean.
    pub fn signed_distance(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        let Some(i) = self.store.grid().index_of(p_world.into()) else { return Answer::Outside };
        let Some(cell) = self.store.at(i) else { return Answer::Unknown };
        let limit = self.rule.truncation * (1.0 - 1e-4);
        if cell.distance.abs() < limit {
            Answer::Known(cell.distance.into())
        } else {
            Answer::Saturated(cell.distance.into())
        }
    }

    /// Cells and where they are.
    pub fn store(&self) -> &Dense<SignedDistance, D> {
        &self.store
    }

    /// The settings.
    pub fn config(&self) -> &TsdfConfig<D> {
        &self.config
    }

    /// The filter.
    pub fn rule(&self) -> &TsdfRule {
        &self.rule
    }

    /// Number of cells with a weight of at least `min_weight` (and above 0).
    pub fn observed_cells(&self, min_weight: f32) -> usize {
        self.store.planes().weights().iter().filter(|&&w| w > 0.0 && w >= min_weight).count()
    }

    /// Shape and place.
    pub fn grid(&self) -> &Grid<D> {
        self.store.grid()
    }
}

impl<const D: usize> MapRepr<D> for Tsdf<D> {
    /// With carving.
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> ScanStats {
        self.integrate(world_from_sensor, scan, true)
    }

    /// The sign of the estimate: 1 behind the surface, 0 in front of it.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        let i = self.store.grid().index_of(p_world)?;
        self.store.at(i).map(|c| if c.distance < 0.0 { 1.0 } else { 0.0 })
    }

    fn distance(&self, _: [f64; D]) -> Option<f64> {
        None
    }

    fn memory_bytes(&self) -> usize {
        self.store.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        Abilities { occupancy: true, distance: false }
    }
}
