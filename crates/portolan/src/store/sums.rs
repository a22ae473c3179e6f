//! A store of sums that answers as a store of the estimates that follow from them.

use super::{Bricks, Store, StoreFull};
use crate::cell::{Cell, Planes, Sign, SumCell, SumPlanes};
use crate::geom::{BlockKey, Lattice, block_cells};
use crate::parallel;
use crate::sweep::Swept;

/// Bricks of sums ([`SumCell`]) for any map of the cells that are estimated from them.
///
/// What is fused in one call is fused wholly or not at all: where the sums turn out to need more than the limit, it is taken away
/// again. A scan may come in several calls, as that of a lidar that moved does; a ledger opens it, asks for a verdict at its end, and
/// undoes all of it where the verdict says so.
#[derive(Clone, Debug)]
pub struct SumStore<C: SumCell, const D: usize> {
    sums: Bricks<C, D>,
    rule: <C::Estimate as Cell>::Rule,
    sign: Sign,
    limit: usize,
    /// The blocks that a scan took something away from so far; `None`: no scan is open.
    open: Option<Vec<BlockKey<D>>>,
}

impl<C: SumCell, const D: usize> SumStore<C, D> {
    /// A store of these sums, with the settings of the estimates.
    pub fn new(sums: Bricks<C, D>, rule: <C::Estimate as Cell>::Rule) -> Self {
        Self { sums, rule, sign: Sign::Plus, limit: usize::MAX, open: None }
    }

    /// Puts other sums in place, on the same lattice.
    pub(crate) fn replace(&mut self, sums: Bricks<C, D>) {
        self.sums = sums;
    }

    /// The sums.
    pub fn sums(&self) -> &Bricks<C, D> {
        &self.sums
    }

    /// What is fused until [`SumStore::verdict`] belongs to one scan, which is added or taken away. Nothing of it is refused.
    pub(crate) fn begin(&mut self, sign: Sign) {
        self.sign = sign;
        self.open = Some(Vec::new());
    }

    /// Whether the scan that was begun can stay: there is room for it, or what was taken away had been there.
    ///
    /// # Errors
    /// Why it has to be undone.
    pub(crate) fn verdict(&mut self) -> Result<(), Unfit<D>> {
        let mut touched = self.open.take().unwrap_or_default();
        touched.sort_unstable();
        touched.dedup();
        let sign = std::mem::take(&mut self.sign);
        let bytes = self.sums.memory_bytes();
        if sign == Sign::Plus && bytes > self.limit {
            return Err(Unfit::Full(StoreFull { limit: self.limit, bytes }));
        }
        let wrong = |key: &BlockKey<D>| self.sums.brick(*key).is_some_and(|brick| !brick.is_possible());
        let first = parallel::map(&touched, 64, wrong).into_iter().position(|wrong| wrong);
        first.map_or(Ok(()), |i| Err(Unfit::NotThere(touched[i])))
    }

    /// Forgets bricks that hold nothing: what a scan that was undone had made.
    pub(crate) fn forget_empty(&mut self) {
        self.sums.retain(|brick| !brick.is_zero());
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
}

/// Why a scan has to be undone.
pub(crate) enum Unfit<const D: usize> {
    /// The sums need more than they may.
    Full(StoreFull),
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
        match &mut self.open {
            Some(touched) => touched.push(key),
            None if self.sums.memory_bytes() > self.limit => {
                self.sums.apply(key, evidence, &C::rule(rule, Sign::Minus))?;
                self.forget_empty();
                return Err(StoreFull { limit: self.limit, bytes: self.sums.memory_bytes() });
            }
            None => {}
        }
        Ok(())
    }

    fn fuse<W>(&mut self, scan: &W, rule: &<C::Estimate as Cell>::Rule) -> Result<u64, StoreFull>
    where
        W: Swept<D, Evidence = <C::Estimate as Cell>::Evidence>,
    {
        let cells = self.sums.fuse(scan, &C::rule(rule, self.sign))?;
        match &mut self.open {
            Some(touched) if self.sign == Sign::Minus => touched.extend(scan.blocks()),
            Some(_) => {}
            None if self.sums.memory_bytes() > self.limit => {
                self.sums.fuse(scan, &C::rule(rule, Sign::Minus))?;
                self.forget_empty();
                return Err(StoreFull { limit: self.limit, bytes: self.sums.memory_bytes() });
            }
            None => {}
        }
        Ok(cells)
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
