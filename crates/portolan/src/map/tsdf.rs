//! Truncated signed distance fields.

use super::MapError;
use super::error::check_grid;
use super::integrate::integrate_watched;
use crate::answer::Answer;
use crate::cell::{Cell, Distances, Evidence, FusionEvent, Planes, SignedDistance, TsdfRule};
use crate::geom::{Aabb, BlockKey, Grid, Pose, block_cells};
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
    /// Weight of an observation of free space beyond the truncation, times the beam's. The textbook's is 1. With
    /// less, what was seen of a surface counts for more than that beams passed near it: thin things survive, and
    /// what has gone fades more slowly, by the same factor.
    pub carve_weight: f32,
    /// How scans become observations.
    pub sweep: SweepKind,
    /// How much each beam is trusted.
    pub weights: WeightModel,
}

impl<const D: usize> Default for TsdfConfig<D> {
    /// The textbook's parameters (r 5 cm, tau 15 cm, W_max 64) and no cells.
    fn default() -> Self {
        Self {
            cells: [0; D],
            resolution: 0.05,
            origin: [0.0; D],
            truncation: 0.15,
            w_max: 64.0,
            carve_weight: 1.0,
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
    watched: Watched<D>,
}

/// Cells whose events are kept: block, cell in the block, and which cell that is, ascending.
#[derive(Clone, Debug, Default)]
struct Watched<const D: usize> {
    places: Vec<(BlockKey<D>, usize, [i32; D])>,
    events: Vec<([i32; D], FusionEvent)>,
}

impl<const D: usize> Watched<D> {
    /// The events of the watched cells of a block, from the evidence that is about to be fused.
    fn look(
        &mut self,
        key: BlockKey<D>,
        store: &Dense<SignedDistance, D>,
        evidence: &Distances,
        rule: &TsdfRule,
    ) {
        let first = self.places.partition_point(|p| p.0 < key);
        for &(_, i, cell) in self.places[first..].iter().take_while(|p| p.0 == key) {
            if let Some(observation) = evidence.one(i) {
                self.events.push((cell, SignedDistance::fuse(store.cell(cell), observation, rule).1));
            }
        }
    }
}

#[derive(Clone, Debug)]
enum CellCentreOrMarch<const D: usize> {
    CellCentre(Box<CellCentre<D>>),
    March(Box<March<D>>),
}

impl<const D: usize> CellCentreOrMarch<D> {
    fn new(config: &TsdfConfig<D>, carve_weight: f32) -> Self {
        match config.sweep {
            SweepKind::CellCentre => {
                Self::CellCentre(Box::new(CellCentre::new(config.truncation, carve_weight, config.weights)))
            }
            SweepKind::March => {
                Self::March(Box::new(March::new(config.truncation, carve_weight, config.weights)))
            }
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
        if !(config.carve_weight > 0.0 && config.carve_weight <= 1.0) {
            return Err(MapError::CarveWeight(config.carve_weight));
        }
        Ok(Self {
            bounds: store.grid().aabb(),
            carving: CellCentreOrMarch::new(&config, config.carve_weight),
            banded: CellCentreOrMarch::new(&config, 0.0),
            scratch: Distances::silent(block_cells::<D>()),
            watched: Watched { places: Vec::new(), events: Vec::new() },
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
        let (rule, bounds, watched) = (&self.rule, &self.bounds, &mut self.watched);
        watched.events.clear();
        let look = |key, store: &Dense<SignedDistance, D>, evidence: &Distances| {
            if !watched.places.is_empty() {
                watched.look(key, store, evidence, rule);
            }
        };
        match sweep {
            CellCentreOrMarch::CellCentre(s) => {
                integrate_watched::<SignedDistance, _, _, D>(store, &mut **s, scratch, rule, bounds, at, look)
            }
            CellCentreOrMarch::March(s) => {
                integrate_watched::<SignedDistance, _, _, D>(store, &mut **s, scratch, rule, bounds, at, look)
            }
        }
    }

    /// Watches these cells from now on, and no others: every scan leaves what it did to them in
    /// [`Tsdf::events`]. Cells outside of the map are left out. What is not watched pays nothing.
    pub fn watch(&mut self, cells: impl IntoIterator<Item = [i32; D]>) {
        let inside = cells.into_iter().filter(|&c| self.store.grid().index(c).is_some());
        self.watched.places =
            inside.map(|cell| (BlockKey::of_cell(cell), BlockKey::offset(cell), cell)).collect();
        self.watched.places.sort_unstable();
        self.watched.places.dedup();
        self.watched.events.clear();
    }

    /// What the last scan that was integrated did to the watched cells that it observed: computed by
    /// [`Cell::fuse`] from the same evidence, so that it is what happened. In the order of blocks.
    pub fn events(&self) -> &[([i32; D], FusionEvent)] {
        &self.watched.events
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

    /// 1 behind the surface, 0 in front of it: the sign of the estimate. `None`: never observed, or outside.
    pub fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        let i = self.store.grid().index_of(p_world)?;
        self.store.at(i).map(|c| if c.distance < 0.0 { 1.0 } else { 0.0 })
    }

    /// Bytes of the cells, measured.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::RangeLimits;

    fn events_are_what_happened(sweep: SweepKind) {
        let config =
            TsdfConfig { cells: [60, 60], origin: [-1.5, -1.5], w_max: 3.0, sweep, ..Default::default() };
        let mut tsdf = Tsdf::<2>::new(config).unwrap();
        let mut unwatched = tsdf.clone();
        let cells = (0..60).flat_map(|x| (0..60).map(move |y| [x, y])).filter(|c| (c[0] * 7 + c[1]) % 3 == 0);
        tsdf.watch(cells.clone().chain([[-1, 4], [60, 2], [3, 3], [3, 3]]));
        let bearings: Vec<f64> = (0..90).map(|i| f64::from(i) * 0.07 - 3.1).collect();
        let mut seen = 0;
        for k in 0..6 {
            let ranges: Vec<f64> = (0..90).map(|i| 0.8 + 0.1 * f64::from((i * k) % 5)).collect();
            let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
            let pose = Pose::<2>::new(0.02 * f64::from(k), 0.0, 0.3 * f64::from(k));
            let before = tsdf.clone();
            tsdf.integrate(&pose, &scan, true);
            unwatched.integrate(&pose, &scan, true);
            assert_eq!(tsdf.store(), unwatched.store());
            assert!(unwatched.events().is_empty());
            let observed: std::collections::HashMap<_, _> = tsdf.events().iter().copied().collect();
            assert_eq!(observed.len(), tsdf.events().len());
            seen += observed.len();
            for cell in cells.clone() {
                let (old, new) = (before.store().cell(cell), tsdf.store().cell(cell));
                match observed.get(&cell) {
                    None => assert_eq!(old, new),
                    Some(e) => {
                        let new = new.unwrap();
                        assert_eq!((e.after as f32, e.weight_after as f32), (new.distance, new.weight));
                        assert_eq!(e.weight_before, old.map_or(0.0, |c| c.weight.into()));
                        assert!(e.gain > 0.0 && e.gain <= 1.0);
                    }
                }
            }
        }
        assert!(seen > 1000);
    }

    #[test]
    fn events_of_watched_cells_are_what_happened() {
        events_are_what_happened(SweepKind::CellCentre);
        events_are_what_happened(SweepKind::March);
    }
}
