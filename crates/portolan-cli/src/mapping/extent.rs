//! How large a map must be, and whether there is memory for it.

use anyhow::{anyhow, bail};
use portolan::cell::Cell;
use portolan::geom::vector::{along, distance};
use portolan::geom::{Aabb, BLOCK_EDGE, Grid, Pose};
use portolan::scan::Scan;
use portolan::store::{Bricks, Store};
use portolan_io::MapFile;
use serde_json::Value;

use super::recipe::MARGIN_CELLS;
use super::{MapKind, Settings};
use crate::arguments::shown_bytes;
use crate::json;

/// The largest cell index that is computed with (an f64 holds whole numbers up to 2^53).
const LARGEST_INDEX: f64 = (1u64 << 45) as f64;

/// The box that the maps of a run cover.
pub(crate) enum Extent {
    /// The grid of dense maps.
    Two(Grid<2>),
    /// The box of all bricks.
    Three(Aabb<3>),
    /// Of a map that is larger than memory.
    OnDisk,
}

impl Extent {
    /// Of a map in bricks.
    pub(super) fn of_bricks(file: &MapFile<3>) -> Self {
        let occupancy = file.occupancy_bricks.as_ref().map_or(Aabb::EMPTY, |map| brick_extent(&map.store));
        let tsdf = file.tsdf_bricks.as_ref().map_or(Aabb::EMPTY, |map| brick_extent(&map.store));
        let attenuation = file.attenuation.as_ref().map_or(Aabb::EMPTY, |map| brick_extent(&map.store));
        Self::Three(occupancy.union(tsdf).union(attenuation))
    }

    /// For `summary.json`.
    pub(super) fn to_json(&self) -> Value {
        match self {
            Self::Two(grid) => json::grid(grid),
            Self::Three(bounds) => json::aabb(bounds),
            Self::OnDisk => Value::Null,
        }
    }
}

/// The box of all bricks of a store (meters).
pub(crate) fn brick_extent<C: Cell, const D: usize>(store: &Bricks<C, D>) -> Aabb<D> {
    let mut extent = Aabb::EMPTY;
    for (key, _) in store.bricks_by_age() {
        let first = key.first_cell();
        extent.include(store.lattice().corner(first));
        extent.include(store.lattice().corner(first.map(|c| c + BLOCK_EDGE as i32)));
    }
    extent
}

/// A hint where some bricks lie far from all others, as single returns from beyond windows do; `None`: there are none.
pub(crate) fn strays<C: Cell>(store: &Bricks<C, 3>) -> Option<String> {
    let last = store.len().checked_sub(1)?;
    let edge = store.lattice().resolution * BLOCK_EDGE as f64;
    let side = |k: usize| {
        let mut all: Vec<i32> = store.bricks_by_age().map(|(key, _)| key.0[k]).collect();
        let whole = f64::from(*all.iter().max()? - *all.iter().min()? + 1);
        let stray = last / 100;
        let low = *all.select_nth_unstable(stray).1;
        let high = *all.select_nth_unstable(last - stray).1;
        Some([whole * edge, f64::from(high - low + 1) * edge])
    };
    let sides = [side(0)?, side(1)?, side(2)?];
    let [whole, usual] = sides.into_iter().max_by(|a, b| (a[0] - a[1]).total_cmp(&(b[0] - b[1])))?;
    let diagonal = sides.iter().map(|s| s[1] * s[1]).sum::<f64>().sqrt().ceil();
    (whole > 2.0 * usual && whole > usual + 20.0).then(|| {
        format!(
            "the map is {whole:.0} m wide, and all but a hundredth of it on each side lies within {usual:.0} m: single returns from \
             far away decide its size; --max-range {diagonal} leaves them out"
        )
    })
}

/// Box of everything that the scans saw, free ends of beams and the sensor included.
pub(crate) fn seen(scans: &[(Pose<2>, Scan<2>)]) -> Aabb<2> {
    let mut bounds = Aabb::EMPTY;
    for (world_from_sensor, scan) in scans {
        bounds.include(world_from_sensor.translation);
        for (i, beam) in scan.beams().enumerate().filter(|(_, b)| b.free_range() > 0.0) {
            let direction = world_from_sensor.rotate(beam.direction);
            let origin = world_from_sensor.transform_point(scan.origin(i));
            bounds.include(along(origin, direction, beam.free_range()));
        }
    }
    bounds
}

/// The grid for what was seen or, where they were given, for the bounds; joined with the grid of a map that is to grow.
pub(crate) fn grid_over(
    seen: Aabb<2>,
    settings: &Settings,
    before: Option<Grid<2>>,
    log: &str,
) -> anyhow::Result<Grid<2>> {
    let r = settings.resolution();
    let bounds = match settings.bounds {
        Some(bounds) => bounds.in_2d("the log")?,
        None => seen.grown(settings.truncation() + MARGIN_CELLS * r),
    };
    let held = bounds.min.iter().chain(&bounds.max).all(|v| (v / r).abs() < LARGEST_INDEX);
    let grid = if held { Grid::covering(bounds, r) } else { None };
    let Some(grid) = grid else {
        let [w, h] = bounds.extent();
        bail!(
            "{log}: the extent is {w:.3e} x {h:.3e} m around ({:.3e}, {:.3e}), too much for cells of {r} m; \
             give --bounds x0,y0,x1,y1 or a coarser --resolution",
            0.5 * (bounds.min[0] + bounds.max[0]),
            0.5 * (bounds.min[1] + bounds.max[1]),
        );
    };
    Ok(before.map_or(grid, |before| joined(&before, &grid)))
}

/// The smallest grid of the lattice that holds both. In whole cells, so that nothing is rounded.
fn joined(a: &Grid<2>, b: &Grid<2>) -> Grid<2> {
    let r = a.lattice.resolution;
    let first = |g: &Grid<2>, k: usize| (g.lattice.origin[k] / r).round();
    let low = [0, 1].map(|k| first(a, k).min(first(b, k)));
    let end = [0, 1].map(|k| (first(a, k) + a.shape[k] as f64).max(first(b, k) + b.shape[k] as f64));
    // An axis that does not grow keeps its origin to the last bit.
    let origin = [0, 1].map(|k| if low[k] == first(a, k) { a.lattice.origin[k] } else { low[k] * r });
    Grid::new(origin, r, [0, 1].map(|k| (end[k] - low[k]) as usize))
}

/// Refuses what needs more memory than allowed, before any of it is taken.
pub(crate) fn check_memory(
    grid: &Grid<2>,
    settings: &Settings,
    scans: &[(Pose<2>, Scan<2>)],
    limit: u64,
    log: &str,
) -> anyhow::Result<()> {
    // Per cell: what the maps keep, and what deriving and writing takes on top (measured, rounded up).
    let per_cell = |kind: &MapKind| match kind {
        MapKind::Grid => 3.0,
        MapKind::Tree => 3.0,
        MapKind::Tsdf => 16.0,
        MapKind::Attenuation => 20.0,
        MapKind::Esdf => 24.0,
        MapKind::Contour | MapKind::Mesh => 1.0,
    };
    let cells: f64 = grid.shape.iter().map(|&s| s as f64).product();
    let beams: usize = scans.iter().map(|(_, s)| s.len()).sum();
    let needed = cells * settings.maps.iter().map(per_cell).sum::<f64>() + 40.0 * beams as f64;
    if needed <= limit as f64 {
        return Ok(());
    }
    let r = settings.resolution();
    let [w, h] = grid.aabb().extent();
    let coarser = two_digits_up(r * (needed / limit as f64).sqrt());
    bail!(
        "{log}: a map of {w:.1} x {h:.1} m with --resolution {r} needs about {} and --memory allows {}; \
         give --bounds x0,y0,x1,y1, --resolution {coarser} or coarser, or more --memory",
        shown_bytes(needed),
        shown_bytes(limit as f64),
    );
}

/// An error about the size of a map, with the scan named that makes it so large, if a single one does.
pub(crate) fn with_outlier(error: anyhow::Error, scans: &[(Pose<2>, Scan<2>)]) -> anyhow::Error {
    let mut positions: Vec<_> = scans.iter().map(|(p, _)| p.translation).collect();
    let mut median = [0.0; 2];
    for (k, m) in median.iter_mut().enumerate() {
        positions.sort_unstable_by(|a, b| a[k].total_cmp(&b[k]));
        *m = positions.get(positions.len() / 2).map_or(0.0, |p| p[k]);
    }
    let size = seen(scans).extent();
    let from_median = |i: &usize| distance(scans[*i].0.translation, median);
    match (0..scans.len()).max_by(|a, b| from_median(a).total_cmp(&from_median(b))) {
        Some(i) if size[0].max(size[1]) > 1e4 && from_median(&i) > 0.4 * size[0].max(size[1]) => {
            let ([x, y], off) = (scans[i].0.translation, from_median(&i));
            anyhow!("{error} (scan {i} lies at ({x:.4e}, {y:.4e}), {off:.1e} m from the others)")
        }
        _ => error,
    }
}

/// A round number not below `v`.
fn two_digits_up(v: f64) -> f64 {
    let unit = 10f64.powf(v.log10().floor() - 1.0);
    let text = format!("{:.1e}", (v / unit).ceil() * unit);
    text.parse().unwrap_or(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stray_bricks_are_told_with_a_remedy() {
        let mut store =
            Bricks::<portolan::cell::SignedDistance, 3>::new(portolan::geom::Lattice::new([0.0; 3], 0.1));
        let brick = || portolan::cell::DistanceBrick::from_parts(&[0.0; 512], &[1.0; 512]).unwrap();
        for i in 0..1000 {
            store.insert(portolan::geom::BlockKey([i % 10, i / 10 % 10, i / 100]), brick()).unwrap();
        }
        assert_eq!(strays(&store), None);
        store.insert(portolan::geom::BlockKey([550, 3, 3]), brick()).unwrap();
        let hint = strays(&store).unwrap();
        assert!(hint.contains("441 m wide") && hint.contains("--max-range 14"), "{hint}");
    }

    #[test]
    fn joining_grids_keeps_the_lattice() {
        let a = Grid::new([-3.0 * 0.05, 0.05 * 7.0], 0.05, [10, 10]);
        assert_eq!(joined(&a, &a), a);
        let b = Grid::new([5.0 * 0.05, 0.05 * -2.0], 0.05, [10, 4]);
        let both = joined(&a, &b);
        assert_eq!((both.shape, both.lattice.origin[0]), ([18, 19], a.lattice.origin[0]));
        assert!((both.lattice.origin[1] + 0.1).abs() < 1e-12);
    }

    #[test]
    fn suggestions_are_round() {
        assert_eq!(two_digits_up(0.0512), 0.052);
        assert_eq!(two_digits_up(3.0), 3.0);
        assert_eq!(two_digits_up(123.0), 130.0);
    }
}
