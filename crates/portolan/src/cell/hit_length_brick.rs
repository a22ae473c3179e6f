//! Hits, lengths and looks of many cells, and of a brick.

use super::hit_length::Run;
use super::packed::ARC_HEADER;
use super::{HitLength, Planes};
use std::sync::Arc;

/// Hits, lengths and looks as three arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HitLengthPlanes {
    hits: Vec<u32>,
    length: Vec<u32>,
    looks: Vec<u16>,
}

impl HitLengthPlanes {
    /// Planes from their arrays. `None` where lengths differ or a pair is no state of the filter (a cell without looks that
    /// has hits or a length).
    pub fn from_parts(hits: Vec<u32>, length: Vec<u32>, looks: Vec<u16>) -> Option<Self> {
        let n = looks.len();
        let sane = |i: usize| looks[i] > 0 || hits[i] | length[i] == 0;
        (hits.len() == n && length.len() == n && (0..n).all(sane)).then_some(Self { hits, length, looks })
    }

    /// Beams that ended in each cell.
    #[inline(always)]
    pub fn hits(&self) -> &[u32] {
        &self.hits
    }

    /// Length of all beams in each cell ([`LENGTH_UNITS`](super::LENGTH_UNITS) to a cell's edge).
    #[inline(always)]
    pub fn lengths(&self) -> &[u32] {
        &self.length
    }

    /// Scans that looked at each cell; 0: never observed.
    #[inline(always)]
    pub fn looks(&self) -> &[u16] {
        &self.looks
    }

    pub(super) fn run_mut(&mut self, start: usize, len: usize) -> Run<'_> {
        Run {
            hits: &mut self.hits[start..start + len],
            length: &mut self.length[start..start + len],
            looks: &mut self.looks[start..start + len],
        }
    }
}

impl Planes<HitLength> for HitLengthPlanes {
    fn unobserved(n: usize) -> Self {
        Self { hits: vec![0; n], length: vec![0; n], looks: vec![0; n] }
    }

    fn len(&self) -> usize {
        self.looks.len()
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<HitLength> {
        let looks = self.looks[i];
        (looks > 0).then(|| HitLength { hits: self.hits[i], length: self.length[i], looks })
    }

    fn set(&mut self, i: usize, cell: Option<HitLength>) {
        let cell = cell.unwrap_or_default();
        (self.hits[i], self.length[i], self.looks[i]) = (cell.hits, cell.length, cell.looks);
    }

    fn bytes(&self) -> usize {
        (self.hits.capacity() + self.length.capacity()) * size_of::<u32>()
            + self.looks.capacity() * size_of::<u16>()
    }
}

/// Hits, lengths and looks of a brick's cells, x fastest, shared between snapshots until one of them changes it.
#[derive(Clone, Debug, PartialEq)]
pub struct HitLengthBrick(Arc<HitLengthPlanes>);

impl HitLengthBrick {
    /// A brick of these planes.
    pub fn of(planes: HitLengthPlanes) -> Self {
        Self(Arc::new(planes))
    }

    /// Its planes.
    #[inline(always)]
    pub fn planes(&self) -> &HitLengthPlanes {
        &self.0
    }

    /// Its planes for writing; copied first where a snapshot shares them.
    #[inline(always)]
    pub fn planes_mut(&mut self) -> &mut HitLengthPlanes {
        Arc::make_mut(&mut self.0)
    }
}

impl Planes<HitLength> for HitLengthBrick {
    fn unobserved(n: usize) -> Self {
        Self::of(HitLengthPlanes::unobserved(n))
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<HitLength> {
        self.0.get(i)
    }

    fn set(&mut self, i: usize, cell: Option<HitLength>) {
        self.planes_mut().set(i, cell);
    }

    fn bytes(&self) -> usize {
        self.0.bytes() + size_of::<HitLengthPlanes>() + ARC_HEADER
    }
}
