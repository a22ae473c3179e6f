//! Arrays without holes: a first pass counts, a second writes every vertex and every triangle in its place.
//!
//! All crossings of such an array are at some cube, and become vertices. So signs alone say how many each brick has, and
//! which number: no piece of a mesh is kept in between, and the result is touched once *(as flying edges do, Schroeder,
//! Maynard & Geveci 2015)*.

use super::dense::{Below, Tiles};
use super::edges::Edges;
use super::patch::Patch;
use super::piece::WORDS;
use super::samples::{DenseSamples, Samples};
use super::signs::Layers;
use super::table::{AMBIGUOUS, TABLE};
use super::vertex::Attributes;
use super::writer::{Place, Writer, fill};
use crate::parallel;
use crate::sets::bits;
use crate::surface::Mesh;

/// No brick.
pub(super) const NONE: u32 = u32::MAX;

/// What a brick with surface has, and where that goes. The order is that of [`Piece`](super::piece::Piece).
pub(super) struct Brick {
    /// Place among all bricks.
    pub(super) at: [usize; 3],
    /// The edges with a crossing: axis + 3 z, a bit per node where an edge starts.
    pub(super) crossing: [u64; WORDS],
    /// Number of crossings in the words before each.
    pub(super) rank: [u16; WORDS],
    /// Cubes with surface.
    pub(super) active: [u64; 8],
    pub(super) own: u32,
    centres: u32,
    triangles: u32,
    pub(super) first_vertex: u32,
}

/// The bricks with surface of one tile, and what their cubes look like.
#[derive(Default)]
pub(super) struct Counted {
    pub(super) bricks: Vec<Brick>,
    /// Where each crossing lies on its edge: computed as long as the samples are in cache.
    pub(super) crossings: Vec<f32>,
    /// The signs of every cube with surface.
    pub(super) cases: Vec<u8>,
    /// The triangles of those that the signs leave ambiguous.
    pub(super) patches: Vec<&'static Patch>,
    vertices: usize,
    triangles: usize,
}

impl Counted {
    fn add(&mut self, at: [usize; 3], layers: &Layers, samples: &DenseSamples) {
        let (inside, observed) = (&layers.inside, &layers.observed);
        let mut brick = Brick {
            at,
            crossing: [0; WORDS],
            rank: [0; WORDS],
            active: [0; 8],
            own: 0,
            centres: 0,
            triangles: 0,
            first_vertex: 0,
        };
        for z in 0..8 {
            let (i, o, above) = (&inside[z], &observed[z], &inside[z + 1]);
            let words = [(i.at ^ i.x) & o.at & o.x, (i.at ^ i.y) & o.at & o.y];
            let upright = (i.at ^ above.at) & o.at & observed[z + 1].at;
            for (axis, word) in [words[0], words[1], upright].into_iter().enumerate() {
                brick.crossing[3 * z + axis] = word;
                brick.rank[3 * z + axis] = brick.own as u16;
                brick.own += word.count_ones();
            }
            let full = o.all() & observed[z + 1].all();
            brick.active[z] = full & (i.any() | above.any()) & !(i.all() & above.all());
        }
        self.crossings.reserve(brick.own as usize);
        for z in 0..8 {
            self.cross::<0>(&brick, z, samples);
            self.cross::<1>(&brick, z, samples);
            self.cross::<2>(&brick, z, samples);
        }
        let table = &*TABLE;
        for z in 0..8 {
            let (low, high) = (&inside[z], &inside[z + 1]);
            for i in bits(brick.active[z]) {
                let bit = |word: u64, k: usize| (word >> i & 1) << k;
                let case = bit(low.at, 0) | bit(low.x, 1) | bit(low.y, 2) | bit(low.xy, 3);
                let case = case | bit(high.at, 4) | bit(high.x, 5) | bit(high.y, 6) | bit(high.xy, 7);
                self.cases.push(case as u8);
                let triangles = table.plain[case as usize & 255].triangles;
                if triangles != AMBIGUOUS {
                    brick.triangles += u32::from(triangles);
                    continue;
                }
                let at = [i & 7, i >> 3, z];
                let corner = |c: usize| std::array::from_fn(|k| (at[k] + (c >> k & 1)) as i32);
                let patch = table.patch(case as u8, &std::array::from_fn(|c| samples.value(corner(c))));
                brick.centres += patch.centres.len() as u32;
                brick.triangles += patch.triangles.len() as u32;
                self.patches.push(patch);
            }
        }
        // Its cubes may have surface at edges of its neighbors alone.
        if brick.own > 0 || brick.triangles > 0 {
            self.vertices += (brick.own + brick.centres) as usize;
            self.triangles += brick.triangles as usize;
            self.bricks.push(brick);
        }
    }

    #[inline(always)]
    fn cross<const AXIS: usize>(&mut self, brick: &Brick, z: usize, samples: &DenseSamples) {
        let edges = Edges::<AXIS>::new(samples, z);
        let all = bits(brick.crossing[3 * z + AXIS]);
        self.crossings.extend(all.map(|i| edges.crossing(i & 7, i >> 3)));
    }
}

/// The surface of an array of which all samples are finite; `None` where one is not, or where there are no cubes.
pub(super) fn surface(
    tiles: &Tiles,
    samples: &DenseSamples,
    below: Below,
    want: Attributes,
    threads: usize,
) -> Option<(Mesh, Vec<f32>)> {
    if samples.shape.iter().any(|n| *n < 2) {
        return None;
    }
    let counted = parallel::map_numbers_on(threads, tiles.count(), Vec::new, |i, signs| {
        let tile = tiles.tile(i);
        if !tile.read(samples.samples, samples.shape, below, signs) {
            return None;
        }
        let mut counted = Counted::default();
        tile.each_crossed(signs, |at, layers| {
            counted.add(at, layers, &DenseSamples { first: at.map(|k| 8 * k), ..*samples });
        });
        Some(counted)
    });
    let mut counted = counted.into_iter().collect::<Option<Vec<_>>>()?;
    let (mut vertices, mut triangles) = (0usize, 0usize);
    for tile in &mut counted {
        for brick in &mut tile.bricks {
            brick.first_vertex = vertices as u32;
            vertices += (brick.own + brick.centres) as usize;
            assert!(vertices < NONE as usize, "a mesh has less than 2^32 vertices");
        }
        triangles += tile.triangles;
    }
    let bricks: Vec<&Brick> = counted.iter().flat_map(|tile| &tile.bricks).collect();
    let mut grid = vec![NONE; tiles.bricks.iter().product()];
    for (i, brick) in bricks.iter().enumerate() {
        grid[brick.at[0] + tiles.bricks[0] * (brick.at[1] + tiles.bricks[1] * brick.at[2])] = i as u32;
    }
    let mut mesh = Mesh {
        vertices: vec![[0.0; 3]; vertices],
        triangles: vec![[0; 3]; triangles],
        normals: vec![[0.0; 3]; if want.normals { vertices } else { 0 }],
        ..Mesh::default()
    };
    let mut ranges = vec![0.0; if want.ranges { vertices } else { 0 }];
    let (mut v, mut t) = (&mut mesh.vertices[..], &mut mesh.triangles[..]);
    let (mut n, mut r) = (&mut mesh.normals[..], &mut ranges[..]);
    let mut places: Vec<Place> = counted
        .iter()
        .map(|tile| Place {
            tile,
            vertices: v.split_off_mut(..tile.vertices).unwrap_or_default(),
            triangles: t.split_off_mut(..tile.triangles).unwrap_or_default(),
            normals: n.split_off_mut(..tile.vertices).unwrap_or_default(),
            ranges: r.split_off_mut(..tile.vertices).unwrap_or_default(),
        })
        .collect();
    let writer = Writer { samples, bricks: &bricks, grid: &grid, extent: tiles.bricks, want };
    // On the stack: an allocation of this size costs a small array more than its surface.
    let numbers = || [0u32; 4096];
    parallel::change_each_on(threads, &mut places, 1, numbers, |place, numbers| {
        fill(&writer, place, numbers)
    });
    super::normals::complete(&mut mesh);
    Some((mesh, ranges))
}
