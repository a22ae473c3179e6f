//! What representations foretell of ranges: of maps made of nine scans in ten, at the poses of the tenth.
//!
//! A map of hits per meter gives a distribution of the range along a ray. The others give one range, where the ray meets
//! their surface or their first occupied cell; as in `eval` it is taken for the middle of a normal distribution of half a
//! cell. All share the same floor of outliers, so that log densities can be set beside each other.

use super::build::chapter_tree;
use super::measured::GallerySettings;
use portolan::beam_model::{ForetoldRanges, RangeFloor};
use portolan::cell::{AttenuationRule, LogOdds8, LogOddsValue};
use portolan::geom::{Pose, RayWalk};
use portolan::map::{Attenuation, BeamSweep, MapError, OccupancyGrid, Quadtree, Tsdf2, TsdfConfig};
use portolan::scan::Scan;
use portolan::store::Store;
use portolan::surface::{RangeNoise, RayCast, RayCastSettings, cast_ray};
use serde::Serialize;

/// One scan in so many is foretold, and not in the maps that foretell it.
const EVERY: usize = 10;

/// How well ranges were foretold that were not fused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Foretold {
    /// Hits of the scans that were held out.
    pub rays: usize,
    /// Share of them within 10 cm of the range that was foretold; where a map foretells a distribution, of its median.
    pub within_10_cm: f64,
    /// Median of the errors of these ranges (meters); where none was foretold, against the largest range.
    pub median_error: f64,
    /// Mean log density of the readings (nats a beam, densities per meter), with 5 % outliers up to the largest range.
    pub log_density: f64,
}

/// The maps that foretell, in the order of their rows.
pub(super) const FORETELLERS: usize = 6;

/// A ray: origin and direction (world), and the range that was read.
type Ray = ([f64; 2], [f64; 2], f64);

/// What grid, trees, signed distances, the textbook's march and hits per meter foretell; `None`: too few scans to hold any
/// out, or none of these hit anything.
pub(super) fn foretold(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
) -> Result<Option<[Foretold; FORETELLERS]>, MapError> {
    let is_held_out = |i: usize| i % EVERY == EVERY - 1;
    let held_out: Vec<_> = log.iter().enumerate().filter(|(i, _)| is_held_out(*i)).map(|(_, s)| s).collect();
    let rays: Vec<Ray> = held_out.iter().flat_map(|(pose, scan)| rays(pose, scan)).collect();
    if rays.is_empty() {
        return Ok(None);
    }
    let (grid, model) = (&settings.grid, settings.model);
    let march = TsdfConfig { beams: BeamSweep::March, carve: true, ..settings.tsdf };
    let mut occupancy = OccupancyGrid::covering(grid, model)?;
    let mut trees = [Quadtree::covering(grid, model)?, chapter_tree(grid, model)?];
    let mut fields =
        [Tsdf2::covering(grid, TsdfConfig { carve: true, ..settings.tsdf })?, Tsdf2::covering(grid, march)?];
    let mut hits = Attenuation::covering(grid, AttenuationRule::NEVER)?;
    for (_, (pose, scan)) in log.iter().enumerate().filter(|(i, _)| !is_held_out(*i)) {
        occupancy.integrate(pose, scan)?;
        for tree in &mut trees {
            tree.integrate(pose, scan)?;
        }
        for field in &mut fields {
            field.integrate(pose, scan)?;
        }
        hits.integrate(pose, scan)?;
    }
    let all = log.iter().flat_map(|(_, scan)| scan.beams().filter(|b| b.is_hit()).map(|b| b.range));
    let max_range = all.fold(grid.lattice.resolution, f64::max);
    let noise = RangeNoise::of_cells(grid.lattice.resolution, max_range);
    let one = |range: &dyn Fn(&Ray) -> Option<f64>| of_ranges(&rays, &noise, range);
    let cast = |field: &Tsdf2| {
        let settings = RayCastSettings { max_range, ..RayCastSettings::default() };
        one(&|(origin, direction, _)| match cast_ray(field, *origin, *direction, &settings) {
            RayCast::Hit(range) => Some(range),
            RayCast::Unknown(_) | RayCast::Outside(_) | RayCast::Free => None,
        })
    };
    let in_tree = |tree: &Quadtree| one(&|ray| first_occupied(tree.store(), ray, max_range));
    let mut ranges = ForetoldRanges::default();
    held_out.iter().for_each(|(pose, scan)| ranges.add_scan(&hits, pose, scan, max_range));
    let floor = RangeFloor { outliers: noise.outliers, max_range };
    let Some(score) = ranges.score(&floor) else { return Ok(None) };
    let of_hits = Foretold {
        rays: ranges.rays(),
        within_10_cm: score.within_10_cm,
        median_error: score.median_error,
        log_density: score.log_density,
    };
    Ok(Some([
        one(&|ray| first_occupied(occupancy.store(), ray, max_range)),
        in_tree(&trees[0]),
        in_tree(&trees[1]),
        cast(&fields[0]),
        cast(&fields[1]),
        of_hits,
    ]))
}

/// The hits of a scan.
fn rays(pose: &Pose<2>, scan: &Scan<2>) -> Vec<Ray> {
    let hits = scan.beams().enumerate().filter(|(_, b)| b.is_hit());
    hits.map(|(i, b)| (pose.transform_point(scan.origin(i)), pose.rotate(b.direction), b.range)).collect()
}

/// Of one range a ray.
fn of_ranges(rays: &[Ray], noise: &RangeNoise, range: impl Fn(&Ray) -> Option<f64>) -> Foretold {
    let (mut errors, mut nats) = (Vec::with_capacity(rays.len()), 0.0);
    for ray in rays {
        let foretold = range(ray);
        nats -= noise.negative_log_likelihood(foretold, ray.2);
        errors.push((foretold.unwrap_or(noise.max_range) - ray.2).abs());
    }
    errors.sort_unstable_by(f64::total_cmp);
    let n = rays.len();
    Foretold {
        rays: n,
        within_10_cm: errors.partition_point(|e| *e <= 0.1) as f64 / n as f64,
        median_error: errors[(n - 1) / 2],
        log_density: nats / n as f64,
    }
}

/// Where a ray is in the middle of the first cell that is more likely occupied than not; `None`: there is none, or the ray is
/// none.
fn first_occupied(
    store: &impl Store<LogOdds8, 2>,
    &(origin, direction, _): &Ray,
    max_range: f64,
) -> Option<f64> {
    let mut walk = RayWalk::new(store.lattice(), origin, direction)?;
    let mut entry = 0.0;
    while entry < max_range {
        let exit = walk.exit();
        if store.cell(walk.cell()).is_some_and(LogOdds8::is_occupied) {
            return Some(0.5 * (entry + exit));
        }
        entry = exit;
        walk.advance();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::geom::Grid;
    use portolan::scan::{Beam, BeamKind};

    /// A wall at x = 3 that every beam meets, at ranges that are noisy by a centimeter, and a curtain at x = 2 that stops one
    /// scan in five.
    fn log(scans: usize) -> Vec<(Pose<2>, Scan<2>)> {
        let scan = |i: usize| {
            let wall = if i % 5 == 3 { 2.02 } else { 3.02 } - 0.52;
            let beam = |k: i32| {
                let bearing = 0.01 * f64::from(k);
                let noise = 0.01 * ((i as f64 * 7.1 + f64::from(k) * 3.3).fract() - 0.5);
                Beam {
                    direction: [bearing.cos(), bearing.sin()],
                    range: wall / bearing.cos() + noise,
                    kind: BeamKind::Hit,
                }
            };
            (Pose::<2>::new(0.52, 1.02, 0.0), Scan::from_beams((-10..=10).map(beam)))
        };
        (0..scans).map(scan).collect()
    }

    #[test]
    fn what_was_held_out_is_foretold() {
        let settings = GallerySettings::new(Grid::new([0.0; 2], 0.05, [80, 40]), 100, None);
        let all = foretold(&log(60), &settings).unwrap().unwrap();
        // The scans that are held out all see the wall: 9, 19, .. are no thirds of five.
        for told in all {
            assert_eq!(told.rays, 6 * 21);
            assert!(told.log_density.is_finite() && told.median_error < 0.11, "{told:?}");
        }
        let [grid, tree, .., field, _, hits] = all;
        assert_eq!(grid, tree, "the same cells");
        // Most beams pass the curtain, and the field averages it away. Half of all beams and more come to the wall.
        assert!(field.within_10_cm > 0.95 && hits.within_10_cm > 0.95, "{field:?} {hits:?}");
        assert_eq!(foretold(&log(9), &settings).unwrap(), None, "nothing is held out");
    }

    #[test]
    fn the_first_occupied_cell_is_met_in_its_middle() {
        let settings = GallerySettings::new(Grid::new([0.0; 2], 0.05, [80, 40]), 100, None);
        let mut map = OccupancyGrid::covering(&settings.grid, settings.model).unwrap();
        for (pose, scan) in log(3) {
            map.integrate(&pose, &scan).unwrap();
        }
        let range = |y: f64, far| first_occupied(map.store(), &([0.52, y], [1.0, 0.0], 0.0), far);
        // The cell from 3 to 3.05.
        assert!((range(1.02, 9.0).unwrap() - (3.025 - 0.52)).abs() < 1e-9);
        assert_eq!((range(1.02, 2.4), range(1.9, 9.0)), (None, None));
        assert_eq!(first_occupied(map.store(), &([f64::NAN; 2], [1.0, 0.0], 0.0), 9.0), None);
    }
}
