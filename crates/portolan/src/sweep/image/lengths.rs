//! Lengths of an image's beams inside of cells, in closed form.

use super::depth_bounds::DepthBounds;
use super::lanes::{LANES, Lanes, Projected};
use super::observe::{BLOCK, BlockCenters, cell_of};
use super::padded_image::{Cleaning, PaddedImage};
use super::projector::Projector;
use super::range_pyramid::RangePyramid;
use super::search::{BlockBox, LONGEST_EDGE, Octants, find_blocks};
use crate::cell::LENGTH_UNITS;
use crate::geom::vector::distance;
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice, Pose};
use crate::scan::RangeImage;
use crate::sweep::{LONGEST_RAY_CELLS, PlanError, PlanLimits, WeightModel};
use multiversion::multiversion;

/// The length that the beams of a scan of rows and columns have in each cell: beams per area across them, times the cell's
/// volume, times the share of four pixels in the cell's window that saw past it (a pixel whose surface lies within the
/// cell's depth counts by how far into it).
///
/// Blocks are found as for distances: cubes of cells against the nearest and the farthest reading in their window.
#[derive(Clone, Debug)]
pub(in crate::sweep) struct ProjectiveLengths {
    projector: Option<Projector>,
    image: PaddedImage,
    pyramid: RangePyramid,
    lattice: Lattice<3>,
    origin: [f64; 3],
    image_from_world: [[f64; 3]; 3],
    keys: Vec<BlockKey<3>>,
    octants: Vec<Octants>,
}

impl Default for ProjectiveLengths {
    fn default() -> Self {
        Self {
            projector: None,
            image: PaddedImage::default(),
            pyramid: RangePyramid::default(),
            lattice: Lattice::new([0.0; 3], 1.0),
            origin: [0.0; 3],
            image_from_world: Pose::<3>::IDENTITY.rotation,
            keys: Vec::new(),
            octants: Vec::new(),
        }
    }
}

impl ProjectiveLengths {
    /// Forgets the blocks.
    pub(in crate::sweep) fn clear(&mut self) {
        self.keys.clear();
        self.octants.clear();
    }

    /// Takes an image in that fits together ([`RangeImage::check`]), and finds the blocks that its beams pass.
    /// `world_from_image` is the pose of the frame in which its pixels look. O(pixels + blocks), in parallel.
    pub(in crate::sweep) fn plan(
        &mut self,
        image: &RangeImage,
        world_from_image: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<(), PlanError> {
        self.clear();
        let projector = self.projector.take().filter(|p| p.is_of(image));
        let projector = projector.unwrap_or_else(|| Projector::of(image));
        let cleaning = Cleaning {
            min_range: 0.0,
            max_range: LONGEST_RAY_CELLS * lattice.resolution,
            step: 0.0,
            weights: WeightModel::Constant,
            colors: false,
        };
        self.image.fill(image, &projector, &cleaning);
        self.pyramid.build(self.image.stride, &self.image.value, false);
        self.lattice = *lattice;
        self.origin = world_from_image.translation;
        self.image_from_world = world_from_image.inverse().rotation;
        let found = self.find_blocks(&projector, world_from_image, limits);
        self.projector = Some(projector);
        found
    }

    fn find_blocks(
        &mut self,
        projector: &Projector,
        world_from_image: &Pose<3>,
        limits: &PlanLimits<3>,
    ) -> Result<(), PlanError> {
        let Some(whole) = self.reach(projector, world_from_image, limits.bounds) else { return Ok(()) };
        if (0..3).any(|k| i64::from(whole.last[k]) - i64::from(whole.first[k]) >= LONGEST_EDGE) {
            return Err(PlanError::TooManyBlocks);
        }
        let bounds = DepthBounds {
            projector,
            pyramid: &self.pyramid,
            lattice: self.lattice,
            origin: self.origin,
            image_from_world: self.image_from_world,
            truncation: self.lattice.resolution,
            carves: true,
        };
        let fits = find_blocks(&bounds, whole, limits.most_blocks, &mut self.keys, &mut self.octants);
        if fits { Ok(()) } else { Err(PlanError::TooManyBlocks) }
    }

    /// A box that holds all blocks that beams pass.
    fn reach(
        &self,
        projector: &Projector,
        world_from_image: &Pose<3>,
        bounds: Option<Aabb<3>>,
    ) -> Option<BlockBox> {
        let whole = self.pyramid.extremes([0, self.image.columns + 2], [0, self.image.rows + 1]);
        let farthest = f64::from(whole[1]);
        if farthest <= 0.0 {
            return None;
        }
        let r = self.lattice.resolution;
        let (low, high) = projector.reach(farthest + r, r);
        let mut seen = Aabb::EMPTY;
        for corner in 0..8 {
            let p = std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
            seen.include(world_from_image.transform_point(p));
        }
        let mut seen = seen.grown(r);
        if let Some(bounds) = bounds {
            seen = seen.intersection(bounds);
        }
        if seen.is_empty() {
            return None;
        }
        let edge = r * BLOCK_EDGE as f64;
        let block = |p: [f64; 3], k: usize| ((p[k] - self.lattice.origin[k]) / edge).floor();
        // Indices that cells may have, with room for their neighbors.
        const LIMIT: f64 = (1u32 << 27) as f64;
        let first: [i32; 3] = std::array::from_fn(|k| block(seen.min, k).max(-LIMIT) as i32);
        let last: [i32; 3] = std::array::from_fn(|k| block(seen.max, k).min(LIMIT - 1.0) as i32);
        (0..3).all(|k| first[k] <= last[k]).then_some(BlockBox { first, last })
    }

    /// The blocks that were found, ascending.
    pub(in crate::sweep) fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    /// Adds the lengths in the `i`-th block, a number a cell.
    pub(in crate::sweep) fn add_to(&self, i: usize, lengths: &mut [u32]) {
        let (Some(projector), Ok(lengths)) =
            (&self.projector, TryInto::<&mut [u32; BLOCK]>::try_into(lengths))
        else {
            return;
        };
        let view = LengthLookup { projector, image: &self.image, cell: self.lattice.resolution as f32 };
        add_block(&view, &self.centers(i, 1), self.octants[i], lengths);
    }

    /// The mean length in the cells of the `i`-th block (units), by groups of eight cells.
    pub(in crate::sweep) fn mean(&self, i: usize) -> f64 {
        let Some(projector) = &self.projector else { return 0.0 };
        let r = self.lattice.resolution;
        // Beside the sensor beams open too fast for groups.
        const NEAR: f64 = 16.0;
        let middle = self.lattice.center(self.keys[i].first_cell().map(|v| v + BLOCK_EDGE as i32 / 2));
        if distance(middle, self.origin) < NEAR * r {
            let mut lengths = [0; BLOCK];
            self.add_to(i, &mut lengths);
            return lengths.iter().map(|l| f64::from(*l)).sum::<f64>() / BLOCK as f64;
        }
        let view = LengthLookup { projector, image: &self.image, cell: 2.0 * r as f32 };
        // A group has eight times the volume, of which each cell has an eighth.
        let groups = f64::from(mean_of_groups(&view, &self.centers(i, 2), self.octants[i].free == 0xff));
        groups * r * r * f64::from(LENGTH_UNITS)
    }

    /// Centers of the `i`-th block's cells, or of groups of `wide^3` of them.
    fn centers(&self, i: usize, wide: i32) -> BlockCenters {
        let cells = f64::from(wide);
        let corner = self.lattice.corner(self.keys[i].first_cell());
        let half = 0.5 * cells * self.lattice.resolution;
        let offset: [f64; 3] = std::array::from_fn(|k| corner[k] + half - self.origin[k]);
        let rows = &self.image_from_world;
        let step = cells * self.lattice.resolution;
        BlockCenters {
            first: rows.map(|row| (0..3).map(|k| row[k] * offset[k]).sum::<f64>() as f32),
            steps: std::array::from_fn(|axis| rows.map(|row| (row[axis] * step) as f32)),
        }
    }
}

/// An image and how it is read.
struct LengthLookup<'a> {
    projector: &'a Projector,
    image: &'a PaddedImage,
    /// Edge of a cell (meters).
    cell: f32,
}

/// Adds the lengths in a block, in the widest vectors there are.
#[multiversion(targets = "simd")]
fn add_block(view: &LengthLookup<'_>, centers: &BlockCenters, octants: Octants, lengths: &mut [u32; BLOCK]) {
    for octant in 0..8 {
        let is = |bits: u8| bits >> octant & 1 == 1;
        if !is(octants.free) && !is(octants.mixed) {
            continue;
        }
        let units = octant_lengths(view, &centers.octant(octant), &centers.steps, is(octants.free));
        for row in 0..LANES / 4 {
            let at = cell_of(octant, 4 * row);
            for (to, from) in lengths[at..at + 4].iter_mut().zip(&units[4 * row..4 * row + 4]) {
                *to = to.saturating_add(*from);
            }
        }
    }
}

/// Mean of beams per area, of those that pass, over the 64 groups of a block (1/m^2).
#[multiversion(targets = "simd")]
fn mean_of_groups(view: &LengthLookup<'_>, centers: &BlockCenters, free: bool) -> f32 {
    let all = beams_per_area(view, &centers.octant(0), &centers.steps, free);
    all.iter().sum::<f32>() * (1.0 / LANES as f32)
}

/// The lengths in 64 cells about these centers (sensor's frame, as are the edges of a cell). `free`: all pixels saw past all
/// of them.
#[inline(always)]
fn octant_lengths(
    view: &LengthLookup<'_>,
    p: &[Lanes; 3],
    edges: &[[f32; 3]; 3],
    free: bool,
) -> [u32; LANES] {
    let beams = beams_per_area(view, p, edges, free);
    let mut units = [0u32; LANES];
    let scale = view.cell * view.cell * LENGTH_UNITS as f32;
    for l in 0..LANES {
        let length = beams[l] * scale;
        // Rounded up or down by chance, so that thin beams are not lost; the low bits are chance enough.
        let chance = (length.to_bits().wrapping_mul(0x9e37_79b9) >> 9) as f32 * (1.0 / (1u32 << 23) as f32);
        units[l] = (length.clamp(0.0, 1e9) + chance) as u32;
    }
    units
}

/// Beams per area across them that pass each of 64 cells (1/m^2).
#[inline(always)]
fn beams_per_area(view: &LengthLookup<'_>, p: &[Lanes; 3], edges: &[[f32; 3]; 3], free: bool) -> Lanes {
    let seen = view.projector.project(p);
    let turning = view.projector.columns_of_turn().is_some();
    let parallel = view.projector.is_parallel();
    let cell = view.cell;
    // How far neighboring rays are apart at each point, columns and rows (pixels per meter), and what their product lacks
    // to beams per area: nothing where rays stand square to the image.
    let [a, b] = view.projector.openings(0);
    let (mut across, mut down) = ([1.0 / a; LANES], [1.0 / b; LANES]);
    if turning {
        for l in 0..LANES {
            let row = (seen.v[l] - 1.0).max(0.0) as usize;
            let [a, b] = view.projector.openings(row);
            (across[l], down[l]) = (1.0 / a, 1.0 / b);
        }
    }
    // Nearer than this the squared range means nothing: over the cell that holds the sensor its mean is this.
    let nearest = 0.36 * cell;
    let mut per_area = [0.0f32; LANES];
    for l in 0..LANES {
        let depth = if parallel { 1.0 } else { (seen.length[l] / seen.scale[l]).max(nearest) };
        across[l] /= depth;
        down[l] /= depth;
        // The mean of one over the squared range is larger than that at the middle, by its curvature.
        let wide = cell / seen.length[l].abs().max(cell);
        let curved = if parallel { 1.0 } else { 1.0 + wide * wide * (1.0 / 12.0) };
        per_area[l] = across[l] * down[l] * seen.scale[l] * curved;
    }
    if !free {
        let per_depth = per_depth(view, &seen, p, edges);
        let share = shares(view, &seen, &across, &down, &per_depth);
        for l in 0..LANES {
            per_area[l] *= share[l];
        }
    }
    per_area
}

/// One over the length of the ray through the middle of each cell (per meter): edge by edge it leaves through the faces that
/// it meets most squarely.
#[inline(always)]
fn per_depth(view: &LengthLookup<'_>, seen: &Projected, p: &[Lanes; 3], edges: &[[f32; 3]; 3]) -> Lanes {
    let mut most = [0.0f32; LANES];
    let parallel = view.projector.is_parallel();
    for edge in edges {
        for l in 0..LANES {
            let turned = p[0][l] * edge[0] + p[1][l] * edge[1] + p[2][l] * edge[2];
            most[l] = most[l].max(if parallel { edge[2].abs() } else { (turned / seen.length[l]).abs() });
        }
    }
    let square = 1.0 / (view.cell * view.cell);
    most.map(|m| m * square)
}

/// The share of four pixels, a quarter of a window's width from its middle, that saw past each point.
#[inline(always)]
fn shares(
    view: &LengthLookup<'_>,
    seen: &Projected,
    across: &Lanes,
    down: &Lanes,
    per_depth: &Lanes,
) -> Lanes {
    const MAGIC: f32 = 8_388_608.0; // 2^23: adding it rounds, and leaves the integer in the low bits
    let (value, stride) = (&view.image.value[..], view.image.stride as u32);
    // Where a cell's middle lies decides whether it is seen; what its window has beyond the image is as at the image's edge.
    let (columns, rows) = (view.image.columns as f32, view.image.rows as f32);
    let (left, right) = if view.projector.is_closed() { (0.0, columns + 1.0) } else { (1.0, columns) };
    let quarter = 0.25 * view.cell;
    let mut share = [0.0f32; LANES];
    for sample in 0..4u32 {
        let (su, sv) = (
            if sample & 1 == 0 { -quarter } else { quarter },
            if sample & 2 == 0 { -quarter } else { quarter },
        );
        for l in 0..LANES {
            let u = (seen.u[l] + su * across[l]).max(left).min(right) + MAGIC;
            let v = (seen.v[l] + sv * down[l]).max(1.0).min(rows) + MAGIC;
            let i = ((v.to_bits() & 0x7f_ffff) * stride + (u.to_bits() & 0x7f_ffff)) as usize;
            let reading = if i < value.len() { value[i].abs() } else { 0.0 };
            let past = (reading * seen.scale[l] - seen.length[l]) * per_depth[l] + 0.5;
            let inside = (seen.u[l] >= left - 0.5)
                & (seen.u[l] < right + 0.5)
                & (seen.v[l] >= 0.5)
                & (seen.v[l] < rows + 0.5);
            let ahead = (reading > 0.0) & inside & (seen.length[l] >= 0.0) & (seen.scale[l] > 0.0);
            share[l] += if ahead { past.clamp(0.0, 1.0) } else { 0.0 };
        }
    }
    share.map(|s| 0.25 * s)
}
