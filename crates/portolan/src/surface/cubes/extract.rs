//! Meshes of bricks of signed distances.

use super::assemble::{Placement, assemble};
use super::parallel::map;
use super::piece::{Attributes, Numbers, Part};
use super::samples::{BrickSamples, MIDDLE};
use super::signs::{Layers, Signs, signs_of_brick};
use crate::cell::{Color, DistanceBrick, SignedDistance};
use crate::geom::BlockKey;
use crate::store::{Bricks, Store};
use crate::surface::Mesh;

/// How a mesh is extracted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSettings {
    /// A cube with a corner of smaller weight has no sign and gets no triangle: no geometry is invented.
    pub min_weight: f32,
    /// Whether vertices get normals.
    pub normals: bool,
    /// Whether vertices get colours, where there are any.
    pub colors: bool,
}

impl Default for MeshSettings {
    /// The `W_min` 0.5 of contours; normals and colours.
    fn default() -> Self {
        Self { min_weight: 0.5, normals: true, colors: true }
    }
}

impl MeshSettings {
    pub(super) fn attributes(&self, colors: bool) -> Attributes {
        Attributes { normals: self.normals, colors: self.colors && colors }
    }
}

impl Placement {
    /// Samples sit at the centres of cells.
    pub(super) fn of(store: &Bricks<SignedDistance, 3>) -> Self {
        let lattice = store.lattice();
        Self { origin: lattice.origin, resolution: lattice.resolution, offset: 0.5, first: None }
    }
}

/// Bricks that one worker meshes before it asks for more.
const TOGETHER: usize = 64;

/// The zero level set of the distances as triangles whose normals point to free space.
///
/// Cubes join the centres of eight neighbouring cells. Negative is inside, zero is free; a vertex lies on an edge
/// between two cells of different sign by linear interpolation, 1/256 of a cell away from both at least. What eight
/// signs leave open is decided as the trilinear field has it: faces by the exact sign at their saddle, so that both
/// cubes at a face agree (asymptotic decider, Nielson & Hamann 1991), and the inside by following the level set through
/// the cube; the triangles have the topology of the trilinear level set. A cube with a corner that was not observed, or
/// by less than `min_weight`, gets no triangle.
///
/// The mesh is a manifold: every edge lies between two triangles, or between one and what was not observed. It has no
/// cracks between bricks: a vertex belongs to its edge. The order of everything is that of the bricks' keys and the same
/// for any number of threads. O(cells), a few nanoseconds each where no surface is near; see the bench `mesh`.
pub fn marching_cubes(
    store: &Bricks<SignedDistance, 3>,
    colors: Option<&Bricks<Color, 3>>,
    settings: &MeshSettings,
) -> Mesh {
    let mut bricks: Vec<_> = store.bricks_by_age().collect();
    bricks.sort_unstable_by_key(|(key, _)| order(*key));
    let want = settings.attributes(colors.is_some());
    let colors = colors.filter(|_| want.colors);
    let chunks = bricks.len().div_ceil(TOGETHER);
    let range = |chunk: usize| chunk * TOGETHER..((chunk + 1) * TOGETHER).min(bricks.len());
    let signs = map(
        chunks,
        || (),
        |(), chunk| {
            let signs = bricks[range(chunk)].iter().map(|(_, b)| signs_of_brick(b, settings.min_weight));
            signs.collect::<Vec<_>>()
        },
    );
    let sign = |i: usize| &signs[i / TOGETHER][i % TOGETHER];
    let parts = map(chunks, Numbers::new, |numbers, chunk| {
        let mut part = Part::default();
        let mut upper = Walk::new(&bricks, range(chunk), want.normals);
        for i in range(chunk) {
            let key = bricks[i].0;
            upper.step(key);
            let layers = Layers::new(std::array::from_fn(|o| {
                let at = std::array::from_fn(|k| (o >> k & 1) as i32);
                upper.brick(at).map_or(&Signs::NOTHING, sign)
            }));
            if !layers.any_crossing() {
                continue;
            }
            let near = |i: usize| upper.found[i].map(|at| bricks[at].1);
            let color = |i: usize| colors?.brick(neighbour(key, i));
            let samples = BrickSamples::new(near, color, settings.min_weight);
            part.add(key, &layers, &samples, want, numbers);
        }
        part
    });
    let pieces: Vec<_> = parts.iter().flat_map(|part| part.pieces.iter().map(move |p| (part, p))).collect();
    assemble(&pieces, &Placement::of(store), want)
}

/// The order of keys in one comparison.
pub(super) fn order(key: BlockKey<3>) -> (i32, i32, i32) {
    (key.0[2], key.0[1], key.0[0])
}

/// The key of a brick's neighbour in the order of [`BrickSamples`].
pub(super) fn neighbour(key: BlockKey<3>, i: usize) -> BlockKey<3> {
    let offset = [i % 3, i / 3 % 3, i / 9];
    BlockKey(std::array::from_fn(|k| key.0[k] + offset[k] as i32 - 1))
}

/// Finds the neighbours of bricks in ascending order of keys: one walk per neighbour.
struct Walk<'a> {
    bricks: &'a [(BlockKey<3>, &'a DistanceBrick)],
    /// Neighbours looked for, and how far each walk is.
    walks: Vec<(usize, usize)>,
    /// Positions of the neighbours of the brick that was stepped to.
    found: [Option<usize>; 27],
}

impl<'a> Walk<'a> {
    /// `all`: all 26 neighbours, not only the upper ones.
    fn new(bricks: &'a [(BlockKey<3>, &'a DistanceBrick)], range: std::ops::Range<usize>, all: bool) -> Self {
        let wanted = (0..27).filter(|&i| all || [i % 3, i / 3 % 3, i / 9].iter().all(|&k| k > 0));
        let start = bricks[range.start].0;
        let walk =
            |i: usize| (i, bricks.partition_point(|(key, _)| order(*key) < order(neighbour(start, i))));
        Self { bricks, walks: wanted.map(walk).collect(), found: [None; 27] }
    }

    fn step(&mut self, key: BlockKey<3>) {
        for (i, at) in &mut self.walks {
            let wanted = neighbour(key, *i);
            while *at < self.bricks.len() && order(self.bricks[*at].0) < order(wanted) {
                *at += 1;
            }
            self.found[*i] = (*at < self.bricks.len() && self.bricks[*at].0 == wanted).then_some(*at);
        }
    }

    fn brick(&self, offset: [i32; 3]) -> Option<usize> {
        self.found[(MIDDLE as i32 + offset[0] + 3 * offset[1] + 9 * offset[2]) as usize]
    }
}
