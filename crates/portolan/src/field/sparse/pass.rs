//! One pass of the separable transform over lines of bricks.

use super::level::{Input, lines};
use super::min_plus::{Found, LANES, Panels, Row, Words, min_plus, min_plus_boxes, min_plus_words};
use super::reach::{Reach, bricks_within};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::parallel;
use multiversion::multiversion;

/// What a pass looks for on its lines, in bricks of type `B`.
pub(super) trait Search<B, const D: usize>: Sync {
    /// A run of bricks of a line, made ready for the search.
    type Line: Default;
    /// Whether words are carried.
    const WORDS: bool;
    /// Bricks that are made ready on either side of what is there.
    const MARGIN: i32 = 0;

    /// Makes the line ready for `length` cells, with nothing on it.
    fn clear(&self, line: &mut Self::Line, rows: &Rows, length: usize);

    /// Puts a brick on the line, from row `first` on.
    fn put(&self, line: &mut Self::Line, brick: &B, first: usize, rows: &Rows, length: usize);

    /// Finds the eight rows from `first` on, no further than `reach` rows away, beginning with what is found already.
    fn find(&self, line: &mut Self::Line, length: usize, first: usize, reach: usize, found: &mut Found);
}

/// The values and words of one brick, in the layout of the pass that reads them.
pub(super) trait Source: Sync {
    /// May be put together in `scratch`.
    fn values<'s>(&'s self, scratch: &'s mut [Vec<f32>; 2]) -> &'s [f32];
    /// Empty where none are carried.
    fn words(&self) -> &[u32];
}

/// A brick of an earlier pass.
#[derive(Clone, Copy)]
pub(super) struct Planes<'a> {
    pub(super) values: &'a [f32],
    /// Empty where none are carried.
    pub(super) words: &'a [u32],
}

impl Source for Planes<'_> {
    fn values<'s>(&'s self, _: &'s mut [Vec<f32>; 2]) -> &'s [f32] {
        self.values
    }

    fn words(&self) -> &[u32] {
        self.words
    }
}

/// The least sum of a sample and its squared offset.
#[derive(Clone, Copy)]
pub(super) struct Least;

/// The same, with the word of the least: a [`super::feature::Feature`], to which the way along this axis is added.
#[derive(Clone, Copy)]
pub(super) struct LeastWord {
    pub(super) axis: usize,
}

/// The least sum of a sample and its squared offset less half a cell; where no brick is, samples are 0.
#[derive(Clone, Copy)]
pub(super) struct LeastBox;

/// Panels of rows of a run of bricks.
#[derive(Default)]
pub(super) struct RowLines {
    values: Vec<Row>,
    words: Vec<Words>,
    /// Of a source.
    brick: [Vec<f32>; 2],
}

impl RowLines {
    fn clear(&mut self, rows: &Rows, length: usize, blank: f32, carries: bool) {
        // Lanes without a line are done at once.
        let blank: Row = std::array::from_fn(|lane| if lane < rows.lines { blank } else { 0.0 });
        self.values.clear();
        self.values.resize(rows.panels * length, blank);
        self.words.resize(if carries { rows.panels * length } else { 0 }, [0; LANES]);
    }

    fn put(&mut self, source: &impl Source, first: usize, rows: &Rows, length: usize) {
        let Self { values, words, brick } = self;
        rows.spread(source.words(), first, length, words);
        rows.spread(source.values(brick), first, length, values);
    }

    fn panels(&self, length: usize) -> Panels<'_> {
        Panels { values: &self.values, words: &self.words, rows: length }
    }
}

/// A search over [`RowLines`].
macro_rules! search_rows {
    ($kind:ty, $carries:expr, $blank:expr, $margin:expr, |$kind_:ident, $f:ident, $first:ident, $reach:ident, $found:ident| $find:expr) => {
        impl<S: Source, const D: usize> Search<S, D> for $kind {
            type Line = RowLines;
            const WORDS: bool = $carries;
            const MARGIN: i32 = $margin;

            fn clear(&self, line: &mut RowLines, rows: &Rows, length: usize) {
                line.clear(rows, length, $blank, $carries);
            }

            fn put(&self, line: &mut RowLines, brick: &S, first: usize, rows: &Rows, length: usize) {
                line.put(brick, first, rows, length);
            }

            fn find(
                &self,
                line: &mut RowLines,
                length: usize,
                $first: usize,
                $reach: usize,
                $found: &mut Found,
            ) {
                let ($kind_, $f) = (self, line.panels(length));
                $find
            }
        }
    };
}
search_rows!(Least, false, f32::INFINITY, 0, |_kind, f, first, reach, found| min_plus(
    f, first, reach, found
));
search_rows!(LeastBox, false, 0.0, 1, |_kind, f, first, reach, found| min_plus_boxes(f, first, reach, found));
search_rows!(LeastWord, true, f32::INFINITY, 0, |kind, f, first, reach, found| {
    min_plus_words(f, first, reach, 10 * kind.axis as u32, found);
});

/// Position of cell `i` of a brick in the layout of a pass along `axis`.
pub(super) fn layout<const D: usize>(axis: usize, i: usize) -> usize {
    let digit = |k: usize| (i >> (3 * k)) & 7;
    let others = (0..D).filter(|&k| k != axis);
    others.chain([axis]).enumerate().map(|(place, k)| digit(k) << (3 * place)).sum()
}

/// What a pass does: along which axis, what is read, and what is to be filled.
pub(super) struct Pass<'a, B, const D: usize> {
    pub(super) axis: usize,
    /// Sorted by lines along the axis, as are the outputs.
    pub(super) inputs: &'a [Input<B, D>],
    pub(super) outputs: &'a [Reach<D>],
    /// What is known of each output already, in the layout of this pass; empty: of none.
    pub(super) known: &'a [Option<Planes<'a>>],
    /// Axis of the layout of the outputs.
    pub(super) to: usize,
}

impl<B: Sync, const D: usize> Pass<'_, B, D> {
    /// Fills the bricks of `outputs`: for every cell the least that `search` finds on its line as far as the brick's budget
    /// reaches, infinity where there is nothing. In the layout `to`; `filled` has the last word on each, and its place
    /// among the outputs.
    ///
    /// `words` is empty where none are carried. Lines are shared out to all cores with the feature `parallel`; every value
    /// is computed by itself.
    pub(super) fn run<S: Search<B, D>>(
        &self,
        search: S,
        values: &mut [f32],
        words: &mut [u32],
        filled: impl Fn(usize, BlockKey<D>, &mut [f32], &mut [u32]) + Sync + Send,
    ) {
        let rows = Rows::of::<D>(self.axis, self.to);
        let cells = block_cells::<D>();
        let mut tasks = Vec::new();
        let (mut values, mut words) = (values, words);
        for line in self.lines() {
            let count = line.outputs.len() * cells;
            let (here, behind) = std::mem::take(&mut values).split_at_mut(count);
            let (words_here, words_behind) =
                std::mem::take(&mut words).split_at_mut(if S::WORDS { count } else { 0 });
            (values, words) = (behind, words_behind);
            tasks.push((line, here, words_here));
        }
        parallel::for_each(tasks.into_iter(), Scratch::default, |(line, values, words), scratch| {
            line.solve(&search, &rows, scratch, (values, words));
            let mut words = words.chunks_exact_mut(cells);
            for (n, (output, values)) in line.outputs.iter().zip(values.chunks_exact_mut(cells)).enumerate() {
                filled(line.first + n, output.key, values, words.next().unwrap_or_default());
            }
        });
    }

    /// [`Pass::run`] that holds no more than a line of each thread at a time: what `make` makes of every output.
    pub(super) fn run_each<S: Search<B, D>, R: Send>(
        &self,
        search: S,
        make: impl Fn(BlockKey<D>, &mut [f32], &mut [u32]) -> R + Sync + Send,
    ) -> Vec<R> {
        let rows = Rows::of::<D>(self.axis, self.to);
        let cells = block_cells::<D>();
        let lines: Vec<_> = self.lines().collect();
        let mut made: Vec<Vec<R>> = lines.iter().map(|line| Vec::with_capacity(line.outputs.len())).collect();
        let scratch = || (Scratch::default(), Vec::new(), Vec::new());
        parallel::for_each(lines.into_iter().zip(&mut made), scratch, |(line, made), scratch| {
            let (scratch, values, words) = scratch;
            let count = line.outputs.len() * cells;
            values.resize(count, 0.0);
            words.resize(if S::WORDS { count } else { 0 }, 0);
            line.solve(&search, &rows, scratch, (&mut *values, &mut *words));
            let mut words = words.chunks_exact_mut(cells);
            for (output, values) in line.outputs.iter().zip(values.chunks_exact_mut(cells)) {
                made.push(make(output.key, values, words.next().unwrap_or_default()));
            }
        });
        made.into_iter().flatten().collect()
    }

    fn lines(&self) -> impl Iterator<Item = Line<'_, B, D>> {
        let mut first = 0;
        lines(self.inputs, self.outputs, self.axis).map(move |(inputs, outputs)| {
            let here = first..first + outputs.len();
            let known = self.known.get(here.clone()).unwrap_or_default();
            first = here.end;
            Line { axis: self.axis, first: here.start, inputs, outputs, known }
        })
    }
}

/// How rows of lines lie in a brick.
pub(super) struct Rows {
    /// Lines through a brick.
    pub(super) lines: usize,
    pub(super) panels: usize,
    /// Where each cell of the outputs' layout is among the found rows; of chunks of eight, unless they are torn
    /// apart.
    places: Vec<u16>,
    way: Way,
}

/// How eight cells that follow each other in the outputs lie among the found rows.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    /// Side by side in a row.
    Row,
    /// One below the other, in a lane.
    Lane,
    /// In lanes of several panels.
    Torn,
}

impl Rows {
    fn of<const D: usize>(axis: usize, to: usize) -> Self {
        let cells = block_cells::<D>();
        let lines = cells / BLOCK_EDGE;
        let mut places = vec![0; cells];
        for i in 0..cells {
            let from = layout::<D>(axis, i);
            let (row, lane) = (from / lines, from % lines);
            places[layout::<D>(to, i)] = ((lane / LANES * BLOCK_EDGE + row) * LANES + lane % LANES) as u16;
        }
        let way = match places[1].wrapping_sub(places[0]) {
            1 => Way::Row,
            step if usize::from(step) == LANES => Way::Lane,
            _ => Way::Torn,
        };
        if way != Way::Torn {
            places = places.into_iter().step_by(BLOCK_EDGE).collect();
        }
        Self { lines, panels: lines.div_ceil(LANES), places, way }
    }

    /// A brick's plane from its found rows.
    fn collect<T: Copy>(&self, found: &[[T; LANES]], plane: &mut [T]) {
        let flat = found.as_flattened();
        let (chunks, _) = plane.as_chunks_mut::<BLOCK_EDGE>();
        match self.way {
            Way::Row => {
                for (chunk, &place) in chunks.iter_mut().zip(&self.places) {
                    chunk.copy_from_slice(&flat[place as usize..][..BLOCK_EDGE]);
                }
            }
            Way::Lane => turn(found, &self.places, chunks),
            Way::Torn => {
                for (value, &place) in plane.iter_mut().zip(&self.places) {
                    *value = flat[place as usize];
                }
            }
        }
    }

    /// Puts a brick's plane into panels of `length` rows, from row `first` on.
    fn spread<T: Copy>(&self, plane: &[T], first: usize, length: usize, to: &mut [[T; LANES]]) {
        for (r, row) in plane.chunks_exact(self.lines).enumerate() {
            let (whole, rest) = row.as_chunks::<LANES>();
            for (panel, lanes) in whole.iter().enumerate() {
                to[panel * length + first + r] = *lanes;
            }
            // In the plane eight lines go through a brick.
            to[(self.panels - 1) * length + first + r][..rest.len()].copy_from_slice(rest);
        }
    }
}

/// Chunks of eight from the lanes in which they stand.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn turn<T: Copy>(found: &[[T; LANES]], places: &[u16], chunks: &mut [[T; BLOCK_EDGE]]) {
    let (panels, _) = found.as_chunks::<BLOCK_EDGE>();
    for (chunk, &place) in chunks.iter_mut().zip(places) {
        let rows = &panels[place as usize / (BLOCK_EDGE * LANES)];
        let lane = place as usize % LANES;
        *chunk = std::array::from_fn(|r| rows[r][lane]);
    }
}

/// One line of bricks.
struct Line<'a, B, const D: usize> {
    axis: usize,
    /// Place of the first output among all.
    first: usize,
    inputs: &'a [Input<B, D>],
    outputs: &'a [Reach<D>],
    known: &'a [Option<Planes<'a>>],
}

/// Values and words of a line's outputs.
type Filled<'a> = (&'a mut [f32], &'a mut [u32]);

struct Scratch<L> {
    line: L,
    found: Found,
}

impl<L: Default> Default for Scratch<L> {
    fn default() -> Self {
        Self { line: L::default(), found: Found::default() }
    }
}

impl<B, const D: usize> Line<'_, B, D> {
    fn solve<S: Search<B, D>>(
        &self,
        search: &S,
        rows: &Rows,
        scratch: &mut Scratch<S::Line>,
        (values, words): Filled<'_>,
    ) {
        let axis = self.axis;
        let at = |key: &BlockKey<D>| key.0[axis];
        let far = self.outputs.iter().map(|o| bricks_within(o.budget)).max().unwrap_or(0);
        let mut done = 0;
        // Runs of inputs that no output sees two of: lines may be long and nearly empty.
        for run in self.inputs.chunk_by(|a, b| at(&b.key) - at(&a.key) <= 2 * far) {
            let (first, last) = (at(&run[0].key), at(&run[run.len() - 1].key));
            let from = self.outputs.partition_point(|o| at(&o.key) < first - far);
            let to = self.outputs.partition_point(|o| at(&o.key) <= last + far);
            self.leave(done..from, rows, scratch, (&mut *values, &mut *words));
            done = to;
            let outputs = &self.outputs[from..to];
            let (Some(lowest), Some(highest)) = (outputs.first(), outputs.last()) else { continue };
            let start = first.min(at(&lowest.key)) - S::MARGIN;
            let length = (last.max(at(&highest.key)) - start + 1 + S::MARGIN) as usize * BLOCK_EDGE;
            search.clear(&mut scratch.line, rows, length);
            for input in run {
                let row = (at(&input.key) - start) as usize * BLOCK_EDGE;
                search.put(&mut scratch.line, &input.source, row, rows, length);
            }
            for (n, output) in outputs.iter().enumerate() {
                let reach = output.budget.sqrt() as usize;
                let row = (at(&output.key) - start) as usize * BLOCK_EDGE;
                self.begin(from + n, rows, &mut scratch.found, S::WORDS);
                search.find(&mut scratch.line, length, row, reach, &mut scratch.found);
                Self::end(from + n, rows, &scratch.found, (&mut *values, &mut *words));
            }
        }
        self.leave(done..self.outputs.len(), rows, scratch, (values, words));
    }

    /// Outputs that no input reaches.
    fn leave<L>(
        &self,
        outputs: std::ops::Range<usize>,
        rows: &Rows,
        scratch: &mut Scratch<L>,
        (values, words): Filled<'_>,
    ) {
        for n in outputs {
            self.begin(n, rows, &mut scratch.found, !words.is_empty());
            Self::end(n, rows, &scratch.found, (&mut *values, &mut *words));
        }
    }

    fn begin(&self, n: usize, rows: &Rows, found: &mut Found, carries: bool) {
        let blank: Row = std::array::from_fn(|lane| if lane < rows.lines { f32::INFINITY } else { 0.0 });
        found.values.clear();
        found.values.resize(rows.panels * BLOCK_EDGE, blank);
        found.words.resize(if carries { rows.panels * BLOCK_EDGE } else { 0 }, [0; LANES]);
        if let Some(Some(known)) = self.known.get(n) {
            rows.spread(known.values, 0, BLOCK_EDGE, &mut found.values);
            rows.spread(known.words, 0, BLOCK_EDGE, &mut found.words);
        }
    }

    fn end(n: usize, rows: &Rows, found: &Found, (values, words): Filled<'_>) {
        let cells = n * block_cells::<D>()..(n + 1) * block_cells::<D>();
        rows.collect(&found.values, &mut values[cells.clone()]);
        if let Some(words) = words.get_mut(cells) {
            rows.collect(&found.words, words);
        }
    }
}
