//! Looks at cells: how often they were hit, and how often they and all their neighbors were seen free in one scan.

use super::erosion::{Words, erode};
use crate::cell::{HitMiss, HitMissSum, LogOdds8, LogOddsRule};
use crate::geom::{BlockKey, Lattice};
use crate::store::{Bricks, Store, StoreFull, SumStore};
use crate::sweep::Swept;
use std::marker::PhantomData;

/// A store of counts, which takes as a miss only what is seen free together with all its neighbors.
#[derive(Clone, Debug)]
pub(super) struct LookStore<const D: usize>(SumStore<HitMissSum, D>);

impl<const D: usize> LookStore<D> {
    pub(super) fn new(lattice: Lattice<D>, rule: LogOddsRule<i8>) -> Self {
        Self(SumStore::new(Bricks::new(lattice), rule))
    }

    pub(super) fn sums(&self) -> &SumStore<HitMissSum, D> {
        &self.0
    }
}

impl<const D: usize> Store<LogOdds8, D> for LookStore<D> {
    fn lattice(&self) -> &Lattice<D> {
        self.0.lattice()
    }

    #[inline]
    fn cell(&self, cell: [i32; D]) -> Option<LogOdds8> {
        self.0.cell(cell)
    }

    /// One block by itself has no neighbors: only its hits count.
    fn apply(
        &mut self,
        key: BlockKey<D>,
        evidence: &HitMiss,
        rule: &LogOddsRule<i8>,
    ) -> Result<(), StoreFull> {
        let hits = std::array::from_fn(|w| evidence.word(w).0);
        self.0.apply(key, &HitMiss::from_words(hits, [0; 8]), rule)
    }

    fn fuse<W>(&mut self, scan: &W, rule: &LogOddsRule<i8>) -> Result<u64, StoreFull>
    where
        W: Swept<D, Evidence = HitMiss>,
    {
        self.0.fuse(&Open::of(scan), rule)
    }

    fn limit(&self) -> usize {
        self.0.limit()
    }

    fn set_limit(&mut self, bytes: usize) {
        self.0.set_limit(bytes);
    }

    fn memory_bytes(&self) -> usize {
        self.0.memory_bytes()
    }
}

/// What a scan hits, and what it sees free with all neighbors.
struct Open<'a, W, const D: usize> {
    keys: Vec<BlockKey<D>>,
    looks: Vec<HitMiss>,
    scan: PhantomData<&'a W>,
}

impl<'a, W: Swept<D, Evidence = HitMiss>, const D: usize> Open<'a, W, D> {
    fn of(scan: &'a W) -> Self {
        let blocks = scan.blocks();
        let both = crate::parallel::map_numbers(
            blocks.len(),
            || scan.scratch(),
            |i, scratch| {
                let evidence = scan.evidence(i, scratch);
                let hit: Words = std::array::from_fn(|w| evidence.word(w).0);
                let free: Words = std::array::from_fn(|w| evidence.word(w).1);
                (hit, free)
            },
        );
        let (hits, mut free): (Vec<Words>, Vec<Words>) = both.into_iter().unzip();
        erode(blocks, &mut free);
        let (mut keys, mut looks) = (Vec::new(), Vec::new());
        for ((key, hit), free) in blocks.iter().zip(hits).zip(free) {
            if hit != [0; 8] || free != [0; 8] {
                keys.push(*key);
                looks.push(HitMiss::from_words(hit, free));
            }
        }
        Self { keys, looks, scan: PhantomData }
    }
}

impl<W: Sync, const D: usize> Swept<D> for Open<'_, W, D> {
    type Evidence = HitMiss;
    type Scratch = ();

    fn scratch(&self) {}

    fn blocks(&self) -> &[BlockKey<D>] {
        &self.keys
    }

    fn evidence<'a>(&'a self, i: usize, (): &'a mut ()) -> &'a HitMiss {
        &self.looks[i]
    }
}
