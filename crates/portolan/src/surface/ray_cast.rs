//! Rays through a distance field.

use crate::cell::{Planes, SignedDistance};
use crate::geom::vector::{along, norm, unit};
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, interpolate};
use crate::map::{DistanceMap, Tsdf};
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

/// A ray's end, and what it went through on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayTrace<const D: usize> {
    /// Where it ends.
    pub end: RayCast,
    /// Length in unknown space that it passed over before its end (metres), to half a cell at each border: more than zero
    /// only where [`RayCastSettings::unknown_tolerance`] or [`RayCastSettings::blind`] allow it.
    pub unknown: f64,
    /// At a hit: away from the surface, at length one, from the derivative of the field there. `None` where it does not
    /// hit, or not all cells around the place were observed.
    pub normal: Option<[f64; D]>,
}

/// How rays are cast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastSettings {
    /// Cells of smaller weight count as never observed. `None`: what fits the map
    /// ([`Thresholds::observed`](crate::map::Thresholds::observed)), and any weight above 0 where cells alone are given.
    pub min_weight: Option<f32>,
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
        Self { min_weight: None, max_range: 100.0, unknown_tolerance: 0.0, blind: 0.0 }
    }
}

impl RayCastSettings {
    /// The default, with the weight that fits a map written out: for rays through its cells alone.
    pub fn of<const D: usize>(map: &impl DistanceMap<D>) -> Self {
        Self::default().fitted(map)
    }

    fn fitted<const D: usize>(self, map: &impl DistanceMap<D>) -> Self {
        Self { min_weight: self.min_weight.or(Some(map.thresholds().observed)), ..self }
    }

    #[inline(always)]
    fn observed(&self, weight: f32) -> bool {
        weight > 0.0 && self.min_weight.is_none_or(|least| weight >= least)
    }
}

/// Casts a ray (world, unit direction) through a field: steps of half a cell over the interpolated field until
/// its sign turns from free to occupied, then the root of the line between the two samples. What is no ray (NaN, a
/// direction far from length one) is outside at once. O(length).
pub fn cast_ray<const D: usize>(
    tsdf: &DenseTsdf<D>,
    origin: [f64; D],
    direction: [f64; D],
    settings: &RayCastSettings,
) -> RayCast {
    cast_dense(tsdf, origin, direction, &settings.fitted(tsdf)).0
}

/// [`cast_ray`], with what the ray went through and the normal where it hits.
///
/// ```
/// use portolan::geom::Grid;
/// use portolan::map::{Tsdf2, TsdfConfig};
/// use portolan::surface::{RayCast, RayCastSettings, trace_ray};
///
/// // A wall at x = 1 m, and a gap in what was seen before it.
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
        normal: normal(end, |s| look_dense(tsdf, along(origin, direction, s), s, settings)),
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
    march(step, settings, |s| look_dense(tsdf, along(origin, direction, s), s, settings))
}

#[inline(always)]
fn look_dense<const D: usize>(
    tsdf: &DenseTsdf<D>,
    p: [f64; D],
    s: f64,
    settings: &RayCastSettings,
) -> Seen<D> {
    let grid = tsdf.grid();
    let strides = grid.strides();
    let planes = tsdf.store().planes();
    if !grid.aabb().contains(p) {
        return Seen::Outside;
    }
    let known = grid.interpolation(p).and_then(|(base, fraction)| {
        let at = grid.index(base)?;
        let observed = (0..1usize << D).all(|c| {
            let corner: usize = (0..D).map(|k| ((c >> k) & 1) * strides[k]).sum();
            settings.observed(planes.weights()[at + corner])
        });
        observed.then(|| interpolate(planes.distances(), &strides, at, &fraction))
    });
    known.map_or(Seen::Unknown { until: s }, |(value, slope)| Seen::Known(value, slope))
}

/// Whether a ray goes anywhere: with another length its steps would be, too, down to none.
fn is_ray<const D: usize>(origin: [f64; D], direction: [f64; D]) -> bool {
    (0.5..2.0).contains(&norm(direction)) && origin.iter().all(|v| v.is_finite())
}

/// What a field says at a point of a ray.
enum Seen<const D: usize> {
    /// Value, and slope per cell.
    Known(f64, [f64; D]),
    /// Nothing is known from here to this arc length at least.
    Unknown {
        until: f64,
    },
    Outside,
}

/// The normal at the end of a ray, where it hits.
fn normal<const D: usize>(end: RayCast, look: impl Fn(f64) -> Seen<D>) -> Option<[f64; D]> {
    let RayCast::Hit(s) = end else { return None };
    match look(s) {
        Seen::Known(_, slope) => unit(slope),
        _ => None,
    }
}

/// Looks along a ray every `step` metres until it ends; also the length in unknown space before that.
fn march<const D: usize>(
    step: f64,
    settings: &RayCastSettings,
    look: impl Fn(f64) -> Seen<D>,
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
        match (look(s), last) {
            (Seen::Outside, _) => return (RayCast::Outside(s), passed + open(s)),
            (Seen::Known(d, _), Some((before, at))) if before >= 0.0 && d < 0.0 => {
                return (RayCast::Hit(at + (s - at) * before / (before - d)), passed);
            }
            (Seen::Known(d, _), _) => {
                passed += open(s);
                last = Some((d, s));
                unknown_since = None;
            }
            (Seen::Unknown { until }, _) => {
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

/// Casts rays through a field in bricks, as [`cast_ray`] does through an array.
#[derive(Clone, Debug)]
pub struct RayCaster<'a, const D: usize> {
    store: &'a Bricks<SignedDistance, D>,
    /// Of all bricks.
    bounds: Aabb<D>,
    settings: RayCastSettings,
}

impl<'a, const D: usize> RayCaster<'a, D> {
    /// Rays through these cells. [`RayCastSettings::of`] are the settings that fit a map. O(bricks).
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

    /// Where a ray (world, unit direction) ends. Outside: it leaves the box of all bricks, never enters it, or is no ray
    /// (NaN, a direction far from length one). A ray that begins outside of the box has passed unknown space where it
    /// enters. Bricks that are not there are passed over at once. O(length in bricks that are there).
    pub fn cast(&self, origin: [f64; D], direction: [f64; D]) -> RayCast {
        self.follow(origin, direction).0
    }

    /// [`RayCaster::cast`], with what the ray went through and the normal where it hits; as [`trace_ray`] of an array.
    pub fn trace(&self, origin: [f64; D], direction: [f64; D]) -> RayTrace<D> {
        let (end, unknown) = self.follow(origin, direction);
        let look = |s| self.look(along(origin, direction, s), direction, s);
        RayTrace { end, unknown, normal: normal(end, look) }
    }

    fn follow(&self, origin: [f64; D], direction: [f64; D]) -> (RayCast, f64) {
        let inside = clip(&self.bounds, origin, direction, self.settings.max_range);
        let Some((enter, leave)) = inside.filter(|_| is_ray(origin, direction)) else {
            return (RayCast::Outside(0.0), 0.0);
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

    fn look(&self, p: [f64; D], direction: [f64; D], s: f64) -> Seen<D> {
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
        let (value, slope) = interpolate(&corners, &std::array::from_fn(|k| 1 << k), 0, &fraction);
        Seen::Known(value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Grid;
    use crate::map::TsdfConfig;

    fn wall<const D: usize>() -> DenseTsdf<D> {
        let mut tsdf = DenseTsdf::covering(
            &Grid::new([0.0; D], 0.1, [20; D]),
            TsdfConfig { truncation: 0.3, ..Default::default() },
        )
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
    fn in_bricks<const D: usize>(tsdf: &DenseTsdf<D>) -> Bricks<SignedDistance, D> {
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
        let mut tsdf =
            DenseTsdf::covering(&Grid { shape: [16; D], ..*whole.grid() }, *whole.config()).unwrap();
        for i in 0..tsdf.grid().len() {
            let cell = tsdf.grid().cell(i);
            if let Some(v) = whole.store().cell(cell).filter(|_| !(cell[0] == 8 && cell[1] < 9)) {
                tsdf.fuse(cell, f64::from(v.distance), 1.0);
            }
        }
        let bricks = in_bricks(&tsdf);
        let (mut counts, mut normals, mut passed) = ([0; 4], 0, 0);
        for i in 0..2000 {
            let at = |a: f64| (f64::from(i) * a).fract();
            let origin: [f64; D] = std::array::from_fn(|k| 0.1 + 1.3 * at([0.618, 0.755, 0.569][k]));
            let aim: [f64; D] = std::array::from_fn(|k| at([0.327, 0.819, 0.671][k]) - 0.4);
            let Some(direction) = crate::geom::vector::unit(aim) else { continue };
            let tolerance = [0.0, 0.25, f64::INFINITY][i as usize % 3];
            let settings =
                RayCastSettings { unknown_tolerance: tolerance, max_range: 0.9, ..Default::default() };
            let traced = [
                RayCaster::new(&bricks, settings).trace(origin, direction),
                trace_ray(&tsdf, origin, direction, &settings),
            ];
            let [got, want] = traced.map(|t| t.end);
            assert_eq!(got, RayCaster::new(&bricks, settings).cast(origin, direction));
            assert_eq!(want, cast_ray(&tsdf, origin, direction, &settings));
            // In bricks a ray that begins in unknown space at the border is followed on from there; else the same.
            assert!((traced[0].unknown - traced[1].unknown).abs() < 0.06, "{traced:?}");
            assert!(traced[0].unknown == 0.0 || tolerance > 0.0);
            if let (Some(a), Some(b)) = (traced[0].normal, traced[1].normal) {
                // The wall is flat: off by what f32 distances leave of a slope over a cell.
                assert!(crate::geom::vector::distance(a, b) < 1e-6 && a[0] < -1.0 + 1e-6);
                normals += 1;
            }
            passed += usize::from(matches!(want, RayCast::Hit(_)) && traced[1].unknown > 0.0);
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
        assert!(normals > 20 && passed > 5, "{normals} {passed}");
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
    fn what_is_no_ray_is_outside_and_ends() {
        let tsdf = wall::<2>();
        let bricks = in_bricks(&tsdf);
        let settings = RayCastSettings {
            max_range: f64::INFINITY,
            unknown_tolerance: f64::INFINITY,
            ..Default::default()
        };
        let rays = RayCaster::new(&bricks, settings);
        let (at, ahead) = ([0.5; 2], [1.0, 0.0]);
        for (origin, direction) in
            [(at, [0.0; 2]), (at, [f64::NAN, 1.0]), (at, [1e-150, 0.0]), ([f64::NAN, 0.5], ahead)]
        {
            assert_eq!(rays.cast(origin, direction), RayCast::Outside(0.0));
            assert_eq!(cast_ray(&tsdf, origin, direction, &settings), RayCast::Outside(0.0));
        }
        // Behind the wall nothing is known to the end.
        let trace = rays.trace([1.46, 0.5], ahead);
        assert!(matches!(trace.end, RayCast::Outside(_)) && trace.unknown > 0.1 && trace.normal.is_none());
    }

    #[test]
    fn hits_where_the_wall_is_2d_and_3d() {
        hits_where_the_wall_is::<2>();
        hits_where_the_wall_is::<3>();
    }
}
