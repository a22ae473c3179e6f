//! Bricks of few different values, packed.

use super::LogOddsValue;
use std::sync::Arc;

/// The two counters that an `Arc` keeps before its content.
pub(super) const ARC_HEADER: usize = 2 * size_of::<usize>();

/// Cells of a brick that can be packed: 3-D ones. An 8 x 8 block is too small to be worth it.
const CELLS: usize = 512;

/// 512 cells as indices of 0, 1, 2 or 4 bits into the values that occur, shared between snapshots.
#[derive(Clone, Debug)]
pub(super) enum Packed<V> {
    /// All alike.
    Uniform(V),
    /// Two values.
    One(Arc<([V; 2], [u64; 8])>),
    /// Up to four.
    Two(Arc<([V; 4], [u64; 16])>),
    /// Up to sixteen.
    Four(Arc<([V; 16], [u64; 32])>),
}

impl<V: LogOddsValue> Packed<V> {
    /// Packs cells; `None` where there are not 512 or more than 16 values occur.
    pub(super) fn of(cells: &[V]) -> Option<Self> {
        if cells.len() != CELLS {
            return None;
        }
        let mut values: Vec<V> = Vec::with_capacity(16);
        let mut indices = [0u8; CELLS];
        for (cell, index) in cells.iter().zip(&mut indices) {
            let at = values.iter().position(|v| v.same(*cell)).unwrap_or(values.len());
            if at == values.len() {
                if at == 16 {
                    return None;
                }
                values.push(*cell);
            }
            *index = at as u8;
        }
        Some(match values.len() {
            0..=1 => Self::Uniform(cells[0]),
            2 => Self::One(Arc::new((table(&values), words(&indices, 1)))),
            3..=4 => Self::Two(Arc::new((table(&values), words(&indices, 2)))),
            _ => Self::Four(Arc::new((table(&values), words(&indices, 4)))),
        })
    }

    /// Cell `i`, marks of never-observed ones included.
    #[inline(always)]
    pub(super) fn at(&self, i: usize) -> V {
        match self {
            Self::Uniform(v) => *v,
            Self::One(p) => p.0[(p.1[(i >> 6) & 7] >> (i & 63)) as usize & 1],
            Self::Two(p) => p.0[(p.1[(i >> 5) & 15] >> (2 * (i & 31))) as usize & 3],
            Self::Four(p) => p.0[(p.1[(i >> 4) & 31] >> (4 * (i & 15))) as usize & 15],
        }
    }

    /// All cells.
    pub(super) fn unpacked(&self) -> Arc<[V]> {
        (0..CELLS).map(|i| self.at(i)).collect()
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let header = ARC_HEADER;
        match self {
            Self::Uniform(_) => 0,
            Self::One(p) => size_of_val(&**p) + header,
            Self::Two(p) => size_of_val(&**p) + header,
            Self::Four(p) => size_of_val(&**p) + header,
        }
    }

    pub(super) const fn len(&self) -> usize {
        CELLS
    }
}

/// The values, the rest filled up.
fn table<V: LogOddsValue, const N: usize>(values: &[V]) -> [V; N] {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(V::UNOBSERVED))
}

fn words<const N: usize>(indices: &[u8; CELLS], bits: usize) -> [u64; N] {
    let mut words = [0u64; N];
    for (i, &index) in indices.iter().enumerate() {
        let at = i * bits;
        words[at / 64] |= u64::from(index) << (at % 64);
    }
    words
}
