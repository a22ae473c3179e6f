//! Rays through a distance field.

use crate::geom::{interpolate, vector::along};
use crate::map::Tsdf;

/// Where a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayCast {
    /// It meets a surface from its free side at this arc length (metres).
    Hit(f64),
    /// It enters space that was never observed, at this arc length.
    Unknown(f64),
    /// It leaves the map, at this arc length.
    Outside(f64),
    /// Nothing up to the largest length asked for.
    Free,
}

/// How rays are cast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastSettings {
    /// Cells of smaller weight count as never observed.
    pub min_weight: f32,
    /// Follow rays no further (metres).
    pub max_range: f64,
    /// Pass over unknown space this long (metres) before calling it unknown: beams see past the gaps between
    /// beams.
    pub unknown_tolerance: f64,
}

impl Default for RayCastSettings {
    fn default() -> Self {
        Self { min_weight: 0.5, max_range: 100.0, unknown_tolerance: 0.0 }
    }
}

/// Casts a ray (world, unit direction) through a field: steps of half a cell over the interpolated field until
/// its sign turns from free to occupied, then the root of the line between the two samples. O(length).
pub fn cast_ray<const D: usize>(
    tsdf: &Tsdf<D>,
    origin: [f64; D],
    direction: [f64; D],
    settings: &RayCastSettings,
) -> RayCast {
    let grid = tsdf.grid();
    let strides = grid.strides();
    let planes = tsdf.store().planes();
    let bounds = grid.aabb();
    let step = 0.5 * grid.lattice.resolution;
    let mut last: Option<(f64, f64)> = None;
    let mut unknown_since = None;
    let mut n = 0.0;
    loop {
        let s = n * step;
        n += 1.0;
        if s > settings.max_range {
            return RayCast::Free;
        }
        let p = along(origin, direction, s);
        if !bounds.contains(p) {
            return RayCast::Outside(s);
        }
        let known = grid.interpolation(p).and_then(|(base, fraction)| {
            let at = grid.index(base)?;
            let observed = (0..1usize << D).all(|c| {
                let corner: usize = (0..D).map(|k| ((c >> k) & 1) * strides[k]).sum();
                let weight = planes.weights()[at + corner];
                weight > 0.0 && weight >= settings.min_weight
            });
            observed.then(|| interpolate(planes.distances(), &strides, at, &fraction).0)
        });
        match (known, last) {
            (Some(d), Some((before, at))) if before >= 0.0 && d < 0.0 => {
                return RayCast::Hit(at + (s - at) * before / (before - d));
            }
            (Some(d), _) => {
                last = Some((d, s));
                unknown_since = None;
            }
            (None, _) => {
                let since = *unknown_since.get_or_insert(s);
                last = None;
                if s - since >= settings.unknown_tolerance {
                    return RayCast::Unknown(since);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::TsdfConfig;

    fn wall<const D: usize>() -> Tsdf<D> {
        let mut tsdf =
            Tsdf::new(TsdfConfig { cells: [20; D], resolution: 0.1, truncation: 0.3, ..Default::default() })
                .unwrap();
        for i in 0..tsdf.grid().len() {
            let cell = tsdf.grid().cell(i);
            let x = tsdf.grid().lattice.center(cell)[0];
            if x < 1.5 {
                tsdf.fuse(cell, 1.234 - x, 1.0);
            }
        }
        tsdf
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
