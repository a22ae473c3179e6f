//! Memory of a tree: inner records only, in groups of siblings.

use crate::cell::LogOddsValue;

/// No record.
pub(super) const NONE: u32 = u32::MAX;

/// An inner record as plain data: the values of the `2^D` children (first `2^D` used), which of them are
/// inner records themselves, and where those stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record<V> {
    pub values: [V; 8],
    pub first_child: u32,
    pub mask: u8,
}

/// Inner records in structure-of-arrays form: `2^D` values, `first_child`, `mask` each; with bytes as values
/// that is 9 bytes a record in 2-D and 13 in 3-D. A leaf has no record: it is a value in its parent.
///
/// The records of a parent's inner children stand side by side, in child order, behind one `first_child`, as
/// many as the mask has bits. Groups that are given back are threaded by size into free lists through their
/// own `first_child` fields, so that a tree that changes for ever does not grow for ever.
#[derive(Clone, Debug)]
pub(super) struct Arena<V, const D: usize> {
    values: Vec<V>,
    first_child: Vec<u32>,
    mask: Vec<u8>,
    /// First free group of each size 1 ..= 2^D.
    free: [u32; 9],
}

/// Number of children of a node.
pub(super) const fn children<const D: usize>() -> usize {
    1 << D
}

impl<V: LogOddsValue, const D: usize> Arena<V, D> {
    pub(super) fn new() -> Self {
        Self { values: Vec::new(), first_child: Vec::new(), mask: Vec::new(), free: [NONE; 9] }
    }

    /// Takes memory for `n` records at once.
    pub(super) fn reserve(&mut self, n: usize) {
        self.values.reserve_exact(n * children::<D>());
        self.first_child.reserve_exact(n);
        self.mask.reserve_exact(n);
    }

    /// Records in use and free together.
    pub(super) fn slots(&self) -> usize {
        self.mask.len()
    }

    /// A group of `n` records with undefined contents.
    pub(super) fn allocate(&mut self, n: usize) -> u32 {
        let free = self.free[n];
        if free != NONE {
            self.free[n] = self.first_child[free as usize];
            return free;
        }
        let first = self.mask.len();
        assert!(first + n < NONE as usize, "a tree holds fewer than 2^32 inner nodes");
        // Growing by an eighth instead of doubling keeps what is measured near to what is needed.
        if self.mask.capacity() < first + n {
            self.reserve(n.max(first / 8));
        }
        self.values.resize((first + n) * children::<D>(), V::UNOBSERVED);
        self.first_child.resize(first + n, NONE);
        self.mask.resize(first + n, 0);
        first as u32
    }

    /// Gives a group of `n` records back. Their children must have been given back or moved before.
    pub(super) fn release(&mut self, first: u32, n: usize) {
        self.first_child[first as usize] = self.free[n];
        self.free[n] = first;
    }

    /// Gives a record's children back, and theirs.
    pub(super) fn release_children(&mut self, record: u32) {
        let n = self.mask(record).count_ones() as usize;
        if n > 0 {
            let first = self.first_child[record as usize];
            for k in 0..n as u32 {
                self.release_children(first + k);
            }
            self.release(first, n);
        }
    }

    #[inline(always)]
    pub(super) fn mask(&self, record: u32) -> u8 {
        self.mask[record as usize]
    }

    #[inline(always)]
    pub(super) fn values(&self, record: u32) -> &[V] {
        &self.values[record as usize * children::<D>()..][..children::<D>()]
    }

    #[inline(always)]
    pub(super) fn set_value(&mut self, record: u32, child: usize, value: V) {
        self.values[record as usize * children::<D>() + child] = value;
    }

    /// The record of an inner child. The child's bit must be set.
    #[inline(always)]
    pub(super) fn child(&self, record: u32, child: usize) -> u32 {
        let before = self.mask[record as usize] & ((1u16 << child) - 1) as u8;
        self.first_child[record as usize] + before.count_ones()
    }

    pub(super) fn write(&mut self, record: u32, contents: &Record<V>) {
        let values = record as usize * children::<D>();
        self.values[values..values + children::<D>()].copy_from_slice(&contents.values[..children::<D>()]);
        self.first_child[record as usize] = contents.first_child;
        self.mask[record as usize] = contents.mask;
    }

    pub(super) fn read(&self, record: u32) -> Record<V> {
        let mut values = [V::UNOBSERVED; 8];
        values[..children::<D>()].copy_from_slice(self.values(record));
        Record { values, first_child: self.first_child[record as usize], mask: self.mask[record as usize] }
    }

    /// Makes a leaf child an inner one, or changes the contents of one that is inner already.
    pub(super) fn set_child(&mut self, record: u32, child: usize, contents: &Record<V>) -> u32 {
        if self.mask(record) >> child & 1 == 0 {
            self.regroup(record, self.mask(record) | 1 << child);
        }
        let slot = self.child(record, child);
        self.write(slot, contents);
        slot
    }

    /// Makes an inner child a leaf. Its own children must have been given back.
    pub(super) fn unset_child(&mut self, record: u32, child: usize) {
        self.regroup(record, self.mask(record) & !(1 << child));
    }

    /// Moves a record's children into a group for another mask; those in both masks keep their contents.
    fn regroup(&mut self, record: u32, mask: u8) {
        let (old_mask, old_first) = (self.mask(record), self.first_child[record as usize]);
        let (old_n, n) = (old_mask.count_ones() as usize, mask.count_ones() as usize);
        let first = if n > 0 { self.allocate(n) } else { NONE };
        let (mut from, mut to) = (old_first, first);
        for c in 0..children::<D>() {
            let (was, is) = (old_mask >> c & 1 != 0, mask >> c & 1 != 0);
            if was && is {
                let contents = self.read(from);
                self.write(to, &contents);
            }
            from = from.wrapping_add(u32::from(was));
            to = to.wrapping_add(u32::from(is));
        }
        if old_n > 0 {
            self.release(old_first, old_n);
        }
        self.first_child[record as usize] = first;
        self.mask[record as usize] = mask;
    }

    /// Free records, by walking the lists.
    pub(super) fn free_slots(&self) -> usize {
        let mut count = 0;
        for n in 1..=children::<D>() {
            let mut at = self.free[n];
            while at != NONE {
                count += n;
                at = self.first_child[at as usize];
            }
        }
        count
    }

    pub(super) fn bytes(&self) -> usize {
        self.values.capacity() * size_of::<V>()
            + self.first_child.capacity() * size_of::<u32>()
            + self.mask.capacity()
    }
}
