//! Meshes of dense arrays.

use super::assemble::{Placement, assemble};
use super::numbers::Numbers;
use super::piece::Part;
use super::samples::DenseSamples;
use super::signs::{Layers, Signs, word32};
use super::vertex::{Attributes, MARGIN};
use super::whole;
use crate::geom::BlockKey;
use crate::parallel;
use crate::surface::Mesh;

/// Which samples are inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inside {
    /// Those below the level, as distances are.
    Below,
    /// Those above the level, as densities are.
    Above,
}

/// What is asked of an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsosurfaceSettings<'a> {
    /// The samples at the surface; a sample of this value is not inside.
    pub level: f64,
    /// Normals point away from it.
    pub inside: Inside,
    /// Whether vertices have normals: central differences of the samples, interpolated.
    pub normals: bool,
    /// Whether vertices have ranges.
    pub ranges: bool,
    /// Vertices stay 1/256 from all nodes, so that there are no triangles without area and no two vertices in one place.
    /// Without it they lie where the samples say.
    pub apart: bool,
    /// A flag for each sample: cubes whose highest node's is not set have no surface. `None`: all may have.
    pub cubes: Option<&'a [bool]>,
    /// On so many threads at most; 1 is the caller's. The surface is the same.
    pub threads: usize,
}

impl Default for IsosurfaceSettings<'_> {
    /// The zero of distances, with normals, on all threads.
    fn default() -> Self {
        Self {
            level: 0.0,
            inside: Inside::Below,
            normals: true,
            ranges: false,
            apart: true,
            cubes: None,
            threads: usize::MAX,
        }
    }
}

/// The level set of an array.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Isosurface {
    /// In units of the grid, sample (0, 0, 0) at the origin.
    pub mesh: Mesh,
    /// By vertex: the largest difference of two samples of one cube with surface at it. Empty where not requested.
    pub ranges: Vec<f32>,
}

/// The level set of samples on a grid as triangles whose normals point away from the inside.
///
/// `samples` are x fastest, `shape` of them along each axis. Samples that are not finite are unknown: cubes with one have no
/// surface. Otherwise as [`marching_cubes`](super::marching_cubes), with the same code. O(samples), limited by memory
/// bandwidth away from the surface.
///
/// # Panics
/// Where the length of `samples` or of flags is not the product of `shape`, or an axis has more than 2^30 samples.
pub fn isosurface(samples: &[f32], shape: [usize; 3], settings: &IsosurfaceSettings) -> Isosurface {
    let product = shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s));
    assert_eq!(product, Some(samples.len()), "one sample per node");
    assert!(settings.cubes.is_none_or(|cubes| cubes.len() == samples.len()), "one flag per node");
    assert!(shape.iter().all(|&n| n <= 1 << 30), "an index of a node is an i32");
    let want = Attributes { normals: settings.normals, colors: false, ranges: settings.ranges };
    let (dense, below, tiles) =
        (DenseSamples::of(samples, shape, settings), Below::of(settings), Tiles::new(shape));
    if settings.cubes.is_none()
        && let Some((mesh, ranges)) = whole::surface(&tiles, &dense, below, want, settings.threads)
    {
        return Isosurface { mesh, ranges };
    }
    with_holes(&tiles, &dense, below, want, settings.threads)
}

impl<'a> DenseSamples<'a> {
    fn of(samples: &'a [f32], shape: [usize; 3], settings: &IsosurfaceSettings<'a>) -> Self {
        Self {
            samples,
            shape,
            level: settings.level,
            sign: Below::of(settings).sign,
            margin: if settings.apart { MARGIN } else { 0.0 },
            cubes: settings.cubes,
            first: [0; 3],
        }
    }
}

/// The level set of any array, piece by piece.
fn with_holes(
    tiles: &Tiles,
    dense: &DenseSamples,
    below: Below,
    want: Attributes,
    threads: usize,
) -> Isosurface {
    let scratch = || (Vec::new(), Numbers::new(), [0; 4]);
    let parts = parallel::map_numbers_on(threads, tiles.count(), scratch, |i, (signs, numbers, sizes)| {
        let tile = tiles.tile(i);
        tile.read(dense.samples, dense.shape, below, signs);
        // The sizes of the previous tile: arrays seldom grow.
        let mut part = Part::like(sizes);
        tile.mesh(dense, want, signs, numbers, &mut part);
        *sizes = part.sizes();
        part
    });
    let pieces: Vec<_> = parts.iter().flat_map(|part| part.pieces.iter().map(move |p| (part, p))).collect();
    let placement = Placement { origin: [0.0; 3], resolution: 1.0, offset: 0.0, first: Some([0; 3]) };
    let (mesh, ranges) = assemble(&pieces, &placement, want, threads);
    Isosurface { mesh, ranges }
}

/// What is inside, in the numbers of the samples: `sign * sample < threshold`.
#[derive(Clone, Copy)]
pub(super) struct Below {
    sign: f32,
    threshold: f32,
}

impl Below {
    /// The least `f32` that is not less than the level says the same of all `f32` as the level itself.
    fn of(settings: &IsosurfaceSettings) -> Self {
        let sign = if settings.inside == Inside::Below { 1.0f32 } else { -1.0 };
        let level = settings.level * f64::from(sign);
        let near = level as f32;
        let threshold = if f64::from(near) < level { near.next_up() } else { near };
        Self { sign, threshold }
    }

    #[inline(always)]
    fn holds(self, sample: f32) -> bool {
        self.sign * sample < self.threshold
    }
}

/// Samples of a tile. Their signs are read first, then values near the surface: few enough to stay in the second level of
/// cache in between.
const TILE: usize = 1 << 17;

/// The bricks of an array in tiles: whole rows of bricks along x, some beside each other along y. In ascending order of
/// keys.
pub(super) struct Tiles {
    pub(super) bricks: [usize; 3],
    /// Rows of bricks of a tile.
    rows: usize,
    /// Tiles along y.
    along: usize,
}

/// Some rows of bricks.
pub(super) struct Tile {
    nx: usize,
    y: std::ops::Range<usize>,
    z: usize,
}

impl Tiles {
    fn new(shape: [usize; 3]) -> Self {
        let bricks = shape.map(|n| n.div_ceil(8));
        let rows = (TILE / (bricks[0] * 512).max(1)).clamp(1, bricks[1].max(1));
        Self { bricks, rows, along: bricks[1].div_ceil(rows) }
    }

    pub(super) fn count(&self) -> usize {
        self.along * self.bricks[2]
    }

    pub(super) fn tile(&self, i: usize) -> Tile {
        let first = i % self.along * self.rows;
        let y = first..(first + self.rows).min(self.bricks[1]);
        Tile { nx: self.bricks[0], y, z: i / self.along }
    }
}

impl Tile {
    /// Index of the signs of a brick, of the tile or of its upper neighbors along y and z.
    fn place(&self, x: usize, y: usize, z: usize) -> usize {
        x + self.nx * (y - self.y.start + (self.y.len() + 1) * (z - self.z))
    }

    /// Signs of the tile's nodes, and of the nearest ones of its upper neighbors; whether all samples are finite.
    pub(super) fn read(
        &self,
        samples: &[f32],
        shape: [usize; 3],
        below: Below,
        signs: &mut Vec<Signs>,
    ) -> bool {
        signs.clear();
        signs.resize(2 * self.nx * (self.y.len() + 1), Signs::NOTHING);
        let mut finite = true;
        for z in 8 * self.z..(8 * self.z + 9).min(shape[2]) {
            for y in 8 * self.y.start..(8 * self.y.end + 1).min(shape[1]) {
                let row = &samples[(y + shape[1] * z) * shape[0]..][..shape[0]];
                let first = self.place(0, y >> 3, z >> 3);
                finite &= read_row(row, below, &mut signs[first..first + self.nx], [y & 7, z & 7]);
            }
        }
        finite
    }

    /// The bricks that may have surface, and the signs around them.
    pub(super) fn each_crossed(&self, signs: &[Signs], mut found: impl FnMut([usize; 3], &Layers)) {
        for y in self.y.clone() {
            for x in 0..self.nx {
                let layers = Layers::new(std::array::from_fn(|o| {
                    let at = self.place(x, y + (o >> 1 & 1), self.z + (o >> 2));
                    if x + (o & 1) < self.nx { &signs[at + (o & 1)] } else { &Signs::NOTHING }
                }));
                if layers.any_crossing() {
                    found([x, y, self.z], &layers);
                }
            }
        }
    }

    /// The pieces of the tile's bricks.
    fn mesh(
        &self,
        samples: &DenseSamples,
        want: Attributes,
        signs: &[Signs],
        numbers: &mut Numbers,
        part: &mut Part,
    ) {
        self.each_crossed(signs, |at, layers| {
            let samples = DenseSamples { first: at.map(|k| 8 * k), ..*samples };
            part.add(BlockKey(at.map(|k| k as i32)), layers, &samples, want, numbers);
        });
    }
}

/// Signs of one row of nodes along x; whether all of it is finite.
fn read_row(row: &[f32], below: Below, signs: &mut [Signs], [y, z]: [usize; 2]) -> bool {
    let shift = 8 * y;
    // Seldom false, and known at once for the row.
    let finite = row.iter().fold(true, |all, v| all & v.is_finite());
    let mut put = |at: usize, inside: u8, observed: u8| {
        signs[at].inside[z] |= u64::from(inside) << shift;
        signs[at].observed[z] |= u64::from(observed) << shift;
    };
    let (words, rest) = row.as_chunks::<32>();
    for (at, values) in words.iter().enumerate() {
        let observed = if finite { u32::MAX } else { word32(values, f32::is_finite) };
        let bytes = word32(values, |v| below.holds(v)).to_le_bytes().into_iter().zip(observed.to_le_bytes());
        for (k, (inside, observed)) in bytes.enumerate() {
            put(4 * at + k, inside, observed);
        }
    }
    for (at, values) in rest.chunks(8).enumerate() {
        let bits = |has: &dyn Fn(f32) -> bool| (0..).zip(values).map(|(k, v)| u8::from(has(*v)) << k).sum();
        put(4 * words.len() + at, bits(&|v| below.holds(v) && v.is_finite()), bits(&f32::is_finite));
    }
    finite
}

#[cfg(test)]
#[path = "dense_tests.rs"]
mod tests;
