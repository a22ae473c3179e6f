//! What the three questions cost each representation.

use super::crossover::cloud_crossover;
use super::measured::Gallery;
use super::probes::{Clock, points, seconds_of, seconds_per_probe};
use super::row::{Cost, Workload, winners};
use crate::MapRepr;
use portolan::field::EsdfGrid;
use portolan::geom::{Grid, vector};
use portolan::map::{OccupancyGrid, Quadtree, Tsdf2};
use portolan::store::Store;
use portolan::surface::{Ambiguity, Contour, level_set, marching_squares};

/// Searches get one in so many probes: each takes about as many times longer.
pub(super) const FEWER: usize = 50;

/// What a workload costs each row, in their order.
type Costs = [Option<Cost>; 9];

impl Gallery {
    /// Asks every representation one of the questions anew, with `probes` points (searches get a fiftieth); updates who
    /// wins it, and for distances where the cloud loses to the ESDF. Other costs stay as they were measured.
    pub fn measure(&mut self, workload: Workload, probes: usize, clock: &mut Clock<'_>) {
        let everywhere = points(&self.tsdf.grid().aabb(), probes);
        let few = &everywhere[..everywhere.len().div_ceil(FEWER)];
        let costs = match workload {
            Workload::Occupancy => self.occupancy_costs(clock, &everywhere, few),
            Workload::Distance => self.distance_costs(clock, &everywhere, few),
            Workload::Surface => self.surface_costs(clock),
        };
        for (row, cost) in self.rows.iter_mut().zip(costs) {
            *workload.cost_mut(row) = cost;
        }
        (self.winners, self.never_win) = winners(&self.rows);
        if workload == Workload::Distance {
            let esdf = self.rows.iter().find(|r| r.name.starts_with("ESDF")).and_then(|r| r.distance);
            let seconds = esdf.map_or(0.0, |c| c.seconds);
            self.cloud_crossover = cloud_crossover(clock, self.cloud.points(), few, seconds);
        }
    }

    fn occupancy_costs(&self, clock: &mut Clock<'_>, everywhere: &[[f64; 2]], few: &[[f64; 2]]) -> Costs {
        let mut tree = |map: &Quadtree| Cost::direct(time_occupancy(clock, everywhere, map));
        let trees = [&self.tree, &self.chapter_tree].map(&mut tree);
        let mut sign = |map: &Tsdf2| Cost::by(time_occupancy(clock, everywhere, map), "sign of D");
        let signs = [&self.tsdf, &self.marched].map(&mut sign);
        let grid = Cost::direct(time_occupancy(clock, everywhere, &self.occupancy));
        let distance = self.distance();
        let esdf = seconds_per_probe(clock, everywhere, |p| sign_of(distance, p).unwrap_or(0.0));
        let inside = |p| f64::from(u8::from(self.contour.is_inside(p) == Some(true)));
        let contour = seconds_per_probe(clock, few, inside);
        let hits = Cost::by(time_occupancy(clock, everywhere, &self.hits), "share that ends");
        let derived = [Cost::by(esdf, "sign of d"), Cost::by(contour, "crossing count")];
        [grid, trees[0], trees[1], signs[0], signs[1], hits, derived[0], derived[1], None]
    }

    fn distance_costs(&self, clock: &mut Clock<'_>, everywhere: &[[f64; 2]], few: &[[f64; 2]]) -> Costs {
        let limit = vector::norm(self.tsdf.grid().aabb().extent());
        let rings = |p| self.occupancy.search_distance_by_rings(p, limit).unwrap_or(0.0);
        let grid = Cost::by(seconds_per_probe(clock, few, rings), "ring search");
        let distance = self.distance();
        let read = |p| distance.distance(p).known().unwrap_or(0.0);
        let esdf = Cost::direct(seconds_per_probe(clock, everywhere, read));
        let nearest = |p| self.contour.nearest_distance(p).unwrap_or(0.0);
        let contour = Cost::by(seconds_per_probe(clock, few, nearest), "brute force");
        let nearest = |p| self.cloud.nearest_distance(p).unwrap_or(0.0);
        let cloud = Cost::direct(seconds_per_probe(clock, few, nearest));
        [grid, None, None, None, None, None, esdf, contour, cloud]
    }

    fn surface_costs(&self, clock: &mut Clock<'_>) -> Costs {
        let mut squares =
            |make: &dyn Fn() -> Contour| Cost::by(seconds_of(clock, make).0, "marching squares");
        let of_tsdf = |map: &Tsdf2| marching_squares(map, &self.contour_settings);
        [
            squares(&|| contour_of_grid(&self.occupancy)),
            squares(&|| contour_of_tree(&self.tree)),
            squares(&|| contour_of_tree(&self.chapter_tree)),
            squares(&|| of_tsdf(&self.tsdf)),
            squares(&|| of_tsdf(&self.marched)),
            None,
            squares(&|| zero_of(self.distance())),
            Cost::direct(0.0),
            None,
        ]
    }
}

fn time_occupancy(clock: &mut Clock<'_>, points: &[[f64; 2]], map: &impl MapRepr<2>) -> f64 {
    seconds_per_probe(clock, points, |p| map.occupancy(p).unwrap_or(0.0))
}

/// The boundary between free and occupied cells of a grid.
pub(super) fn contour_of_grid(map: &OccupancyGrid<2>) -> Contour {
    occupancy_contour(map.store().grid(), |cell| map.store().cell(cell).map(|v| v.0))
}

/// The boundary between free and occupied cells of a tree, over all that its root covers.
pub(super) fn contour_of_tree(map: &Quadtree) -> Contour {
    let own = Grid { lattice: *map.store().lattice(), shape: map.store().grid().shape };
    occupancy_contour(&own, |cell| map.store().cell(cell).map(|v| v.0))
}

/// Log odds as a field, occupied negative.
fn occupancy_contour(grid: &Grid<2>, value: impl Fn([i32; 2]) -> Option<i8>) -> Contour {
    let samples: Vec<f32> =
        (0..grid.len()).map(|i| value(grid.cell(i)).map_or(f32::NAN, |v| 0.5 - f32::from(v))).collect();
    level_set(grid, &samples, |i| !samples[i].is_nan(), Ambiguity::Decide)
}

/// 1 where the distance of the cell that holds a point is negative, 0 where it is not; `None` where it is unknown.
pub(super) fn sign_of(field: &EsdfGrid<2>, p: [f64; 2]) -> Option<f64> {
    let d = *field.samples().get(field.grid().index_of(p)?)?;
    (!d.is_nan()).then_some(if d < 0.0 { 1.0 } else { 0.0 })
}

/// Where a distance field is zero.
pub(super) fn zero_of(field: &EsdfGrid<2>) -> Contour {
    let samples = field.samples();
    level_set(field.grid(), samples, |i| !samples[i].is_nan(), Ambiguity::Decide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gallery::{GallerySettings, run};
    use portolan::geom::Pose;
    use portolan::scan::Scan;

    #[test]
    fn one_workload_is_measured_without_the_others() {
        let circle: Vec<[f64; 2]> =
            (0..64).map(|i| f64::from(i) * 0.1).map(|a| [1.5 * a.cos(), 1.5 * a.sin()]).collect();
        let log = [(Pose::<2>::IDENTITY, Scan::from_points(&circle))];
        let settings = GallerySettings::new(Grid::new([-2.0; 2], 0.1, [40, 40]), 100, None);
        // A clock that counts how often it was read: a round of n probes seems to take a 1/n of a second each.
        let mut calls = 0.0;
        let mut clock = || {
            calls += 1.0;
            calls
        };
        let mut gallery = run(&log, &settings, None, &mut clock).unwrap();
        let before = gallery.rows.clone();
        gallery.measure(Workload::Occupancy, 400, &mut clock);
        for (old, new) in before.iter().zip(&gallery.rows) {
            assert_eq!((old.distance, old.surface), (new.distance, new.surface), "{}", old.name);
            assert_eq!(old.occupancy.is_some(), new.occupancy.is_some());
        }
        assert_eq!(before[0].occupancy.unwrap().seconds, 1.0 / 100.0);
        assert_eq!(gallery.rows[0].occupancy.unwrap().seconds, 1.0 / 400.0);
        assert_eq!(gallery.winners, winners(&gallery.rows).0);
    }
}
