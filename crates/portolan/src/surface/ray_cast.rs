//! Rays through a distance field.

use crate::cell::{Planes, SignedDistance};
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, interpolate, vector::along};
use crate::map::Tsdf;
use crate::store::{Bricks, Store};
use crate::sweep::clip;

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
    /// What is unknown up to this arc length is passed over (metres): close before a sensor no other has looked.
    pub blind: f64,
}

impl Default for RayCastSettings {
    fn default() -> Self {
        Self { min_weight: 0.5, max_range: 100.0, unknown_tolerance: 0.0, blind: 0.0 }
    }
}

impl RayCastSettings {
    #[inline(always)]
    fn observed(&self, weight: f32) -> bool {
        weight > 0.0 && weight >= self.min_weight
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
    march(0.5 * grid.lattice.resolution, settings, |s| {
        let p = along(origin, direction, s);
        if !bounds.contains(p) {
            return Seen::Outside;
        }
        let known = grid.interpolation(p).and_then(|(base, fraction)| {
            let at = grid.index(base)?;
            let observed = (0..1usize << D).all(|c| {
                let corner: usize = (0..D).map(|k| ((c >> k) & 1) * strides[k]).sum();
                settings.observed(planes.weights()[at + corner])
            });
            observed.then(|| interpolate(planes.distances(), &strides, at, &fraction).0)
        });
        known.map_or(Seen::Unknown { until: s }, Seen::Known)
    })
}

/// What a field says at a point of a ray.
enum Seen {
    Known(f64),
    /// Nothing is known from here to this arc length at least.
    Unknown {
        until: f64,
    },
    Outside,
}

/// Looks along a ray every `step` metres until it ends.
fn march(step: f64, settings: &RayCastSettings, look: impl Fn(f64) -> Seen) -> RayCast {
    let mut last: Option<(f64, f64)> = None;
    let mut unknown_since = None;
    let mut n = 0.0;
    loop {
        let s = n * step;
        n += 1.0;
        if s > settings.max_range {
            return RayCast::Free;
        }
        match (look(s), last) {
            (Seen::Outside, _) => return RayCast::Outside(s),
            (Seen::Known(d), Some((before, at))) if before >= 0.0 && d < 0.0 => {
                return RayCast::Hit(at + (s - at) * before / (before - d));
            }
            (Seen::Known(d), _) => {
                last = Some((d, s));
                unknown_since = None;
            }
            (Seen::Unknown { until }, _) => {
                let since = *unknown_since.get_or_insert(s);
                last = None;
                let end = until.max(s);
                if end >= settings.blind && end - since.max(settings.blind) >= settings.unknown_tolerance {
                    return RayCast::Unknown(since);
                }
                n = n.max((until.min(settings.max_range) / step).ceil());
            }
        }
    }
}

/// Casts rays through a field in bricks, as [`cast_ray`] does through an array.
#[derive(Clone, Debug)]
pub struct RayCaster<'a, const D: usize> {
    store: &'a Bricks<SignedDistance, D>,
    /// Of all bricks.
    bounds: Aabb<D>,
    settings: RayCastSettings,
}

impl<'a, const D: usize> RayCaster<'a, D> {
    /// Rays through this field. O(bricks).
    pub fn new(store: &'a Bricks<SignedDistance, D>, settings: RayCastSettings) -> Self {
        let mut bounds = Aabb::EMPTY;
        for (key, _) in store.bricks_by_age() {
            let first = key.first_cell();
            bounds = bounds.union(store.lattice().aabb(first, first.map(|c| c + BLOCK_EDGE as i32)));
        }
        Self { store, bounds, settings }
    }

    /// How rays are cast.
    pub fn settings(&self) -> &RayCastSettings {
        &self.settings
    }

    /// Where a ray (world, unit direction) ends. Outside: it leaves the box of all bricks, or never enters it. A ray that
    /// begins outside of the box has passed unknown space where it enters. Bricks that are not there are passed over at
    /// once. O(length in bricks that are there).
    pub fn cast(&self, origin: [f64; D], direction: [f64; D]) -> RayCast {
        let Some((enter, leave)) = clip(&self.bounds, origin, direction, self.settings.max_range) else {
            return RayCast::Outside(0.0);
        };
        let resolution = self.store.lattice().resolution;
        march(0.5 * resolution, &self.settings, |s| {
            if s > leave {
                return Seen::Outside;
            }
            if s < enter {
                return Seen::Unknown { until: enter };
            }
            match self.look(along(origin, direction, s), direction, s) {
                Seen::Unknown { until } => Seen::Unknown { until: until.min(leave) },
                seen => seen,
            }
        })
    }

    fn look(&self, p: [f64; D], direction: [f64; D], s: f64) -> Seen {
        let lattice = self.store.lattice();
        let nothing = Seen::Unknown { until: s };
        // In cells, from the centre of cell 0: between whole numbers lie the samples that are interpolated.
        let at = lattice.to_cells(p).map(|v| v - 0.5);
        let Some(base) = lattice.cell_of(std::array::from_fn(|k| p[k] - 0.5 * lattice.resolution)) else {
            return nothing;
        };
        let key = BlockKey::of_cell(base);
        let Some(brick) = self.store.brick(key) else {
            let first = key.first_cell();
            let exit = (0..D).filter(|&k| direction[k] != 0.0).map(|k| {
                let face = if direction[k] > 0.0 { BLOCK_EDGE as f64 } else { 0.0 };
                (f64::from(first[k]) + face - at[k]) / direction[k]
            });
            let cells = exit.fold(f64::INFINITY, f64::min).max(0.0);
            return Seen::Unknown { until: s + cells * lattice.resolution };
        };
        let inside = (0..D).all(|k| (base[k] & 7) < BLOCK_EDGE as i32 - 1);
        let mut corners = [0.0f32; 8];
        for (c, corner) in corners.iter_mut().enumerate().take(1 << D) {
            let cell: [i32; D] = std::array::from_fn(|k| base[k] + ((c >> k) & 1) as i32);
            let found = if inside { brick.get(BlockKey::offset(cell)) } else { self.store.cell(cell) };
            match found.filter(|f| self.settings.observed(f.weight)) {
                Some(found) => *corner = found.distance,
                None => return nothing,
            }
        }
        let fraction: [f64; D] = std::array::from_fn(|k| (at[k] - f64::from(base[k])).clamp(0.0, 1.0));
        Seen::Known(interpolate(&corners, &std::array::from_fn(|k| 1 << k), 0, &fraction).0)
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

    /// The same cells in bricks.
    fn in_bricks<const D: usize>(tsdf: &Tsdf<D>) -> Bricks<SignedDistance, D> {
        let mut bricks = Bricks::new(tsdf.grid().lattice);
        for i in 0..tsdf.grid().len() {
            let cell = tsdf.grid().cell(i);
            let Some(value) = tsdf.store().cell(cell) else { continue };
            let key = BlockKey::of_cell(cell);
            let mut brick: crate::cell::DistanceBrick =
                bricks.brick(key).cloned().unwrap_or_else(|| Planes::unobserved(BLOCK_EDGE.pow(D as u32)));
            brick.set(BlockKey::offset(cell), Some(value));
            bricks.insert(key, brick).unwrap();
        }
        bricks
    }

    fn bricks_say_what_an_array_says<const D: usize>() {
        // Whole bricks, so that both end at the same place; with a hole in what was observed.
        let whole = wall::<D>();
        let mut tsdf = Tsdf::new(TsdfConfig { cells: [16; D], ..*whole.config() }).unwrap();
        for i in 0..tsdf.grid().len() {
            let cell = tsdf.grid().cell(i);
            if let Some(v) = whole.store().cell(cell).filter(|_| !(cell[0] == 8 && cell[1] < 9)) {
                tsdf.fuse(cell, f64::from(v.distance), 1.0);
            }
        }
        let bricks = in_bricks(&tsdf);
        let mut counts = [0; 4];
        for i in 0..2000 {
            let at = |a: f64| (f64::from(i) * a).fract();
            let origin: [f64; D] = std::array::from_fn(|k| 0.1 + 1.3 * at([0.618, 0.755, 0.569][k]));
            let aim: [f64; D] = std::array::from_fn(|k| at([0.327, 0.819, 0.671][k]) - 0.4);
            let Some(direction) = crate::geom::vector::unit(aim) else { continue };
            let tolerance = [0.0, 0.25, f64::INFINITY][i as usize % 3];
            let settings =
                RayCastSettings { unknown_tolerance: tolerance, max_range: 0.9, ..Default::default() };
            let (got, want) = (
                RayCaster::new(&bricks, settings).cast(origin, direction),
                cast_ray(&tsdf, origin, direction, &settings),
            );
            match (got, want) {
                (RayCast::Hit(a), RayCast::Hit(b)) => assert!((a - b).abs() < 1e-9),
                (RayCast::Unknown(a), RayCast::Unknown(b)) => assert_eq!(a, b),
                (RayCast::Free, RayCast::Free) => {}
                (RayCast::Outside(a), RayCast::Outside(b)) => assert_eq!(a, b),
                other => panic!("{other:?} from {origin:?} along {direction:?}"),
            }
            counts[match want {
                RayCast::Hit(_) => 0,
                RayCast::Unknown(_) => 1,
                RayCast::Free => 2,
                RayCast::Outside(_) => 3,
            }] += 1;
        }
        assert!(counts.iter().all(|&n| n > 20), "{counts:?}");
    }

    #[test]
    fn bricks_say_what_an_array_says_2d_and_3d() {
        bricks_say_what_an_array_says::<2>();
        bricks_say_what_an_array_says::<3>();
    }

    #[test]
    fn what_is_not_there_is_passed_over() {
        // A wall in one brick, seen from 50 m away: with patience it is hit, without it is unknown.
        let mut bricks = in_bricks(&wall::<3>());
        let rays = RayCaster::new(
            &bricks,
            RayCastSettings { unknown_tolerance: f64::INFINITY, ..Default::default() },
        );
        let RayCast::Hit(s) = rays.cast([-50.0, 0.5, 0.5], [1.0, 0.0, 0.0]) else { panic!("no hit") };
        assert!((s - 51.234).abs() < 1e-4, "{s}");
        let rays = RayCaster::new(&bricks, RayCastSettings::default());
        assert_eq!(rays.cast([-50.0, 0.5, 0.5], [1.0, 0.0, 0.0]), RayCast::Unknown(0.0));
        assert_eq!(rays.cast([-50.0, 0.5, 0.5], [0.0, 1.0, 0.0]), RayCast::Outside(0.0));
        // Far bricks make the box large, and the way between them costs nothing.
        let brick = bricks.brick(BlockKey([0; 3])).cloned().unwrap();
        bricks.insert(BlockKey([-1_000_000, 0, 0]), brick).unwrap();
        let patient =
            RayCastSettings { unknown_tolerance: f64::INFINITY, max_range: 1e6, ..Default::default() };
        let rays = RayCaster::new(&bricks, patient);
        let RayCast::Hit(s) = rays.cast([-700_000.0, 0.5, 0.5], [1.0, 0.0, 0.0]) else { panic!("no hit") };
        assert!((s - 700_001.234).abs() < 1e-4, "{s}");
    }

    #[test]
    fn hits_where_the_wall_is_2d_and_3d() {
        hits_where_the_wall_is::<2>();
        hits_where_the_wall_is::<3>();
    }
}
