//! Meshes of bricks of signed distances.

use super::assemble::{Placement, assemble};
use super::numbers::Numbers;
use super::piece::Part;
use super::samples::{BrickSamples, MIDDLE, threshold};
use super::signs::{Layers, Signs, signs_of_brick};
use super::vertex::Attributes;
use crate::cell::{Color, DistanceBrick, SignedDistance};
use crate::geom::BlockKey;
use crate::map::DistanceMap;
use crate::parallel;
use crate::store::{Bricks, Store};
use crate::surface::Mesh;

/// Settings of [`marching_cubes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSettings {
    /// Cells of smaller weight are unknown; a cube with an unknown corner gets no triangles.
    pub min_weight: Option<f32>,
    /// Whether vertices get normals.
    pub normals: bool,
    /// Whether vertices get colors, if the map has any.
    pub colors: bool,
}

impl Default for MeshSettings {
    /// A least weight of 0.5, half an observation; normals and colors.
    fn default() -> Self {
        Self { min_weight: None, normals: true, colors: true }
    }
}

impl MeshSettings {
    /// The default, with the weight that fits a map written out: for meshes of its cells alone.
    pub fn of(map: &impl DistanceMap<3>) -> Self {
        Self { min_weight: Some(map.min_weight()), ..Self::default() }
    }

    pub(super) fn attributes(&self, colors: bool) -> Attributes {
        Attributes { normals: self.normals, colors: self.colors && colors, ranges: false }
    }
}

impl Placement {
    /// Samples lie at cell centers.
    pub(super) fn of(store: &Bricks<SignedDistance, 3>) -> Self {
        let lattice = store.lattice();
        Self { origin: lattice.origin, resolution: lattice.resolution, offset: 0.5, first: None }
    }
}

/// Bricks in one task.
const TOGETHER: usize = 64;

/// The zero level set of the distances as triangles whose normals point to free space.
///
/// The corners of a cube are the centers of eight neighboring cells *(Lorensen & Cline 1987)*. Negative is inside, zero is
/// free; a vertex is placed on an edge between two cells of different sign by linear interpolation, at least 1/256 of a cell
/// from both. Cases that the eight signs leave ambiguous have the topology of the trilinear field: faces by the exact sign
/// at their saddle, so that both cubes at a face agree (asymptotic decider, Nielson & Hamann 1991), and the interior by
/// following the level set through the cube. A cube with a corner of weight 0 or less than `min_weight` gets no triangles.
///
/// The mesh is a manifold: every edge has two triangles, or one at the border of observed space. There are no cracks between
/// bricks. Vertices and triangles are in the order of the bricks' keys and do not depend on the number of threads. O(cells),
/// a few nanoseconds per cell away from the surface; see the bench `mesh`.
pub fn marching_cubes(
    map: &impl DistanceMap<3>,
    colors: Option<&Bricks<Color, 3>>,
    settings: &MeshSettings,
) -> Mesh {
    let min_weight = settings.min_weight.unwrap_or(map.min_weight());
    mesh_of(&map.bricks(), colors, settings, min_weight)
}

fn mesh_of(
    store: &Bricks<SignedDistance, 3>,
    colors: Option<&Bricks<Color, 3>>,
    settings: &MeshSettings,
    min_weight: f32,
) -> Mesh {
    let mut bricks: Vec<_> = store.bricks_by_age().collect();
    bricks.sort_unstable_by_key(|(key, _)| order(*key));
    let want = settings.attributes(colors.is_some());
    let colors = colors.filter(|_| want.colors);
    let threshold = threshold(min_weight);
    let chunks = bricks.len().div_ceil(TOGETHER);
    let range = |chunk: usize| chunk * TOGETHER..((chunk + 1) * TOGETHER).min(bricks.len());
    let signs = parallel::map(&bricks, TOGETHER, |(_, brick)| signs_of_brick(brick, threshold));
    let sign = |i: usize| &signs[i];
    let parts = parallel::map_numbers(chunks, Numbers::new, |chunk, numbers| {
        let mut part = Part::default();
        let mut upper = Walk::new(&bricks, range(chunk), want.normals);
        let mut samples = BrickSamples::new(threshold);
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
            for (i, _) in &upper.walks {
                let color = colors.and_then(|colors| colors.brick(neighbor(key, *i)));
                samples.set(*i, upper.found[*i].map(|at| bricks[at].1), color);
            }
            part.add(key, &layers, &samples, want, numbers);
        }
        part
    });
    let pieces: Vec<_> = parts.iter().flat_map(|part| part.pieces.iter().map(move |p| (part, p))).collect();
    assemble(&pieces, &Placement::of(store), want, usize::MAX).0
}

/// The order of keys as a tuple.
pub(super) fn order(key: BlockKey<3>) -> (i32, i32, i32) {
    (key.0[2], key.0[1], key.0[0])
}

/// The key of a brick's neighbor in the order of [`BrickSamples`].
pub(super) fn neighbor(key: BlockKey<3>, i: usize) -> BlockKey<3> {
    let offset = [i % 3, i / 3 % 3, i / 9];
    BlockKey(std::array::from_fn(|k| key.0[k] + offset[k] as i32 - 1))
}

/// Finds the neighbors of bricks in ascending order of keys: one pass per neighbor.
struct Walk<'a> {
    bricks: &'a [(BlockKey<3>, &'a DistanceBrick)],
    /// The neighbors to find, and the position of each pass.
    walks: Vec<(usize, usize)>,
    /// Positions of the neighbors of the current brick.
    found: [Option<usize>; 27],
}

impl<'a> Walk<'a> {
    /// With `all`, finds all 26 neighbors, else the upper ones.
    fn new(bricks: &'a [(BlockKey<3>, &'a DistanceBrick)], range: std::ops::Range<usize>, all: bool) -> Self {
        let wanted = (0..27).filter(|&i| all || [i % 3, i / 3 % 3, i / 9].iter().all(|&k| k > 0));
        let start = bricks[range.start].0;
        let walk = |i: usize| (i, bricks.partition_point(|(key, _)| order(*key) < order(neighbor(start, i))));
        Self { bricks, walks: wanted.map(walk).collect(), found: [None; 27] }
    }

    fn step(&mut self, key: BlockKey<3>) {
        for (i, at) in &mut self.walks {
            let wanted = neighbor(key, *i);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::ColorBrick;
    use crate::geom::Lattice;
    use crate::surface::cubes::testing::bricks;
    use crate::testing::{Random, with_threads};

    fn sphere(center: [f64; 3], radius: f64) -> impl Fn([i32; 3]) -> f32 {
        move |c| {
            let off: [f64; 3] = std::array::from_fn(|k| f64::from(c[k]) + 0.5 - center[k]);
            (off.iter().map(|v| v * v).sum::<f64>().sqrt() - radius) as f32
        }
    }

    #[test]
    fn a_mesh_at_utm_coordinates_is_as_fine_as_one_at_zero() {
        for origin in [[0.0; 3], [500_000.0, 4_000_000.0, 120.0]] {
            // Far from the lattice's own zero too.
            let first = [100_000, -70_000, 9];
            let center = first.map(|v| f64::from(v) + 20.0);
            let store = bricks(Lattice::new(origin, 0.05), first, [40; 3], sphere(center, 12.3));
            let mesh = marching_cubes(&store, None, &MeshSettings::default());
            assert_eq!((mesh.edge_counts().border, mesh.euler_characteristic()), (0, 2));
            for i in 0..mesh.vertices.len() {
                let p = mesh.vertex_world(i);
                let off: [f64; 3] = std::array::from_fn(|k| (p[k] - origin[k]) / 0.05 - center[k]);
                let radius = off.iter().map(|v| v * v).sum::<f64>().sqrt();
                // Chords of cells, and UTM coordinates hold 1e-9 m.
                assert!((radius - 12.3).abs() < 0.02, "{radius}");
                let cosine: f64 = (0..3).map(|k| off[k] / radius * f64::from(mesh.normals[i][k])).sum();
                assert!(cosine > 0.998);
            }
        }
    }

    #[test]
    fn what_was_not_observed_has_no_surface() {
        let value = |c: [i32; 3]| if c[0] > 20 { f32::NAN } else { c[2] as f32 - 9.7 };
        let store = bricks(Lattice::new([0.0; 3], 1.0), [3; 3], [30; 3], value);
        let mesh = marching_cubes(&store, None, &MeshSettings::default());
        assert_eq!(mesh.triangles.len(), 2 * 17 * 29);
        assert_eq!(mesh.vertices.len(), 18 * 30);
        assert!(mesh.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
        let strict = MeshSettings { min_weight: Some(1.5), ..MeshSettings::default() };
        assert!(marching_cubes(&store, None, &strict).triangles.is_empty());
        assert_eq!(marching_cubes(&Bricks::new(Lattice::new([0.0; 3], 1.0)), None, &strict), Mesh::default());
    }

    #[test]
    fn crossings_without_a_whole_cube_are_no_vertices() {
        let mut random = Random(5);
        let value = |_: [i32; 3]| if random.next().is_multiple_of(3) { f32::NAN } else { random.value() };
        let value = std::cell::RefCell::new(value);
        let store = bricks(Lattice::new([0.0; 3], 1.0), [-11; 3], [30; 3], |c| value.borrow_mut()(c));
        let mesh = marching_cubes(&store, None, &MeshSettings::default());
        assert_eq!(mesh.edge_counts().faulty, 0);
        let mut used = vec![false; mesh.vertices.len()];
        mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        assert!(mesh.triangles.len() > 500 && used.iter().all(|&u| u));
    }

    #[test]
    fn colours_are_weighted_by_nearness_and_weight() {
        let store = bricks(Lattice::new([0.0; 3], 1.0), [0; 3], [8; 3], |c| c[2] as f32 - 3.25);
        let mut colors = Bricks::new(Lattice::new([0.0; 3], 1.0));
        let words = |weight: u16| -> Vec<[u16; 4]> {
            let word = |z: usize| if z > 3 { [65535, 0, 0, weight] } else { [0, 0, 65535, 256] };
            (0..512).map(|i| word(i / 64)).collect()
        };
        let settings = MeshSettings::default();
        colors.insert(BlockKey([0; 3]), ColorBrick::from_words(&words(256))).unwrap();
        let mesh = marching_cubes(&store, Some(&colors), &settings);
        assert!(mesh.colors.iter().all(|c| *c == [64, 0, 191]), "{:?}", mesh.colors[0]);
        colors.insert(BlockKey([0; 3]), ColorBrick::from_words(&words(768))).unwrap();
        let mesh = marching_cubes(&store, Some(&colors), &settings);
        assert!(mesh.colors.iter().all(|c| *c == [128, 0, 128]), "{:?}", mesh.colors[0]);
        colors.insert(BlockKey([0; 3]), ColorBrick::from_words(&words(0))).unwrap();
        let mesh = marching_cubes(&store, Some(&colors), &settings);
        assert!(mesh.colors.iter().all(|c| *c == [0, 0, 255]), "{:?}", mesh.colors[0]);
        assert!(marching_cubes(&store, None, &settings).colors.is_empty());
    }

    #[cfg(feature = "parallel")]
    #[test]
    fn threads_do_not_change_a_byte() {
        let mut random = Random(9);
        let value = std::cell::RefCell::new(move || random.value());
        let store = bricks(Lattice::new([1e6; 3], 0.1), [-30; 3], [70; 3], |_| value.borrow_mut()());
        let with = |threads| with_threads(threads, || marching_cubes(&store, None, &MeshSettings::default()));
        let one = with(1);
        assert!(one.triangles.len() > 300_000 && one == with(2) && one == with(7));
    }
}
