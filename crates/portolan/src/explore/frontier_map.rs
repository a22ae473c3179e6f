//! The frontiers of a map, updated with its changes.

use super::Frontier;
use super::faces::BrickFrontier;
use super::frontier::{Pieces, join};
use crate::cell::SignedDistance;
use crate::geom::{BlockKey, Lattice};
use crate::map::DistanceMap;
use crate::parallel;
use crate::store::{Bricks, Store};

/// Settings of a [`FrontierMap`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontierSettings {
    /// Cells of smaller weight are unknown.
    pub min_weight: Option<f32>,
    /// Frontiers of fewer cells are omitted.
    pub min_cells: usize,
}

impl Default for FrontierSettings {
    /// A weight of 0.5, half an observation; ten cells.
    fn default() -> Self {
        Self { min_weight: None, min_cells: 10 }
    }
}

impl FrontierSettings {
    /// The default, with the weight that fits a map ([`DistanceMap::min_weight`](crate::map::DistanceMap::min_weight)).
    pub fn of<const D: usize>(map: &impl DistanceMap<D>) -> Self {
        Self { min_weight: Some(map.min_weight()), ..Self::default() }
    }
}

/// The frontiers of a map *(Yamauchi 1997)*, brick by brick, kept between changes of the map.
///
/// [`FrontierMap::update`] processes the bricks that changed since the last call; [`FrontierMap::frontiers`] joins the
/// cells of all bricks. The result equals that of a new `FrontierMap` over the whole map.
///
/// ```
/// use portolan::cell::DistanceBrick;
/// use portolan::explore::{FrontierMap, FrontierSettings};
/// use portolan::geom::{BlockKey, Lattice};
/// use portolan::store::Bricks;
///
/// // 8 x 8 observed cells of 10 cm: a wall on the left, else free.
/// let mut store = Bricks::new(Lattice::new([0.0, 0.0], 0.1));
/// let known: Vec<f32> = (0..64).map(|i| if i % 8 == 0 { -0.05 } else { 0.3 }).collect();
/// store.insert(BlockKey([0, 0]), DistanceBrick::from_parts(&known, &[1.0; 64]).expect("sane"))?;
///
/// let mut map = FrontierMap::new(FrontierSettings::default());
/// map.update(&store);
/// let [border] = &map.frontiers()[..] else { panic!("one border") };
/// assert_eq!((border.cells.len(), border.faces), (20, 22));
/// let toward = border.normal.expect("the right side is open, the left is not");
/// assert!((toward[0] - 1.0).abs() < 1e-12);
///
/// // More is observed on the right: only the bricks there are processed.
/// store.insert(BlockKey([1, 0]), DistanceBrick::from_parts(&[0.3; 64], &[1.0; 64]).expect("sane"))?;
/// assert_eq!(map.update(&store), [BlockKey([0, 0]), BlockKey([1, 0])]);
/// assert_eq!(map.frontiers()[0].extent.max[0], 1.6);
/// # Ok::<(), portolan::store::StoreFull>(())
/// ```
///
/// The same in 3-D, where the store is that of [`Tsdf3::store`](crate::map::Tsdf3::store):
///
/// ```
/// use portolan::cell::DistanceBrick;
/// use portolan::explore::FrontierMap;
/// use portolan::geom::{BlockKey, Lattice};
/// use portolan::store::Bricks;
///
/// let mut store = Bricks::new(Lattice::new([0.0; 3], 0.1));
/// store.insert(BlockKey([0; 3]), DistanceBrick::from_parts(&[0.3; 512], &[1.0; 512]).expect("sane"))?;
/// let mut map = FrontierMap::<3>::new(Default::default());
/// map.update(&store);
/// // The shell of the free cube, open to all sides.
/// let shell = &map.frontiers()[0];
/// assert_eq!((shell.cells.len(), shell.faces, shell.normal), (512 - 216, 384, None));
/// # Ok::<(), portolan::store::StoreFull>(())
/// ```
#[derive(Clone, Debug)]
pub struct FrontierMap<const D: usize> {
    settings: FrontierSettings,
    /// Bricks with a frontier cell.
    pieces: Pieces<D>,
    /// Epoch up to which the pieces are.
    seen: u64,
    lattice: Option<Lattice<D>>,
}

impl<const D: usize> FrontierMap<D> {
    /// An empty one.
    pub fn new(settings: FrontierSettings) -> Self {
        Self { settings, pieces: Pieces::default(), seen: 0, lattice: None }
    }

    /// The settings.
    pub fn settings(&self) -> &FrontierSettings {
        &self.settings
    }

    /// Processes the bricks that changed since the last call, and those that share a face with them. Returns their keys,
    /// ascending. O(bricks) to find changes, then O(changed bricks), on all cores with the feature `parallel`.
    ///
    /// `store` must be the store of the last call; use another `FrontierMap` for another map. A store with another lattice
    /// or an earlier epoch is processed from scratch.
    pub fn update(&mut self, store: &Bricks<SignedDistance, D>) -> Vec<BlockKey<D>> {
        if self.lattice != Some(*store.lattice()) || store.epoch() < self.seen {
            (self.pieces, self.seen) = (Pieces::default(), 0);
            self.lattice = Some(*store.lattice());
        }
        let mut dirty = Vec::new();
        for key in store.changed_since(self.seen) {
            dirty.push(key);
            for k in 0..D {
                dirty.extend([-1, 1].map(|step| {
                    let mut at = key;
                    at.0[k] += step;
                    at
                }));
            }
        }
        dirty.sort_unstable();
        dirty.dedup();
        dirty.retain(|key| store.brick(*key).is_some());
        let min_weight = self.settings.min_weight.unwrap_or(0.0);
        let pieces = parallel::map(&dirty, 16, |key| BrickFrontier::of(store, *key, min_weight));
        for (key, piece) in dirty.iter().zip(pieces) {
            if piece.cells.is_empty() {
                self.pieces.remove(key);
            } else {
                self.pieces.insert(*key, piece);
            }
        }
        self.seen = store.epoch();
        dirty
    }

    /// The frontiers as of the last update, largest first. O(n log n) in the bricks with frontier cells, O(n) in those
    /// cells.
    pub fn frontiers(&self) -> Vec<Frontier<D>> {
        self.lattice.map_or(Vec::new(), |lattice| join(&self.pieces, &lattice, self.settings.min_cells))
    }

    /// Memory of the frontier cells (bytes).
    pub fn memory_bytes(&self) -> usize {
        let cells = |piece: &BrickFrontier| size_of_val(&piece.cells[..]);
        self.pieces.values().map(cells).sum::<usize>()
            + self.pieces.capacity() * 8 / 7 * (size_of::<(BlockKey<D>, BrickFrontier)>() + 1)
            + size_of::<Self>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explore::cells::Known;
    use crate::explore::testing::{Edit, edits, put};
    use crate::geom::{Aabb, block_cells};
    use proptest::prelude::*;
    use std::collections::{BTreeMap, BTreeSet};

    const SETTINGS: FrontierSettings = FrontierSettings { min_weight: Some(0.5), min_cells: 2 };

    fn of_all<const D: usize>(store: &Bricks<SignedDistance, D>) -> Vec<Frontier<D>> {
        let mut map = FrontierMap::new(SETTINGS);
        map.update(store);
        map.frontiers()
    }

    /// Cell by cell, through the store's own interface.
    fn known<const D: usize>(store: &Bricks<SignedDistance, D>, cell: [i32; D]) -> Known {
        match store.cell(cell).filter(|c| Some(c.weight) >= SETTINGS.min_weight) {
            None => Known::Unknown,
            Some(c) if c.distance > 0.0 => Known::Free,
            Some(_) => Known::Occupied,
        }
    }

    /// Frontier cells with their open faces (axis, direction), by flooding over a set of cells.
    fn brute_force<const D: usize>(store: &Bricks<SignedDistance, D>) -> BTreeSet<Vec<[i32; D]>> {
        let mut open = BTreeMap::new();
        for key in store.keys() {
            for i in 0..block_cells::<D>() {
                let cell = key.cell(i);
                let faces: Vec<(usize, i32)> = (0..D)
                    .flat_map(|k| [(k, -1), (k, 1)])
                    .filter(|&(k, step)| {
                        let mut next = cell;
                        next[k] += step;
                        known(store, next) == Known::Unknown
                    })
                    .collect();
                if known(store, cell) == Known::Free && !faces.is_empty() {
                    open.insert(cell, faces);
                }
            }
        }
        let mut clusters = BTreeSet::new();
        while let Some((&start, _)) = open.first_key_value() {
            let (mut cluster, mut front) = (vec![], vec![start]);
            open.remove(&start);
            while let Some(cell) = front.pop() {
                cluster.push(cell);
                let near: Vec<_> = open
                    .keys()
                    .filter(|other| (0..D).all(|k| (other[k] - cell[k]).abs() <= 1))
                    .copied()
                    .collect();
                for next in near {
                    open.remove(&next);
                    front.push(next);
                }
            }
            cluster.sort_unstable();
            if cluster.len() >= SETTINGS.min_cells {
                clusters.insert(cluster);
            }
        }
        clusters
    }

    fn follows_changes<const D: usize>(edits: &[Edit]) {
        let mut store = Bricks::new(Lattice::new([100.0; D], 0.1));
        let mut map = FrontierMap::<D>::new(SETTINGS);
        assert!(map.frontiers().is_empty());
        for (i, edit) in edits.iter().enumerate() {
            put(&mut store, edit);
            // Sometimes two changes at once.
            if i % 3 != 2 {
                map.update(&store);
                assert_eq!(map.frontiers(), of_all(&store));
                assert!(map.update(&store).is_empty());
            }
        }
        map.update(&store);
        let got = map.frontiers();
        let sets: BTreeSet<_> = got
            .iter()
            .map(|f| {
                let mut cells = f.cells.clone();
                cells.sort_unstable();
                cells
            })
            .collect();
        assert_eq!(sets, brute_force(&store));
        for f in &got {
            measures_are_right(&store, f);
        }
        assert!(got.windows(2).all(|f| f[0].cells.len() >= f[1].cells.len()));
    }

    fn measures_are_right<const D: usize>(store: &Bricks<SignedDistance, D>, f: &Frontier<D>) {
        let lattice = store.lattice();
        let mut mean = [0.0; D];
        let mut normal = [0.0; D];
        let mut extent = Aabb::EMPTY;
        let mut faces = 0;
        for cell in &f.cells {
            extent = extent.union(lattice.aabb(*cell, cell.map(|v| v + 1)));
            for k in 0..D {
                mean[k] += lattice.center(*cell)[k] / f.cells.len() as f64;
                for step in [-1, 1] {
                    let mut next = *cell;
                    next[k] += step;
                    if known(store, next) == Known::Unknown {
                        normal[k] += f64::from(step);
                        faces += 1;
                    }
                }
            }
        }
        assert_eq!((f.faces, f.extent), (faces, extent));
        assert!(crate::geom::vector::distance(mean, f.centroid) < 1e-9);
        assert_eq!(f.normal, crate::geom::vector::unit(normal));
        let off = |cell: &[i32; D]| crate::geom::vector::distance(lattice.center(*cell), f.centroid);
        let nearest = f.cells.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!((crate::geom::vector::distance(f.middle, f.centroid) - nearest).abs() < 1e-9);
        assert!(f.cells.iter().any(|c| lattice.center(*c) == f.middle));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..Default::default() })]
        #[test]
        fn follows_changes_2d_and_3d(edits in edits()) {
            follows_changes::<2>(&edits);
            follows_changes::<3>(&edits);
        }
    }

    #[test]
    fn clusters_join_over_corners_of_bricks() {
        // One free cell in each of two bricks that touch in a corner alone, far from zero.
        let mut store = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], 0.1));
        let cells = [[-1, -1, 799_999], [0, 0, 800_000], [2, 0, 800_000]];
        for cell in cells {
            let key = BlockKey::of_cell(cell);
            let mut brick = store.brick(key).cloned().unwrap_or_else(|| crate::cell::Planes::unobserved(512));
            let free = SignedDistance { distance: 0.3, weight: 1.0 };
            crate::cell::Planes::set(&mut brick, BlockKey::offset(cell), Some(free));
            store.insert(key, brick).unwrap();
        }
        let mut map = FrontierMap::new(FrontierSettings { min_cells: 0, ..SETTINGS });
        map.update(&store);
        let found = map.frontiers();
        assert_eq!(
            found.iter().map(|f| f.cells.clone()).collect::<Vec<_>>(),
            [cells[..2].to_vec(), vec![cells[2]]]
        );
        assert_eq!(
            (found[0].normal, found[0].faces, found[0].middle),
            (None, 12, store.lattice().center(cells[0]))
        );
        assert!(map.memory_bytes() > 0);
        // Another map is not taken for this one.
        let other = Bricks::new(Lattice::new([0.0; 3], 0.2));
        map.update(&other);
        assert!(map.frontiers().is_empty());
    }
}
