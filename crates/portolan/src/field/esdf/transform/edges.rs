//! The accurate transform: squared distances to the crossings of the lattice's edges, and which is the nearest.

use super::outputs::{Output, line_order, needed};
use super::pass::Pass;
use super::roots::FromCrossings;
use super::search::{FromFeatures, Planes};
use super::stage::{Input, Stage, inputs, reachable};
use crate::field::esdf::surface::BrickCrossings;
use crate::geom::BlockKey;
use crate::parallel;

/// A brick with crossings.
pub(crate) type Edges<'a, const D: usize> = Input<&'a BrickCrossings<D>, D>;

/// `min over crossings w of |q - w|^2 + h_w` (squared cells) for all cells of the bricks of `outputs`, and the edge that
/// it comes from, as a [`super::feature::Feature`]: exact wherever it is not beyond the brick's budget, too large or
/// infinite there, and then the edge means nothing. What `solved` makes of each brick's planes, cells x fastest; bricks in
/// the order of lines along the last axis. `edges` ascending.
///
/// Crossings on edges along an axis enter the pass along it as parabolas with real-valued roots, and the passes along the
/// other axes are sums with squares of whole numbers: the separable transform of *(Felzenszwalb & Huttenlocher 2012)* once
/// per axis. With `g_a` the first pass and `M_a` a further one, `min(M_y g_x, M_x g_y)` in 2-D and
/// `min(M_x M_y g_z, M_z min(M_y g_x, M_x g_y))` in 3-D, where one pass serves two axes.
///
/// No value depends on the budgets, on which other bricks are asked for, or on threads; of crossings at the same distance
/// the same one is named.
pub(crate) fn edge_distances<R: Send, const D: usize>(
    edges: &[Edges<'_, D>],
    mut outputs: Vec<Output<D>>,
    solved: impl Fn(BlockKey<D>, &mut [f32], &mut [u32]) -> R + Sync + Send,
) -> Vec<(BlockKey<D>, R)> {
    sort(&mut outputs, D - 1);
    let keys = outputs.iter().map(|r| r.key).collect::<Vec<_>>();
    let found = if D == 2 {
        let mut spare = Spare::default();
        let pass = XyPasses::of(edges, outputs, true, &mut spare);
        pass.finish(|pass, search| pass.run_each(search, solved))
    } else {
        solve_3d(edges, &outputs, solved)
    };
    keys.into_iter().zip(found).collect()
}

/// Levels whose memory is used again.
#[derive(Default)]
struct Spare<const D: usize>([Stage<D>; 2]);

fn solve_3d<R: Send, const D: usize>(
    edges: &[Edges<'_, D>],
    outputs: &[Output<D>],
    solved: impl Fn(BlockKey<D>, &mut [f32], &mut [u32]) -> R + Sync + Send,
) -> Vec<R> {
    let along = sorted(outputs, 0);
    let before_x = sorted(&needed(&along, 0), 1);
    let mut roots_z = Stage::default();
    first_pass(2, edges, needed(&before_x, 1), 1, &mut roots_z);
    let roots_z = inputs([&roots_z], 1);
    let before_z = sorted(&needed(outputs, 2), 1);
    // Slab by slab of the last axis, so that only what the last pass reads is held for the whole map.
    let slabs: Vec<i32> = before_z.chunk_by(|a, b| a.key.0[2] == b.key.0[2]).map(|s| s[0].key.0[2]).collect();
    let mut stages: Vec<[Stage<D>; 2]> = slabs.iter().map(|_| Default::default()).collect();
    parallel::for_each(
        slabs.into_iter().zip(&mut stages),
        Spare::default,
        |(z, [along_z, in_slab]), spare| {
            let here = slab(&roots_z, z, |i| &i.key);
            let along_y = &mut spare.0[0];
            further(1, here, slab(&before_x, z, |r| &r.key), 0, along_y);
            further(0, &inputs([&*along_y], 0), slab(&along, z, |r| &r.key), 2, along_z);
            let edges = slab(edges, z, |i| &i.key);
            let pass = XyPasses::of(edges, slab(&before_z, z, |r| &r.key).to_vec(), false, spare);
            in_slab.hold(&pass.outputs, true);
            pass.finish(|pass, search| {
                pass.run(search, in_slab.planes_mut(), |_, _| {});
            });
        },
    );
    let known = known(outputs, stages.iter().map(|[along_z, _]| along_z), 2);
    let inputs = inputs(stages.iter().map(|[_, in_slab]| in_slab), 2);
    let pass = Pass { axis: 2, inputs: &inputs, outputs, known: &known, to: 2 };
    pass.run_each(FromFeatures { axis: 2 }, solved)
}

/// `min(M_y g_x, M_x g_y)`, ready for its last pass.
struct XyPasses<'s, const D: usize> {
    /// `M_x g_y`.
    of_y: &'s Stage<D>,
    /// `g_x`.
    roots_x: &'s Stage<D>,
    /// Sorted by lines along y.
    outputs: Vec<Output<D>>,
}

impl<'s, const D: usize> XyPasses<'s, D> {
    /// For outputs sorted by lines along y, of `edges` in the same slabs: for all of them, or for those that are reached.
    fn of(edges: &[Edges<'_, D>], mut outputs: Vec<Output<D>>, all: bool, spare: &'s mut Spare<D>) -> Self {
        let [of_y, roots] = &mut spare.0;
        let along = sorted(&outputs, 0);
        first_pass(1, edges, needed(&along, 0), 0, roots);
        further(0, &inputs([&*roots], 0), &along, 1, of_y);
        first_pass(0, edges, needed(&outputs, 1), 1, roots);
        let (of_y, roots_x) = (&*of_y, &*roots);
        if !all {
            let mut reached = reachable(&inputs([roots_x], 1), &outputs, 1).into_iter().peekable();
            let mut found = known(&outputs, [of_y], 1).into_iter();
            outputs.retain(|output| {
                let reached = reached.next_if_eq(output).is_some();
                reached | found.next().flatten().is_some()
            });
        }
        Self { of_y, roots_x, outputs }
    }

    /// The last pass, in the layout of the last axis.
    fn finish<T>(&self, run: impl FnOnce(Pass<'_, Planes<'_>, D>, FromFeatures) -> T) -> T {
        let known = known(&self.outputs, [self.of_y], 1);
        let inputs = inputs([self.roots_x], 1);
        let pass = Pass { axis: 1, inputs: &inputs, outputs: &self.outputs, known: &known, to: D - 1 };
        run(pass, FromFeatures { axis: 1 })
    }
}

/// The pass with real roots along `axis`, as far as there is something.
fn first_pass<const D: usize>(
    axis: usize,
    edges: &[Edges<'_, D>],
    outputs: Vec<Output<D>>,
    to: usize,
    stage: &mut Stage<D>,
) {
    let has_some =
        |i: &&Edges<'_, D>| i.source.height[axis].iter().fold(false, |any, h| any | (*h < f32::INFINITY));
    let mut edges: Vec<_> = edges.iter().filter(has_some).copied().collect();
    edges.sort_unstable_by_key(|i| line_order(&i.key, axis));
    // An edge of the brick below ends at the first cell of this one: nearer by a cell than its own cell is.
    let further = outputs.iter().map(|r| Output { key: r.key, budget: (r.budget.sqrt() + 1.0).powi(2) });
    let outputs = reachable(&edges, &sorted(&further.collect::<Vec<_>>(), axis), axis);
    stage.hold(&outputs, true);
    let pass = Pass { axis, inputs: &edges, outputs: &outputs, known: &[], to };
    pass.run(FromCrossings { axis }, stage.planes_mut(), |_, _| {});
}

/// A further pass along `axis`, as far as there is something.
fn further<const D: usize>(
    axis: usize,
    inputs: &[Input<Planes<'_>, D>],
    outputs: &[Output<D>],
    to: usize,
    stage: &mut Stage<D>,
) {
    let outputs = reachable(inputs, outputs, axis);
    stage.hold(&outputs, true);
    let pass = Pass { axis, inputs, outputs: &outputs, known: &[], to };
    pass.run(FromFeatures { axis }, stage.planes_mut(), |_, _| {});
}

/// What stages hold of each output; outputs sorted by lines along `axis`.
fn known<'a, const D: usize>(
    outputs: &[Output<D>],
    stages: impl IntoIterator<Item = &'a Stage<D>>,
    axis: usize,
) -> Vec<Option<Planes<'a>>> {
    let mut held = inputs(stages, axis).into_iter().peekable();
    outputs.iter().map(|output| held.next_if(|h| h.key == output.key).map(|h| h.source)).collect()
}

fn sort<const D: usize>(bricks: &mut [Output<D>], axis: usize) {
    bricks.sort_unstable_by_key(|r| line_order(&r.key, axis));
}

fn sorted<const D: usize>(bricks: &[Output<D>], axis: usize) -> Vec<Output<D>> {
    let mut bricks = bricks.to_vec();
    sort(&mut bricks, axis);
    bricks
}

/// Those of bricks in slabs of the last axis that are in one.
fn slab<T, const D: usize>(bricks: &[T], z: i32, key: impl Fn(&T) -> &BlockKey<D>) -> &[T] {
    let from = bricks.partition_point(|b| key(b).0[D - 1] < z);
    let to = bricks.partition_point(|b| key(b).0[D - 1] <= z);
    &bricks[from..to]
}

#[cfg(test)]
#[path = "edges_tests.rs"]
mod tests;
