//! Range images and points in a field of distances.

use super::{MapError, PointSweep, Tsdf};
use crate::cell::{Color, SignedDistance};
use crate::geom::Pose;
use crate::scan::{Origin, PointScan, RangeImage, ScanStats, SphericalLayout, Way, WhyRays, strips};
use crate::store::Store;
use crate::sweep::PointRays;

/// What the search for the blocks of an image keeps of each: a key, its octants, and their place.
const IMAGE_BLOCK_BYTES: usize = 1024;

impl<S: Store<SignedDistance, 3>, C: Store<Color, 3>> Tsdf<3, S, C> {
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
            _ if scan.delivered.is_some() => return self.integrate_moving(world_from_sensor, scan),
            _ => return self.integrate_rays(world_from_sensor, scan, WhyRays::OwnOrigins),
        };
        let at = Pose { translation: world_from_sensor.transform_point(origin), ..*world_from_sensor };
        if let Some(image) = &scan.image {
            let stats = self.integrate_image(&at, image)?;
            return Ok(ScanStats { refused: stats.refused + scan.refused, ..stats });
        }
        let colored = !scan.colors.is_empty();
        let image = match self.organise(&scan.points, &scan.free_ends, colored, origin) {
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

    /// A turning lidar that moved: strips of columns, each taken at one moment. Cells between two strips are seen through the one
    /// that they lie in; only those within half a column of a border may be seen through both.
    fn integrate_moving(
        &mut self,
        world_from_sensor: &Pose<3>,
        scan: &PointScan,
    ) -> Result<ScanStats, MapError> {
        let Some((points, free_ends, origin)) = scan.delivered.as_deref().map(|d| d.rays()) else {
            return self.integrate_rays(world_from_sensor, scan, WhyRays::OwnOrigins);
        };
        let image = match self.organise(points, free_ends, !scan.colors.is_empty(), origin) {
            Ok(image) => image,
            Err(why) => return self.integrate_rays(world_from_sensor, scan, why),
        };
        let Some(parts) = strips(scan, &image, self.config.resolution) else {
            return self.integrate_rays(world_from_sensor, scan, WhyRays::OwnOrigins);
        };
        let mut total = ScanStats { scans: 1, refused: scan.refused, ..ScanStats::default() };
        for (scan_from_image, strip) in &parts {
            let stats = self.integrate_image(&(*world_from_sensor * *scan_from_image), strip)?;
            if stats.scans == 0 {
                return Ok(stats);
            }
            total.cells += stats.cells;
            total.hits_outside += stats.hits_outside;
        }
        let count = |is: fn(&f32) -> bool| image.values.iter().filter(|v| is(v)).count() as u64;
        total.beams.hit = count(|v| *v > 0.0);
        total.beams.max_range = count(|v| *v < 0.0);
        let used = total.beams.hit + total.beams.max_range;
        total.beams.dropped = ((points.len() + free_ends.len()) as u64).saturating_sub(used);
        Ok(total.by(Way::Found))
    }

    /// The image of a scan without rows and columns, where it can be given them. Not where points have colors to be fused:
    /// pixels have lost which point they come from.
    fn organise(
        &mut self,
        points: &[[f32; 3]],
        free_ends: &[[f32; 3]],
        colored: bool,
        origin: [f64; 3],
    ) -> Result<RangeImage, WhyRays> {
        if self.config.color && colored {
            return Err(WhyRays::Colors);
        }
        let mut image = self.layout.image(points, origin, self.config.resolution)?;
        if let (Some(layout), false) = (self.layout.layout(), free_ends.is_empty()) {
            let free = layout.image(free_ends, origin);
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
