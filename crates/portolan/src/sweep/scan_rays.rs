//! The rays of 3-D scans, and their rows and columns, for every sweep that follows rays where there are none.

use super::{OccupancySweep, PlanError};
use crate::geom::Pose;
use crate::scan::{LayoutFinder, Origin, PointScan, RangeImage, Way, WhyRays};
use std::borrow::Cow;

/// One beam in the world's frame (meters).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray<const D: usize> {
    pub(crate) origin: [f64; D],
    pub(crate) end: [f64; D],
    /// Whether there is a surface at the end.
    pub(crate) hit: bool,
    /// Whether what it passes counts; else only its end does.
    pub(crate) passes: bool,
}

impl Ray<3> {
    /// The `i`-th ray of a scan of points: first those to the points, which pass what is before them if `passes`, then the
    /// free ones. `common` is the scan's origin in the world, if its points have one.
    #[inline]
    pub(super) fn of_points(
        scan: &PointScan,
        i: usize,
        common: [f64; 3],
        world_from_sensor: &Pose<3>,
        passes: bool,
    ) -> Self {
        let to_world = |p: [f32; 3]| world_from_sensor.transform_point(p.map(f64::from));
        let origin = match &scan.origin {
            Origin::Common(_) => common,
            Origin::PerPoint(all) => all.get(i).map_or([f64::NAN; 3], |o| to_world(*o)),
            // It ends where it begins.
            Origin::Unknown => to_world(scan.points[i]),
        };
        if let Some(free) = i.checked_sub(scan.points.len()) {
            return Self { origin, end: to_world(scan.free_ends[free]), hit: false, passes: true };
        }
        Self { origin, end: to_world(scan.points[i]), hit: true, passes }
    }
}

/// The origin of a scan of points in the world, the way in which it is read, and its image if it has one.
pub(super) type Organised<'a> = ([f64; 3], Way, Option<Cow<'a, RangeImage>>);

/// How a scan of points is read: with an image where the sweep wants rows and columns and the scan has them, or gets them of
/// `layout` for cells of this edge (meters).
pub(super) fn organised<'a>(
    scan: &'a PointScan,
    world_from_sensor: &Pose<3>,
    sweep: OccupancySweep,
    layout: &mut LayoutFinder,
    cell: f64,
) -> Result<Organised<'a>, PlanError> {
    let origin = match scan.origin {
        Origin::Common(origin) => origin,
        Origin::PerPoint(_) => {
            return Ok((world_from_sensor.translation, Way::Rays(WhyRays::OwnOrigins), None));
        }
        Origin::Unknown => return Ok((world_from_sensor.translation, Way::Points, None)),
    };
    let common = world_from_sensor.transform_point(origin);
    if sweep == OccupancySweep::Exact {
        return Ok((common, Way::Rays(WhyRays::Asked), None));
    }
    if let Some(image) = &scan.image {
        image.check().map_err(PlanError::BadImage)?;
        return Ok((common, Way::Stated, Some(Cow::Borrowed(image))));
    }
    Ok(match layout.image(&scan.points, origin, cell) {
        Ok(image) => (common, Way::Found, Some(Cow::Owned(image))),
        Err(why) => (common, Way::Rays(why), None),
    })
}
