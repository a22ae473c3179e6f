//! The text's thesis as an interface: a map is what it can answer cheaply.

use portolan::cell::{HitLength, LogOdds8, SignedDistance};
use portolan::field::LEAST_HITS;
use portolan::geom::Pose;
use portolan::map::{Attenuation, Cloud, MapError, Occupancy, Tsdf};
use portolan::mapper::THIN;
use portolan::scan::{Scan, ScanStats};
use portolan::store::Store;

/// Which questions a representation answers at all, within its documented cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abilities {
    /// Is this point occupied?
    pub occupancy: bool,
    /// How far to the nearest surface?
    pub distance: bool,
}

/// The thin view in which the gallery compares representations.
///
/// The two negatives are not mixed: [`MapRepr::abilities`] lists what a representation *can* answer; a `None`
/// is an answer that is not *known*.
pub trait MapRepr<const D: usize> {
    /// Folds one scan in, with a known pose.
    ///
    /// # Errors
    /// Where the map has no room for it, or it reaches too far.
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> Result<ScanStats, MapError>;

    /// P(occupied) at a point (world, meters). `None`: never observed, which is not 0.5.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64>;

    /// Signed distance to the nearest surface (meters), positive in free space, without a search. `None`: not
    /// known there.
    fn distance(&self, p_world: [f64; D]) -> Option<f64>;

    /// Bytes held: measured, not estimated.
    fn memory_bytes(&self) -> usize;

    /// What it can answer at all.
    fn abilities(&self) -> Abilities;
}

impl<const D: usize, S: Store<LogOdds8, D>> MapRepr<D> for Occupancy<D, LogOdds8, S> {
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> Result<ScanStats, MapError> {
        self.integrate(world_from_sensor, scan)
    }

    fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        self.probability(p_world).known()
    }

    fn distance(&self, _: [f64; D]) -> Option<f64> {
        None
    }

    fn memory_bytes(&self) -> usize {
        self.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        Abilities { occupancy: true, distance: false }
    }
}

impl<const D: usize, S: Store<SignedDistance, D>> MapRepr<D> for Tsdf<D, S> {
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> Result<ScanStats, MapError> {
        self.integrate(world_from_sensor, scan)
    }

    /// The sign of the estimate: 1 behind the surface, 0 in front of it.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        self.occupancy(p_world)
    }

    fn distance(&self, _: [f64; D]) -> Option<f64> {
        None
    }

    fn memory_bytes(&self) -> usize {
        self.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        Abilities { occupancy: true, distance: false }
    }
}

impl<const D: usize, S: Store<HitLength, D>> MapRepr<D> for Attenuation<D, S> {
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> Result<ScanStats, MapError> {
        self.integrate(world_from_sensor, scan)
    }

    /// 1 where a cell stops beams as an obstacle of the distance field does, 0 where it does not.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        let cell = self.store().lattice().cell_of(p_world)?;
        let stops = self.stops_beams(cell, THIN, LEAST_HITS);
        self.store().cell(cell).map(|_| if stops { 1.0 } else { 0.0 })
    }

    fn distance(&self, _: [f64; D]) -> Option<f64> {
        None
    }

    fn memory_bytes(&self) -> usize {
        self.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        Abilities { occupancy: true, distance: false }
    }
}

impl<const D: usize> MapRepr<D> for Cloud<D> {
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> Result<ScanStats, MapError> {
        Ok(self.integrate(world_from_sensor, scan))
    }

    fn occupancy(&self, _: [f64; D]) -> Option<f64> {
        None
    }

    /// Unsigned: a cloud has no inside.
    fn distance(&self, p_world: [f64; D]) -> Option<f64> {
        self.nearest_distance(p_world)
    }

    fn memory_bytes(&self) -> usize {
        self.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        Abilities { occupancy: false, distance: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::cell::OccupancyModel;
    use portolan::geom::Grid;
    use portolan::map::OccupancyGrid;

    #[test]
    fn what_cannot_be_asked_is_not_what_is_not_known() {
        let mut grid =
            OccupancyGrid::<2>::covering(&Grid::new([0.0; 2], 0.1, [4; 2]), OccupancyModel::default())
                .unwrap();
        let (no_scan, p) = (Scan::from_beams([]), [0.2, 0.2]);
        assert_eq!(grid.integrate_scan(&Pose::IDENTITY, &no_scan).unwrap().scans, 1);
        assert_eq!((MapRepr::occupancy(&grid, p), MapRepr::distance(&grid, p)), (None, None));
        assert_eq!(grid.abilities(), Abilities { occupancy: true, distance: false });
        let cloud = Cloud::from_points([[0.2, 0.5]]);
        assert!((MapRepr::distance(&cloud, p).unwrap() - 0.3).abs() < 1e-12);
        assert_eq!(MapRepr::occupancy(&cloud, p), None);
        assert_eq!(cloud.abilities(), Abilities { occupancy: false, distance: true });
    }
}
