//! The nearest reading of any window of pixels, by one look.

use crate::parallel;

/// Windows for bricks and larger: a window that is larger than needed only means to look closer.
const COARSE: [usize; 11] = [2, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96];
/// Windows for single cells, in steps of about a half: what is larger than needed frees less.
const FINE: [usize; 11] = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];

/// Minima over windows of one size at every place, also over the image's border.
#[derive(Clone, Debug, Default)]
pub(crate) struct WindowMin {
    /// Size of the windows.
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// From one row of windows to the next.
    pub(crate) stride: usize,
    /// Rows of windows.
    pub(crate) lines: usize,
    /// Window that starts at `(row, column)`: at `(row + rows - 1) * stride + column + columns - 1`.
    pub(crate) minima: Vec<f32>,
}

impl WindowMin {
    /// The same for larger windows, at most twice as large along each axis, into `to`. `outside` counts for what is not in the
    /// image; in a closed one the last column is a neighbour of the first.
    fn grow(&self, to: &mut Self, (columns, rows): (usize, usize), edge: Edge, wide: &mut Vec<f32>) {
        let (more_c, more_r) = (columns - self.columns, rows - self.rows);
        let stride = edge.columns + columns - 1;
        let lines = self.lines;
        wide.clear();
        wide.reserve(lines * stride);
        let mut line = vec![edge.outside; stride + more_c];
        for from in self.minima.chunks_exact(self.stride) {
            line[more_c..more_c + self.stride].copy_from_slice(from);
            if edge.closed {
                // Starts before the image are those before its end, and the other way round.
                for i in (0..more_c).rev() {
                    line[i] = line[i + edge.columns];
                }
                for i in more_c + self.stride..stride + more_c {
                    line[i] = line[i - edge.columns];
                }
            }
            smaller(wide, &line[..stride], &line[more_c..]);
        }
        (to.columns, to.rows, to.stride, to.lines) = (columns, rows, stride, lines + more_r);
        to.minima.clear();
        to.minima.reserve((lines + more_r) * stride);
        let beyond = vec![edge.outside; stride];
        let of = |i: usize| match i.checked_sub(more_r) {
            Some(i) if i < lines => &wide[i * stride..(i + 1) * stride],
            _ => &beyond[..],
        };
        for i in 0..lines + more_r {
            smaller(&mut to.minima, of(i), of(i + more_r));
        }
    }

    /// Index of the window whose middle is nearest to a pixel coordinate; `None` where it is not in the image at all.
    #[inline(always)]
    pub(crate) fn around(&self, column: f32, row: f32) -> Option<usize> {
        let c = column + 0.5 * self.columns as f32;
        let r = row + 0.5 * self.rows as f32;
        let inside = c >= 0.0 && c < self.stride as f32 && r >= 0.0 && r < self.lines as f32;
        // Small and positive: truncating is rounding down.
        inside.then(|| (r as i32 as u32 * self.stride as u32 + c as i32 as u32) as usize)
    }
}

/// What is beyond an image's border.
#[derive(Clone, Copy, Debug)]
struct Edge {
    columns: usize,
    closed: bool,
    outside: f32,
}

/// Appends the smaller of each pair.
#[inline(always)]
fn smaller(to: &mut Vec<f32>, a: &[f32], b: &[f32]) {
    to.extend(a.iter().zip(b).map(|(&a, &b)| if a < b { a } else { b }));
}

/// The tables of one image. Buffers are kept from image to image.
#[derive(Clone, Debug, Default)]
pub(crate) struct Guard {
    /// Nearest reading; no reading counts as infinitely far.
    pub(crate) fine: Vec<WindowMin>,
    /// Nearest reading; no reading counts as 0.
    pub(crate) nearest: Vec<WindowMin>,
    /// Farthest reading, negated; no reading counts as 0.
    pub(crate) farthest: Vec<WindowMin>,
    /// The nearest reading of all.
    pub(crate) overall: f32,
}

impl Guard {
    /// Makes the tables of an image's values, with windows that are `rows_per_column` as high as wide.
    pub(crate) fn fill(&mut self, values: &[f32], columns: usize, closed: bool, rows_per_column: f32) {
        let known = |v: f32| if v > 0.0 { v } else { f32::INFINITY };
        let series = |all: &mut Vec<WindowMin>, sizes: &[usize], value: fn(f32) -> f32, outside: f32| {
            all.resize_with(sizes.len(), WindowMin::default);
            let minima = values.iter().map(|v| value(v.abs())).collect();
            let mut first = WindowMin {
                columns: 1,
                rows: 1,
                stride: columns,
                lines: values.len() / columns.max(1),
                minima,
            };
            let mut wide = Vec::new();
            for (i, &n) in sizes.iter().enumerate() {
                let rows = ((n as f32 * rows_per_column).ceil() as usize).clamp(2, 64);
                let edge = Edge { columns, closed: closed && n < columns, outside };
                if i == 0 {
                    // From single pixels in steps that at most double.
                    while 2 * first.columns < n || 2 * first.rows < rows {
                        let mut next = WindowMin::default();
                        let size = (n.min(2 * first.columns), rows.min(2 * first.rows));
                        first.grow(&mut next, size, edge, &mut wide);
                        first = next;
                    }
                    first.grow(&mut all[0], (n, rows), edge, &mut wide);
                } else {
                    let (done, rest) = all.split_at_mut(i);
                    done[i - 1].grow(&mut rest[0], (n, rows), edge, &mut wide);
                }
            }
        };
        let (fine, nearest, farthest) = (&mut self.fine, &mut self.nearest, &mut self.farthest);
        parallel::join(
            || series(fine, &FINE, |v| if v > 0.0 { v } else { f32::INFINITY }, f32::INFINITY),
            || {
                series(nearest, &COARSE, |v| v, 0.0);
                series(farthest, &COARSE, |v| -v, 0.0);
            },
        );
        self.overall = values.iter().map(|v| known(v.abs())).fold(f32::INFINITY, f32::min);
    }
}

/// Sizes of windows, as lanes to compare with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    columns: [f32; 16],
    rows: [f32; 16],
    len: usize,
}

impl Sizes {
    /// Of windows that grow along both axes, at most 16.
    pub(crate) fn of(windows: &[WindowMin]) -> Self {
        let lane = |i: usize, size: fn(&WindowMin) -> usize| {
            windows.get(i).map_or(f32::INFINITY, |w| size(w) as f32)
        };
        Self {
            columns: std::array::from_fn(|i| lane(i, |w| w.columns)),
            rows: std::array::from_fn(|i| lane(i, |w| w.rows)),
            len: windows.len(),
        }
    }

    /// The smallest windows that hold `columns` and `rows` pixels, by position; `None` where none do, or one is not a number.
    #[inline(always)]
    pub(crate) fn level(&self, columns: f32, rows: f32) -> Option<usize> {
        let holds = |i: usize| (self.columns[i] >= columns) & (self.rows[i] >= rows);
        let level = (0..16).map(|i| usize::from(!holds(i))).sum::<usize>();
        (level < self.len).then_some(level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn windows_hold_their_smallest(values in prop::collection::vec(0.0..9.0f32, 80 * 24), closed in any::<bool>(), ratio in 0.2..1.5f32) {
            let (columns, rows) = (80i32, 24i32);
            let mut guard = Guard::default();
            guard.fill(&[1.0; 800], 40, !closed, 1.0);
            guard.fill(&values, 80, closed, ratio);
            for need in [0.5, 2.0, 3.5, 16.0, 64.0, 64.5, f32::INFINITY, f32::NAN] {
                let first = guard.fine.iter().position(|w| w.columns as f32 >= need && w.rows as f32 >= 0.4 * need);
                prop_assert_eq!(Sizes::of(&guard.fine).level(need, 0.4 * need), first);
            }
            for w in &guard.fine {
                for k in 0..40 {
                    let (r, c) = (k * 7 % 24 - k % 3, (k * 31) % 80 - k % 5);
                    let (r, c) = (r.max(1 - w.rows as i32), c.max(1 - w.columns as i32));
                    let mut least = f32::INFINITY;
                    for i in r..r + w.rows as i32 {
                        for j in c..c + w.columns as i32 {
                            let j = if closed { j.rem_euclid(columns) } else { j };
                            if (0..rows).contains(&i) && (0..columns).contains(&j) {
                                let v = values[(i * columns + j) as usize];
                                least = least.min(if v > 0.0 { v } else { f32::INFINITY });
                            }
                        }
                    }
                    let at = (r + w.rows as i32 - 1) as usize * w.stride + (c + w.columns as i32 - 1) as usize;
                    prop_assert_eq!(w.minima[at], least, "{} x {} at {}, {}", w.rows, w.columns, r, c);
                }
            }
        }
    }
}
