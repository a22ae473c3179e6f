//! Cells whose filter is watched step by step.

use crate::cell::{Cell, Evidence};
use crate::geom::BlockKey;
use crate::store::Store;
use crate::sweep::Swept;

/// Watched cells, and what the last scan did to those that it observed. What is not watched pays nothing.
#[derive(Clone, Debug)]
pub(super) struct Watch<E, const D: usize> {
    /// Ascending.
    places: Vec<Place<D>>,
    events: Vec<([i32; D], E)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place<const D: usize> {
    block: BlockKey<D>,
    offset: usize,
    cell: [i32; D],
}

impl<E, const D: usize> Default for Watch<E, D> {
    fn default() -> Self {
        Self { places: Vec::new(), events: Vec::new() }
    }
}

impl<E, const D: usize> Watch<E, D> {
    /// Watches these cells, and no others.
    pub(super) fn watch(&mut self, cells: impl IntoIterator<Item = [i32; D]>) {
        let place = |cell| Place { block: BlockKey::of_cell(cell), offset: BlockKey::offset(cell), cell };
        self.places = cells.into_iter().map(place).collect();
        self.places.sort_unstable();
        self.places.dedup();
        self.events.clear();
    }

    /// Forgets the events of the last scan.
    pub(super) fn clear(&mut self) {
        self.events.clear();
    }

    /// The events of the last scan, in the order of blocks.
    pub(super) fn events(&self) -> &[([i32; D], E)] {
        &self.events
    }

    /// Computes what a swept scan is about to do to the watched cells, by [`Cell::fuse`] from the same evidence.
    pub(super) fn look<C, S, W>(&mut self, scan: &W, store: &S, rule: &C::Rule)
    where
        C: Cell<Event = E>,
        S: Store<C, D>,
        W: Swept<D, Evidence = C::Evidence>,
    {
        if self.places.is_empty() {
            return;
        }
        let mut scratch = scan.scratch();
        for places in self.places.chunk_by(|a, b| a.block == b.block) {
            let Ok(i) = scan.blocks().binary_search(&places[0].block) else { continue };
            let evidence = scan.evidence(i, &mut scratch);
            for place in places {
                if let Some(observation) = evidence.one(place.offset) {
                    self.events.push((place.cell, C::fuse(store.cell(place.cell), observation, rule).1));
                }
            }
        }
    }
}
