//! Truncated signed distance fields.

use super::error::{check_grid, check_lattice};
use super::integrate::{limits, plan};
use super::watch::Watch;
use super::{MapError, ScanKind, TsdfConfig};
use crate::answer::Answer;
use crate::cell::{
    Color, ColorRule, Colors, Distances, Evidence, FusionEvent, Planes, SignedDistance, TsdfRule,
};
use crate::geom::{Aabb, BlockKey, CellBox, Grid, Lattice, Pose, block_cells};
use crate::scan::{LayoutFinder, ScanStats};
use crate::store::{Bricks, Dense, Store};
use crate::sweep::{CellCentre, Inside, March, PointRays, Projective, Sweep, Swept, SweptColors};

/// A truncated signed distance field: per cell a scalar information filter of the signed distance to the nearest surface
/// (Curless & Levoy 1996).
///
/// Distances are measured along rays and kept within the truncation: the map answers *where is the surface*, not *how far
/// is it*; the distance field derived from it does that. Cells lie in bricks, which exist only where something was seen, or
/// in a dense array ([`Tsdf2`](super::Tsdf2)). Colors lie beside them in a store of their own, near surfaces only.
///
/// A clone is a snapshot: bricks are shared until one side changes them, arrays are copied.
#[derive(Clone, Debug)]
pub struct Tsdf<const D: usize, S = Bricks<SignedDistance, D>, C = Bricks<Color, D>> {
    pub(super) config: TsdfConfig<D>,
    rule: TsdfRule,
    color_rule: ColorRule,
    pub(super) distances: S,
    pub(super) colors: Option<C>,
    pub(super) bounds: Option<Aabb<D>>,
    limit: usize,
    pub(super) layout: LayoutFinder,
    pub(super) sweeps: Box<Sweeps<D>>,
    pub(super) watch: Watch<FusionEvent, D>,
}

/// What sweeps of beams keep of a touched cell: distance, weight, how far aside, which beam.
pub(super) const BEAM_CELL_BYTES: usize = 16;

/// The sweeps with their memory, which is kept from scan to scan.
#[derive(Debug)]
pub(super) struct Sweeps<const D: usize> {
    config: TsdfConfig<D>,
    pub(super) centers: CellCentre<D>,
    pub(super) march: March<D>,
    pub(super) image: Projective,
    pub(super) points: PointRays,
}

impl<const D: usize> Sweeps<D> {
    fn new(config: TsdfConfig<D>) -> Self {
        let (tau, free, weights) = (config.truncation, config.free_weight(), config.weights);
        Self {
            config,
            centers: CellCentre::new(tau, free, weights),
            march: March::new(tau, free, weights),
            image: Projective::new(config.projective()),
            points: PointRays::new(config.projective()),
        }
    }
}

/// Without what they remember of the last scan: a snapshot does not pay for it.
impl<const D: usize> Clone for Sweeps<D> {
    fn clone(&self) -> Self {
        Self::new(self.config)
    }
}

impl<const D: usize> Tsdf<D> {
    /// A field in bricks in which nothing was observed.
    ///
    /// # Errors
    /// Where a setting is not possible.
    pub fn new(config: TsdfConfig<D>) -> Result<Self, MapError> {
        let lattice = Lattice::new(config.origin, config.resolution);
        let colors = config.color.then(|| Bricks::new(lattice));
        Self::from_stores(Bricks::new(lattice), colors, config)
    }

    /// Number of cells with a weight of at least `min_weight` (and above 0).
    pub fn observed_cells(&self, min_weight: f32) -> usize {
        self.distances.bricks_by_age().map(|(_, brick)| observed(brick.weights(), min_weight)).sum()
    }
}

fn observed(weights: &[f32], min_weight: f32) -> usize {
    weights.iter().filter(|&&w| w > 0.0 && w >= min_weight).count()
}

impl<const D: usize> Tsdf<D, Dense<SignedDistance, D>> {
    /// A field over all cells of a grid, in which nothing was observed. Resolution and origin are those of the grid.
    ///
    /// # Errors
    /// Where the grid or a setting is not possible.
    pub fn covering(grid: &Grid<D>, config: TsdfConfig<D>) -> Result<Self, MapError> {
        check_grid(grid)?;
        Self::from_stores(Dense::new(*grid), None, config)
    }

    /// Shape and place.
    pub fn grid(&self) -> &Grid<D> {
        self.distances.grid()
    }

    /// Number of cells with a weight of at least `min_weight` (and above 0).
    pub fn observed_cells(&self, min_weight: f32) -> usize {
        observed(self.distances.planes().weights(), min_weight)
    }

    /// One step of one cell's filter, as if a scan had observed it: `d` meters with weight `w`. Cells outside of the map
    /// compute the step from nothing and keep nothing.
    pub fn fuse(&mut self, cell: [i32; D], d: f64, w: f64) -> FusionEvent {
        let index = self.distances.grid().index(cell);
        let prior = index.and_then(|i| self.distances.at(i));
        let state = prior.unwrap_or(SignedDistance { distance: 0.0, weight: 0.0 });
        let event = self.rule.step(state.distance.into(), state.weight.into(), d, w);
        if let Some(i) = index {
            let after = SignedDistance { distance: event.after as f32, weight: event.weight_after as f32 };
            self.distances.planes_mut().set(i, Some(after));
        }
        event
    }
}

impl<const D: usize, S: Store<SignedDistance, D>, C: Store<Color, D>> Tsdf<D, S, C> {
    /// A field of stored cells; resolution and origin are taken from the store, and whether there are colors.
    ///
    /// # Errors
    /// Where a setting is not possible, or the two stores have not the same lattice.
    pub fn from_stores(distances: S, colors: Option<C>, config: TsdfConfig<D>) -> Result<Self, MapError> {
        let lattice = *distances.lattice();
        check_lattice(&lattice)?;
        if colors.as_ref().is_some_and(|c| *c.lattice() != lattice) {
            return Err(MapError::Lattices);
        }
        let color = colors.is_some();
        let config = TsdfConfig { resolution: lattice.resolution, origin: lattice.origin, color, ..config };
        Ok(Self {
            rule: config.rule()?,
            color_rule: ColorRule { w_max: config.color_w_max },
            distances,
            colors,
            bounds: None,
            limit: usize::MAX,
            layout: LayoutFinder::default(),
            sweeps: Box::new(Sweeps::new(config)),
            watch: Watch::default(),
            config,
        })
    }

    /// Fuses one scan taken at a known pose. O(cells seen); in bricks parallel, with the same bytes for any number of
    /// threads. A pose that is not rigid or has no cell refuses the scan, which is counted.
    ///
    /// # Errors
    /// [`MapError::Full`] where a brick would pass the limit: what was fused before it stays. Also where the search for
    /// bricks alone would take more: nothing is fused then. [`MapError::TooFar`] where it would never end.
    /// [`MapError::Image`] where an image contradicts itself.
    pub fn integrate(
        &mut self,
        world_from_sensor: &Pose<D>,
        scan: &impl ScanKind<D>,
    ) -> Result<ScanStats, MapError> {
        self.watch.clear();
        scan.fuse_distances(self, world_from_sensor)
    }

    /// Fuses a scan by one of the sweeps, whose touched blocks cost `bytes` each.
    pub(super) fn sweep<W>(
        &mut self,
        choose: impl Fn(&mut Sweeps<D>) -> &mut W,
        bytes: usize,
        world_from_sensor: &Pose<D>,
        scan: &W::Scan,
    ) -> Result<ScanStats, MapError>
    where
        W: Sweep<D, Evidence = Distances> + SweptColors<D>,
    {
        let others = self.colors.as_ref().map_or(0, Store::memory_bytes);
        self.distances.set_limit(self.limit.saturating_sub(others));
        let sweep = choose(&mut self.sweeps);
        let limits = limits(&self.distances, self.bounds, bytes);
        let Some(mut stats) = plan(&self.distances, sweep, &limits, world_from_sensor, scan)? else {
            return Ok(ScanStats::refused_pose());
        };
        let cells = self.bounds.map(|b| CellBox::of_centers(&b, self.distances.lattice()));
        let scan = Inside { scan: &*sweep, cells };
        self.watch.look(&scan, &self.distances, &self.rule);
        stats.cells = self.distances.fuse(&scan, &self.rule)?;
        if let Some(colors) = &mut self.colors {
            colors.set_limit(self.limit.saturating_sub(self.distances.memory_bytes()));
            // Corners of the cells that a surface passes through are at most a diagonal away from it.
            let band = (1.75 * self.config.resolution).min(self.config.truncation) as f32;
            colors.fuse(&ColorsOf { scan: &scan, band }, &self.color_rule)?;
        }
        Ok(stats)
    }

    /// Watches these cells from now on, and no others: every scan leaves what it did to them in [`Tsdf::events`]. Cells
    /// outside of the map have no events. What is not watched pays nothing.
    pub fn watch(&mut self, cells: impl IntoIterator<Item = [i32; D]>) {
        self.watch.watch(cells.into_iter().filter(|&c| self.distances.contains(c)));
    }

    /// What the last scan did to the watched cells that it observed, by [`Cell::fuse`](crate::cell::Cell::fuse) from the
    /// same evidence. In the order of blocks. (Where the memory limit stopped a scan, also what it would have done.)
    pub fn events(&self) -> &[([i32; D], FusionEvent)] {
        self.watch.events()
    }

    /// The estimate of the cell that holds a point; saturated at the truncation, where the field is a constant. Measured
    /// along rays, not Euclidean. Outside: beyond the bounds, or beyond what an index can hold.
    pub fn signed_distance(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        let p = p_world.into();
        let outside = self.bounds.is_some_and(|b| !b.contains(p));
        let Some(cell) = self.lattice().cell_of(p).filter(|_| !outside) else { return Answer::Outside };
        let Some(state) = self.distances.cell(cell) else {
            return if self.distances.contains(cell) { Answer::Unknown } else { Answer::Outside };
        };
        let limit = self.rule.truncation * (1.0 - 1e-4);
        if state.distance.abs() < limit {
            Answer::Known(state.distance.into())
        } else {
            Answer::Saturated(state.distance.into())
        }
    }

    /// The color of the cell that holds a point; `None` where none was seen.
    pub fn color(&self, p_world: impl Into<[f64; D]>) -> Option<Color> {
        self.colors.as_ref()?.cell(self.lattice().cell_of(p_world.into())?)
    }

    /// 1 behind the surface, 0 in front of it: the sign of the estimate. `None`: never observed, or outside.
    pub fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        match self.signed_distance(p_world) {
            Answer::Known(d) | Answer::Saturated(d) => Some(if d < 0.0 { 1.0 } else { 0.0 }),
            Answer::Unknown | Answer::Outside => None,
        }
    }

    /// The distances.
    pub fn store(&self) -> &S {
        &self.distances
    }

    /// Distances and colors, for stores that are told what to do with scans.
    pub(crate) fn stores_mut(&mut self) -> (&mut S, Option<&mut C>) {
        (&mut self.distances, self.colors.as_mut())
    }

    /// Forgets what earlier scans taught about the next: rows and columns.
    pub(crate) fn forget_scans(&mut self) {
        self.layout = LayoutFinder::default();
    }

    /// The colors beside them; `None` where the map keeps none.
    pub fn colors(&self) -> Option<&C> {
        self.colors.as_ref()
    }

    /// The stores of the map: distances, colors.
    pub fn into_stores(self) -> (S, Option<C>) {
        (self.distances, self.colors)
    }

    /// Allows no more than `bytes` for distances and colors together from now on.
    pub fn set_limit(&mut self, bytes: usize) {
        self.limit = bytes;
    }

    /// Keeps to cells whose center lies in a box (world) from now on; `None`: everywhere.
    pub fn set_bounds(&mut self, bounds: Option<Aabb<D>>) {
        self.bounds = bounds;
    }

    /// Bytes that the cells hold: measured, not estimated.
    pub fn memory_bytes(&self) -> usize {
        self.distances.memory_bytes() + self.colors.as_ref().map_or(0, Store::memory_bytes)
    }

    /// The settings.
    pub fn config(&self) -> &TsdfConfig<D> {
        &self.config
    }

    /// The filter.
    pub fn rule(&self) -> &TsdfRule {
        &self.rule
    }

    /// Index to meters.
    pub fn lattice(&self) -> &Lattice<D> {
        self.distances.lattice()
    }
}

/// The colors of a swept scan, as evidence of its own.
struct ColorsOf<'a, W> {
    scan: &'a W,
    /// Only cells so near to a surface have colors (meters).
    band: f32,
}

impl<const D: usize, W: SweptColors<D>> Swept<D> for ColorsOf<'_, W> {
    type Evidence = Colors;
    type Scratch = (W::Scratch, Colors);

    fn scratch(&self) -> Self::Scratch {
        (self.scan.scratch(), Colors::silent(block_cells::<D>()))
    }

    fn blocks(&self) -> &[BlockKey<D>] {
        self.scan.blocks()
    }

    fn evidence<'a>(&'a self, i: usize, (scratch, colors): &'a mut Self::Scratch) -> &'a Colors {
        colors.clear();
        if !self.scan.is_free(i) {
            let distances = self.scan.evidence(i, scratch);
            if distances.observed() > 0 {
                self.scan.colors(i, distances, self.band, colors);
            }
        }
        colors
    }
}
