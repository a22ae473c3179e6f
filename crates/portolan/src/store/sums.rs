//! A store of sums that answers as a store of the estimates that follow from them.

use super::{Bricks, Store, StoreFull};
use crate::cell::{Cell, Planes, Sign, SumCell, SumPlanes};
use crate::geom::{BlockKey, Lattice, block_cells};
use crate::parallel;
use crate::sweep::Swept;

/// Bricks of sums ([`SumCell`]) for any map of the cells that are estimated from them.
///
/// A scan is fused wholly or not at all: where its sums turn out to need more than the limit, it is taken away again. What is taken away
/// ([`SumStore::set_sign`]) must have been there: a scan that leaves sums that no observations have is put back, and
/// [`SumStore::refused`] says where.
#[derive(Clone, Debug)]
pub struct SumStore<C: SumCell, const D: usize> {
    sums: Bricks<C, D>,
    rule: <C::Estimate as Cell>::Rule,
    sign: Sign,
    limit: usize,
    refused: Option<BlockKey<D>>,
}

impl<C: SumCell, const D: usize> SumStore<C, D> {
    /// A store of these sums, with the settings of the estimates.
    pub fn new(sums: Bricks<C, D>, rule: <C::Estimate as Cell>::Rule) -> Self {
        Self { sums, rule, sign: Sign::Plus, limit: usize::MAX, refused: None }
    }

    /// Puts other sums in place, on the same lattice.
    pub(crate) fn replace(&mut self, sums: Bricks<C, D>) {
        self.sums = sums;
    }

    /// The sums.
    pub fn sums(&self) -> &Bricks<C, D> {
        &self.sums
    }

    /// Adds scans from now on, or takes them away.
    pub fn set_sign(&mut self, sign: Sign) {
        self.sign = sign;
    }

    /// A block of the last scan that could not be taken away, because it was not there; asking forgets it.
    pub fn refused(&mut self) -> Option<BlockKey<D>> {
        self.refused.take()
    }

    /// Adds another store's sums, or takes them away.
    ///
    /// # Errors
    /// The block in which a sum would become one that no observations have, or pass [`MOST_SUM`](crate::cell::MOST_SUM);
    /// nothing is changed then.
    pub fn add(&mut self, other: &Self, sign: Sign) -> Result<(), BlockKey<D>> {
        let keys = other.sums.keys();
        let change = |key: &BlockKey<D>| {
            let mut brick =
                self.sums.brick(*key).cloned().unwrap_or_else(|| C::Brick::unobserved(block_cells::<D>()));
            let done = other.sums.brick(*key).is_none_or(|more| brick.add(more, sign)) && brick.is_possible();
            if done { Ok((*key, brick)) } else { Err(*key) }
        };
        // Made first and put in place together, so that an error changes nothing.
        let made = parallel::map(&keys, 16, change).into_iter().collect::<Result<Vec<_>, _>>()?;
        for (key, brick) in made {
            self.sums.insert(key, brick).map_err(|_| key)?;
        }
        Ok(())
    }

    /// The estimates of all bricks that hold any, in ascending order of their keys.
    ///
    /// # Errors
    /// Where they take more than `limit` bytes.
    pub fn estimates(&self, limit: usize) -> Result<Bricks<C::Estimate, D>, StoreFull> {
        let mut made = Bricks::new(*self.sums.lattice());
        made.set_limit(limit);
        for keys in self.sums.keys().chunks(4096) {
            let bricks =
                parallel::map(keys, 16, |key| self.sums.brick(*key).and_then(|b| self.estimates_of(b)));
            for (key, brick) in keys.iter().zip(bricks) {
                if let Some(brick) = brick {
                    made.insert(*key, brick)?;
                }
            }
        }
        Ok(made)
    }

    /// The estimates of a brick; `None` where nothing was observed in it.
    fn estimates_of(&self, sums: &C::Brick) -> Option<<C::Estimate as Cell>::Brick> {
        if sums.is_zero() {
            return None;
        }
        Some(C::estimates(sums, &self.rule))
    }

    /// Whether what was just done to these blocks can stay.
    fn verdict(&self, blocks: &[BlockKey<D>]) -> Verdict<D> {
        if self.sign == Sign::Plus {
            let bytes = self.sums.memory_bytes();
            return if bytes > self.limit { Verdict::Full(bytes) } else { Verdict::Fused };
        }
        let wrong = |key: &BlockKey<D>| self.sums.brick(*key).is_some_and(|brick| !brick.is_possible());
        let first = parallel::map(blocks, 64, wrong).into_iter().position(|wrong| wrong);
        first.map_or(Verdict::Fused, |i| Verdict::NotThere(blocks[i]))
    }

    /// After what cannot stay was undone: forgets the bricks that it had made, which hold nothing.
    fn end(&mut self, verdict: Verdict<D>) -> Result<(), StoreFull> {
        match verdict {
            Verdict::Fused => return Ok(()),
            Verdict::NotThere(block) => self.refused = Some(block),
            Verdict::Full(_) => {}
        }
        self.sums.retain(|brick| !brick.is_zero());
        match verdict {
            Verdict::Full(bytes) => Err(StoreFull { limit: self.limit, bytes }),
            _ => Ok(()),
        }
    }
}

/// What is to become of evidence that was fused.
enum Verdict<const D: usize> {
    /// It stays.
    Fused,
    /// The sums take so many bytes, more than they may.
    Full(usize),
    /// Something was taken away that was not in this block.
    NotThere(BlockKey<D>),
}

impl<C: SumCell, const D: usize> Store<C::Estimate, D> for SumStore<C, D> {
    fn lattice(&self) -> &Lattice<D> {
        self.sums.lattice()
    }

    #[inline]
    fn cell(&self, cell: [i32; D]) -> Option<C::Estimate> {
        self.sums.cell(cell).map(|sums| sums.estimate(&self.rule))
    }

    fn blocks_with(&self, holds: impl Fn(C::Estimate) -> bool) -> Vec<BlockKey<D>> {
        self.sums.blocks_with(|sums| holds(sums.estimate(&self.rule)))
    }

    fn apply(
        &mut self,
        key: BlockKey<D>,
        evidence: &<C::Estimate as Cell>::Evidence,
        rule: &<C::Estimate as Cell>::Rule,
    ) -> Result<(), StoreFull> {
        self.sums.apply(key, evidence, &C::rule(rule, self.sign))?;
        let verdict = self.verdict(&[key]);
        if !matches!(verdict, Verdict::Fused) {
            self.sums.apply(key, evidence, &C::rule(rule, self.sign.opposite()))?;
        }
        self.end(verdict)
    }

    fn fuse<W>(&mut self, scan: &W, rule: &<C::Estimate as Cell>::Rule) -> Result<u64, StoreFull>
    where
        W: Swept<D, Evidence = <C::Estimate as Cell>::Evidence>,
    {
        let cells = self.sums.fuse(scan, &C::rule(rule, self.sign))?;
        let verdict = self.verdict(scan.blocks());
        if !matches!(verdict, Verdict::Fused) {
            self.sums.fuse(scan, &C::rule(rule, self.sign.opposite()))?;
        }
        self.end(verdict).map(|()| cells)
    }

    fn limit(&self) -> usize {
        self.limit
    }

    fn set_limit(&mut self, bytes: usize) {
        self.limit = bytes;
    }

    fn memory_bytes(&self) -> usize {
        self.sums.memory_bytes()
    }
}
