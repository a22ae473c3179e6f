//! Evidence for hits per meter: how many beams ended in a cell, and the length of all beams inside of it.

use super::Evidence;

/// Lengths are counted in this part of a cell's edge: a whole number of them is the same in any order.
pub const LENGTH_UNITS: u32 = 64;

/// What the beams of a scan did in one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HitLengthObservation {
    /// Beams that ended here.
    pub hits: u32,
    /// Length of all beams inside of the cell ([`LENGTH_UNITS`] to a cell's edge).
    pub length: u32,
}

/// Hits and lengths of a block. Unlike hits and misses these are counts: what is observed is a length, once for each beam
/// that has it, so that ten beams through a cell say ten times as much as one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HitLengths {
    hits: Box<[u32]>,
    length: Box<[u32]>,
}

impl HitLengths {
    /// A beam ended in cell `i` of the block.
    #[inline(always)]
    pub fn add_hit(&mut self, i: usize) {
        self.hits[i] = self.hits[i].saturating_add(1);
    }

    /// Beams have this much length in cell `i` of the block ([`LENGTH_UNITS`] to a cell's edge).
    #[inline(always)]
    pub fn add_length(&mut self, i: usize, units: u32) {
        self.length[i] = self.length[i].saturating_add(units);
    }

    /// Hits, one number a cell.
    #[inline(always)]
    pub fn hits(&self) -> &[u32] {
        &self.hits
    }

    /// Lengths, one number a cell.
    #[inline(always)]
    pub fn lengths(&self) -> &[u32] {
        &self.length
    }

    /// Lengths for writing.
    #[inline(always)]
    pub fn lengths_mut(&mut self) -> &mut [u32] {
        &mut self.length
    }

    /// Adds what another part of the same scan says about the same block.
    pub fn add(&mut self, other: &Self) {
        let sum = |to: &mut [u32], from: &[u32]| {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = to.saturating_add(*from));
        };
        sum(&mut self.hits, &other.hits);
        sum(&mut self.length, &other.length);
    }
}

impl Evidence for HitLengths {
    type One = HitLengthObservation;

    fn silent(cells: usize) -> Self {
        Self { hits: vec![0; cells].into(), length: vec![0; cells].into() }
    }

    fn clear(&mut self) {
        self.hits.fill(0);
        self.length.fill(0);
    }

    #[inline(always)]
    fn one(&self, i: usize) -> Option<HitLengthObservation> {
        let (hits, length) = (self.hits[i], self.length[i]);
        (hits | length != 0).then_some(HitLengthObservation { hits, length })
    }

    fn observed(&self) -> usize {
        let said = |(h, l): (&u32, &u32)| u32::from(h | l != 0);
        self.hits.iter().zip(&self.length).map(said).sum::<u32>() as usize
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        for i in (0..self.hits.len()).filter(|&i| !inside(i)) {
            (self.hits[i], self.length[i]) = (0, 0);
        }
    }
}
