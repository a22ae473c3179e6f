//! The accurate transform: squared distances to the crossings of the lattice's edges, and which is the nearest.

use super::crossings::BrickCrossings;
use super::level::{Input, Level, inputs, reachable};
use super::pass::{LeastWord, Pass, Planes, for_each};
use super::reach::{Reach, line_order, needed};
use super::roots::Roots;
use crate::geom::BlockKey;

/// A brick with crossings.
pub(super) type Edges<'a, const D: usize> = Input<&'a BrickCrossings<D>, D>;

/// `min over crossings w of |q - w|^2 + h_w` (squared cells) for all cells of the bricks of `outputs`, and the edge that
/// it comes from, as a [`super::feature::Feature`]: exact wherever it is not beyond the brick's budget, too large or
/// infinite there, and then the edge means nothing. In the order of lines along the last axis, cells x fastest; `solved`
/// has the last word on each, and its place in that order. `edges` ascending.
///
/// Crossings on edges along an axis enter the pass along it as parabolas with real-valued roots, and the passes along the
/// other axes are sums with squares of whole numbers: the separable transform of *(Felzenszwalb & Huttenlocher 2012)* once
/// per axis. With `g_a` the first pass and `M_a` a further one, `min(M_y g_x, M_x g_y)` in the plane and
/// `min(M_y M_x g_z, M_z min(M_y g_x, M_x g_y))` in space, where one pass serves two axes.
///
/// No value depends on the budgets, on which other bricks are asked for, or on threads; of crossings at the same distance
/// the same one is named.
pub(super) fn edge_distances<const D: usize>(
    edges: &[Edges<'_, D>],
    mut outputs: Vec<Reach<D>>,
    solved: impl Fn(usize, BlockKey<D>, &mut [f32], &mut [u32]) + Sync + Send,
) -> Level<D> {
    sort(&mut outputs, D - 1);
    if D == 2 {
        return in_plane(edges, outputs, true, solved);
    }
    let across = sorted(&outputs, 1);
    let before_y = sorted(&needed(&across, 1), 0);
    let roots_z = first_pass(2, edges, needed(&before_y, 0), 0);
    let roots_z = inputs([&roots_z], 0);
    let before_z = sorted(&needed(&outputs, 2), 1);
    // Slab by slab of the last axis, so that only what the last pass reads is held for the whole map.
    let slabs: Vec<i32> = before_z.chunk_by(|a, b| a.key.0[2] == b.key.0[2]).map(|s| s[0].key.0[2]).collect();
    let mut levels: Vec<[Level<D>; 2]> = slabs.iter().map(|_| Default::default()).collect();
    for_each(
        slabs.into_iter().zip(&mut levels).collect(),
        || (),
        |(z, [along_z, in_slab]), ()| {
            *along_z = {
                let here = slab(&roots_z, z, |i| &i.key);
                let along_x = further(0, here, slab(&before_y, z, |r| &r.key), 1);
                further(1, &inputs([&along_x], 1), slab(&across, z, |r| &r.key), 2)
            };
            let edges = slab(edges, z, |i| &i.key);
            *in_slab = in_plane(edges, slab(&before_z, z, |r| &r.key).to_vec(), false, |_, _, _, _| {});
        },
    );
    let known = known(&outputs, levels.iter().map(|[along_z, _]| along_z), 2);
    let inputs = inputs(levels.iter().map(|[_, in_slab]| in_slab), 2);
    let mut level = Level::default();
    level.hold(&outputs, true);
    let pass = Pass { axis: 2, inputs: &inputs, outputs: &outputs, known: &known, to: 2 };
    pass.run(LeastWord { axis: 2 }, &mut level.values, &mut level.words, solved);
    level
}

/// `min(M_y g_x, M_x g_y)` for bricks sorted by lines along y, of `edges` in the same slabs: in the layout of the last
/// axis, for all of them or for those that are reached.
fn in_plane<const D: usize>(
    edges: &[Edges<'_, D>],
    mut outputs: Vec<Reach<D>>,
    all: bool,
    solved: impl Fn(usize, BlockKey<D>, &mut [f32], &mut [u32]) + Sync + Send,
) -> Level<D> {
    let along = sorted(&outputs, 0);
    let roots_y = first_pass(1, edges, needed(&along, 0), 0);
    let of_y = further(0, &inputs([&roots_y], 0), &along, 1);
    let roots_x = first_pass(0, edges, needed(&outputs, 1), 1);
    let roots_x = inputs([&roots_x], 1);
    let mut found = known(&outputs, [&of_y], 1);
    if !all {
        let mut reached = reachable(&roots_x, &outputs, 1).into_iter().map(|r| r.key).peekable();
        let mut kept = outputs.iter().zip(&found).map(|(output, found)| {
            let reached = reached.next_if_eq(&output.key).is_some();
            reached || found.is_some()
        });
        let kept: Vec<bool> = kept.by_ref().collect();
        let (mut first, mut second) = (kept.iter(), kept.iter());
        outputs.retain(|_| first.next() == Some(&true));
        found.retain(|_| second.next() == Some(&true));
    }
    let mut level = Level::default();
    level.hold(&outputs, true);
    let pass = Pass { axis: 1, inputs: &roots_x, outputs: &outputs, known: &found, to: D - 1 };
    pass.run(LeastWord { axis: 1 }, &mut level.values, &mut level.words, solved);
    level
}

/// The pass with real roots along `axis`, as far as there is something.
fn first_pass<const D: usize>(
    axis: usize,
    edges: &[Edges<'_, D>],
    outputs: Vec<Reach<D>>,
    to: usize,
) -> Level<D> {
    let mut edges = edges.to_vec();
    edges.sort_unstable_by_key(|i| line_order(&i.key, axis));
    // An edge of the brick below ends at the first cell of this one: nearer by a cell than its own cell is.
    let further = outputs.iter().map(|r| Reach { key: r.key, budget: (r.budget.sqrt() + 1.0).powi(2) });
    let outputs = reachable(&edges, &sorted(&further.collect::<Vec<_>>(), axis), axis);
    let mut level = Level::default();
    level.hold(&outputs, true);
    let pass = Pass { axis, inputs: &edges, outputs: &outputs, known: &[], to };
    pass.run(Roots { axis }, &mut level.values, &mut level.words, |_, _, _, _| {});
    level
}

/// A further pass along `axis`, as far as there is something.
fn further<const D: usize>(
    axis: usize,
    inputs: &[Input<Planes<'_>, D>],
    outputs: &[Reach<D>],
    to: usize,
) -> Level<D> {
    let outputs = reachable(inputs, outputs, axis);
    let mut level = Level::default();
    level.hold(&outputs, true);
    let pass = Pass { axis, inputs, outputs: &outputs, known: &[], to };
    pass.run(LeastWord { axis }, &mut level.values, &mut level.words, |_, _, _, _| {});
    level
}

/// What levels hold of each output; outputs sorted by lines along `axis`.
fn known<'a, const D: usize>(
    outputs: &[Reach<D>],
    levels: impl IntoIterator<Item = &'a Level<D>>,
    axis: usize,
) -> Vec<Option<Planes<'a>>> {
    let mut held = inputs(levels, axis).into_iter().peekable();
    outputs.iter().map(|output| held.next_if(|h| h.key == output.key).map(|h| h.source)).collect()
}

fn sort<const D: usize>(bricks: &mut [Reach<D>], axis: usize) {
    bricks.sort_unstable_by_key(|r| line_order(&r.key, axis));
}

fn sorted<const D: usize>(bricks: &[Reach<D>], axis: usize) -> Vec<Reach<D>> {
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
