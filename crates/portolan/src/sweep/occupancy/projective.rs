//! Free space through a range image: a cell is free where every beam that looks its way saw farther.

use super::guard::{Guard, Sizes, WindowMin};
use super::lens::{LANES, Lens, STEP_BITS, STEPS, Seen, Views};
use crate::geom::{BLOCK_EDGE, BlockKey, Lattice, Pose};
use crate::parallel;
use crate::scan::RangeImage;

/// What a scan says about the cells of a cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    /// All are free.
    Free,
    /// Nothing: behind all that was seen, or out of sight.
    Silent,
    /// Cells have to be asked one by one, and pixels may lack a reading.
    Mixed,
    /// Cells have to be asked one by one; all pixels have a reading.
    Known,
}

/// How far beyond a cell's centre the beams must have seen, in cells. Half a cell is where a surface square to the beam
/// would touch it.
const MARGIN: f32 = 0.5;
/// Half of the width that a cell has for beams, in cells.
const HALF_WIDTH: f32 = 0.5;
/// Bits of pixels' readings.
const OWN: u8 = 1;
const BESIDE: u8 = 2;
/// Edge of the largest nodes, in bricks.
const TOP: i32 = 8;

/// Misses of a scan of rows and columns. A cell is missed where all beams within its width (and at least the four around
/// its centre) that had a reading saw beyond it, and the pixel that it is in, or one within its width, had one. That is
/// the smallest of several ranges against one distance: cells on grazing surfaces between two beams are kept, which exact
/// rays carve. Bricks, and in them groups of `4^3` cells, that are wholly free or wholly unseen are found by one look at
/// the nearest and the farthest reading in their window.
#[derive(Clone, Debug)]
pub(crate) struct Projective {
    lens: Lens,
    guard: Guard,
    /// Of `guard.fine` and `guard.nearest`.
    fine_sizes: Sizes,
    coarse_sizes: Sizes,
    /// For every pixel [`OWN`], where it has a reading, and [`BESIDE`], where it or one of the eight around it has one.
    readings: Vec<u8>,
    columns: usize,
    rows: usize,
    /// Edge of a cell (metres).
    resolution: f32,
    lattice: Lattice<3>,
    sensor_from_world: Pose<3>,
    /// Centres of `4^3` cells about the centre of all, in the sensor's frame, x of the lattice fastest.
    offsets: Box<[[f32; LANES]; 3]>,
    /// Corners of a cell about its centre, in the sensor's frame.
    corners: [[f32; 8]; 3],
}

impl Projective {
    /// Makes an image ready. `world_from_image` is the pose of the frame in which its pixels look; `guard` lends its memory.
    pub(crate) fn new(
        image: &RangeImage,
        world_from_image: &Pose<3>,
        lattice: &Lattice<3>,
        mut guard: Guard,
    ) -> Self {
        let lens = Lens::of(image);
        let sensor_from_world = world_from_image.inverse();
        // Along axis `k` of the sensor, for `at` cells along the lattice's axes.
        let along = |k: usize, at: [f64; 3]| -> f32 {
            let sum: f64 =
                (0..3).map(|a| sensor_from_world.rotation[k][a] * at[a] * lattice.resolution).sum();
            sum as f32
        };
        let cell = |i: usize| [0, 1, 2].map(|a| (i >> (2 * a) & 3) as f64 - 1.5);
        let corner = |i: usize| [0, 1, 2].map(|a| (i >> a & 1) as f64 - 0.5);
        // Readings that no cell can hold are none.
        let farthest = (f64::from(1 << 29) * lattice.resolution) as f32;
        let values: Vec<f32> =
            image.values.iter().map(|&v| if v.abs() <= farthest { v } else { 0.0 }).collect();
        guard.fill(&values, image.columns, lens.is_closed(), lens.rows_per_column());
        Self {
            fine_sizes: Sizes::of(&guard.fine),
            coarse_sizes: Sizes::of(&guard.nearest),
            guard,
            lens,
            readings: readings(&values, image.columns),
            columns: image.columns,
            rows: image.rows,
            resolution: lattice.resolution as f32,
            lattice: *lattice,
            sensor_from_world,
            offsets: Box::new([0, 1, 2].map(|k| std::array::from_fn(|i| along(k, cell(i))))),
            corners: [0, 1, 2].map(|k| std::array::from_fn(|i| along(k, corner(i)))),
        }
    }

    /// The bricks between `first` and `last` (both included) that hold cells which may be free, in ascending order, and
    /// whether all of their cells are.
    pub(crate) fn bricks(&self, first: BlockKey<3>, last: BlockKey<3>) -> Vec<(BlockKey<3>, bool)> {
        let nodes = |k: usize| (first.0[k].div_euclid(TOP)..=last.0[k].div_euclid(TOP)).map(|v| v * TOP);
        let mut tops = Vec::new();
        for z in nodes(2) {
            for y in nodes(1) {
                tops.extend(nodes(0).map(|x| [x, y, z]));
            }
        }
        let parts = parallel::map(&tops, 1, |&top| {
            let mut found = Vec::new();
            self.descend(top, TOP, &mut found);
            found
        });
        let mut all: Vec<(BlockKey<3>, bool)> = parts.into_iter().flatten().collect();
        all.retain(|(key, _)| (0..3).all(|k| first.0[k] <= key.0[k] && key.0[k] <= last.0[k]));
        all.sort_unstable_by_key(|e| e.0);
        all
    }

    /// Looks at the eight halves of a node and goes on into those that are mixed.
    fn descend(&self, node: [i32; 3], edge: i32, found: &mut Vec<(BlockKey<3>, bool)>) {
        let half = edge / 2;
        let classes = self.classify_halves(node.map(|v| v * BLOCK_EDGE as i32), edge * BLOCK_EDGE as i32);
        for (i, class) in classes.into_iter().enumerate() {
            let child = [0, 1, 2].map(|k| node[k] + half * (i as i32 >> k & 1));
            match class {
                Class::Silent => {}
                Class::Mixed | Class::Known if half == 1 => found.push((BlockKey(child), false)),
                Class::Mixed | Class::Known => self.descend(child, half, found),
                Class::Free => {
                    for z in 0..half {
                        for y in 0..half {
                            let row = |x| (BlockKey([child[0] + x, child[1] + y, child[2] + z]), true);
                            found.extend((0..half).map(row));
                        }
                    }
                }
            }
        }
    }

    /// The memory that it was lent.
    pub(crate) fn into_guard(self) -> Guard {
        self.guard
    }

    /// Centre of a cube of `edge^3` cells in the sensor's frame.
    #[inline(always)]
    fn centre(&self, first: [i32; 3], edge: i32) -> [f32; 3] {
        let r = self.lattice.resolution;
        let world: [f64; 3] = std::array::from_fn(|k| {
            self.lattice.origin[k] + (f64::from(first[k]) + 0.5 * f64::from(edge)) * r
        });
        self.sensor_from_world.transform_point(world).map(|v| v as f32)
    }

    /// Radius of the ball that holds the centres of a cube's cells.
    #[inline(always)]
    fn radius(&self, edge: i32) -> f32 {
        0.866_03 * (edge - 1) as f32 * self.resolution
    }

    /// What the scan says about the eight halves of a cube of `edge^3` cells, x fastest.
    fn classify_halves(&self, first: [i32; 3], edge: i32) -> [Class; 8] {
        let half = edge / 2;
        let shape = Balls {
            centre: self.centre(first, edge),
            corners: &self.corners,
            scale: half as f32,
            radius: self.radius(half),
            half: HALF_WIDTH * self.resolution,
        };
        let mut views = Views::default();
        view_eight(&self.lens, &shape, &mut views);
        std::array::from_fn(|i| self.classify(&views, i))
    }

    #[inline(always)]
    fn classify(&self, views: &Views, i: usize) -> Class {
        let (columns, rows) = (2.0 * views.half_columns[i] + 2.0, 2.0 * views.half_rows[i] + 2.0);
        let Some(level) = self.coarse_sizes.level(columns, rows) else { return Class::Mixed };
        let Some(at) = self.guard.nearest[level].around(views.column[i], views.row[i]) else {
            return Class::Silent;
        };
        let nearest = self.guard.nearest[level].minima[at];
        if -self.guard.farthest[level].minima[at] <= views.near[i] {
            Class::Silent
        } else if nearest > views.far[i] + MARGIN * self.resolution && views.near[i] > 0.0 {
            Class::Free
        } else if nearest > 0.0 {
            Class::Known
        } else {
            Class::Mixed
        }
    }

    /// The free cells of a brick, a bit each.
    pub(crate) fn free_cells(&self, key: BlockKey<3>) -> [u64; 8] {
        let mut words = [0u64; 8];
        let low = key.first_cell();
        for (part, class) in self.classify_halves(low, BLOCK_EDGE as i32).into_iter().enumerate() {
            let corner = [0, 1, 2].map(|k| 4 * (part as i32 >> k & 1));
            let first = [0, 1, 2].map(|k| low[k] + corner[k]);
            let bits = match class {
                Class::Silent => continue,
                Class::Free => u64::MAX,
                class => self.free_of_group(first, class == Class::Known),
            };
            for z in 0..4 {
                let mut layer = 0;
                for y in 0..4 {
                    layer |= (bits >> (16 * z + 4 * y) & 0xf)
                        << (8 * (corner[1] as usize + y) + corner[0] as usize);
                }
                words[corner[2] as usize + z] |= layer;
            }
        }
        words
    }

    /// The free cells among `4^3`, a bit each, x fastest. `known`: whether all pixels that they see have a reading.
    fn free_of_group(&self, first: [i32; 3], known: bool) -> u64 {
        let centre = self.centre(first, 4);
        // The widest that any of the cells looks: from the nearest of them.
        let view = self.lens.view_cell(centre, self.radius(4), HALF_WIDTH * self.resolution);
        let (c, r) = view.unwrap_or((f32::INFINITY, f32::INFINITY));
        let level = self.fine_sizes.level(2.0 * c + 2.0, 2.0 * r + 2.0);
        let windows = &self.guard.fine[level.unwrap_or(self.guard.fine.len() - 1)];
        let mut seen = Seen { column: [0; LANES], row: [0; LANES], depth: [0.0; LANES] };
        // Where no window is wide enough, so near to the sensor, nothing at all may be nearer.
        let nearest_of_all = if level.is_some() { f32::INFINITY } else { self.guard.overall };
        let look = Look {
            windows,
            columns: self.columns as i32,
            rows: self.rows as i32,
            margin: MARGIN * self.resolution,
            nearest_of_all,
        };
        let mut bits = free_lanes(&self.lens, centre, &self.offsets, &look, &mut seen);
        if !known && bits != 0 {
            // The window may be wider than the cell: its own pixel must have a reading, or one beside that is within its width.
            let enough = if c >= 2.0 && r >= 2.0 { BESIDE } else { OWN };
            let mut left = bits;
            while left != 0 {
                let i = left.trailing_zeros() as usize;
                left &= left - 1;
                bits &= !(u64::from(self.readings_at(seen.column[i], seen.row[i]) & enough == 0) << i);
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
    centre: [f32; 3],
    corners: &'a [[f32; 8]; 3],
    scale: f32,
    radius: f32,
    half: f32,
}

/// [`Lens::views`] of eight balls.
#[multiversion::multiversion(targets("x86_64+avx2+fma+bmi2"))]
fn view_eight(lens: &Lens, balls: &Balls<'_>, views: &mut Views) {
    let centres =
        [0, 1, 2].map(|k| std::array::from_fn(|i| balls.centre[k] + balls.scale * balls.corners[k][i]));
    lens.views(&centres, balls.radius, balls.half, views);
}

/// What [`free_lanes`] compares with.
struct Look<'a> {
    windows: &'a WindowMin,
    columns: i32,
    rows: i32,
    /// How far beyond a cell's centre beams must have seen (metres).
    margin: f32,
    /// Cells must be nearer than this.
    nearest_of_all: f32,
}

/// Which of the points `centre + offsets` are nearer than all that their windows saw, a bit each.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+fma+bmi2",
    "x86_64+avx2+fma+bmi2"
))]
fn free_lanes(
    lens: &Lens,
    centre: [f32; 3],
    offsets: &[[f32; LANES]; 3],
    look: &Look<'_>,
    seen: &mut Seen,
) -> u64 {
    lens.project(centre, offsets, seen);
    let windows = look.windows;
    let stride = windows.stride as i32;
    let (half_c, half_r) = (windows.columns as i32 * STEPS / 2, windows.rows as i32 * STEPS / 2);
    let mut index = [0u32; LANES];
    for i in 0..LANES {
        let (c, r) = (seen.column[i] + STEPS / 2, seen.row[i] + STEPS / 2);
        let inside = (c >= 0) & (c < look.columns * STEPS) & (r >= 0) & (r < look.rows * STEPS);
        let at = ((r - STEPS / 2 + half_r) >> STEP_BITS) * stride + ((c - STEPS / 2 + half_c) >> STEP_BITS);
        index[i] = if inside { at as u32 } else { u32::MAX };
    }
    let mut nearest = [0.0f32; LANES];
    for i in 0..LANES {
        nearest[i] = windows.minima.get(index[i] as usize).copied().unwrap_or(0.0);
    }
    let mut free = [0u8; LANES];
    for i in 0..LANES {
        let (limit, n) = (seen.depth[i] + look.margin, nearest[i]);
        let is_free =
            (limit < n) & (n < f32::INFINITY) & (limit < look.nearest_of_all) & (seen.depth[i] > 0.0);
        free[i] = u8::from(is_free);
    }
    let mut bits = 0;
    for (i, eight) in free.chunks_exact(8).enumerate() {
        // Gathers the low bits of eight bytes.
        let bytes = eight.iter().rev().fold(0u64, |w, &b| w << 8 | u64::from(b));
        bits |= (bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
    }
    bits
}
