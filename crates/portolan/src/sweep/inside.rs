//! A swept scan without the cells outside of a box.

use super::{Swept, SweptColors};
use crate::cell::{Colors, Distances, Evidence};
use crate::geom::{BlockKey, CellBox};

/// A swept scan of which only the cells of a box count; `None`: all of them.
pub(crate) struct Inside<'a, W, const D: usize> {
    pub(crate) scan: &'a W,
    pub(crate) cells: Option<CellBox<D>>,
}

impl<const D: usize, W: Swept<D>> Swept<D> for Inside<'_, W, D> {
    type Evidence = W::Evidence;
    type Scratch = (W::Scratch, Option<W::Evidence>);

    fn scratch(&self) -> Self::Scratch {
        (self.scan.scratch(), None)
    }

    fn blocks(&self) -> &[BlockKey<D>] {
        self.scan.blocks()
    }

    fn evidence<'a>(&'a self, i: usize, (scratch, kept): &'a mut Self::Scratch) -> &'a W::Evidence {
        let all = self.scan.evidence(i, scratch);
        let key = self.blocks()[i];
        match &self.cells {
            Some(cells) if !cells.contains_block(key) => {
                let kept = kept.insert(all.clone());
                kept.keep(|cell| cells.contains(key.cell(cell)));
                kept
            }
            _ => all,
        }
    }
}

impl<const D: usize, W: SweptColors<D>> SweptColors<D> for Inside<'_, W, D> {
    fn colors(&self, i: usize, distances: &Distances, band: f32, colors: &mut Colors) {
        self.scan.colors(i, distances, band, colors);
    }

    fn is_free(&self, i: usize) -> bool {
        self.scan.is_free(i)
    }
}
