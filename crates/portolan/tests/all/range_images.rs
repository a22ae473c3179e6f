//! What distances and misses have in common where they look into a range image: the seam, rows and columns of bare points.

use portolan::cell::LogOdds8;
use portolan::geom::{Lattice, Pose};
use portolan::map::{Occupancy, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, PointScan, RangeImage, Spherical};
use portolan::store::Store;
use portolan::sweep::WeightModel;
use std::f64::consts::TAU;

const RESOLUTION: f64 = 0.05;

/// Both maps after one scan.
struct Maps {
    distances: Tsdf3,
    occupancy: Occupancy<3, LogOdds8>,
}

impl Maps {
    fn of(frame: &Frame) -> Self {
        let config = TsdfConfig { resolution: RESOLUTION, ..TsdfConfig::textbook() };
        let lattice = Lattice::new([0.0; 3], RESOLUTION);
        let mut maps = Self {
            distances: Tsdf3::new(config).unwrap(),
            occupancy: Occupancy::new(lattice, Default::default()).unwrap(),
        };
        maps.distances.integrate(&Pose::IDENTITY, frame).unwrap();
        maps.occupancy.integrate(&Pose::IDENTITY, frame).unwrap();
        maps
    }

    /// Whether a cell is free in either map; `None`: never observed.
    fn is_free(&self, cell: [i32; 3]) -> [Option<bool>; 2] {
        let center = self.distances.lattice().center(cell);
        let behind = self.distances.occupancy(center);
        [behind.map(|p| p == 0.0), self.occupancy.is_occupied(cell).map(|occupied| !occupied)]
    }
}

/// A lidar of `columns` columns, of which a full turn has `turn`, in a hollow ball of 4 m.
fn ball(columns: usize, turn: f64, value: impl Fn(usize) -> f32) -> RangeImage {
    let elevations: Vec<f32> = (0..33).map(|row| 0.32 - 0.02 * row as f32).collect();
    let rows = elevations.len();
    let lidar = Spherical { elevations, first_azimuth: 0.7, azimuth_step: TAU / turn };
    let ranges: Vec<f32> = (0..columns * rows).map(|i| value(i % columns)).collect();
    let image = RangeImage::from_ranges(lidar, columns, ranges);
    assert_eq!(image.check(), Ok(()));
    image
}

/// Cells between 2.5 m and 3.5 m, near the sensor's height, with the column that their center falls on, in `-1..turn - 1`.
fn cells_by_column(turn: f64) -> impl Iterator<Item = ([i32; 3], f64)> {
    let lattice = Lattice::new([0.0; 3], RESOLUTION);
    let cells = (-80..80).flat_map(|x| (-80..80).map(move |y| [x, y, 0]));
    cells.filter_map(move |cell: [i32; 3]| {
        let [x, y, _] = lattice.center(cell);
        let column = (y.atan2(x) - 0.7) / TAU * turn;
        (2.5..3.5).contains(&x.hypot(y)).then(|| (cell, (column + 1.0).rem_euclid(turn) - 1.0))
    })
}

/// One body for both maps: across the seam of a full turn cells are free as everywhere else; in a gap of one column and more
/// those are not that no pixel is near to.
fn the_seam(columns: usize, turn: f64) {
    let image = ball(columns, turn, |_| 4.0);
    let closed = (turn - columns as f64).abs() < 0.5;
    assert_eq!(image.is_full_turn(), closed, "{columns} of {turn}");
    let has_gap = turn - columns as f64 >= 0.5;
    let maps = Maps::of(&Frame::Image(image));
    let (mut on_pixels, mut in_gap) = (0, 0);
    for (cell, column) in cells_by_column(turn) {
        // How far into the gap: from the first column downwards, from the last one on.
        let aside = if column < 0.0 { -column } else { column - (columns - 1) as f64 };
        let beside = aside.min(turn - (columns - 1) as f64 - aside);
        if has_gap && beside > 0.55 {
            assert_eq!(maps.is_free(cell), [None; 2], "{columns} of {turn}: column {column}");
            in_gap += 1;
        } else if !has_gap || beside < 0.0 {
            assert_eq!(maps.is_free(cell), [Some(true); 2], "{columns} of {turn}: column {column}");
            on_pixels += 1;
        }
    }
    assert!(on_pixels > 3000 && (!has_gap || in_gap > 3), "{on_pixels} {in_gap}");
}

#[test]
fn a_full_turn_has_no_seam_and_a_gap_is_one_in_both_maps() {
    for turn in [64.0, 63.8, 64.3, 65.0, 66.0, 70.0] {
        the_seam(64, turn);
    }
    // One column more than a turn has: only wide images may have it.
    the_seam(1201, 1200.0);
    the_seam(1199, 1200.0);
}

/// Whatever is on the other side of the seam: cells wider than a column whose center lies between a pixel that saw beyond them and one
/// across the seam that did not are not free. Further on the surface between the readings around their center decides.
#[test]
fn beams_beyond_the_seam_count_for_misses() {
    for columns in [1199, 1200, 1201] {
        // All columns of the last twentieth of a turn see a wall at 1 m.
        let image = ball(columns, 1200.0, |column| if column >= 1140 { 1.0 } else { 4.0 });
        let maps = Maps::of(&Frame::Image(image));
        let lattice = Lattice::new([0.0; 3], RESOLUTION);
        let mut across = 0;
        for (x, y) in (-30..30).flat_map(|x| (-30..30).map(move |y| (x, y))) {
            let [px, py, _] = lattice.center([x, y, 0]);
            let (range, column) = (px.hypot(py), (py.atan2(px) - 0.7).rem_euclid(TAU) / TAU * 1200.0);
            // Columns of a cell's width, and how far the center is beyond the wall's last pixel.
            let wide = RESOLUTION / range / TAU * 1200.0;
            let beyond = column - (columns - 1).min(1199) as f64;
            if range > 1.05 && wide > 4.0 && (0.05..0.95).contains(&beyond) {
                across += 1;
                assert_ne!(maps.is_free([x, y, 0])[1], Some(true), "{columns}: {range} m, column {column}");
            }
        }
        assert!(across > 0, "{columns}");
    }
}

/// Rows and columns of bare points follow the sensor, in both maps: no points are dropped when another lidar goes on.
#[test]
fn another_lidar_is_noticed_by_both_maps() {
    let scan = |rings: usize, half: f64| {
        let beam = move |i: usize| {
            let e = half - 2.0 * half * (i / 512) as f64 / (rings - 1) as f64;
            let a = TAU * (i % 512) as f64 / 512.0;
            [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()].map(|v| (4.0 * v) as f32)
        };
        Frame::Points(PointScan::new((0..512 * rings).map(beam), [0.0; 3]))
    };
    let mut maps = Maps::of(&scan(16, 0.2));
    for _ in 0..3 {
        let frame = scan(32, 0.6);
        let distances = maps.distances.integrate(&Pose::IDENTITY, &frame).unwrap();
        let occupancy = maps.occupancy.integrate(&Pose::IDENTITY, &frame).unwrap();
        for stats in [distances, occupancy] {
            assert_eq!((stats.beams.hit, stats.beams.dropped), (512 * 32, 0));
        }
    }
}

/// A wall 2 m away with this unit normal towards it, in an image of 61 x 81 rays about the x axis.
fn wall(normal: [f64; 3]) -> RangeImage {
    let elevations: Vec<f32> = (0..61).map(|row| 0.3 - 0.01 * row as f32).collect();
    let lidar = Spherical { elevations: elevations.clone(), first_azimuth: -0.4, azimuth_step: 0.01 };
    let range = |column: usize, elevation: f32| {
        let (azimuth, elevation) = (-0.4 + 0.01 * column as f64, f64::from(elevation));
        let flat = elevation.cos();
        let ray = [flat * azimuth.cos(), flat * azimuth.sin(), elevation.sin()];
        (2.0 / (0..3).map(|k| normal[k] * ray[k]).sum::<f64>()) as f32
    };
    let ranges: Vec<f32> =
        elevations.iter().flat_map(|&e| (0..81).map(move |c| (c, e))).map(|(c, e)| range(c, e)).collect();
    RangeImage::from_ranges(lidar, 81, ranges)
}

/// What one scan of a wall leaves in cells in front of it is the weight of its ray: the cosine of the incidence, or that over
/// the square of the range.
#[test]
fn weights_of_images_are_those_of_range_and_incidence() {
    // Head on, turned to the side, turned upwards, both.
    for [side, up] in [[0.0f64, 0.0], [0.8, 0.0], [0.0, 0.8], [0.5, -0.5]] {
        let normal = [side.cos() * up.cos(), side.sin() * up.cos(), up.sin()];
        for weights in
            [WeightModel::CosIncidence, WeightModel::InverseSquare, WeightModel::InverseSquareCosIncidence]
        {
            let config = TsdfConfig { resolution: RESOLUTION, weights, ..TsdfConfig::textbook() };
            let mut map = Tsdf3::new(config).unwrap();
            map.integrate(&Pose::IDENTITY, &Frame::Image(wall(normal))).unwrap();
            let mut seen = 0;
            for n in 0..40 * 40 {
                let (azimuth, elevation) =
                    (-0.25 + 0.0125 * f64::from(n % 40), -0.15 + 0.0075 * f64::from(n / 40));
                let flat = elevation.cos();
                let ray = [flat * azimuth.cos(), flat * azimuth.sin(), elevation.sin()];
                let cosine: f64 = (0..3).map(|k| normal[k] * ray[k]).sum();
                let range = 2.0 / cosine;
                let p = ray.map(|v| (range - 0.08) * v);
                let cell = map.lattice().cell_of(p).and_then(|c| Store::cell(map.store(), c));
                let Some(cell) = cell.filter(|c| c.distance > 0.0) else { continue };
                seen += 1;
                let (square, angle) = match weights {
                    WeightModel::CosIncidence => (1.0, cosine),
                    WeightModel::InverseSquare => (range.powi(-2), 1.0),
                    _ => (range.powi(-2), cosine),
                };
                let want = square * angle;
                // The cell's center is on a ray beside this one.
                assert!(
                    (f64::from(cell.weight) / want - 1.0).abs() < 0.15,
                    "{weights:?} {side} {up}: {} instead of {want}",
                    cell.weight
                );
            }
            assert!(seen > 1000, "{seen}");
        }
    }
}
