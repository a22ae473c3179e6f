//! One pass over lines that lie side by side.

use super::number::Number;
use super::search::{Found, Window};
use multiversion::multiversion;

/// Lines along one axis, side by side: row by row, all lanes.
pub(super) struct Panel<L, const N: usize> {
    /// What the pass before left. Rows of the line.
    pub(super) rows: Vec<[L; N]>,
    /// The minima.
    pub(super) best: Vec<[L; N]>,
    /// Where they come from, in rows from their own; empty unless they are asked for.
    pub(super) offset: Vec<[L; N]>,
    /// The cells of `rows`, and after [`solve`] of the minima; empty unless they are asked for.
    pub(super) cells: Vec<[u32; N]>,
    gathered: Vec<[u32; N]>,
    /// Which rows hold the minima of a solved row, over all lanes.
    spans: Vec<(u32, u32)>,
}

/// Up to so many rows on each side are searched plainly.
pub(super) const PLAIN: usize = 48;

/// Rows on each side that are searched before it is worth knowing where the minima are.
const NEAR: usize = 12;

impl<L: Number, const N: usize> Panel<L, N> {
    /// For lines of `n` cells.
    pub(super) fn new(n: usize, with_offsets: bool) -> Self {
        let rows = vec![[L::FAR; N]; n];
        let asked = if with_offsets { n } else { 0 };
        Self {
            best: rows.clone(),
            rows,
            offset: vec![[L::ZERO; N]; asked],
            cells: vec![[0; N]; asked],
            gathered: vec![[0; N]; asked],
            spans: vec![(0, 0); n],
        }
    }

    /// Lanes without any value become lanes of zeros, which are done at once. `None`: all lanes are such.
    #[inline(always)]
    fn silence(&mut self) -> Option<[bool; N]> {
        let mut least = [L::FAR; N];
        for row in &self.rows {
            for i in 0..N {
                least[i] = if row[i] < least[i] { row[i] } else { least[i] };
            }
        }
        let silent = least.map(|l| l >= L::FAR);
        if silent.iter().all(|s| *s) {
            return None;
        }
        if silent.iter().any(|s| *s) {
            for row in &mut self.rows {
                for i in 0..N {
                    row[i] = if silent[i] { L::ZERO } else { row[i] };
                }
            }
        }
        Some(silent)
    }

    #[inline(always)]
    fn solve_lanes<const OFFSET: bool>(&mut self, reach: usize, squares: &[L]) {
        let Some(silent) = self.silence() else {
            self.best.fill([L::FAR; N]);
            return;
        };
        if reach <= PLAIN {
            self.plain::<OFFSET>(reach, squares);
        } else {
            self.ordered::<OFFSET>(squares);
        }
        if silent.iter().any(|s| *s) {
            for row in &mut self.best {
                for i in 0..N {
                    row[i] = if silent[i] { L::FAR } else { row[i] };
                }
            }
        }
    }

    /// Every row by itself.
    #[inline(always)]
    fn plain<const OFFSET: bool>(&mut self, reach: usize, squares: &[L]) {
        let n = self.rows.len();
        for row in 0..n {
            let window =
                Window { row, first: row.saturating_sub(reach), last: row.saturating_add(reach).min(n - 1) };
            let mut found = Found::at(&self.rows, window);
            found.look::<OFFSET>(&self.rows, window, squares, 1, n);
            self.put::<OFFSET>(row, &found);
        }
    }

    /// Every row between two solved ones, in halving strides: all its minima lie between theirs. Proof: let `a` be a
    /// minimum of row `r`, `q > r` and `p < a`; then `(q - p)^2 + f(p) - (q - a)^2 - f(a)` is what it is for `r`, not
    /// negative, plus `2 (q - r)(a - p) > 0`.
    #[inline(always)]
    fn ordered<const OFFSET: bool>(&mut self, squares: &[L]) {
        let n = self.rows.len();
        self.between::<OFFSET, true>(Window { row: 0, first: 0, last: n - 1 }, squares);
        let mut stride = n.next_power_of_two() / 2;
        while stride > 0 {
            for row in (stride..n).step_by(2 * stride) {
                let first = self.spans[row - stride].0 as usize;
                let last = self.spans.get(row + stride).map_or(n - 1, |span| span.1 as usize);
                let window = Window { row, first, last };
                if stride > 1 {
                    self.between::<OFFSET, true>(window, squares);
                } else {
                    self.between::<OFFSET, false>(window, squares);
                }
            }
            stride /= 2;
        }
    }

    /// One row, from what its window holds; with `SPAN` it is remembered where its minima are.
    #[inline(always)]
    fn between<const OFFSET: bool, const SPAN: bool>(&mut self, window: Window, squares: &[L]) {
        let Window { row, first, last } = window;
        let rows = &self.rows;
        let mut found = Found::at(rows, window);
        let end = window.farthest() + 1;
        let within = |k: usize| ((row.saturating_sub(k)).max(first) as u32, (row + k).min(last) as u32);
        let near = if SPAN { NEAR } else { end };
        let (k, done) = found.look::<OFFSET>(rows, window, squares, 1, near);
        let mut span = within(k);
        if SPAN && !done {
            if OFFSET {
                found.look::<true>(rows, window, squares, k, end);
                span = bounds(&found.offset, row);
            } else {
                // Lanes that find nothing better keep what is near.
                found.offset = [L::of_offset(0); N];
                found.look::<true>(rows, window, squares, k, end);
                let far = bounds(&found.offset, row);
                span = (far.0.min(span.0), far.1.max(span.1));
            }
        }
        if SPAN {
            self.spans[row] = (span.0.max(first as u32), span.1.min(last as u32));
        }
        self.put::<OFFSET>(row, &found);
    }

    /// Replaces the cells of the rows by those of their minima, `stride` further with every row.
    #[inline(always)]
    fn gather(&mut self, stride: u32) {
        let cells = self.cells.as_flattened();
        for (q, (offset, to)) in self.offset.iter().zip(&mut self.gathered).enumerate() {
            let mut row = [0; N];
            for lane in 0..N {
                row[lane] = (q as u32).wrapping_add(offset[lane].offset() as u32);
            }
            for lane in 0..N {
                // What is far may have any row.
                to[lane] = cells.get(row[lane] as usize * N + lane).copied().unwrap_or(u32::MAX);
            }
            for lane in 0..N {
                to[lane] = to[lane].wrapping_add(row[lane].wrapping_mul(stride));
            }
        }
        std::mem::swap(&mut self.cells, &mut self.gathered);
    }

    #[inline(always)]
    fn put<const OFFSET: bool>(&mut self, row: usize, found: &Found<L, N>) {
        self.best[row] = found.best;
        if OFFSET {
            self.offset[row] = found.offset;
        }
    }
}

/// The lowest and the highest row that the offsets of a row lead to.
#[inline(always)]
fn bounds<L: Number, const N: usize>(offsets: &[L; N], row: usize) -> (u32, u32) {
    // In the numbers of the lanes, one after the other: what becomes vectors best.
    let (mut low, mut high) = (offsets[0], offsets[0]);
    for &offset in offsets {
        low = if offset < low { offset } else { low };
        high = if offset > high { offset } else { high };
    }
    let (low, high) = (low.offset(), high.offset());
    (row.saturating_add_signed(low) as u32, row.saturating_add_signed(high) as u32)
}

/// Fills `best`, and `offset` unless it is empty: `min over |k| <= reach of rows(q + k) + k^2`; ties go to the lowest
/// row. `squares` holds the costs of all offsets in the line. Values that are far, and beyond `reach` any that is not
/// less than its square, mean nothing. Where cells are asked for, they become those of the minima: `stride` more with
/// every row.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
pub(super) fn solve<L: Number, const N: usize>(
    panel: &mut Panel<L, N>,
    reach: usize,
    squares: &[L],
    stride: usize,
) {
    if panel.offset.is_empty() {
        panel.solve_lanes::<false>(reach, squares);
    } else {
        panel.solve_lanes::<true>(reach, squares);
        panel.gather(stride as u32);
    }
}
