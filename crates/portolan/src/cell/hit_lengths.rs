//! Evidence for hits per meter: how many beams ended in a cell, and the length of all beams inside of it.

use super::Evidence;

/// Lengths are counted in this part of a cell's edge: a whole number of them is the same in any order.
pub const LENGTH_UNITS: u32 = 256;

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
///
/// Where no beam ended, a block may say no more than the mean length of its cells ([`HitLengths::set_even`]), which is the
/// same as if each had it.
#[derive(Clone, Debug)]
pub struct HitLengths {
    hits: Box<[u32]>,
    length: Box<[u32]>,
    /// Length of every cell; the arrays say nothing then.
    even: Option<u32>,
}

impl HitLengths {
    /// A beam ended in cell `i` of the block.
    #[inline(always)]
    pub fn add_hit(&mut self, i: usize) {
        self.spread();
        self.hits[i] = self.hits[i].saturating_add(1);
    }

    /// Beams have this much length in cell `i` of the block ([`LENGTH_UNITS`] to a cell's edge).
    #[inline(always)]
    pub fn add_length(&mut self, i: usize, units: u32) {
        self.spread();
        self.length[i] = self.length[i].saturating_add(units);
    }

    /// No beam ended in the block, and all cells have this length.
    pub fn set_even(&mut self, units: u32) {
        self.even = Some(units);
    }

    /// The length of every cell, where no beam ended and all are alike for sure.
    #[inline(always)]
    pub fn even(&self) -> Option<u32> {
        self.even
    }

    /// Hits and lengths, one number a cell, for writing.
    #[inline(always)]
    pub fn planes_mut(&mut self) -> (&mut [u32], &mut [u32]) {
        self.spread();
        (&mut self.hits, &mut self.length)
    }

    /// Hits and lengths, one number a cell; `None` where all are alike ([`HitLengths::even`]).
    #[inline(always)]
    pub fn planes(&self) -> Option<(&[u32], &[u32])> {
        self.even.is_none().then_some((&self.hits, &self.length))
    }

    /// Writes what is alike into the arrays.
    #[inline(always)]
    fn spread(&mut self) {
        if let Some(units) = self.even.take() {
            self.hits.fill(0);
            self.length.fill(units);
        }
    }

    /// Says what another one of as many cells says.
    pub fn copy(&mut self, other: &Self) {
        self.even = other.even;
        self.hits.copy_from_slice(&other.hits);
        self.length.copy_from_slice(&other.length);
    }

    /// Adds what another part of the same scan says about the same block.
    pub fn add(&mut self, other: &Self) {
        let (hits, length) = self.planes_mut();
        for i in 0..hits.len() {
            let o = other.one(i).unwrap_or_default();
            hits[i] = hits[i].saturating_add(o.hits);
            length[i] = length[i].saturating_add(o.length);
        }
    }
}

/// Saying the same about every cell, in either form.
impl PartialEq for HitLengths {
    fn eq(&self, other: &Self) -> bool {
        self.hits.len() == other.hits.len() && (0..self.hits.len()).all(|i| self.one(i) == other.one(i))
    }
}

impl Evidence for HitLengths {
    type One = HitLengthObservation;

    fn silent(cells: usize) -> Self {
        Self { hits: vec![0; cells].into(), length: vec![0; cells].into(), even: None }
    }

    fn clear(&mut self) {
        self.hits.fill(0);
        self.length.fill(0);
        self.even = None;
    }

    #[inline(always)]
    fn one(&self, i: usize) -> Option<HitLengthObservation> {
        let (hits, length) = match self.even {
            Some(units) => (0, units),
            None => (self.hits[i], self.length[i]),
        };
        (hits | length != 0).then_some(HitLengthObservation { hits, length })
    }

    fn observed(&self) -> usize {
        if let Some(units) = self.even {
            return if units > 0 { self.hits.len() } else { 0 };
        }
        let said = |(h, l): (&u32, &u32)| u32::from(h | l != 0);
        self.hits.iter().zip(&self.length).map(said).sum::<u32>() as usize
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        self.spread();
        for i in (0..self.hits.len()).filter(|&i| !inside(i)) {
            (self.hits[i], self.length[i]) = (0, 0);
        }
    }
}
