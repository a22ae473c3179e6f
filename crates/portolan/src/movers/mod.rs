//! What moved: readings of people, doors and chairs, told from what stands still.
//!
//! A cell that was seen free in one scan together with all its neighbors was empty then, whatever errors of poses and ranges do to
//! its edge; a surface in it at another time is something that moved (Duberg et al. 2024). One look
//! would do if errors had a largest size. They have a standard deviation, and over hundreds of looks the largest of them opens the
//! cells of walls, too. So looks are counted, and a surface moved if half of the looks at its cell found it open.
//!
//! Cells have an edge of five standard deviations of a pose, whatever those of the maps: what moves closer to a wall or to the floor
//! than that is not told from it, and stays. Space that was never seen without what is in it stays, too.
//!
//! ```
//! use portolan::{geom::Pose, movers::Movers, scan::{RangeLimits, Scan}};
//!
//! // A room of 6 m x 6 m; somebody stands 1.5 m before the laser in one scan of ten.
//! let bearings: Vec<f64> = (0..720).map(|i| (f64::from(i) / 2.0 - 180.0).to_radians()).collect();
//! let room = |b: &f64| 3.0 / b.cos().abs().max(b.sin().abs());
//! let empty: Vec<f64> = bearings.iter().map(room).collect();
//! let walked: Vec<f64> = bearings.iter().map(|b| if b.abs() < 0.1 { 1.5 } else { room(b) }).collect();
//! let scan = |ranges: &[f64]| Scan::from_laser(&bearings, ranges, &RangeLimits::default());
//!
//! let mut movers = Movers::<2>::new(0.02, [0.0; 2], usize::MAX)?;
//! for i in 0..10 {
//!     movers.look(&Pose::<2>::IDENTITY, &scan(if i == 4 { &walked } else { &empty }))?;
//! }
//! let (rest, gone) = movers.split(&Pose::<2>::IDENTITY, scan(&walked));
//! assert!(gone.len() > 20 && gone.iter().all(|p| p[0] < 1.6));
//! assert_eq!(rest.counts().hit + gone.len() as u64, 720);
//! # Ok::<(), portolan::map::MapError>(())
//! ```

mod erosion;
mod looks;

use crate::cell::{HitMissSum, LogOdds8, LogOddsValue, OccupancyModel, SumBrick};
use crate::geom::{Lattice, Pose};
use crate::map::{MapError, Occupancy, ScanKind};
use crate::scan::{Movable, ScanStats};
use crate::store::{Bricks, Store};
use looks::LookStore;

/// Edge of a cell in standard deviations of a pose: errors of several scans together seldom open the cells of a wall.
pub const EDGE_SIGMAS: f64 = 5.0;
/// Share of the looks at a cell that found it open from which on a surface in it is of something that moved: less, and the legs of
/// tables that many looks pass would be taken for movers; what stood there in more than half of the looks is part of the map.
pub const OPEN_SHARE: f64 = 0.5;

/// Coordinates beyond so many cells from the origin need an origin of their own.
const FAR_CELLS: f64 = 1e6;

/// How often cells were seen open and how often they were hit, and so what moved.
#[derive(Clone, Debug)]
pub struct Movers<const D: usize> {
    looks: Occupancy<D, LogOdds8, LookStore<D>>,
}

impl<const D: usize> Movers<D> {
    /// Nothing was looked at yet. `pose_sigma`: standard deviation of the error of a pose along a line (meters). `place`: where the
    /// first scan is taken (world, meters), near which cells are counted from. `memory`: bytes that the counts may take.
    ///
    /// # Errors
    /// Where the numbers are not possible.
    pub fn new(pose_sigma: f64, place: [f64; D], memory: usize) -> Result<Self, MapError> {
        let edge = EDGE_SIGMAS * pose_sigma;
        let near = |v: f64| if v.abs() < FAR_CELLS * edge { 0.0 } else { (v / edge).round() * edge };
        let model = OccupancyModel::default();
        let store = LookStore::new(Lattice::new(place.map(near), edge), LogOdds8::rule(&model)?);
        let mut looks = Occupancy::from_store(store, model)?;
        looks.set_limit(memory);
        Ok(Self { looks })
    }

    /// Looks at a scan, taken at a known pose. Scans in another order give the same, unless rows and columns are found in points.
    ///
    /// # Errors
    /// As [`Occupancy::integrate`].
    pub fn look(
        &mut self,
        world_from_sensor: &Pose<D>,
        scan: &impl ScanKind<D>,
    ) -> Result<ScanStats, MapError> {
        self.looks.integrate(world_from_sensor, scan)
    }

    /// Looks that hit the cell of a point (world, meters), and looks that found it open. `None`: there was none of either.
    pub fn looks_at(&self, p_world: [f64; D]) -> Option<HitMissSum> {
        self.counts().cell(self.counts().lattice().cell_of(p_world)?)
    }

    /// Whether a surface at a point (world, meters) is of something that moved. O(1).
    pub fn moved(&self, p_world: [f64; D]) -> bool {
        let open = |looks: HitMissSum| looks.misses as f64 >= OPEN_SHARE * (looks.hits + looks.misses) as f64;
        self.looks_at(p_world).is_some_and(open)
    }

    /// Number of cells that any look found open. None: nothing can be told to have moved. O(cells).
    pub fn open_cells(&self) -> usize {
        let open = |brick: &SumBrick<2>| (0..brick.cells()).filter(|&i| brick.at(i)[1] > 0).count();
        self.counts().bricks_by_age().map(|(_, brick)| open(brick)).sum()
    }

    /// Edge of the cells of the looks (meters).
    pub fn edge(&self) -> f64 {
        self.counts().lattice().resolution
    }

    /// The scan without what moved, which it sees free space up to, and the points that moved (world, meters).
    pub fn split<S: Movable<D>>(&self, world_from_sensor: &Pose<D>, scan: S) -> (S, Vec<[f64; D]>) {
        let (rest, gone) = scan.without(&|p| self.moved(world_from_sensor.transform_point(p)));
        (rest, gone.into_iter().map(|p| world_from_sensor.transform_point(p)).collect())
    }

    fn counts(&self) -> &Bricks<HitMissSum, D> {
        self.looks.store().sums().sums()
    }

    /// Bytes held: measured, not estimated.
    pub fn memory_bytes(&self) -> usize {
        self.looks.memory_bytes()
    }
}

#[cfg(test)]
mod tests;
