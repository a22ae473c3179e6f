//! A mesh that is updated with its map: only bricks near a change are meshed again.

use super::assemble::{Placement, assemble};
use super::extract::{MeshSettings, neighbor, order};
use super::numbers::Numbers;
use super::piece::{Part, Piece, place_of};
use super::samples::{BrickSamples, threshold};
use super::signs::{Layers, Signs, signs_of_brick};
use super::vertex::Attributes;
use crate::cell::{Color, SignedDistance};
use crate::geom::BlockKey;
use crate::parallel;
use crate::store::Bricks;
use crate::surface::Mesh;
use rustc_hash::FxHashMap;

/// The pieces of a mesh, brick by brick, kept between changes of the map.
///
/// [`IncrementalMesh::update`] meshes the bricks that changed since the last call; [`IncrementalMesh::mesh`] joins the
/// pieces. The result is equal, byte for byte, to [`marching_cubes`](super::marching_cubes) over the whole map.
#[derive(Debug)]
pub struct IncrementalMesh {
    settings: MeshSettings,
    /// Whether the pieces have colors: whether the last update had.
    colored: bool,
    pieces: FxHashMap<BlockKey<3>, Part>,
    /// Epochs of distances and colors of the pieces.
    seen: [u64; 2],
    placement: Option<Placement>,
}

impl IncrementalMesh {
    /// An empty mesh.
    pub fn new(settings: MeshSettings) -> Self {
        Self { settings, colored: false, pieces: FxHashMap::default(), seen: [0; 2], placement: None }
    }

    /// Meshes the bricks that changed since the last call, and the neighbors that read their cells: the lower ones, or all
    /// for normals, which are differences between cells. Returns the keys of the pieces meshed, ascending. O(bricks) to find
    /// changes, then O(changed bricks).
    ///
    /// `store` and `colors` must be those of the last call; use another `IncrementalMesh` for another map.
    pub fn update(
        &mut self,
        store: &Bricks<SignedDistance, 3>,
        colors: Option<&Bricks<Color, 3>>,
    ) -> Vec<BlockKey<3>> {
        let want = self.settings.attributes(colors.is_some());
        if want.colors != self.colored {
            // Pieces without colors cannot be kept.
            self.pieces.clear();
            self.seen = [0; 2];
            self.colored = want.colors;
        }
        let colors = colors.filter(|_| want.colors);
        let mut dirty: Vec<BlockKey<3>> = Vec::new();
        let mut mark = |changed: Vec<BlockKey<3>>, all: bool| {
            for key in changed {
                // A neighbor whose upper neighbor changed is a lower neighbor of the change.
                let lower = |i: &usize| all || [i % 3, i / 3 % 3, i / 9].iter().all(|&k| k < 2);
                dirty.extend((0..27).filter(lower).map(|i| neighbor(key, i)));
            }
        };
        mark(store.changed_since(self.seen[0]), want.normals);
        if let Some(colors) = colors {
            mark(colors.changed_since(self.seen[1]), false);
        }
        dirty.sort_unstable_by_key(|key| order(*key));
        dirty.dedup();
        dirty.retain(|key| store.brick(*key).is_some());
        let parts = parallel::map_numbers(dirty.len(), Numbers::new, |i, numbers| {
            mesh_brick(store, colors, self.settings.min_weight.unwrap_or(0.0), want, dirty[i], numbers)
        });
        for (key, part) in dirty.iter().zip(parts) {
            if part.pieces.is_empty() {
                self.pieces.remove(key);
            } else {
                self.pieces.insert(*key, part);
            }
        }
        self.seen = [store.epoch(), colors.map_or(0, Bricks::epoch)];
        self.placement = Some(Placement::of(store));
        dirty
    }

    /// The mesh as of the last update. O(triangles).
    pub fn mesh(&self) -> Mesh {
        let Some(placement) = &self.placement else { return Mesh::default() };
        let mut pieces: Vec<_> = self
            .pieces
            .values()
            .flat_map(|part| part.pieces.iter().map(move |piece| (part, piece)))
            .collect();
        pieces.sort_unstable_by_key(|(_, piece)| order(piece.key));
        assemble(&pieces, placement, self.settings.attributes(self.colored), usize::MAX).0
    }

    /// The keys of all pieces, ascending. O(n log n).
    pub fn keys(&self) -> Vec<BlockKey<3>> {
        let mut keys: Vec<_> = self.pieces.keys().copied().collect();
        keys.sort_unstable_by_key(|key| order(*key));
        keys
    }

    /// The numbers of vertices and triangles of [`IncrementalMesh::piece`]; zeros for a brick without surface. O(1).
    pub fn piece_size(&self, key: BlockKey<3>) -> [usize; 2] {
        let piece = self.pieces.get(&key).and_then(|part| part.pieces.first());
        piece.map_or([0; 2], |p| [(p.own + p.foreign + p.centres) as usize, p.triangles as usize])
    }

    /// The piece of one brick as a mesh of its own, for drawing a map brick by brick: triangles and positions are those of
    /// [`IncrementalMesh::mesh`]; vertices at the upper sides of the brick are duplicates of its neighbors'. The origin is
    /// the lower corner of the brick `first`. Empty for a brick without surface. O(triangles of the brick).
    pub fn piece(&self, key: BlockKey<3>, first: BlockKey<3>) -> Mesh {
        let (Some(placement), Some(part)) = (&self.placement, self.pieces.get(&key)) else {
            return Mesh::default();
        };
        let Some(piece) = part.pieces.first() else { return Mesh::default() };
        let want = self.settings.attributes(self.colored);
        let scale = placement.resolution;
        let mut mesh = Mesh {
            origin: std::array::from_fn(|k| placement.origin[k] + f64::from(first.0[k]) * 8.0 * scale),
            ..Mesh::default()
        };
        let mut add = |part: &Part, piece: &Piece, i: usize| {
            // The same operations as in `assemble`, so that vertices have the same bits.
            let place = |k: usize| {
                let base = 8.0 * (f64::from(piece.key.0[k]) - f64::from(first.0[k])) + placement.offset;
                ((base + f64::from(part.vertices[i][k])) * scale) as f32
            };
            mesh.vertices.push([place(0), place(1), place(2)]);
            if want.normals {
                mesh.normals.push(super::normals::unit(part.gradients[i]));
            }
            if want.colors {
                mesh.colors.push(part.colors[i]);
            }
        };
        let (start, own) = (piece.first_vertex as usize, piece.own as usize);
        (start..start + own).for_each(|i| add(part, piece, i));
        let foreign = piece.first_foreign as usize;
        for &code in &part.foreign[foreign..foreign + piece.foreign as usize] {
            let octant = i32::from(code >> 11);
            let at = BlockKey(std::array::from_fn(|k| key.0[k] + (octant >> k & 1)));
            let owner = self.pieces.get(&at).and_then(|part| Some((part, part.pieces.first()?)));
            // A crossing that a cube uses exists in its owner: both were meshed from the same cells.
            let Some((part, owner)) = owner else { return Mesh::default() };
            let (word, bit) = place_of(code);
            let below = (owner.crossing[word] & ((1 << bit) - 1)).count_ones();
            add(part, owner, owner.first_vertex as usize + usize::from(owner.rank[word]) + below as usize);
        }
        (start + own..start + own + piece.centres as usize).for_each(|i| add(part, piece, i));
        let triangles = piece.first_triangle as usize;
        let triangles = &part.triangles[triangles..triangles + piece.triangles as usize];
        mesh.triangles = triangles.iter().map(|t| t.map(u32::from)).collect();
        super::normals::complete(&mut mesh);
        mesh
    }

    /// Memory of the pieces (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.pieces.values().map(Part::memory_bytes).sum::<usize>()
            + self.pieces.capacity() * (size_of::<(BlockKey<3>, Part)>() + 1)
    }
}

/// The piece of one brick.
fn mesh_brick(
    store: &Bricks<SignedDistance, 3>,
    colors: Option<&Bricks<Color, 3>>,
    min_weight: f32,
    want: Attributes,
    key: BlockKey<3>,
    numbers: &mut Numbers,
) -> Part {
    let threshold = threshold(min_weight);
    let octants: [Signs; 8] = std::array::from_fn(|o| {
        let at = BlockKey(std::array::from_fn(|k| key.0[k] + (o >> k & 1) as i32));
        store.brick(at).map_or(Signs::NOTHING, |brick| signs_of_brick(brick, threshold))
    });
    let layers = Layers::new(octants.each_ref());
    let mut part = Part::default();
    if layers.any_crossing() {
        let mut samples = BrickSamples::new(threshold);
        for i in 0..27 {
            let at = neighbor(key, i);
            samples.set(i, store.brick(at), colors.and_then(|colors| colors.brick(at)));
        }
        part.add(key, &layers, &samples, want, numbers);
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{ColorBrick, DistanceBrick};
    use crate::geom::Lattice;
    use crate::surface::cubes::testing::bricks;
    use crate::surface::marching_cubes;
    use crate::testing::Random;
    use proptest::prelude::*;

    fn noise_brick(random: &mut Random, holes: u64) -> DistanceBrick {
        crate::testing::brick::<3>(|_| {
            let distance = random.value();
            (random.next() % 100 >= holes).then_some((distance, 1.0))
        })
    }

    fn color_brick(random: &mut Random) -> ColorBrick {
        let words: Vec<[u16; 4]> = (0..512).map(|_| std::array::from_fn(|_| random.next() as u16)).collect();
        ColorBrick::from_words(&words)
    }

    /// The corners of all triangles with all that they carry, sorted.
    fn corners(mesh: &Mesh) -> Vec<[[u32; 6]; 3]> {
        let corner = |v: u32| {
            let v = v as usize;
            let [r, g, b] = mesh.colors.get(v).map_or([0; 3], |c| c.map(u32::from));
            let [x, y, z] = mesh.vertices[v].map(f32::to_bits);
            // Normals that come from triangles differ where the triangles of a brick are not all.
            let n = mesh
                .normals
                .get(v)
                .map_or(0, |n| n.map(f32::to_bits).iter().fold(0, |h: u32, b| h.rotate_left(7) ^ b));
            [x, y, z, r << 16 | g << 8 | b, n, 0]
        };
        let mut all: Vec<_> = mesh.triangles.iter().map(|t| t.map(corner)).collect();
        all.sort_unstable();
        all
    }

    /// The pieces one by one, relative to where the mesh is.
    fn pieces_joined(incremental: &IncrementalMesh, mesh: &Mesh) -> Vec<[[u32; 6]; 3]> {
        let first = |k: usize| incremental.keys().iter().map(|key| key.0[k]).min().unwrap_or(0);
        let first = BlockKey(std::array::from_fn(first));
        let mut all = Vec::new();
        for key in incremental.keys() {
            let piece = incremental.piece(key, first);
            assert_eq!(incremental.piece_size(key), [piece.vertices.len(), piece.triangles.len()]);
            assert_eq!(piece.origin, mesh.origin);
            all.extend(corners(&piece));
        }
        all.sort_unstable();
        all
    }

    fn random_key(random: &mut Random) -> BlockKey<3> {
        BlockKey(std::array::from_fn(|_| (random.next() % 4) as i32 - 2))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn meshing_changes_equals_meshing_all(seed: u64, normals: bool, colored: bool, holes in 0..12u64) {
            let mut random = Random(seed);
            let lattice = Lattice::new([500_000.0, 4_000_000.0, -3.0], 0.05);
            let (mut store, mut colors) = (Bricks::new(lattice), Bricks::new(lattice));
            let settings = MeshSettings { min_weight: Some(0.5), normals, colors: true };
            let mut incremental = IncrementalMesh::new(settings);
            for round in 0..6 {
                for _ in 0..1 + random.next() % 4 {
                    store.insert(random_key(&mut random), noise_brick(&mut random, holes)).unwrap();
                }
                if round % 2 == 0 {
                    colors.insert(random_key(&mut random), color_brick(&mut random)).unwrap();
                }
                let colors = colored.then_some(&colors);
                incremental.update(&store, colors);
                let (mesh, whole) = (incremental.mesh(), marching_cubes(&store, colors, &settings));
                prop_assert_eq!(whole.edge_counts().faulty, 0);
                prop_assert_eq!(whole.colors.len(), if colored { whole.vertices.len() } else { 0 });
                prop_assert!(mesh == whole);
                prop_assert_eq!(pieces_joined(&incremental, &mesh), corners(&mesh));
                // Nothing changed: nothing is done.
                prop_assert!(incremental.update(&store, colors).is_empty());
            }
        }
    }

    #[test]
    fn a_change_reaches_its_lower_neighbours_only() {
        let plane = |c: [i32; 3]| c[2] as f32 - 11.5;
        let mut store = bricks(Lattice::new([0.0; 3], 0.1), [0; 3], [40; 3], plane);
        let mut incremental =
            IncrementalMesh::new(MeshSettings { normals: false, ..MeshSettings::default() });
        assert_eq!(incremental.mesh(), Mesh::default());
        assert_eq!(incremental.update(&store, None).len(), 125);
        let key = BlockKey([2, 2, 1]);
        let brick = store.brick(key).unwrap().clone();
        store.insert(key, brick).unwrap();
        let again = incremental.update(&store, None);
        assert_eq!((again.len(), again[0], again[7]), (8, BlockKey([1, 1, 0]), key));
        assert_eq!(incremental.mesh().triangles.len(), 2 * 39 * 39);
        assert!(incremental.memory_bytes() > 0);
    }
}
