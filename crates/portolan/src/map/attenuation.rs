//! Maps of hits per meter, over any store.

use super::error::{check_grid, check_lattice};
use super::integrate::{limits, plan};
use super::{MapError, ScanKind};
use crate::answer::Answer;
use crate::cell::{AttenuationRule, HitLength, HitLengths, LENGTH_UNITS, StopRule, mean_chord};
use crate::geom::{Aabb, CellBox, Grid, Lattice, Pose, block_cells};
use crate::scan::{PointScan, RangeImage, ScanStats};
use crate::store::{Bricks, Dense, Store};
use crate::sweep::{BeamLengths, HitBlocks, HitLengthSweep, Inside, KnowsHits, OccupancySweep, Sweep};

/// Hits that a cell is believed to have had before it was looked at, and in what length (cells): so few that one beam
/// overrules them, and no cell is certain to let everything pass. Chosen by held-out ranges of two buildings at 5 cm: a
/// third as much or three times as much loses up to 0.05 nats a beam.
const PRIOR_HITS: f64 = 0.02;
const PRIOR_LENGTH: f64 = 0.2;

/// How many beams ended in each cell, over the length of all beams inside of it: hits per meter
/// *(Schaefer, Luft & Burgard 2017, "decay rates")*.
///
/// It is the density that a volume renderer descends to, in closed form, and a model of beams: what a sensor would read
/// along a ray is a [`RangeDistribution`](crate::beam_model::RangeDistribution). Beams that pass do not wipe out those that
/// end, they are counted beside them; so thin things stay, as the share that they stop. Every beam counts, however many pass
/// a cell in one scan: lengths are what was observed, once a beam.
///
/// Cells lie in bricks, which exist only where beams were (the default), or in a dense array. A clone is a snapshot: bricks
/// are shared until one side changes them, arrays are copied.
///
/// ```
/// use portolan::{geom::{Lattice, Pose}, map::Attenuation, scan::{RangeLimits, Scan}};
///
/// // Three beams to the wall at 2 m, and one of four that a post at 1 m stops.
/// let mut map = Attenuation::<2>::new(Lattice::new([0.0; 2], 0.1), Default::default())?;
/// for range in [2.0, 1.0, 2.0, 2.0] {
///     let scan = Scan::from_laser(&[0.0], &[range + 0.01], &RangeLimits::default());
///     map.integrate(&Pose::<2>::new(0.05, 0.05, 0.0), &scan)?;
/// }
/// let [free, post, wall] = [0.55, 1.08, 2.08].map(|x| map.attenuation([x, 0.05]).known().unwrap_or(-1.0));
/// assert!(free == 0.0 && 2.0 < post && post < 4.0 && wall > 10.0);
/// assert_eq!(map.attenuation([2.25, 0.05]).known(), None);
/// # Ok::<(), portolan::map::MapError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Attenuation<const D: usize, S = Bricks<HitLength, D>> {
    store: S,
    rule: AttenuationRule,
    bounds: Option<CellBox<D>>,
    /// The blocks in which a beam ever ended.
    hit: HitBlocks<D>,
    sweeps: Sweeps<D>,
}

/// The sweeps with their memory, which is kept from scan to scan.
#[derive(Clone, Debug)]
pub(super) struct Sweeps<const D: usize> {
    pub(super) beams: BeamLengths<D>,
    pub(super) images: HitLengthSweep<RangeImage>,
    pub(super) points: HitLengthSweep<PointScan>,
}

impl<const D: usize> Sweeps<D> {
    fn new(sweep: OccupancySweep) -> Self {
        Self {
            beams: BeamLengths::new(),
            images: HitLengthSweep::new(sweep),
            points: HitLengthSweep::new(sweep),
        }
    }
}

impl<const D: usize> Attenuation<D> {
    /// A map in bricks in which nothing was observed.
    ///
    /// # Errors
    /// Where the lattice is not possible.
    pub fn new(lattice: Lattice<D>, rule: AttenuationRule) -> Result<Self, MapError> {
        Self::from_store(Bricks::new(lattice), rule)
    }

    /// Number of cells that were observed. O(cells).
    pub fn observed_cells(&self) -> usize {
        self.store.bricks_by_age().map(|(_, brick)| brick.observed()).sum()
    }
}

impl<const D: usize> Attenuation<D, Dense<HitLength, D>> {
    /// A map over all cells of a grid, in which nothing was observed.
    ///
    /// # Errors
    /// Where the grid is not possible.
    pub fn covering(grid: &Grid<D>, rule: AttenuationRule) -> Result<Self, MapError> {
        check_grid(grid)?;
        Self::from_store(Dense::new(*grid), rule)
    }

    /// Number of cells that were observed. O(cells).
    pub fn observed_cells(&self) -> usize {
        self.store.planes().looks().iter().filter(|l| **l > 0).count()
    }
}

impl<const D: usize, S: Store<HitLength, D>> Attenuation<D, S> {
    /// A map of stored cells.
    ///
    /// # Errors
    /// Where the lattice is not possible.
    pub fn from_store(store: S, rule: AttenuationRule) -> Result<Self, MapError> {
        check_lattice(store.lattice())?;
        let hit = store.blocks_with(|cell| cell.hits > 0).into_iter().collect();
        Ok(Self { store, rule, bounds: None, hit, sweeps: Sweeps::new(OccupancySweep::default()) })
    }

    /// The same map, with this sweep for images and points from now on.
    pub fn with_sweep(self, sweep: OccupancySweep) -> Self {
        Self { sweeps: Sweeps::new(sweep), ..self }
    }

    /// Fuses one scan taken at a known pose. O(cells passed); in bricks parallel, with the same bytes for any number of
    /// threads, and without forgetting for any order of scans in 2-D. In 3-D only blocks of 8 cells an edge in which a beam
    /// ever ended are told apart cell by cell; in the others nothing stops beams, whatever their length is, so that each
    /// scan adds its mean length there. (In another order of scans hits are the same, lengths may be spread otherwise within
    /// a block that was passed before it was hit.) A pose that is not rigid or has no cell refuses the scan,
    /// which is counted, and so is a beam that is not finite, or longer than 2^20 cells within the bounds.
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
        scan.fuse_attenuation(self, world_from_sensor)
    }

    /// Fuses a scan by one of the sweeps.
    pub(super) fn sweep<W: Sweep<D, Evidence = HitLengths> + KnowsHits<D>>(
        &mut self,
        choose: impl Fn(&mut Sweeps<D>) -> &mut W,
        world_from_sensor: &Pose<D>,
        scan: &W::Scan,
    ) -> Result<ScanStats, MapError> {
        let sweep = choose(&mut self.sweeps);
        let bounds = self.bounds.map(|b| b.aabb(self.store.lattice()));
        let limits = limits(&self.store, bounds, size_of::<HitLength>() * block_cells::<D>());
        // Lent to the sweep, which adds the blocks that the scan hits.
        std::mem::swap(sweep.hit_blocks(), &mut self.hit);
        let planned = plan(&self.store, sweep, &limits, world_from_sensor, scan);
        std::mem::swap(sweep.hit_blocks(), &mut self.hit);
        let Some(stats) = planned? else { return Ok(ScanStats::refused_pose()) };
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

    /// Hits per meter at a point (world), as counted. O(1).
    ///
    /// In 3-D a block of 8 cells an edge in which no beam ended is known as one: 0 in all of it as soon as a beam passed
    /// through any of it. Which of its cells were seen is for maps of occupancy and distances to say.
    #[inline]
    pub fn attenuation(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        let Some(cell) = self.store.lattice().cell_of(p_world.into()) else { return Answer::Outside };
        match self.store.cell(cell) {
            Some(c) => Answer::Known(c.per_cell() / self.store.lattice().resolution),
            None if self.store.contains(cell) => Answer::Unknown,
            None => Answer::Outside,
        }
    }

    /// The share of beams through a cell that end in it, as counted ([`HitLength::opacity`]); `None`: never observed or
    /// outside. In 3-D blocks without hits are known as one, as for [`Attenuation::attenuation`]. O(1).
    #[inline]
    pub fn opacity(&self, cell: [i32; D]) -> Option<f64> {
        self.store.cell(cell).map(HitLength::opacity::<D>)
    }

    /// The share of beams through a cell that will end in it, also where it was never observed: as if before a fiftieth of a
    /// hit had come in a fifth of a cell's length. So an empty cell is never certain, and an unseen one stops 7.6 % (2-D) or
    /// 6.4 % (3-D). O(1).
    #[inline]
    pub fn hit_probability(&self, cell: [i32; D]) -> f64 {
        -(-hits_per_cell(self.store.cell(cell)) * mean_chord::<D>()).exp_m1()
    }

    /// Whether a cell had at least `least_hits` hits and stops more than `share` of the beams through it
    /// ([`HitLength::opacity`]), compared in whole numbers ([`StopRule`], which answers for many cells at once). O(1).
    #[inline]
    pub fn stops_beams(&self, cell: [i32; D], share: f64, least_hits: u32) -> bool {
        self.store.cell(cell).is_some_and(|c| StopRule::<D>::new(share, least_hits).stops(c))
    }

    /// Cells and where they are.
    pub fn store(&self) -> &S {
        &self.store
    }

    /// Cells, for a store that is told what to do with scans.
    pub(crate) fn store_mut(&mut self) -> &mut S {
        &mut self.store
    }

    /// Forgets what earlier scans taught about the next: rows and columns, and which blocks to tell apart cell by cell.
    pub(crate) fn forget_scans(&mut self) {
        self.hit.clear();
        self.sweeps.points.forget_layout();
    }

    /// The map's cells, taken out.
    pub fn into_store(self) -> S {
        self.store
    }

    /// How it forgets.
    pub fn rule(&self) -> &AttenuationRule {
        &self.rule
    }

    /// Bytes of the cells and of what finds them: measured, not estimated.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes()
    }
}

/// Hits per cell's length with what is believed beforehand; also of a cell that was never observed.
#[inline(always)]
pub(crate) fn hits_per_cell(cell: Option<HitLength>) -> f64 {
    let HitLength { hits, length, .. } = cell.unwrap_or_default();
    (f64::from(hits) + PRIOR_HITS) / (f64::from(length) / f64::from(LENGTH_UNITS) + PRIOR_LENGTH)
}
