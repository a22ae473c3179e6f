//! The blocks that a scan touches, with evidence for each.

use crate::cell::Evidence;
use crate::geom::{BlockKey, block_cells};
use rustc_hash::FxHashMap;

/// Evidence by block. Buffers are kept from scan to scan.
#[derive(Clone, Debug)]
pub(super) struct Touched<E, const D: usize> {
    slots: FxHashMap<BlockKey<D>, u32>,
    evidence: Vec<E>,
    used: usize,
    last: Option<(BlockKey<D>, usize)>,
    keys: Vec<BlockKey<D>>,
    order: Vec<u32>,
}

impl<E: Evidence, const D: usize> Touched<E, D> {
    pub(super) fn new() -> Self {
        Self {
            slots: FxHashMap::default(),
            evidence: Vec::new(),
            used: 0,
            last: None,
            keys: Vec::new(),
            order: Vec::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.slots.clear();
        self.keys.clear();
        self.used = 0;
        self.last = None;
    }

    /// The evidence of the block that holds `cell`. Hashes only where the block is not that of the last call.
    #[inline(always)]
    pub(super) fn of_cell(&mut self, cell: [i32; D]) -> &mut E {
        let key = BlockKey::of_cell(cell);
        let slot = match self.last {
            Some((last, slot)) if last == key => slot,
            _ => self.find(key),
        };
        &mut self.evidence[slot]
    }

    #[inline(never)]
    fn find(&mut self, key: BlockKey<D>) -> usize {
        let slot = *self.slots.entry(key).or_insert_with(|| {
            if self.used == self.evidence.len() {
                self.evidence.push(E::silent(block_cells::<D>()));
            } else {
                self.evidence[self.used].clear();
            }
            self.keys.push(key);
            self.used += 1;
            (self.used - 1) as u32
        }) as usize;
        self.last = Some((key, slot));
        slot
    }

    /// Brings the blocks into ascending order; call once after the last beam.
    pub(super) fn sort(&mut self) {
        self.order.clear();
        self.order.extend(0..self.used as u32);
        self.order.sort_unstable_by_key(|&i| self.keys[i as usize]);
        // The keys were in order of slots; now in order of memory.
        self.keys.sort_unstable();
    }

    pub(super) fn keys(&self) -> &[BlockKey<D>] {
        &self.keys
    }

    /// Evidence of the `i`-th block in ascending order.
    pub(super) fn evidence(&self, i: usize) -> &E {
        &self.evidence[self.order[i] as usize]
    }
}
