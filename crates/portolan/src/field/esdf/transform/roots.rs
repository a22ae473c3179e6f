//! The first pass of the accurate transform: the nearest crossing along one axis.

use super::feature::Feature;
use super::layout::{Layout, layout};
use super::min_plus::{Found, LANES, Row, exceeds};
use super::search::LineSearch;
use crate::field::esdf::surface::BrickCrossings;
use crate::geom::{BLOCK_EDGE, block_cells};
use multiversion::multiversion;

/// A row of a panel in which some edge has a crossing.
#[derive(Clone, Copy)]
struct Root {
    row: i32,
    place: Row,
    /// Infinite in lanes without one.
    height: Row,
}

/// The rows with a crossing of each panel, ascending. Rows without are not looked at at all.
#[derive(Default)]
pub(super) struct CrossingLines {
    panels: Vec<Vec<Root>>,
    place: Vec<f32>,
    height: Vec<f32>,
}

/// `g(q) = min over crossings of the line of (i + u - q)^2 + h`, with the edge as a [`Feature`].
#[derive(Clone, Copy)]
pub(super) struct FromCrossings {
    pub(super) axis: usize,
}

impl<'a, const D: usize> LineSearch<&'a BrickCrossings<D>, D> for FromCrossings {
    type Line = CrossingLines;
    const FEATURES: bool = true;

    fn clear(&self, line: &mut CrossingLines, rows: &Layout, _: usize) {
        line.panels.resize_with(rows.panels, Vec::new);
        line.panels.iter_mut().for_each(Vec::clear);
    }

    fn put(
        &self,
        line: &mut CrossingLines,
        source: &&'a BrickCrossings<D>,
        first: usize,
        rows: &Layout,
        _: usize,
    ) {
        let CrossingLines { panels, place, height } = line;
        let (mut places, mut heights) = (&*source.place[self.axis], &*source.height[self.axis]);
        if self.axis != D - 1 {
            place.resize(block_cells::<D>(), 0.0);
            height.resize(block_cells::<D>(), 0.0);
            for i in 0..block_cells::<D>() {
                let to = layout::<D>(self.axis, i);
                (place[to], height[to]) = (places[i], heights[i]);
            }
            (places, heights) = (place, height);
        }
        for r in 0..BLOCK_EDGE {
            for (panel, list) in panels.iter_mut().enumerate() {
                let from = r * rows.lines + panel * LANES;
                let to = (from + LANES).min((r + 1) * rows.lines);
                if heights[from..to].iter().all(|h| *h == f32::INFINITY) {
                    continue;
                }
                let mut root =
                    Root { row: (first + r) as i32, place: [0.0; LANES], height: [f32::INFINITY; LANES] };
                root.place[..to - from].copy_from_slice(&places[from..to]);
                root.height[..to - from].copy_from_slice(&heights[from..to]);
                list.push(root);
            }
        }
    }

    fn find(&self, line: &mut CrossingLines, _: usize, first: usize, reach: usize, found: &mut Found) {
        let feature = Feature::new::<D>(self.axis, [0; D]).0;
        let values = found.values.chunks_exact_mut(BLOCK_EDGE);
        let out = values.zip(found.features.chunks_exact_mut(BLOCK_EDGE));
        for (list, (values, features)) in line.panels.iter().zip(out) {
            for r in 0..BLOCK_EDGE {
                let mut at = [0; LANES];
                nearest(list, (first + r) as i32, reach as i32, &mut values[r], &mut at);
                for (to, step) in features[r].iter_mut().zip(at) {
                    *to = feature.wrapping_add(Feature::step(self.axis, step));
                }
            }
        }
    }
}

/// The least of a row's crossings, and how many rows further its edge begins. Looks at pairs of edges that begin `j`
/// rows above and `j + 1` below, none of which costs less than `j^2`: exact for `j <= reach`, by the same order whatever
/// the reach is, and done as soon as no lane exceeds that.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn nearest(list: &[Root], q: i32, reach: i32, best: &mut Row, at: &mut [i32; LANES]) {
    let split = list.partition_point(|root| root.row < q);
    let (mut below, mut above) = list.split_at(split);
    let mut least = *best;
    let mut steps = *at;
    loop {
        let up = above.first().map_or(i32::MAX, |root| root.row - q);
        let down = below.last().map_or(i32::MAX, |root| q - 1 - root.row);
        let j = up.min(down);
        if j > reach || !exceeds(&least, (j * j) as f32) {
            break;
        }
        let root = if up <= down {
            let [root, rest @ ..] = above else { break };
            above = rest;
            root
        } else {
            let [rest @ .., root] = below else { break };
            below = rest;
            root
        };
        let step = root.row - q;
        let from = step as f32;
        for i in 0..LANES {
            let d = from + root.place[i];
            let sum = d * d + root.height[i];
            let less = sum < least[i];
            least[i] = if less { sum } else { least[i] };
            steps[i] = if less { step } else { steps[i] };
        }
    }
    *best = least;
    *at = steps;
}
