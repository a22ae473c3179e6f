//! One pass of the separable transform over lines of bricks.

use super::layout::Layout;
use super::min_plus::{Found, LANES, Row};
use super::outputs::{Output, bricks_within};
use super::planes_mut::PlanesMut;
use super::search::{LineSearch, Planes};
use super::stage::{Input, lines};
use crate::geom::{BLOCK_EDGE, BlockKey, block_cells};
use crate::parallel;

/// What a pass does: along which axis, what is read, and what is to be filled.
pub(super) struct Pass<'a, B, const D: usize> {
    pub(super) axis: usize,
    /// Sorted by lines along the axis, as are the outputs.
    pub(super) inputs: &'a [Input<B, D>],
    pub(super) outputs: &'a [Output<D>],
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
    /// Lines are shared out to all cores with the feature `parallel`; every value is computed by itself.
    pub(super) fn run<S: LineSearch<B, D>>(
        &self,
        search: S,
        planes: PlanesMut<'_>,
        filled: impl Fn(BlockKey<D>, &mut [f32]) + Sync + Send,
    ) {
        let layout = Layout::of::<D>(self.axis, self.to);
        let cells = block_cells::<D>();
        let mut tasks = Vec::new();
        let mut behind = planes;
        for line in self.lines() {
            let here;
            (here, behind) = behind.split(line.outputs.len() * cells);
            tasks.push((line, here));
        }
        parallel::for_each(tasks.into_iter(), Scratch::default, |(line, mut planes), scratch| {
            line.solve(&search, &layout, scratch, &mut planes);
            for (output, values) in line.outputs.iter().zip(planes.values.chunks_exact_mut(cells)) {
                filled(output.key, values);
            }
        });
    }

    /// [`Pass::run`] that holds no more than a line of each thread at a time: what `make` makes of every output.
    pub(super) fn run_each<S: LineSearch<B, D>, R: Send>(
        &self,
        search: S,
        make: impl Fn(BlockKey<D>, &mut [f32], &mut [u32]) -> R + Sync + Send,
    ) -> Vec<R> {
        let layout = Layout::of::<D>(self.axis, self.to);
        let cells = block_cells::<D>();
        let lines: Vec<_> = self.lines().collect();
        let mut made: Vec<Vec<R>> = lines.iter().map(|line| Vec::with_capacity(line.outputs.len())).collect();
        let scratch = || (Scratch::default(), Vec::new(), Vec::new());
        parallel::for_each(lines.into_iter().zip(&mut made), scratch, |(line, made), scratch| {
            let (scratch, values, features) = scratch;
            let count = line.outputs.len() * cells;
            values.resize(count, 0.0);
            features.resize(if S::FEATURES { count } else { 0 }, 0);
            let mut planes = PlanesMut { values, features };
            line.solve(&search, &layout, scratch, &mut planes);
            for (n, output) in line.outputs.iter().enumerate() {
                let PlanesMut { values, features } = planes.brick(n, cells);
                made.push(make(output.key, values, features));
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
            Line { axis: self.axis, inputs, outputs, known }
        })
    }
}

/// One line of bricks.
struct Line<'a, B, const D: usize> {
    axis: usize,
    inputs: &'a [Input<B, D>],
    outputs: &'a [Output<D>],
    known: &'a [Option<Planes<'a>>],
}

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
    fn solve<S: LineSearch<B, D>>(
        &self,
        search: &S,
        layout: &Layout,
        scratch: &mut Scratch<S::Line>,
        planes: &mut PlanesMut<'_>,
    ) {
        let Scratch { line, found } = scratch;
        let at = |key: &BlockKey<D>| key.0[self.axis];
        let far = self.outputs.iter().map(|o| bricks_within(o.budget)).max().unwrap_or(0);
        let mut done = 0;
        // Runs of inputs that no output sees two of: lines may be long and nearly empty.
        for run in self.inputs.chunk_by(|a, b| at(&b.key) - at(&a.key) <= 2 * far) {
            let (first, last) = (at(&run[0].key), at(&run[run.len() - 1].key));
            let from = self.outputs.partition_point(|o| at(&o.key) < first - far);
            let to = self.outputs.partition_point(|o| at(&o.key) <= last + far);
            // What no input reaches stays as it begins.
            (done..from).for_each(|n| self.fill(n, layout, found, planes, |_| {}));
            done = to;
            let outputs = &self.outputs[from..to];
            let (Some(lowest), Some(highest)) = (outputs.first(), outputs.last()) else { continue };
            let start = first.min(at(&lowest.key)) - S::MARGIN;
            let length = (last.max(at(&highest.key)) - start + 1 + S::MARGIN) as usize * BLOCK_EDGE;
            let row = |key: &BlockKey<D>| (at(key) - start) as usize * BLOCK_EDGE;
            search.clear(line, layout, length);
            for input in run {
                search.put(line, &input.source, row(&input.key), layout, length);
            }
            for (n, output) in outputs.iter().enumerate() {
                let reach = output.budget.sqrt() as usize;
                self.fill(from + n, layout, found, planes, |found| {
                    search.find(line, length, row(&output.key), reach, found);
                });
            }
        }
        (done..self.outputs.len()).for_each(|n| self.fill(n, layout, found, planes, |_| {}));
    }

    /// Fills output `n` with what is known of it, and with what `find` finds.
    #[inline(always)]
    fn fill(
        &self,
        n: usize,
        layout: &Layout,
        found: &mut Found,
        planes: &mut PlanesMut<'_>,
        find: impl FnOnce(&mut Found),
    ) {
        let carries = !planes.features.is_empty();
        let blank: Row = std::array::from_fn(|lane| if lane < layout.lines { f32::INFINITY } else { 0.0 });
        found.values.clear();
        found.values.resize(layout.panels * BLOCK_EDGE, blank);
        found.features.resize(if carries { layout.panels * BLOCK_EDGE } else { 0 }, [0; LANES]);
        if let Some(Some(known)) = self.known.get(n) {
            layout.spread(known.values, 0, BLOCK_EDGE, &mut found.values);
            layout.spread(known.features, 0, BLOCK_EDGE, &mut found.features);
        }
        find(found);
        let PlanesMut { values, features } = planes.brick(n, block_cells::<D>());
        layout.collect(&found.values, values);
        if carries {
            layout.collect(&found.features, features);
        }
    }
}
