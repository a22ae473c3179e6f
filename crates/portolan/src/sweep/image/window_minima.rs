//! The nearest reading of any window of pixels, by one read.

/// Windows for single cells, in steps of about a half: what is larger than needed frees less.
const FINE: [usize; 11] = [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];

/// Minima over windows of one size at every place, also over the image's border.
#[derive(Clone, Debug, Default)]
pub(super) struct WindowMinima {
    /// Size of the windows.
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// From one row of windows to the next.
    pub(super) stride: usize,
    /// Rows of windows.
    pub(super) lines: usize,
    /// Window that starts at `(row, column)`: at `(row + rows - 1) * stride + column + columns - 1`.
    pub(super) minima: Vec<f32>,
}

impl WindowMinima {
    /// The same for larger windows, at most twice as large along each axis, into `to`. In a turning sensor's image they go on
    /// at the other side.
    fn grow(&self, to: &mut Self, (columns, rows): (usize, usize), edge: Edge, wide: &mut Vec<f32>) {
        let (more_c, more_r) = (columns - self.columns, rows - self.rows);
        let stride = edge.columns + columns - 1;
        let lines = self.lines;
        wide.clear();
        wide.reserve(lines * stride);
        let mut line = vec![OUTSIDE; stride + more_c];
        for from in self.minima.chunks_exact(self.stride) {
            line[more_c..more_c + self.stride].copy_from_slice(from);
            if let Some(turn) = edge.turn {
                // Starts before the image are those before a turn's end, and the other way round.
                let known = more_c + self.stride;
                for i in (0..more_c).rev() {
                    line[i] = if i + turn < known { line[i + turn] } else { OUTSIDE };
                }
                for i in known..stride + more_c {
                    line[i] = if i >= turn { line[i - turn] } else { OUTSIDE };
                }
            }
            smaller(wide, &line[..stride], &line[more_c..]);
        }
        (to.columns, to.rows, to.stride, to.lines) = (columns, rows, stride, lines + more_r);
        to.minima.clear();
        to.minima.reserve((lines + more_r) * stride);
        let beyond = vec![OUTSIDE; stride];
        let of = |i: usize| match i.checked_sub(more_r) {
            Some(i) if i < lines => &wide[i * stride..(i + 1) * stride],
            _ => &beyond[..],
        };
        for i in 0..lines + more_r {
            smaller(&mut to.minima, of(i), of(i + more_r));
        }
    }
}

/// What is beyond an image's border.
#[derive(Clone, Copy, Debug)]
struct Edge {
    columns: usize,
    /// Columns of a full turn, where windows go on beyond the border.
    turn: Option<usize>,
}

/// What counts for what is not in the image.
const OUTSIDE: f32 = f32::INFINITY;

/// Appends the smaller of each pair.
#[inline(always)]
fn smaller(to: &mut Vec<f32>, a: &[f32], b: &[f32]) {
    to.extend(a.iter().zip(b).map(|(&a, &b)| if a < b { a } else { b }));
}

/// The tables of one image. Buffers are kept from image to image.
#[derive(Clone, Debug, Default)]
pub(super) struct RangeTables {
    /// Nearest reading; no reading counts as infinitely far.
    pub(super) fine: Vec<WindowMinima>,
    /// The nearest reading of all.
    pub(super) overall: f32,
}

impl RangeTables {
    /// Makes the tables of an image's values, with windows that are `rows_per_column` as high as wide. `turn`:
    /// columns of a full turn, whether the image has all of them or not; `None` where the sensor does not turn.
    pub(super) fn fill(&mut self, values: &[f32], columns: usize, turn: Option<usize>, rows_per_column: f32) {
        let known = |v: &f32| if *v != 0.0 { v.abs() } else { f32::INFINITY };
        self.fine.resize_with(FINE.len(), WindowMinima::default);
        let mut first = WindowMinima {
            columns: 1,
            rows: 1,
            stride: columns,
            lines: values.len() / columns.max(1),
            minima: values.iter().map(known).collect(),
        };
        self.overall = first.minima.iter().copied().fold(f32::INFINITY, f32::min);
        let mut wide = Vec::new();
        for (i, &n) in FINE.iter().enumerate() {
            let rows = ((n as f32 * rows_per_column).ceil() as usize).clamp(2, 64);
            let edge = Edge { columns, turn: turn.filter(|&t| n < t.min(columns)) };
            if i == 0 {
                // From single pixels in steps that at most double.
                while 2 * first.columns < n || 2 * first.rows < rows {
                    let mut next = WindowMinima::default();
                    let size = (n.min(2 * first.columns), rows.min(2 * first.rows));
                    first.grow(&mut next, size, edge, &mut wide);
                    first = next;
                }
                first.grow(&mut self.fine[0], (n, rows), edge, &mut wide);
            } else {
                let (done, rest) = self.fine.split_at_mut(i);
                done[i - 1].grow(&mut rest[0], (n, rows), edge, &mut wide);
            }
        }
    }
}

/// Sizes of windows, as lanes to compare with.
#[derive(Clone, Copy, Debug)]
pub(super) struct WindowSizes {
    columns: [f32; 16],
    rows: [f32; 16],
    len: usize,
}

impl WindowSizes {
    /// Of windows that grow along both axes, at most 16.
    pub(super) fn of(windows: &[WindowMinima]) -> Self {
        let lane = |i: usize, size: fn(&WindowMinima) -> usize| {
            windows.get(i).map_or(f32::INFINITY, |w| size(w) as f32)
        };
        Self {
            columns: std::array::from_fn(|i| lane(i, |w| w.columns)),
            rows: std::array::from_fn(|i| lane(i, |w| w.rows)),
            len: windows.len(),
        }
    }

    /// The smallest windows that hold `columns` and `rows` pixels, by position; `None` where all are too small, or one is not a number.
    #[inline(always)]
    pub(super) fn level(&self, columns: f32, rows: f32) -> Option<usize> {
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
        fn windows_hold_their_smallest(
            values in prop::collection::vec(0.0..9.0f32, 80 * 24),
            turn in prop::option::of(prop_oneof![3 => Just(80usize), 2 => 76..=120usize]),
            ratio in 0.2..1.5f32,
        ) {
            let (columns, rows) = (80i32, 24i32);
            let mut tables = RangeTables::default();
            tables.fill(&[1.0; 800], 40, None, 1.0);
            tables.fill(&values, 80, turn, ratio);
            for need in [0.5, 2.0, 3.5, 16.0, 64.0, 64.5, f32::INFINITY, f32::NAN] {
                let first = tables.fine.iter().position(|w| w.columns as f32 >= need && w.rows as f32 >= 0.4 * need);
                prop_assert_eq!(WindowSizes::of(&tables.fine).level(need, 0.4 * need), first);
            }
            for w in &tables.fine {
                for k in 0..40 {
                    let (r, c) = (k * 7 % 24 - k % 3, (k * 31) % 80 - k % 5);
                    let (r, c) = (r.max(1 - w.rows as i32), c.max(1 - w.columns as i32));
                    // A window that starts before the image is the one that starts a turn later.
                    let start = turn.filter(|_| c < 0).map_or(c, |turn| c + turn as i32);
                    let mut least = f32::INFINITY;
                    for i in r..r + w.rows as i32 {
                        for j in start..start + w.columns as i32 {
                            let j = turn.filter(|_| j >= columns).map_or(j, |turn| j - turn as i32);
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
