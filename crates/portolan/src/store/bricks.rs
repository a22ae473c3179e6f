//! Hashed bricks of `8^D` cells: memory only where something was seen.

use super::{Store, StoreFull};
use crate::cell::{Cell, Evidence, Planes};
use crate::geom::{BlockKey, Lattice, block_cells};
use crate::parallel;
use crate::sweep::Swept;
use rustc_hash::FxHashMap;

/// Keys that are taken out, fused and put back together: enough for every core, few enough that what is allocated
/// beyond a limit is forgotten quickly.
const TOGETHER: usize = 4096;

/// Cells that are worth a task of their own: 16 bricks in 3-D, 128 in 2-D.
const CELLS_A_TASK: usize = 8192;

/// Cells in bricks of `8^D`, found by hashing the brick's index.
///
/// A brick shares its planes with every snapshot (a clone of the store) until one of the two changes it. Indices are
/// `i32` about the lattice's `f64` origin, so that a map at UTM coordinates works like one near zero. Bricks keep the
/// epoch of their last change, for everything that is derived from them piece by piece.
#[derive(Clone, Debug)]
pub struct Bricks<C: Cell, const D: usize> {
    lattice: Lattice<D>,
    slots: FxHashMap<BlockKey<D>, u32>,
    keys: Vec<BlockKey<D>>,
    bricks: Vec<C::Brick>,
    /// Epoch of each brick's last change.
    changed: Vec<u64>,
    epoch: u64,
    /// Bytes of all bricks' planes.
    bytes: usize,
    limit: usize,
}

impl<C: Cell, const D: usize> Bricks<C, D> {
    /// A store in which nothing was observed.
    pub fn new(lattice: Lattice<D>) -> Self {
        Self {
            lattice,
            slots: FxHashMap::default(),
            keys: Vec::new(),
            bricks: Vec::new(),
            changed: Vec::new(),
            epoch: 0,
            bytes: 0,
            limit: usize::MAX,
        }
    }

    /// Number of bricks.
    pub fn len(&self) -> usize {
        self.bricks.len()
    }

    /// Whether nothing was ever observed.
    pub fn is_empty(&self) -> bool {
        self.bricks.is_empty()
    }

    /// A brick's planes; `None`: no cell of it was ever observed.
    #[inline]
    pub fn brick(&self, key: BlockKey<D>) -> Option<&C::Brick> {
        self.slots.get(&key).map(|&slot| &self.bricks[slot as usize])
    }

    /// The keys of all bricks, ascending. O(n log n).
    pub fn keys(&self) -> Vec<BlockKey<D>> {
        let mut keys = self.keys.clone();
        keys.sort_unstable();
        keys
    }

    /// All bricks in the order in which they came to be, which is the same in every run.
    pub fn bricks_by_age(&self) -> impl ExactSizeIterator<Item = (BlockKey<D>, &C::Brick)> {
        self.keys.iter().copied().zip(&self.bricks)
    }

    /// The epoch of the newest change; 0: none yet.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// The keys of bricks that changed after `epoch`, ascending.
    pub fn changed_since(&self, epoch: u64) -> Vec<BlockKey<D>> {
        let changed = self.keys.iter().zip(&self.changed).filter(|(_, at)| **at > epoch);
        let mut keys: Vec<_> = changed.map(|(key, _)| *key).collect();
        keys.sort_unstable();
        keys
    }

    /// Puts a brick in place, replacing the one that is there. Counts as a change of a new epoch.
    ///
    /// # Errors
    /// [`StoreFull`] where the limit leaves no room; the store is then as before.
    pub fn insert(&mut self, key: BlockKey<D>, brick: C::Brick) -> Result<(), StoreFull> {
        assert_eq!(brick.len(), block_cells::<D>(), "a brick has 8^D cells");
        self.epoch += 1;
        match self.slots.get(&key) {
            Some(&slot) => {
                let slot = slot as usize;
                self.bytes = self.bytes - self.bricks[slot].bytes() + brick.bytes();
                self.bricks[slot] = brick;
                self.changed[slot] = self.epoch;
                Ok(())
            }
            None => self.add(key, brick),
        }
    }

    /// Forgets the bricks for which this does not hold. What is derived from them by epochs does not learn of it. O(n).
    pub(crate) fn retain(&mut self, keep: impl Fn(&C::Brick) -> bool) {
        let (keys, bricks, changed) = (&mut self.keys, &mut self.bricks, &mut self.changed);
        let all = std::mem::take(keys).into_iter().zip(std::mem::take(bricks)).zip(std::mem::take(changed));
        for ((key, brick), at) in all.filter(|((_, brick), _)| keep(brick)) {
            keys.push(key);
            bricks.push(brick);
            changed.push(at);
        }
        self.bytes = bricks.iter().map(Planes::bytes).sum();
        self.slots = keys.iter().zip(0..).map(|(key, slot)| (*key, slot)).collect();
    }

    /// Bytes by which what finds bricks grows with the next one: tables double when they are full.
    fn growth(&self) -> usize {
        let keys = if self.keys.len() == self.keys.capacity() { self.keys.capacity().max(4) } else { 0 };
        let full = self.slots.len() == self.slots.capacity();
        keys * Self::SLOT + if full { (self.slots.capacity() + 4) * 8 / 7 * Self::BUCKET } else { 0 }
    }

    const SLOT: usize = size_of::<BlockKey<D>>() + size_of::<C::Brick>() + size_of::<u64>();
    /// A hash table keeps a byte of control per bucket and an eighth of its buckets empty.
    const BUCKET: usize = size_of::<(BlockKey<D>, u32)>() + 1;

    fn add(&mut self, key: BlockKey<D>, brick: C::Brick) -> Result<(), StoreFull> {
        let room = self.limit.checked_sub(self.memory_bytes() + brick.bytes() + self.growth());
        if room.is_none() {
            return Err(StoreFull { limit: self.limit, bytes: self.memory_bytes() });
        }
        self.bytes += brick.bytes();
        self.slots.insert(key, self.bricks.len() as u32);
        self.keys.push(key);
        self.bricks.push(brick);
        self.changed.push(self.epoch);
        Ok(())
    }

    /// Changes the bricks of `keys` (each key once), in parallel with the feature `parallel`; the result is the same
    /// bytes. One call is one epoch.
    ///
    /// `change` gets the position of the key, the brick (`None` where there is none yet; it may put one there) and scratch
    /// made by `scratch`, and returns how many cells it changed; with 0 the brick must be as before. Returns the sum.
    ///
    /// # Errors
    /// [`StoreFull`] at the first brick, in the order of `keys`, that the limit leaves no room for; those before it are
    /// changed.
    pub fn update<S: Send>(
        &mut self,
        keys: &[BlockKey<D>],
        scratch: impl Fn() -> S + Sync + Send,
        change: impl Fn(usize, &mut Option<C::Brick>, &mut S) -> usize + Sync + Send,
    ) -> Result<u64, StoreFull> {
        self.epoch += 1;
        let mut total = 0;
        let mut work: Vec<Work<C>> = Vec::with_capacity(keys.len().min(TOGETHER));
        let mut slots = Vec::new();
        let empty = C::Brick::unobserved(0);
        for (chunk, keys) in keys.chunks(TOGETHER).enumerate() {
            work.clear();
            find(&self.slots, keys, &mut slots);
            work.extend(slots.iter().enumerate().map(|(i, &slot)| {
                // Taken out, so that every brick is changed in place by one worker alone.
                let brick = slot.map(|s| std::mem::replace(&mut self.bricks[s as usize], empty.clone()));
                let bytes = brick.as_ref().map_or(0, Planes::bytes);
                // What takes no memory yet may come to take some: then the limit is asked first.
                let before = brick.clone().filter(|_| bytes == 0);
                Work { position: chunk * TOGETHER + i, slot, bytes, before, brick, cells: 0 }
            }));
            parallel::change_each(&mut work, CELLS_A_TASK / block_cells::<D>(), &scratch, |w, s| {
                w.cells = change(w.position, &mut w.brick, s)
            });
            let mut full = Ok(());
            for (w, &key) in work.drain(..).zip(keys) {
                match (w.slot, w.brick) {
                    (Some(slot), Some(brick)) => {
                        let slot = slot as usize;
                        let grown = brick.bytes().saturating_sub(w.bytes);
                        let fits = grown == 0 || full.is_ok() && self.limit >= self.memory_bytes() + grown;
                        if let (false, Some(before)) = (fits, w.before) {
                            self.bricks[slot] = before;
                            full = full.and(Err(StoreFull { limit: self.limit, bytes: self.memory_bytes() }));
                            continue;
                        }
                        self.bytes = self.bytes - w.bytes + brick.bytes();
                        self.bricks[slot] = brick;
                        if w.cells > 0 {
                            self.changed[slot] = self.epoch;
                        }
                    }
                    (None, Some(brick)) if w.cells > 0 && full.is_ok() => full = self.add(key, brick),
                    _ => {}
                }
                if full.is_ok() {
                    total += w.cells as u64;
                }
            }
            full?;
        }
        Ok(total)
    }
}

/// Fuses evidence into a brick, which is made where there is none; returns the number of observed cells.
fn fuse_brick<C: Cell, const D: usize>(
    brick: &mut Option<C::Brick>,
    evidence: &C::Evidence,
    rule: &C::Rule,
) -> usize {
    let observed = evidence.observed();
    if observed > 0 {
        C::fuse_brick(brick.get_or_insert_with(|| C::Brick::unobserved(block_cells::<D>())), evidence, rule);
    }
    observed
}

/// A brick that is being changed.
struct Work<C: Cell> {
    position: usize,
    slot: Option<u32>,
    bytes: usize,
    /// The brick as it was, where it took no memory.
    before: Option<C::Brick>,
    brick: Option<C::Brick>,
    cells: usize,
}

/// The slots of keys, in their order.
fn find<const D: usize>(
    slots: &FxHashMap<BlockKey<D>, u32>,
    keys: &[BlockKey<D>],
    found: &mut Vec<Option<u32>>,
) {
    // Fewer are found sooner than a thread wakes up.
    const TOGETHER: usize = 2048;
    found.clear();
    found.resize(keys.len(), None);
    parallel::each(keys.chunks(TOGETHER).zip(found.chunks_mut(TOGETHER)), |(keys, found)| {
        keys.iter().zip(found).for_each(|(key, found)| *found = slots.get(key).copied());
    });
}

impl<C: Cell, const D: usize> Store<C, D> for Bricks<C, D> {
    fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    #[inline]
    fn cell(&self, cell: [i32; D]) -> Option<C> {
        self.brick(BlockKey::of_cell(cell))?.get(BlockKey::offset(cell))
    }

    fn blocks_with(&self, holds: impl Fn(C) -> bool) -> Vec<BlockKey<D>> {
        let has = |key: &BlockKey<D>| {
            self.brick(*key).is_some_and(|b| (0..b.len()).any(|i| b.get(i).is_some_and(&holds)))
        };
        self.keys().into_iter().filter(has).collect()
    }

    fn apply(&mut self, key: BlockKey<D>, evidence: &C::Evidence, rule: &C::Rule) -> Result<(), StoreFull> {
        let fuse =
            |_: usize, brick: &mut Option<C::Brick>, (): &mut ()| fuse_brick::<C, D>(brick, evidence, rule);
        self.update(&[key], || (), fuse).map(|_| ())
    }

    /// In parallel over bricks, with the feature `parallel`.
    fn fuse<W>(&mut self, scan: &W, rule: &C::Rule) -> Result<u64, StoreFull>
    where
        W: Swept<D, Evidence = C::Evidence>,
    {
        self.update(
            scan.blocks(),
            || scan.scratch(),
            |i, brick, scratch| fuse_brick::<C, D>(brick, scan.evidence(i, scratch), rule),
        )
    }

    fn limit(&self) -> usize {
        self.limit
    }

    /// Checked whenever a brick is added.
    fn set_limit(&mut self, bytes: usize) {
        self.limit = bytes;
    }

    fn memory_bytes(&self) -> usize {
        let tables = self.keys.capacity() * Self::SLOT + self.slots.capacity() * 8 / 7 * Self::BUCKET;
        self.bytes + tables + size_of::<Self>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{HitMiss, LogOdds8, LogOddsRule, OccupancyModel, SignedDistance};
    use crate::geom::Grid;
    use crate::store::Dense;
    use proptest::prelude::*;

    fn rule() -> LogOddsRule<i8> {
        LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap()
    }

    fn evidence<const D: usize>(seed: u64) -> HitMiss {
        let mut e = HitMiss::silent(block_cells::<D>());
        for i in 0..block_cells::<D>() {
            match (seed.wrapping_mul(i as u64 * 2 + 1) >> 7) % 5 {
                0 => e.mark_hit(i),
                1 | 2 => e.mark_miss(i),
                _ => {}
            }
        }
        e
    }

    fn holds_what_an_array_holds<const D: usize>(scans: &[(Vec<i32>, u64)]) {
        let grid = Grid::new([1.0; D], 0.5, [32; D]);
        let mut dense = Dense::<LogOdds8, D>::new(grid);
        let mut bricks = Bricks::<LogOdds8, D>::new(grid.lattice);
        for (blocks, seed) in scans {
            let mut keys: Vec<_> =
                blocks.iter().map(|b| BlockKey(std::array::from_fn(|k| (b >> (2 * k)) & 3))).collect();
            keys.sort_unstable();
            keys.dedup();
            let e = evidence::<D>(*seed);
            keys.iter().for_each(|&key| dense.apply(key, &e, &rule()).unwrap());
            let change = |_: usize, brick: &mut Option<_>, (): &mut ()| {
                LogOdds8::fuse_brick(
                    brick.get_or_insert_with(|| Planes::unobserved(block_cells::<D>())),
                    &e,
                    &rule(),
                );
                e.observed()
            };
            let snapshot = bricks.clone();
            let before: Vec<_> = snapshot.bricks_by_age().map(|(k, b)| (k, b.clone())).collect();
            let cells = bricks.update(&keys, || (), change).unwrap();
            assert_eq!(cells, (keys.len() * e.observed()) as u64);
            assert_eq!(
                bricks.changed_since(bricks.epoch() - 1),
                if e.observed() > 0 { keys } else { vec![] }
            );
            assert!(snapshot.bricks_by_age().map(|(k, b)| (k, b.clone())).eq(before), "a snapshot changed");
        }
        for i in 0..grid.len() {
            assert_eq!(bricks.cell(grid.cell(i)), dense.at(i));
        }
        let sum: usize = bricks.bricks_by_age().map(|(_, b)| b.bytes()).sum();
        assert_eq!(sum, bricks.bytes);
    }

    proptest! {
        #[test]
        fn holds_what_an_array_holds_2d_and_3d(
            scans in prop::collection::vec((prop::collection::vec(0..64i32, 1..40), any::<u64>()), 1..6),
        ) {
            holds_what_an_array_holds::<2>(&scans);
            holds_what_an_array_holds::<3>(&scans);
        }
    }

    #[test]
    fn the_limit_is_kept_at_every_brick() {
        let mut bricks = Bricks::<SignedDistance, 3>::new(Lattice::new([500_000.0, 4_000_000.0, 0.0], 0.1));
        bricks.set_limit(100_000);
        let keys: Vec<_> = (-500..500).map(|x| BlockKey([x, 0, 0])).collect();
        let one = |_: usize, brick: &mut Option<_>, (): &mut ()| {
            *brick = Some(Planes::unobserved(512));
            1
        };
        let full = bricks.update(&keys, || (), one).unwrap_err();
        assert!(bricks.memory_bytes() <= 100_000 && bricks.len() > 15, "{full}");
        // What was there before the limit was met can still be changed.
        assert_eq!(bricks.update(&keys[..4], || (), one), Ok(4));
        let p = bricks.lattice().center([-4000, 3, 3]);
        assert_eq!(bricks.lattice().cell_of(p), Some([-4000, 3, 3]));
    }
}
