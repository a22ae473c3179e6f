//! Cells of masks, and of arrays of labels.

use super::ends::{border_ends, label_ends};
use super::number::Number;
use super::scan::{scan, scan_labels};

/// A cell of a mask: set or not.
pub trait MaskCell: Copy + Send + Sync {
    /// Whether distances are measured to this cell.
    fn is_set(self) -> bool;
}

impl MaskCell for bool {
    #[inline(always)]
    fn is_set(self) -> bool {
        self
    }
}

/// Any value but 0 is set.
impl MaskCell for u8 {
    #[inline(always)]
    fn is_set(self) -> bool {
        self != 0
    }
}

/// A cell of an array of labels. The default value (0, `false`) is background.
pub trait Label: Copy + PartialEq + Default + Send + Sync {}

impl<T: Copy + PartialEq + Default + Send + Sync> Label for T {}

/// What distances along one axis are measured to.
pub(super) trait Cells: Copy + Send + Sync {
    /// Whether cells of another label, or what lies around the array, end a line.
    fn has_ends(&self) -> bool;

    /// Number of cells.
    fn len(&self) -> usize;

    /// Squared distances along the line of `out.len()` cells from `first` on, and where these are (`nearest` may be empty).
    fn scan<L: Number>(&self, first: usize, squares: &[L], out: &mut [L], nearest: &mut [u32]);

    /// Lowers the minima of some lines to the squared distances along the lines to their ends. Cell `lane` of row `q` is
    /// `first + lane + q * stride`.
    fn ends<L: Number, const N: usize>(&self, first: usize, stride: usize, unit: f64, best: &mut [[L; N]]);
}

/// Distances to cells that are set.
#[derive(Clone, Copy)]
pub(super) struct Mask<'a, M>(pub(super) &'a [M]);

impl<M: MaskCell> Cells for Mask<'_, M> {
    fn has_ends(&self) -> bool {
        false
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline]
    fn scan<L: Number>(&self, first: usize, squares: &[L], out: &mut [L], nearest: &mut [u32]) {
        scan(&self.0[first..first + out.len()], M::is_set, squares, out, nearest);
    }

    fn ends<L: Number, const N: usize>(&self, _: usize, _: usize, _: f64, _: &mut [[L; N]]) {}
}

/// Distances to cells of another label.
#[derive(Clone, Copy)]
pub(super) struct Labels<'a, T> {
    pub(super) cells: &'a [T],
    /// Cells have several labels beside the background's.
    pub(super) several: bool,
    /// What lies around the array is of another label.
    pub(super) border: bool,
}

/// Whether there are two labels or more beside the background's. O(cells) at most.
pub(super) fn several<T: Label>(cells: &[T]) -> bool {
    let background = T::default();
    let Some(label) = cells.iter().find(|cell| **cell != background) else { return false };
    cells.chunks(1024).any(|chunk| {
        let other = |cell: &T| *cell != *label && *cell != background;
        chunk.iter().fold(false, |any, cell| any | other(cell))
    })
}

impl<T: Label> Cells for Labels<'_, T> {
    fn has_ends(&self) -> bool {
        self.several || self.border
    }

    fn len(&self) -> usize {
        self.cells.len()
    }

    #[inline]
    fn scan<L: Number>(&self, first: usize, squares: &[L], out: &mut [L], nearest: &mut [u32]) {
        let cells = &self.cells[first..first + out.len()];
        if self.has_ends() {
            scan_labels(cells, self.border, squares, out);
        } else {
            scan(cells, |cell| cell == T::default(), squares, out, nearest);
        }
    }

    fn ends<L: Number, const N: usize>(&self, first: usize, stride: usize, unit: f64, best: &mut [[L; N]]) {
        if self.several {
            label_ends(&self.cells[first..], stride, self.border, unit, best);
        } else if self.border {
            border_ends(unit, best);
        }
    }
}
