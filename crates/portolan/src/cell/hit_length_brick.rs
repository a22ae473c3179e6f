//! Hits, lengths and looks of many cells, and of a brick.

use super::hit_length::Run;
use super::packed::ARC_HEADER;
use super::{HitLength, Planes};
use std::borrow::Cow;
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

    fn alike(cell: HitLength, n: usize) -> Self {
        Self { hits: vec![cell.hits; n], length: vec![cell.length; n], looks: vec![cell.looks; n] }
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

/// Hits, lengths and looks of a brick's cells, x fastest, shared between snapshots until one of them changes it. A brick in
/// which all cells are alike, as in free space, is one cell.
#[derive(Clone, Debug)]
pub struct HitLengthBrick(Form);

#[derive(Clone, Debug)]
enum Form {
    Even { cell: HitLength, len: usize },
    Cells(Arc<HitLengthPlanes>),
}

impl HitLengthBrick {
    /// A brick of these planes; one cell where all are alike and none was hit.
    pub fn of(planes: HitLengthPlanes) -> Self {
        let cell = |i| planes.get(i).unwrap_or_default();
        let first = if planes.is_empty() { HitLength::default() } else { cell(0) };
        let alike = first.hits == 0 && (0..planes.len()).all(|i| cell(i) == first);
        Self(if alike {
            Form::Even { cell: first, len: planes.len() }
        } else {
            Form::Cells(Arc::new(planes))
        })
    }

    /// A brick of `len` cells that were not hit and are all like this one.
    pub(super) fn alike(cell: HitLength, len: usize) -> Self {
        Self(Form::Even { cell, len })
    }

    /// Its planes; made where all cells are alike.
    pub fn planes(&self) -> Cow<'_, HitLengthPlanes> {
        match &self.0 {
            Form::Even { cell, len } => Cow::Owned(HitLengthPlanes::alike(*cell, *len)),
            Form::Cells(planes) => Cow::Borrowed(planes),
        }
    }

    /// Its planes for writing; made where all cells are alike, copied first where a snapshot shares them.
    pub fn planes_mut(&mut self) -> &mut HitLengthPlanes {
        if let Form::Even { cell, len } = self.0 {
            self.0 = Form::Cells(Arc::new(HitLengthPlanes::alike(cell, len)));
        }
        match &mut self.0 {
            Form::Cells(planes) => Arc::make_mut(planes),
            Form::Even { .. } => unreachable!("its planes were made just now"),
        }
    }

    /// The cell that all are like, if they are known to be.
    pub(super) fn even_mut(&mut self) -> Option<&mut HitLength> {
        match &mut self.0 {
            Form::Even { cell, .. } => Some(cell),
            Form::Cells(_) => None,
        }
    }

    /// Whether any cell was hit.
    pub fn has_hits(&self) -> bool {
        match &self.0 {
            Form::Even { cell, .. } => cell.hits > 0,
            Form::Cells(planes) => planes.hits().iter().any(|h| *h > 0),
        }
    }

    /// Number of cells that were observed.
    pub fn observed(&self) -> usize {
        match &self.0 {
            Form::Even { cell, len } => len * usize::from(cell.looks > 0),
            Form::Cells(planes) => planes.looks().iter().filter(|l| **l > 0).count(),
        }
    }
}

/// Equal cells, in either form.
impl PartialEq for HitLengthBrick {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && (0..self.len()).all(|i| self.get(i) == other.get(i))
    }
}

impl Planes<HitLength> for HitLengthBrick {
    fn unobserved(n: usize) -> Self {
        Self(Form::Even { cell: HitLength::default(), len: n })
    }

    fn len(&self) -> usize {
        match &self.0 {
            Form::Even { len, .. } => *len,
            Form::Cells(planes) => planes.len(),
        }
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<HitLength> {
        match &self.0 {
            Form::Even { cell, .. } => (cell.looks > 0).then_some(*cell),
            Form::Cells(planes) => planes.get(i),
        }
    }

    fn set(&mut self, i: usize, cell: Option<HitLength>) {
        self.planes_mut().set(i, cell);
    }

    fn bytes(&self) -> usize {
        match &self.0 {
            Form::Even { .. } => 0,
            Form::Cells(planes) => planes.bytes() + size_of::<HitLengthPlanes>() + ARC_HEADER,
        }
    }
}
