//! Range images and points in an occupancy map.

use super::{MapError, Occupancy};
use crate::cell::LogOddsValue;
use crate::geom::Pose;
use crate::scan::{ScanStats, SphericalLayout};
use crate::store::Store;

impl<V: LogOddsValue, S: Store<V, 3>> Occupancy<3, V, S> {
    /// Fuses surfaces seen from `origin_world` (both world, meters), in one call, with exact rays. Points that are not
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
