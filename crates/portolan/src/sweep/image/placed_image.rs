//! A range image with its tables, at the pose at which it was taken: which cells beams saw beyond.

use super::balls::BallWindows;
use super::lanes::LANES;
use super::pixels::{PixelProjector, Pixels};
use super::search::{Class, Classify, Cube};
use super::sheet::Sheet;
use super::steps::{STEP_BITS, STEPS};
use super::window_minima::{RangeTables, WindowMinima, WindowSizes};
use super::window_readings::WindowReadings;
use crate::geom::{BLOCK_EDGE, Lattice, Pose};
use crate::parallel;
use crate::scan::{Bridges, Projection, RangeImage};

/// How far beyond a cell's center the beams must have seen, in cells. Half a cell is where a surface square to the beam
/// would touch it.
const MARGIN: f32 = 0.5;
/// How far before the surface through the readings around it a cell's center must be, across that surface, in cells.
const BEFORE: f32 = 0.5;
/// Half of the width that a cell has for beams, in cells.
const HALF_WIDTH: f32 = 0.5;
/// Bits of pixels' readings.
const OWN: u8 = 1;
const BESIDE: u8 = 2;
/// Edge of the largest cubes that are looked at, in cells.
const LARGEST: i64 = 4 * BLOCK_EDGE as i64;
/// An image, and where it was taken.
#[derive(Clone, Debug)]
pub(super) struct PlacedImage {
    projector: PixelProjector,
    tables: RangeTables,
    /// Of `tables.fine`.
    fine_sizes: WindowSizes,
    /// For the windows of cubes.
    window_readings: WindowReadings,
    /// For every pixel [`OWN`], where it has a reading, and [`BESIDE`], where it or one of the eight around it has one.
    readings: Vec<u8>,
    sheet: Sheet,
    columns: usize,
    rows: usize,
    /// Edge of a cell (meters).
    resolution: f32,
    lattice: Lattice<3>,
    sensor_from_world: Pose<3>,
    /// Centers of `4^3` cells about the center of all, in the sensor's frame, x of the lattice fastest.
    offsets: [[f32; LANES]; 3],
    /// Corners of a cell about its center, in the sensor's frame.
    corners: [[f32; 8]; 3],
}

impl PlacedImage {
    /// `old` lends its memory, and its projector if that fits.
    pub(super) fn new(
        image: &RangeImage,
        world_from_image: &Pose<3>,
        lattice: &Lattice<3>,
        old: Option<Box<Self>>,
    ) -> Self {
        let (projector, mut tables, mut sheet, mut window_readings) = match old {
            Some(old) => {
                let projector = Some(old.projector).filter(|p| p.projector.is_of(image));
                (projector, old.tables, old.sheet, old.window_readings)
            }
            None => Default::default(),
        };
        let projector = projector.unwrap_or_else(|| PixelProjector::of(image));
        let sensor_from_world = world_from_image.inverse();
        // Along axis `k` of the sensor, for `at` cells along the lattice's axes.
        let along = |k: usize, at: [f64; 3]| -> f32 {
            let sum: f64 =
                (0..3).map(|a| sensor_from_world.rotation[k][a] * at[a] * lattice.resolution).sum();
            sum as f32
        };
        let cell = |i: usize| [0, 1, 2].map(|a| (i >> (2 * a) & 3) as f64 - 1.5);
        let corner = |i: usize| [0, 1, 2].map(|a| (i >> a & 1) as f64 - 0.5);
        // Readings that no cell can hold are not used.
        let farthest = (f64::from(1 << 29) * lattice.resolution) as f32;
        let mut values: Vec<f32> =
            image.values.iter().map(|&v| if v.abs() <= farthest { v } else { 0.0 }).collect();
        if let Projection::Spherical(rays) = &image.projection {
            Bridges::of(rays, image.is_full_turn()).fill(&mut values, image.columns);
        }
        let turn = projector.projector.columns_of_turn();
        parallel::join(
            || tables.fill(&values, image.columns, turn, projector.rows_per_column()),
            || {
                sheet.fill(&values, &projector.projector);
                window_readings.fill(&values, image.columns, turn);
            },
        );
        Self {
            fine_sizes: WindowSizes::of(&tables.fine),
            window_readings,
            tables,
            projector,
            readings: readings(&values, image.columns),
            sheet,
            columns: image.columns,
            rows: image.rows,
            resolution: lattice.resolution as f32,
            lattice: *lattice,
            sensor_from_world,
            offsets: [0, 1, 2].map(|k| std::array::from_fn(|i| along(k, cell(i)))),
            corners: [0, 1, 2].map(|k| std::array::from_fn(|i| along(k, corner(i)))),
        }
    }

    /// Center of a cube of `edge^3` cells in the sensor's frame.
    #[inline(always)]
    fn center(&self, first: [i64; 3], edge: i64) -> [f32; 3] {
        let r = self.lattice.resolution;
        let world: [f64; 3] =
            std::array::from_fn(|k| self.lattice.origin[k] + (first[k] as f64 + 0.5 * edge as f64) * r);
        self.sensor_from_world.transform_point(world).map(|v| v as f32)
    }

    /// Radius of the ball that holds the centers of a cube's cells.
    #[inline(always)]
    fn radius(&self, edge: i64) -> f32 {
        0.866_03 * (edge - 1) as f32 * self.resolution
    }

    #[inline(always)]
    fn class(&self, windows: &BallWindows, i: usize) -> Class {
        let halves = [windows.half_columns[i], windows.half_rows[i]];
        // Too near to the sensor.
        if !halves.iter().all(|half| half.is_finite()) {
            return Class::Mixed;
        }
        let at = [windows.column[i], windows.row[i]];
        let Some([nearest, farthest]) = self.window_readings.extremes(at, halves) else {
            return Class::Nothing;
        };
        if farthest <= windows.near[i] {
            Class::Nothing
        } else if nearest > windows.far[i] + MARGIN * self.resolution && windows.near[i] > 0.0 {
            Class::Free
        } else if nearest > 0.0 {
            Class::Complete
        } else {
            Class::Mixed
        }
    }

    /// The free cells among `4^3`, a bit each, x fastest. `complete`: whether all pixels that they see have a reading.
    pub(super) fn free_of_octant(&self, first: [i64; 3], complete: bool) -> u64 {
        let center = self.center(first, 4);
        // The widest that any of the cells looks: from the nearest of them.
        let across = self.projector.pixels_across(center, self.radius(4), HALF_WIDTH * self.resolution);
        let (c, r) = across.unwrap_or((f32::INFINITY, f32::INFINITY));
        let level = self.fine_sizes.level(2.0 * c + 2.0, 2.0 * r + 2.0);
        let windows = &self.tables.fine[level.unwrap_or(self.tables.fine.len() - 1)];
        let mut pixels = Pixels { column: [0; LANES], row: [0; LANES], depth: [0.0; LANES] };
        // Where no window is wide enough, so near to the sensor, nothing at all may be nearer.
        let nearest_of_all = if level.is_some() { f32::INFINITY } else { self.tables.overall };
        let test = FreeTest {
            windows,
            columns: self.columns as i32,
            rows: self.rows as i32,
            margin: MARGIN * self.resolution,
            sheet: &self.sheet,
            before: if c >= 0.5 && r >= 0.5 { BEFORE * self.resolution } else { f32::INFINITY },
            nearest_of_all,
        };
        let mut bits = free_lanes(&self.projector, center, &self.offsets, &test, &mut pixels);
        if !complete && bits != 0 {
            // The window may be wider than the cell: its own pixel must have a reading, or one beside that is within its width.
            let enough = if c >= 2.0 && r >= 2.0 { BESIDE } else { OWN };
            for i in crate::sets::bits(bits) {
                let readings = self.readings_at(pixels.column[i], pixels.row[i]);
                bits &= !(u64::from(readings & enough == 0) << i);
            }
        }
        bits
    }

    #[inline(always)]
    fn readings_at(&self, column: i32, row: i32) -> u8 {
        let pixel = |v: i32, n: usize| (((v + STEPS / 2) / STEPS).max(0) as usize).min(n - 1);
        self.readings[pixel(row, self.rows) * self.columns + pixel(column, self.columns)]
    }
}

impl Classify for PlacedImage {
    type Known = ();

    fn nothing_known(&self) {}

    /// All halves at once: one costs as much as eight.
    fn classify(&self, cube: Cube, (): (), _: u8) -> [(Class, ()); 8] {
        let half = cube.edge / 2;
        if half > LARGEST {
            return [(Class::Mixed, ()); 8];
        }
        let balls = Balls {
            center: self.center(cube.first_cell, cube.edge),
            corners: &self.corners,
            scale: half as f32,
            radius: self.radius(half),
            half: HALF_WIDTH * self.resolution,
        };
        let mut windows = BallWindows::default();
        eight_windows(&self.projector, &balls, &mut windows);
        std::array::from_fn(|i| (self.class(&windows, i), ()))
    }
}

/// [`OWN`] and [`BESIDE`] of every pixel. Pixels beyond the border have no reading.
fn readings(values: &[f32], columns: usize) -> Vec<u8> {
    let own: Vec<u8> = values.iter().map(|&v| u8::from(v != 0.0)).collect();
    // Above, here and below; then to the left and to the right.
    let mut tall = own.clone();
    let below = tall.iter_mut().zip(own.iter().skip(columns));
    below.for_each(|(to, from)| *to |= from);
    let above = tall.iter_mut().skip(columns).zip(&own);
    above.for_each(|(to, from)| *to |= from);
    let mut all = own;
    for (all, tall) in all.chunks_exact_mut(columns.max(1)).zip(tall.chunks_exact(columns.max(1))) {
        all.iter_mut().zip(tall).for_each(|(to, from)| *to |= from * BESIDE);
        all.iter_mut().zip(&tall[1..]).for_each(|(to, from)| *to |= from * BESIDE);
        all[1..].iter_mut().zip(tall).for_each(|(to, from)| *to |= from * BESIDE);
    }
    all
}

/// Eight balls about the corners of a cube.
struct Balls<'a> {
    center: [f32; 3],
    corners: &'a [[f32; 8]; 3],
    scale: f32,
    radius: f32,
    half: f32,
}

/// [`PixelProjector::ball_windows`], in the widest vectors.
#[multiversion::multiversion(targets("x86_64+avx2+fma+bmi2"))]
fn eight_windows(projector: &PixelProjector, balls: &Balls<'_>, windows: &mut BallWindows) {
    let centers =
        [0, 1, 2].map(|k| std::array::from_fn(|i| balls.center[k] + balls.scale * balls.corners[k][i]));
    projector.ball_windows(&centers, balls.radius, balls.half, windows);
}

/// What [`free_lanes`] compares with.
struct FreeTest<'a> {
    windows: &'a WindowMinima,
    columns: i32,
    rows: i32,
    /// How far beyond a cell's center beams must have seen (meters).
    margin: f32,
    /// Cells must be nearer than this.
    nearest_of_all: f32,
    sheet: &'a Sheet,
    /// How far before the surface through the readings around it a cell's center must be (meters).
    before: f32,
}

/// Which of the points `center + offsets` are nearer than all that the readings in their windows, a bit each.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+fma+bmi2",
    "x86_64+avx2+fma+bmi2"
))]
fn free_lanes(
    projector: &PixelProjector,
    center: [f32; 3],
    offsets: &[[f32; LANES]; 3],
    test: &FreeTest<'_>,
    pixels: &mut Pixels,
) -> u64 {
    projector.pixels(center, offsets, pixels);
    let windows = test.windows;
    let stride = windows.stride as i32;
    let (half_c, half_r) = (windows.columns as i32 * STEPS / 2, windows.rows as i32 * STEPS / 2);
    let mut index = [0u32; LANES];
    for i in 0..LANES {
        let (c, r) = (pixels.column[i] + STEPS / 2, pixels.row[i] + STEPS / 2);
        let inside = (c >= 0) & (c < test.columns * STEPS) & (r >= 0) & (r < test.rows * STEPS);
        let at = ((r - STEPS / 2 + half_r) >> STEP_BITS) * stride + ((c - STEPS / 2 + half_c) >> STEP_BITS);
        index[i] = if inside { at as u32 } else { u32::MAX };
    }
    let mut nearest = [0.0f32; LANES];
    for i in 0..LANES {
        nearest[i] = windows.minima.get(index[i] as usize).copied().unwrap_or(0.0);
    }
    let mut free = [0u8; LANES];
    for i in 0..LANES {
        let (limit, n) = (pixels.depth[i] + test.margin, nearest[i]);
        let is_free =
            (limit < n) & (n < f32::INFINITY) & (limit < test.nearest_of_all) & (pixels.depth[i] > 0.0);
        free[i] = u8::from(is_free);
    }
    for i in 0..LANES {
        let (column, row, depth) = (pixels.column[i], pixels.row[i], pixels.depth[i]);
        if free[i] == 0 && index[i] != u32::MAX && depth > 0.0 {
            free[i] = u8::from(test.sheet.is_behind(column, row, depth, test.before));
        }
    }
    let mut bits = 0;
    for (i, eight) in free.chunks_exact(8).enumerate() {
        // Gathers the low bits of eight bytes.
        let bytes = eight.iter().rev().fold(0u64, |w, &b| w << 8 | u64::from(b));
        bits |= (bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
    }
    bits
}
