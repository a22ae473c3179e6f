//! Every map on the simulated Apartment: 240 x 180 cells of 5 cm, 200 scans of 360 beams.
//!
//! `update` fuses the whole lap into an empty map, so that its time is divided by 200 for a scan.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use portolan::Mapper;
use portolan::cell::OccupancyModel;
use portolan::field::{EsdfGrid, esdf_from_tsdf};
use portolan::geom::{Grid, Lattice, Pose};
use portolan::map::{
    BeamSweep, Cloud, MapError, Occupancy, OccupancyGrid, Quadtree, Tsdf, Tsdf2, TsdfConfig,
};
use portolan::scan::{Scan, ScanStats};
use portolan::surface::{ContourSettings, marching_squares};
use std::sync::LazyLock;

fn main() {
    divan::main();
}

static LOG: LazyLock<Vec<(Pose<2>, Scan<2>)>> =
    LazyLock::new(|| portolan_sim::lap(&portolan_sim::apartment().world, &Default::default()));
static TSDF: LazyLock<Tsdf2> = LazyLock::new(|| tsdf(BeamSweep::CellCentre, true));
static PROBES: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let at = |i: u32, a: f64| (0.5 + f64::from(i) * a).fract();
    (1..=10_000)
        .map(|i| [12.0 * at(i, 0.754_877_666_246_692_7), 9.0 * at(i, 0.569_840_290_998_053_2)])
        .collect()
});

fn grid() -> Grid<2> {
    Grid::new([0.0; 2], 0.05, [240, 180])
}

fn scans() -> ItemsCount {
    ItemsCount::new(LOG.len())
}

fn occupancy() -> OccupancyGrid<2> {
    let mut map = OccupancyGrid::covering(&grid(), OccupancyModel::default()).expect("a valid map");
    for (pose, scan) in LOG.iter() {
        map.integrate(pose, scan).expect("memory without limit");
    }
    map
}

fn quadtree(resolution: f64) -> Quadtree {
    let mut map = Quadtree::with_depth(Lattice::new([0.0; 2], resolution), 8, OccupancyModel::default())
        .expect("a valid map");
    for (pose, scan) in LOG.iter() {
        map.integrate(pose, scan).expect("memory without limit");
    }
    map
}

fn tsdf(sweep: BeamSweep, carve: bool) -> Tsdf2 {
    let config = TsdfConfig { beams: sweep, carve, ..TsdfConfig::textbook() };
    let mut map = Tsdf2::covering(&grid(), config).expect("a valid map");
    for (pose, scan) in LOG.iter() {
        map.integrate(pose, scan).expect("memory without limit");
    }
    map
}

/// Fuses the lap into a map in bricks.
fn in_bricks<M>(mut map: M, fuse: impl Fn(&mut M, &Pose<2>, &Scan<2>) -> Result<ScanStats, MapError>) -> M {
    for (pose, scan) in LOG.iter() {
        fuse(&mut map, pose, scan).expect("memory without limit");
    }
    map
}

mod update {
    use super::*;

    #[divan::bench]
    fn occupancy_bricks(bencher: Bencher) {
        let new = || Occupancy::<2>::new(grid().lattice, OccupancyModel::default()).expect("a valid map");
        bencher.counter(scans()).bench(|| in_bricks(new(), |map, pose, scan| map.integrate(pose, scan)));
    }

    #[divan::bench(args = [false, true])]
    fn tsdf_bricks(bencher: Bencher, carve: bool) {
        let config = TsdfConfig { carve, ..TsdfConfig::textbook() };
        let new = || Tsdf::<2>::new(config).expect("a valid map");
        bencher.counter(scans()).bench(|| in_bricks(new(), |map, pose, scan| map.integrate(pose, scan)));
    }

    #[divan::bench]
    fn mapper(bencher: Bencher) {
        let new = || Mapper::<2>::new(0.05);
        bencher.counter(scans()).bench(|| in_bricks(new(), |map, pose, scan| map.integrate(pose, scan)));
    }

    #[divan::bench]
    fn occupancy_grid(bencher: Bencher) {
        bencher.counter(scans()).bench(occupancy);
    }

    #[divan::bench]
    fn quadtree_5_cm(bencher: Bencher) {
        bencher.counter(scans()).bench(|| quadtree(0.05));
    }

    #[divan::bench]
    fn quadtree_6_25_cm(bencher: Bencher) {
        bencher.counter(scans()).bench(|| quadtree(0.0625));
    }

    #[divan::bench(args = [false, true])]
    fn tsdf_cell_centre(bencher: Bencher, carve: bool) {
        bencher.counter(scans()).bench(|| tsdf(BeamSweep::CellCentre, carve));
    }

    #[divan::bench(args = [false, true])]
    fn tsdf_march(bencher: Bencher, carve: bool) {
        bencher.counter(scans()).bench(|| tsdf(BeamSweep::March, carve));
    }
}

mod derive {
    use super::*;

    #[divan::bench]
    fn esdf() -> EsdfGrid<2> {
        esdf_from_tsdf(black_box(&TSDF), 0.5, 1.5)
    }

    #[divan::bench]
    fn contour() -> usize {
        marching_squares(black_box(&*TSDF), &ContourSettings::default()).segments.len()
    }

    #[divan::bench]
    fn cloud() -> Cloud<2> {
        Cloud::from_points(LOG.iter().flat_map(|(pose, scan)| scan.hits_world(pose)))
    }
}

mod probe {
    use super::*;

    fn bench(bencher: Bencher, ask: impl Fn([f64; 2]) -> Option<f64> + Sync) {
        bencher
            .counter(ItemsCount::new(PROBES.len()))
            .bench(|| PROBES.iter().filter_map(|&p| ask(black_box(p))).sum::<f64>());
    }

    #[divan::bench]
    fn occupancy_grid(bencher: Bencher) {
        let map = occupancy();
        bench(bencher, |p| map.probability(p).known());
    }

    #[divan::bench]
    fn occupancy_quadtree(bencher: Bencher) {
        let map = quadtree(0.05);
        bench(bencher, |p| map.probability(p).known());
    }

    #[divan::bench]
    fn occupancy_tsdf(bencher: Bencher) {
        bench(bencher, |p| TSDF.occupancy(p));
    }

    #[divan::bench]
    fn distance_esdf(bencher: Bencher) {
        let esdf = esdf_from_tsdf(&TSDF, 0.5, 1.5);
        bench(bencher, |p| esdf.distance(p).known());
    }

    #[divan::bench]
    fn distance_and_gradient_esdf(bencher: Bencher) {
        let esdf = esdf_from_tsdf(&TSDF, 0.5, 1.5);
        bench(bencher, |p| esdf.distance_and_gradient(p).known().map(|(d, g)| d + g[0] + g[1]));
    }

    #[divan::bench]
    fn distance_cloud(bencher: Bencher) {
        let cloud = Cloud::from_points(LOG.iter().flat_map(|(pose, scan)| scan.hits_world(pose)));
        bench(bencher, |p| cloud.nearest_distance(p));
    }

    #[divan::bench]
    fn distance_grid_by_ring_search(bencher: Bencher) {
        let map = occupancy();
        bench(bencher, |p| map.search_distance_by_rings(p, 15.0));
    }

    #[divan::bench(sample_count = 10)]
    fn distance_contour_by_brute_force(bencher: Bencher) {
        let contour = marching_squares(&*TSDF, &ContourSettings::default());
        bench(bencher, |p| contour.nearest_distance(p));
    }

    #[divan::bench(sample_count = 10)]
    fn inside_contour_by_crossings(bencher: Bencher) {
        let contour = marching_squares(&*TSDF, &ContourSettings::default());
        bench(bencher, |p| contour.is_inside(p).map(|inside| f64::from(u8::from(inside))));
    }
}
