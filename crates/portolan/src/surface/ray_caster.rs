//! Rays through a distance field in bricks.

use super::ray_cast::{FieldSample, is_ray, march, normal};
use super::{RayCast, RayCastSettings, RayTrace};
use crate::cell::{Planes, SignedDistance};
use crate::geom::vector::along;
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, interpolate};
use crate::store::{Bricks, Store};
use crate::sweep::clip;

/// Casts rays through a field in bricks, as [`cast_ray`](super::cast_ray) does through an array.
#[derive(Clone, Debug)]
pub struct RayCaster<'a, const D: usize> {
    store: &'a Bricks<SignedDistance, D>,
    /// Bounding box of all bricks.
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

    /// The settings.
    pub fn settings(&self) -> &RayCastSettings {
        &self.settings
    }

    /// Where a ray (world, unit direction) ends. `Outside` where it leaves the bounding box of all bricks or never enters
    /// it, and for a ray that is not finite or whose direction is far from length one. The part of a ray before the box is
    /// unknown space. Missing bricks are skipped in one step. O(length in existing bricks).
    pub fn cast(&self, origin: [f64; D], direction: [f64; D]) -> RayCast {
        self.follow(origin, direction).0
    }

    /// [`RayCaster::cast`] with the length in unknown space and the normal at a hit; as
    /// [`trace_ray`](super::trace_ray) through an array.
    pub fn trace(&self, origin: [f64; D], direction: [f64; D]) -> RayTrace<D> {
        let (end, unknown) = self.follow(origin, direction);
        let sample = |s| self.sample(along(origin, direction, s), direction, s);
        RayTrace { end, unknown, normal: normal(end, sample) }
    }

    fn follow(&self, origin: [f64; D], direction: [f64; D]) -> (RayCast, f64) {
        let inside = clip(&self.bounds, origin, direction, self.settings.max_range);
        let Some((enter, leave)) = inside.filter(|_| is_ray(origin, direction)) else {
            return (RayCast::Outside(0.0), 0.0);
        };
        let resolution = self.store.lattice().resolution;
        march(0.5 * resolution, &self.settings, |s| {
            if s > leave {
                return FieldSample::Outside;
            }
            if s < enter {
                return FieldSample::Unknown { until: enter };
            }
            match self.sample(along(origin, direction, s), direction, s) {
                FieldSample::Unknown { until } => FieldSample::Unknown { until: until.min(leave) },
                other => other,
            }
        })
    }

    fn sample(&self, p: [f64; D], direction: [f64; D], s: f64) -> FieldSample<D> {
        let lattice = self.store.lattice();
        let nothing = FieldSample::Unknown { until: s };
        // In cells from the center of cell 0: samples lie at integers.
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
            return FieldSample::Unknown { until: s + cells * lattice.resolution };
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
        FieldSample::Known(value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Grid;
    use crate::map::DenseTsdf;
    use crate::surface::ray_cast::tests::wall;
    use crate::surface::{cast_ray, trace_ray};

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
        let bricks: Bricks<_, _> = tsdf.store().into();
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
        let mut bricks: Bricks<_, 3> = wall().store().into();
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
        let bricks: Bricks<_, _> = tsdf.store().into();
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
}
