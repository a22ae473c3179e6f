//! Rays through a distance field in a dense array, and the steps shared with [`super::RayCaster`].

use crate::geom::interpolate;
use crate::geom::vector::{along, norm, unit};
use crate::map::{DenseTsdf, DistanceMap};

/// Where a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayCast {
    /// At a surface, met from its free side at this arc length (meters).
    Hit(f64),
    /// In unknown space, entered at this arc length (meters).
    Unknown(f64),
    /// At the border of the map, at this arc length (meters).
    Outside(f64),
    /// In free space, at the maximum range.
    Free,
}

/// The end of a ray, its length in unknown space, and the surface normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayTrace<const D: usize> {
    /// Where the ray ends.
    pub end: RayCast,
    /// Length in unknown space before the end (meters), accurate to half a cell at each border: nonzero only where
    /// [`RayCastSettings::unknown_tolerance`] or [`RayCastSettings::blind`] allow it.
    pub unknown: f64,
    /// Unit normal of the surface at a hit, toward free space, from the gradient of the field. `None` without a hit, or
    /// where a cell around it is unknown.
    pub normal: Option<[f64; D]>,
}

/// Settings of ray casting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastSettings {
    /// Cells of smaller weight are unknown. `None`: what fits the map
    /// ([`DistanceMap::min_weight`](crate::map::DistanceMap::min_weight)), and any weight above 0 where cells alone are given.
    pub min_weight: Option<f32>,
    /// Maximum length of a ray (meters).
    pub max_range: f64,
    /// Length of unknown space that a ray may cross without ending in it (meters), such as gaps between beams.
    pub unknown_tolerance: f64,
    /// Arc length up to which unknown space is ignored (meters): the space directly before a sensor is often unobserved.
    pub blind: f64,
}

impl Default for RayCastSettings {
    fn default() -> Self {
        Self { min_weight: None, max_range: 100.0, unknown_tolerance: 0.0, blind: 0.0 }
    }
}

impl RayCastSettings {
    /// The default, with the weight that fits a map written out: for rays through its cells alone.
    pub fn of<const D: usize>(map: &impl DistanceMap<D>) -> Self {
        Self::default().fitted(map)
    }

    fn fitted<const D: usize>(self, map: &impl DistanceMap<D>) -> Self {
        Self { min_weight: self.min_weight.or(Some(map.min_weight())), ..self }
    }

    #[inline(always)]
    pub(super) fn observed(&self, weight: f32) -> bool {
        weight > 0.0 && self.min_weight.is_none_or(|least| weight >= least)
    }
}

/// Casts a ray (world, unit direction) through a field: in steps of half a cell through the interpolated field until its
/// sign changes from free to occupied, then to the zero of the line between the two samples. A ray that is not finite, or
/// whose direction is far from length one, returns `Outside(0.0)`. O(length).
pub fn cast_ray<const D: usize>(
    tsdf: &DenseTsdf<D>,
    origin: [f64; D],
    direction: [f64; D],
    settings: &RayCastSettings,
) -> RayCast {
    cast_dense(tsdf, origin, direction, &settings.fitted(tsdf)).0
}

/// [`cast_ray`] with the length in unknown space and the normal at a hit.
///
/// ```
/// use portolan::geom::Grid;
/// use portolan::map::{Tsdf2, TsdfConfig};
/// use portolan::surface::{RayCast, RayCastSettings, trace_ray};
///
/// // A wall at x = 1 m, and an unobserved gap before it.
/// let mut tsdf = Tsdf2::covering(&Grid::new([0.0; 2], 0.05, [24, 8]), TsdfConfig::default())?;
/// for i in (0..192).filter(|i| !(8..12).contains(&(i % 24))) {
///     let cell = [i % 24, i / 24];
///     tsdf.fuse(cell, 1.0 - tsdf.grid().lattice.center(cell)[0], 1.0);
/// }
/// let trace = |unknown_tolerance| {
///     let settings = RayCastSettings { unknown_tolerance, ..Default::default() };
///     trace_ray(&tsdf, [0.1, 0.2], [1.0, 0.0], &settings)
/// };
/// assert!(matches!(trace(0.0).end, RayCast::Unknown(s) if (s - 0.3).abs() < 0.026));
/// let through = trace(1.0);
/// assert!(matches!(through.end, RayCast::Hit(s) if (s - 0.9).abs() < 1e-6));
/// assert!((through.unknown - 0.25).abs() < 0.051 && through.normal == Some([-1.0, 0.0]));
/// # Ok::<(), portolan::map::MapError>(())
/// ```
pub fn trace_ray<const D: usize>(
    tsdf: &DenseTsdf<D>,
    origin: [f64; D],
    direction: [f64; D],
    settings: &RayCastSettings,
) -> RayTrace<D> {
    let settings = &settings.fitted(tsdf);
    let (end, unknown) = cast_dense(tsdf, origin, direction, settings);
    RayTrace {
        end,
        unknown,
        normal: normal(end, |s| sample_dense(tsdf, along(origin, direction, s), s, settings)),
    }
}

fn cast_dense<const D: usize>(
    tsdf: &DenseTsdf<D>,
    origin: [f64; D],
    direction: [f64; D],
    settings: &RayCastSettings,
) -> (RayCast, f64) {
    if !is_ray(origin, direction) {
        return (RayCast::Outside(0.0), 0.0);
    }
    let step = 0.5 * tsdf.grid().lattice.resolution;
    march(step, settings, |s| sample_dense(tsdf, along(origin, direction, s), s, settings))
}

#[inline(always)]
fn sample_dense<const D: usize>(
    tsdf: &DenseTsdf<D>,
    p: [f64; D],
    s: f64,
    settings: &RayCastSettings,
) -> FieldSample<D> {
    let grid = tsdf.grid();
    let strides = grid.strides();
    let planes = tsdf.store().planes();
    if !grid.aabb().contains(p) {
        return FieldSample::Outside;
    }
    let known = grid.interpolation(p).and_then(|(base, fraction)| {
        let at = grid.index(base)?;
        let observed = (0..1usize << D).all(|c| {
            let corner: usize = (0..D).map(|k| ((c >> k) & 1) * strides[k]).sum();
            settings.observed(planes.weights()[at + corner])
        });
        observed.then(|| interpolate(planes.distances(), &strides, at, &fraction))
    });
    known.map_or(FieldSample::Unknown { until: s }, |(value, slope)| FieldSample::Known(value, slope))
}

/// Whether origin and direction are valid: steps scale with the length of the direction, down to zero.
pub(super) fn is_ray<const D: usize>(origin: [f64; D], direction: [f64; D]) -> bool {
    (0.5..2.0).contains(&norm(direction)) && origin.iter().all(|v| v.is_finite())
}

/// The value of a field at a point of a ray.
pub(super) enum FieldSample<const D: usize> {
    /// Value, and slope per cell.
    Known(f64, [f64; D]),
    /// Unknown from here to this arc length at least.
    Unknown {
        until: f64,
    },
    Outside,
}

/// The normal at the end of a ray, where it hits.
pub(super) fn normal<const D: usize>(
    end: RayCast,
    sample: impl Fn(f64) -> FieldSample<D>,
) -> Option<[f64; D]> {
    let RayCast::Hit(s) = end else { return None };
    match sample(s) {
        FieldSample::Known(_, slope) => unit(slope),
        _ => None,
    }
}

/// Samples along a ray every `step` meters to its end; also returns the length in unknown space before it.
pub(super) fn march<const D: usize>(
    step: f64,
    settings: &RayCastSettings,
    sample: impl Fn(f64) -> FieldSample<D>,
) -> (RayCast, f64) {
    let mut last: Option<(f64, f64)> = None;
    let mut unknown_since = None;
    let mut passed = 0.0;
    let mut n = 0.0;
    loop {
        let s = n * step;
        n += 1.0;
        let open = |s: f64| unknown_since.map_or(0.0, |since| f64::max(s - since, 0.0));
        if s > settings.max_range {
            return (RayCast::Free, passed + open(settings.max_range));
        }
        match (sample(s), last) {
            (FieldSample::Outside, _) => return (RayCast::Outside(s), passed + open(s)),
            (FieldSample::Known(d, _), Some((before, at))) if before >= 0.0 && d < 0.0 => {
                return (RayCast::Hit(at + (s - at) * before / (before - d)), passed);
            }
            (FieldSample::Known(d, _), _) => {
                passed += open(s);
                last = Some((d, s));
                unknown_since = None;
            }
            (FieldSample::Unknown { until }, _) => {
                let since = *unknown_since.get_or_insert(s);
                last = None;
                let end = until.max(s);
                if end >= settings.blind && end - since.max(settings.blind) >= settings.unknown_tolerance {
                    return (RayCast::Unknown(since), passed);
                }
                n = n.max((until.min(settings.max_range) / step).ceil());
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geom::Grid;

    pub(crate) fn wall<const D: usize>() -> DenseTsdf<D> {
        crate::testing::tsdf(Grid::new([0.0; D], 0.1, [20; D]), 0.3, |p| {
            if p[0] < 1.5 { 1.234 - p[0] } else { f64::NAN }
        })
    }

    fn hits_where_the_wall_is<const D: usize>() {
        let tsdf = wall::<D>();
        let mut direction = [0.0; D];
        let settings = RayCastSettings::default();
        (direction[0], direction[1]) = (0.8, 0.6);
        let mut origin = [0.5; D];
        let RayCast::Hit(s) = cast_ray(&tsdf, origin, direction, &settings) else { panic!("no hit") };
        assert!((s - (1.234 - 0.5) / 0.8).abs() < 1e-6);
        // From behind there is no surface to hit.
        origin[0] = 1.35;
        (direction[0], direction[1]) = (-1.0, 0.0);
        assert!(matches!(
            cast_ray(&tsdf, origin, direction, &settings),
            RayCast::Unknown(_) | RayCast::Outside(_)
        ));
        direction[0] = 1.0;
        assert!(matches!(cast_ray(&tsdf, origin, direction, &settings), RayCast::Unknown(_)));
        origin[0] = -3.0;
        assert_eq!(cast_ray(&tsdf, origin, direction, &settings), RayCast::Outside(0.0));
        origin[0] = 0.3;
        let short = RayCastSettings { max_range: 0.2, ..settings };
        assert_eq!(cast_ray(&tsdf, origin, direction, &short), RayCast::Free);
    }

    #[test]
    fn hits_where_the_wall_is_2d_and_3d() {
        hits_where_the_wall_is::<2>();
        hits_where_the_wall_is::<3>();
    }
}
