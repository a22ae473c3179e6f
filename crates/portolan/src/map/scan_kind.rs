//! What a map can fuse: beams in any dimension, range images and points in 3-D.

use super::tsdf::BEAM_CELL_BYTES;
use super::{Attenuation, BeamSweep, MapError, Occupancy, Tsdf};
use crate::cell::{Color, HitLength, LogOddsValue, SignedDistance};
use crate::geom::{Pose, block_cells};
use crate::scan::{Fingerprint, Frame, PointScan, RangeImage, Scan, ScanStats};
use crate::store::Store;

/// A kind of scan that maps of `D` dimensions fuse: [`Scan`] in 2-D and 3-D; [`RangeImage`], [`PointScan`] and [`Frame`] in
/// 3-D.
pub trait ScanKind<const D: usize>: Fingerprint {
    /// Fuses the scan into a field of distances; see [`Tsdf::integrate`].
    ///
    /// # Errors
    /// As [`Tsdf::integrate`].
    fn fuse_distances<S: Store<SignedDistance, D>, C: Store<Color, D>>(
        &self,
        map: &mut Tsdf<D, S, C>,
        world_from_sensor: &Pose<D>,
    ) -> Result<ScanStats, MapError>;

    /// Fuses the scan into an occupancy map; see [`Occupancy::integrate`].
    ///
    /// # Errors
    /// As [`Occupancy::integrate`].
    fn fuse_occupancy<V: LogOddsValue, S: Store<V, D>>(
        &self,
        map: &mut Occupancy<D, V, S>,
        world_from_sensor: &Pose<D>,
    ) -> Result<ScanStats, MapError>;

    /// Fuses the scan into a map of hits per meter; see [`Attenuation::integrate`].
    ///
    /// # Errors
    /// As [`Attenuation::integrate`].
    fn fuse_attenuation<S: Store<HitLength, D>>(
        &self,
        map: &mut Attenuation<D, S>,
        world_from_sensor: &Pose<D>,
    ) -> Result<ScanStats, MapError>;
}

impl<const D: usize> ScanKind<D> for Scan<D> {
    fn fuse_distances<S: Store<SignedDistance, D>, C: Store<Color, D>>(
        &self,
        map: &mut Tsdf<D, S, C>,
        world_from_sensor: &Pose<D>,
    ) -> Result<ScanStats, MapError> {
        let bytes = BEAM_CELL_BYTES * block_cells::<D>();
        match map.config.beams {
            BeamSweep::CellCentre => map.sweep(|s| &mut s.centers, bytes, world_from_sensor, self),
            BeamSweep::March => map.sweep(|s| &mut s.march, bytes, world_from_sensor, self),
        }
    }

    fn fuse_occupancy<V: LogOddsValue, S: Store<V, D>>(
        &self,
        map: &mut Occupancy<D, V, S>,
        world_from_sensor: &Pose<D>,
    ) -> Result<ScanStats, MapError> {
        map.sweep(|sweeps| &mut sweeps.beams, world_from_sensor, self)
    }

    fn fuse_attenuation<S: Store<HitLength, D>>(
        &self,
        map: &mut Attenuation<D, S>,
        world_from_sensor: &Pose<D>,
    ) -> Result<ScanStats, MapError> {
        map.sweep(|sweeps| &mut sweeps.beams, world_from_sensor, self)
    }
}

impl ScanKind<3> for RangeImage {
    fn fuse_distances<S: Store<SignedDistance, 3>, C: Store<Color, 3>>(
        &self,
        map: &mut Tsdf<3, S, C>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        map.integrate_image(world_from_sensor, self)
    }

    fn fuse_occupancy<V: LogOddsValue, S: Store<V, 3>>(
        &self,
        map: &mut Occupancy<3, V, S>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        map.sweep(|sweeps| &mut sweeps.images, world_from_sensor, self)
    }

    fn fuse_attenuation<S: Store<HitLength, 3>>(
        &self,
        map: &mut Attenuation<3, S>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        map.sweep(|sweeps| &mut sweeps.images, world_from_sensor, self)
    }
}

impl ScanKind<3> for PointScan {
    fn fuse_distances<S: Store<SignedDistance, 3>, C: Store<Color, 3>>(
        &self,
        map: &mut Tsdf<3, S, C>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        map.integrate_point_scan(world_from_sensor, self)
    }

    fn fuse_occupancy<V: LogOddsValue, S: Store<V, 3>>(
        &self,
        map: &mut Occupancy<3, V, S>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        map.sweep(|sweeps| &mut sweeps.points, world_from_sensor, self)
    }

    fn fuse_attenuation<S: Store<HitLength, 3>>(
        &self,
        map: &mut Attenuation<3, S>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        map.sweep(|sweeps| &mut sweeps.points, world_from_sensor, self)
    }
}

impl ScanKind<3> for Frame {
    fn fuse_distances<S: Store<SignedDistance, 3>, C: Store<Color, 3>>(
        &self,
        map: &mut Tsdf<3, S, C>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        match self {
            Self::Image(image) => image.fuse_distances(map, world_from_sensor),
            Self::Points(scan) => scan.fuse_distances(map, world_from_sensor),
        }
    }

    fn fuse_occupancy<V: LogOddsValue, S: Store<V, 3>>(
        &self,
        map: &mut Occupancy<3, V, S>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        match self {
            Self::Image(image) => image.fuse_occupancy(map, world_from_sensor),
            Self::Points(scan) => scan.fuse_occupancy(map, world_from_sensor),
        }
    }

    fn fuse_attenuation<S: Store<HitLength, 3>>(
        &self,
        map: &mut Attenuation<3, S>,
        world_from_sensor: &Pose<3>,
    ) -> Result<ScanStats, MapError> {
        match self {
            Self::Image(image) => image.fuse_attenuation(map, world_from_sensor),
            Self::Points(scan) => scan.fuse_attenuation(map, world_from_sensor),
        }
    }
}
