//! Range images and points in an occupancy map.

use super::{MapError, Occupancy};
use crate::cell::LogOddsValue;
use crate::geom::Pose;
use crate::scan::{PointScan, RangeImage, ScanStats, SphericalLayout};
use crate::store::Store;

impl<V: LogOddsValue, S: Store<V, 3>> Occupancy<3, V, S> {
    pub(super) fn integrate_image(
        &mut self,
        world_from_sensor: &Pose<3>,
        image: &RangeImage,
    ) -> Result<ScanStats, MapError> {
        self.sweep(|sweeps| &mut sweeps.images, world_from_sensor, image)
    }

    pub(super) fn integrate_point_scan(
        &mut self,
        world_from_sensor: &Pose<3>,
        scan: &PointScan,
    ) -> Result<ScanStats, MapError> {
        self.sweep(|sweeps| &mut sweeps.points, world_from_sensor, scan)
    }

    /// Fuses surfaces seen from `origin_world` (both world, metres), in one call, with exact rays. Points that are not
    /// finite are refused and counted.
    ///
    /// # Errors
    /// As [`Occupancy::integrate`].
    pub fn integrate_points(
        &mut self,
        points_world: &[[f64; 3]],
        origin_world: [f64; 3],
    ) -> Result<ScanStats, MapError> {
        let at = Pose { translation: origin_world, ..Pose::IDENTITY };
        self.sweep(|sweeps| &mut sweeps.world, &at, points_world)
    }

    /// Rows and columns for scans of points that come without them; otherwise they are looked for, and kept while they fit.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.sweeps.points.set_layout(layout);
    }
}
