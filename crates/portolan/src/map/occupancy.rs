//! Occupancy maps: clamped log odds over any store.

use super::error::{check_grid, check_lattice};
use super::integrate::{limits, plan};
use super::{MapError, ScanKind};
use crate::answer::Answer;
use crate::cell::{HitMiss, LogOdds8, LogOddsValue, OccupancyModel, Planes};
use crate::geom::{Aabb, CellBox, Grid, Lattice, Pose, block_cells};
use crate::scan::{PointScan, RangeImage, ScanStats};
use crate::store::{Bricks, Dense, Store};
use crate::sweep::{HitMissSweep, Inside, OccupancySweep, Rays, Sweep};

/// Clamped log odds of being occupied (Moravec & Elfes 1985), one byte a cell or one `f32`.
///
/// Each scan gives a cell at most one observation: hit where a beam ends in it, else miss where beams pass. Cells lie in
/// bricks, which exist only where something was seen (the default), in a dense array
/// ([`OccupancyGrid`](super::OccupancyGrid)), or in a pruned tree ([`Quadtree`](super::Quadtree),
/// [`Octree`](super::Octree)). Works at UTM coordinates, since cells are counted from the lattice's origin. Has no distance.
///
/// A clone is a snapshot: bricks are shared until one side changes them, arrays and trees are copied.
///
/// ```
/// use portolan::{geom::Lattice, map::Occupancy};
///
/// let mut map = Occupancy::<3>::new(Lattice::new([0.0; 3], 0.1), Default::default())?;
/// map.integrate_points(&[[2.0, 0.0, 0.5], [2.0, 0.1, 0.5]], [0.0, 0.0, 0.5])?;
/// assert!(map.probability([2.05, 0.05, 0.55]).known() > Some(0.5));
/// assert!(map.probability([1.05, 0.05, 0.55]).known() < Some(0.5));
/// assert_eq!(map.probability([3.0, 0.0, 0.5]).known(), None);
/// # Ok::<(), portolan::map::MapError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Occupancy<const D: usize, V: LogOddsValue = LogOdds8, S = Bricks<V, D>> {
    pub(super) store: S,
    pub(super) rule: V::Rule,
    pub(super) lookup: V::Lookup,
    model: OccupancyModel,
    bounds: Option<CellBox<D>>,
    pub(super) sweeps: Sweeps<D>,
}

/// The sweeps with their memory, which is kept from scan to scan.
#[derive(Clone, Debug)]
pub(super) struct Sweeps<const D: usize> {
    pub(super) beams: Rays<D>,
    pub(super) images: HitMissSweep<RangeImage>,
    pub(super) points: HitMissSweep<PointScan>,
    /// Of points in the world's frame, seen from the pose's translation.
    pub(super) world: HitMissSweep<[[f64; 3]]>,
}

impl<const D: usize> Sweeps<D> {
    fn new(wall_depth: f64, sweep: OccupancySweep) -> Self {
        Self {
            beams: Rays::new(wall_depth),
            images: HitMissSweep::new(sweep),
            points: HitMissSweep::new(sweep),
            world: HitMissSweep::new(OccupancySweep::Exact),
        }
    }
}

impl<const D: usize, V: LogOddsValue> Occupancy<D, V> {
    /// A map in bricks in which nothing was observed.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn new(lattice: Lattice<D>, model: OccupancyModel) -> Result<Self, MapError> {
        Self::from_store(Bricks::new(lattice), model)
    }

    /// Packs the bricks that did not change after `epoch` ([`Bricks::epoch`]; `None`: all): few values occur in a brick
    /// that was looked at for long. Answers stay the same; what is written to again unpacks itself. O(cells).
    pub fn pack(&mut self, epoch: Option<u64>) {
        let warm = epoch.map(|e| self.store.changed_since(e)).unwrap_or_default();
        let mut keys = self.store.keys();
        keys.retain(|key| warm.binary_search(key).is_err());
        let pack = |_: usize, brick: &mut Option<V::Brick>, (): &mut ()| {
            *brick = brick.as_ref().map(V::Brick::packed);
            0
        };
        let done = self.store.update(&keys, || (), pack);
        debug_assert!(done.is_ok(), "no brick was added");
    }

    /// Number of cells that were observed. O(cells).
    pub fn observed_cells(&self) -> usize {
        let observed = |brick: &V::Brick| (0..brick.len()).filter(|&i| brick.get(i).is_some()).count();
        self.store.bricks_by_age().map(|(_, brick)| observed(brick)).sum()
    }
}

impl<const D: usize, V: LogOddsValue> Occupancy<D, V, Dense<V, D>> {
    /// A map over all cells of a grid, in which nothing was observed.
    ///
    /// # Errors
    /// Where the grid or the model is not possible.
    pub fn covering(grid: &Grid<D>, model: OccupancyModel) -> Result<Self, MapError> {
        check_grid(grid)?;
        Self::from_store(Dense::new(*grid), model)
    }

    /// Number of cells that were observed. O(cells).
    pub fn observed_cells(&self) -> usize {
        (0..self.store.grid().len()).filter(|&i| self.store.at(i).is_some()).count()
    }
}

impl<const D: usize, V: LogOddsValue, S: Store<V, D>> Occupancy<D, V, S> {
    /// A map of stored cells.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn from_store(store: S, model: OccupancyModel) -> Result<Self, MapError> {
        check_lattice(store.lattice())?;
        let rule = V::rule(&model)?;
        Ok(Self {
            lookup: V::lookup(&rule),
            sweeps: Sweeps::new(wall_depth(&model, store.lattice()), OccupancySweep::default()),
            bounds: None,
            store,
            rule,
            model,
        })
    }

    /// The same map, with this sweep for images and points from now on.
    pub fn with_sweep(self, sweep: OccupancySweep) -> Self {
        Self { sweeps: Sweeps::new(wall_depth(&self.model, self.store.lattice()), sweep), ..self }
    }

    /// Fuses one scan taken at a known pose. O(cells passed); in bricks parallel, with the same bytes for any number of
    /// threads. A pose that is not rigid or has no cell refuses the scan, which is counted, and so is a beam that is not
    /// finite, or longer than 2^20 cells within the bounds.
    ///
    /// Beams hit the cells within half of the model's `wall_depth` of their end; the rays of images and points the cell of
    /// their end and no other.
    ///
    /// # Errors
    /// [`MapError::Full`] where the limit of memory leaves no room; part of the scan is then fused. Also where its rays pass
    /// more bricks than the limit can ever hold (and 4096 more): nothing is fused then. [`MapError::TooFar`] where they pass
    /// more than 2^26, whatever the limit. [`MapError::Image`] where an image that is used contradicts itself.
    pub fn integrate(
        &mut self,
        world_from_sensor: &Pose<D>,
        scan: &impl ScanKind<D>,
    ) -> Result<ScanStats, MapError> {
        scan.fuse_occupancy(self, world_from_sensor)
    }

    /// Fuses a scan by one of the sweeps.
    pub(super) fn sweep<W: Sweep<D, Evidence = HitMiss>>(
        &mut self,
        choose: impl Fn(&mut Sweeps<D>) -> &mut W,
        world_from_sensor: &Pose<D>,
        scan: &W::Scan,
    ) -> Result<ScanStats, MapError> {
        let sweep = choose(&mut self.sweeps);
        let bounds = self.bounds.map(|b| b.aabb(self.store.lattice()));
        let limits = limits(&self.store, bounds, size_of::<V>() * block_cells::<D>());
        let Some(stats) = plan(&self.store, sweep, &limits, world_from_sensor, scan)? else {
            return Ok(ScanStats::refused_pose());
        };
        let scan = Inside { scan: &*sweep, cells: self.bounds };
        Ok(ScanStats { cells: self.store.fuse(&scan, &self.rule)?, ..stats })
    }

    /// Changes only cells in this box (world) from now on; `None`: everywhere. Snapped outwards to cells.
    pub fn set_bounds(&mut self, bounds: Option<Aabb<D>>) {
        self.bounds = bounds.map(|b| CellBox::covering(&b, self.store.lattice()));
    }

    /// Allows no more than `bytes` for the store from now on.
    pub fn set_limit(&mut self, bytes: usize) {
        self.store.set_limit(bytes);
    }

    /// P(occupied) at a point. O(1) in bricks and arrays, O(depth) in trees.
    #[inline]
    pub fn probability(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        let Some(cell) = self.store.lattice().cell_of(p_world.into()) else { return Answer::Outside };
        match self.store.cell(cell) {
            Some(v) => Answer::Known(v.look_up(&self.lookup)),
            None if self.store.contains(cell) => Answer::Unknown,
            None => Answer::Outside,
        }
    }

    /// Whether a cell is more likely occupied than not; `None`: never observed or outside.
    #[inline]
    pub fn is_occupied(&self, cell: [i32; D]) -> Option<bool> {
        self.store.cell(cell).map(V::is_occupied)
    }

    /// Cells and where they are.
    pub fn store(&self) -> &S {
        &self.store
    }

    /// Cells, for a store that is told what to do with scans.
    pub(crate) fn store_mut(&mut self) -> &mut S {
        &mut self.store
    }

    /// Forgets what earlier scans taught about the next: rows and columns.
    pub(crate) fn forget_scans(&mut self) {
        self.sweeps.points.forget_layout();
    }

    /// The map's cells, taken out.
    pub fn into_store(self) -> S {
        self.store
    }

    /// The model that the filter's numbers come from.
    pub fn model(&self) -> &OccupancyModel {
        &self.model
    }

    /// The filter.
    pub fn rule(&self) -> &V::Rule {
        &self.rule
    }

    /// Bytes of the cells and of what finds them: measured, not estimated.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes()
    }
}

/// The depth of what a beam calls occupied (meters).
fn wall_depth<const D: usize>(model: &OccupancyModel, lattice: &Lattice<D>) -> f64 {
    model.wall_depth.unwrap_or(lattice.resolution)
}
