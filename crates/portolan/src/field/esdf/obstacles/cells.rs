//! Where something stops beams, as maps of occupancy and of attenuation say.

use crate::cell::{HitLength, LogOddsValue, Planes, StopRule};
use crate::field::esdf::cell_mask::CellMask;
use crate::geom::{BlockKey, Lattice};
use crate::parallel;
use crate::store::{Bricks, Store};
use rustc_hash::FxHashMap;

/// Bricks in one task.
const TOGETHER: usize = 64;

/// Hits that a cell must have had for its share of stopped beams to mean something.
pub const LEAST_HITS: u32 = 3;

/// Cells of which a map says that something is there: obstacles of a distance field, where no surface explains them
/// ([`Esdf::with_obstacles`](crate::field::Esdf::with_obstacles)).
///
/// Two kinds of map may say so, and each is enough. Clamped log odds answer at once to what is new and to what has gone.
/// Counts of hits and of beams that went on keep what only a part of the beams hits: thin things.
///
/// Bricks are those of the map of distances: all maps have one lattice.
#[derive(Clone, Debug, Default)]
pub struct ObstacleCells<const D: usize> {
    occupied: Listed<D>,
    opaque: Listed<D>,
    /// Cells with any hit, where they are counted.
    hit: Listed<D>,
    counted: bool,
    /// Of the maps; none before one was followed.
    lattice: Option<Lattice<D>>,
}

/// The cells of one map.
#[derive(Clone, Debug, Default)]
struct Listed<const D: usize> {
    bricks: FxHashMap<BlockKey<D>, CellMask>,
    /// Of the map, when it was looked at last.
    epoch: u64,
}

impl<const D: usize> Listed<D> {
    fn put(&mut self, key: BlockKey<D>, cells: CellMask) {
        if cells.any() {
            self.bricks.insert(key, cells);
        } else {
            self.bricks.remove(&key);
        }
    }

    fn brick(&self, key: &BlockKey<D>) -> CellMask {
        self.bricks.get(key).copied().unwrap_or_default()
    }
}

impl<const D: usize> ObstacleCells<D> {
    /// Index to meters; `None` before a map was followed.
    pub fn lattice(&self) -> Option<&Lattice<D>> {
        self.lattice.as_ref()
    }

    fn on(&mut self, lattice: &Lattice<D>) {
        assert_eq!(self.lattice.get_or_insert(*lattice), lattice, "all maps have one lattice");
    }

    /// Of an occupancy map alone: the cells whose log odds are above zero. O(cells).
    pub fn of_occupancy<V: LogOddsValue>(map: &Bricks<V, D>) -> Self {
        let mut cells = Self::default();
        cells.follow_occupancy(map);
        cells
    }

    /// Takes in what changed in an occupancy map, always the same one. O(changed bricks).
    ///
    /// # Panics
    /// Where another map has another lattice.
    pub fn follow_occupancy<V: LogOddsValue>(&mut self, map: &Bricks<V, D>) {
        self.on(map.lattice());
        let changed = map.changed_since(self.occupied.epoch);
        let found = parallel::map(&changed, TOGETHER, |&key| match map.brick(key) {
            Some(brick) => CellMask::of::<D>(|i| brick.get(i).is_some_and(V::is_occupied)),
            None => CellMask::default(),
        });
        self.occupied.epoch = map.epoch();
        changed.into_iter().zip(found).for_each(|(key, cells)| self.occupied.put(key, cells));
    }

    /// Takes in what changed in a map of hits per meter, always the same one: the cells that stop more than `share` of the
    /// beams through them, by three hits or more. Where it counted no hit, log odds alone make no obstacle: they call
    /// cells around the end of a beam occupied, too. O(changed bricks).
    ///
    /// # Panics
    /// Where another map has another lattice.
    pub fn follow_attenuation(&mut self, map: &Bricks<HitLength, D>, share: f64) {
        self.on(map.lattice());
        let rule = StopRule::<D>::new(share, LEAST_HITS);
        let changed = map.changed_since(self.opaque.epoch);
        let found = parallel::map(&changed, TOGETHER, |&key| match map.brick(key) {
            Some(brick) => {
                let cell = |i| brick.get(i).unwrap_or_default();
                (CellMask::of::<D>(|i| rule.stops(cell(i))), CellMask::of::<D>(|i| cell(i).hits > 0))
            }
            None => Default::default(),
        });
        (self.opaque.epoch, self.counted) = (map.epoch(), true);
        for (key, (stops, hit)) in changed.into_iter().zip(found) {
            self.opaque.put(key, stops);
            self.hit.put(key, hit);
        }
    }

    /// Of the cells that the occupancy map calls occupied, those that were hit.
    fn occupied_and_hit(&self, key: &BlockKey<D>) -> CellMask {
        let occupied = self.occupied.brick(key);
        if self.counted { occupied.and(self.hit.brick(key)) } else { occupied }
    }

    /// Cells that the occupancy map alone, the counts alone, and both call occupied.
    pub fn agreement(&self) -> [usize; 3] {
        let mut counts = [0; 3];
        for key in self.keys() {
            let (a, b) = (self.occupied_and_hit(&key), self.opaque.brick(&key));
            counts[0] += a.and_not(b).count();
            counts[1] += b.and_not(a).count();
            counts[2] += a.count() - a.and_not(b).count();
        }
        counts
    }

    /// The cells of a brick.
    pub(crate) fn brick(&self, key: &BlockKey<D>) -> CellMask {
        self.occupied_and_hit(key).or(self.opaque.brick(key))
    }

    /// The bricks with such cells, ascending.
    pub(crate) fn keys(&self) -> Vec<BlockKey<D>> {
        let mut keys: Vec<_> =
            self.occupied.bricks.keys().chain(self.opaque.bricks.keys()).copied().collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let bucket = size_of::<(BlockKey<D>, CellMask)>() + 1;
        let lists = [&self.occupied, &self.opaque, &self.hit];
        lists.iter().map(|list| list.bricks.capacity()).sum::<usize>() * 8 / 7 * bucket
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, LENGTH_UNITS, LogOdds8};
    use crate::geom::block_cells;

    fn cells_of_either_map<const D: usize>() {
        let (lattice, key) = (Lattice::new([0.0; D], 0.1), BlockKey([-1; D]));
        let mut occupancy = Bricks::<LogOdds8, D>::new(lattice);
        let mut brick = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<D>());
        // Occupied, and hit or not; free.
        for (i, v) in [(3, 20), (4, 20), (5, 1), (6, 0), (7, -5)] {
            brick.set(i, Some(LogOdds8(v)));
        }
        occupancy.insert(key, brick).unwrap();
        let mut counts = Bricks::<HitLength, D>::new(lattice);
        let mut brick = <HitLength as Cell>::Brick::unobserved(block_cells::<D>());
        let cell = |hits, cells| HitLength { hits, length: cells * LENGTH_UNITS, looks: 50 };
        // Two hits are too few, and so is one in a hundred.
        let counted =
            [(3, cell(9, 9)), (5, cell(1, 90)), (7, cell(30, 90)), (8, cell(2, 2)), (9, cell(9, 900))];
        for (i, c) in counted {
            brick.set(i, Some(c));
        }
        counts.insert(key, brick).unwrap();

        let alone = ObstacleCells::of_occupancy(&occupancy);
        assert_eq!(alone.brick(&key).cells().collect::<Vec<_>>(), [3, 4, 5]);
        let mut both = alone.clone();
        both.follow_attenuation(&counts, 0.15);
        assert_eq!(both.brick(&key).cells().collect::<Vec<_>>(), [3, 5, 7]);
        assert_eq!(both.agreement(), [1, 1, 1]);
        assert_eq!(both.keys(), [key]);
        // What has gone is gone when it is followed.
        occupancy.insert(key, <LogOdds8 as Cell>::Brick::unobserved(block_cells::<D>())).unwrap();
        both.follow_occupancy(&occupancy);
        assert_eq!(both.brick(&key).cells().collect::<Vec<_>>(), [3, 7]);
    }

    #[test]
    fn cells_of_either_map_2d_and_3d() {
        cells_of_either_map::<2>();
        cells_of_either_map::<3>();
    }
}
