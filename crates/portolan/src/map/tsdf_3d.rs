//! Range images and points in a field of distances.

use super::{MapError, PointSweep, Tsdf};
use crate::cell::SignedDistance;
use crate::geom::Pose;
use crate::scan::{Origin, PointScan, RangeImage, ScanStats, SphericalLayout, Way, WhyRays};
use crate::store::Store;
use crate::sweep::PointRays;

/// What the search for the blocks of an image keeps of each: a key, its octants, and their place.
const IMAGE_BLOCK_BYTES: usize = 1024;

impl<S: Store<SignedDistance, 3>> Tsdf<3, S> {
    pub(super) fn integrate_image(
        &mut self,
        world_from_image: &Pose<3>,
        image: &RangeImage,
    ) -> Result<ScanStats, MapError> {
        Ok(self.sweep(|s| &mut s.image, IMAGE_BLOCK_BYTES, world_from_image, image)?.by(Way::Stated))
    }

    pub(super) fn integrate_rays(
        &mut self,
        world_from_scan: &Pose<3>,
        scan: &PointScan,
        why: WhyRays,
    ) -> Result<ScanStats, MapError> {
        let stats = self.sweep(|s| &mut s.points, PointRays::BLOCK_BYTES, world_from_scan, scan)?;
        Ok(stats.by(Way::Rays(why)))
    }

    pub(super) fn integrate_point_scan(
        &mut self,
        world_from_sensor: &Pose<3>,
        scan: &PointScan,
    ) -> Result<ScanStats, MapError> {
        let origin = match (&scan.origin, &scan.image, self.config.points) {
            (Origin::Common(origin), _, PointSweep::Projective) => *origin,
            // Parallel rays have no common origin; their image is in the frame of the points.
            (Origin::PerPoint(_), Some(image), PointSweep::Projective) if image.has_parallel_rays() => {
                let stats = self.integrate_image(world_from_sensor, image)?;
                return Ok(ScanStats { refused: stats.refused + scan.refused, ..stats });
            }
            (_, _, PointSweep::Rays) => return self.integrate_rays(world_from_sensor, scan, WhyRays::Asked),
            _ => return self.integrate_rays(world_from_sensor, scan, WhyRays::OwnOrigins),
        };
        let at = Pose { translation: world_from_sensor.transform_point(origin), ..*world_from_sensor };
        if let Some(image) = &scan.image {
            let stats = self.integrate_image(&at, image)?;
            return Ok(ScanStats { refused: stats.refused + scan.refused, ..stats });
        }
        let image = match self.organise(scan, origin) {
            Ok(image) => image,
            Err(why) => return self.integrate_rays(world_from_sensor, scan, why),
        };
        let mut stats = self.integrate_image(&at, &image)?.by(Way::Found);
        stats.refused += scan.refused;
        // Pixels without a point are no readings; points beside another of their pixel are.
        let used = stats.beams.hit + stats.beams.max_range;
        stats.beams.dropped = ((scan.points.len() + scan.free_ends.len()) as u64).saturating_sub(used);
        Ok(stats)
    }

    /// The image of a scan without rows and columns, where it can be given them. Not where points have colors to be fused:
    /// pixels have lost which point they come from.
    fn organise(&mut self, scan: &PointScan, origin: [f64; 3]) -> Result<RangeImage, WhyRays> {
        if self.config.color && !scan.colors.is_empty() {
            return Err(WhyRays::Colors);
        }
        let mut image = self.layout.image(&scan.points, origin, self.config.resolution)?;
        if let (Some(layout), false) = (self.layout.layout(), scan.free_ends.is_empty()) {
            let free = layout.image(&scan.free_ends, origin);
            for (value, free) in image.values.iter_mut().zip(free.values) {
                *value = if *value == 0.0 { -free } else { *value };
            }
        }
        Ok(image)
    }

    /// Fuses points (world, meters) seen from `origin_world`, in one call. Points that are not finite or lie on the origin
    /// are refused and counted.
    ///
    /// # Errors
    /// As [`Tsdf::integrate`].
    pub fn integrate_points(
        &mut self,
        points_world: &[[f64; 3]],
        origin_world: [f64; 3],
    ) -> Result<ScanStats, MapError> {
        // Relative to the sensor: far from zero f32 loses millimeters.
        let offset = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - origin_world[k]) as f32);
        let scan = PointScan::new(points_world.iter().map(offset), [0.0; 3]);
        let at = Pose { translation: origin_world, ..Pose::IDENTITY };
        self.watch.clear();
        // Ray by ray: which way the sensor's axis points is not known.
        self.integrate_rays(&at, &scan, WhyRays::Asked)
    }

    /// Gives scans of points without rows and columns these from now on. Without this call they are looked for, and kept
    /// while they fit.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = crate::scan::LayoutFinder::of(layout);
    }
}
