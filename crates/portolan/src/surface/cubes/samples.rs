//! The nodes of the cubes of a brick: from bricks of a store, or from a dense array.

use super::vertex::MARGIN;
use crate::cell::{Color, ColorBrick, DistanceBrick};

/// The nodes around a brick. Node (0, 0, 0) is its lowest one; indices are -1 to 9 along each axis.
pub(super) trait Samples {
    /// Value at an observed node; unspecified elsewhere.
    fn value(&self, node: [i32; 3]) -> f32;

    /// Value at a node; `None` where unobserved.
    fn observed(&self, node: [i32; 3]) -> Option<f32>;

    /// Color at a node; `None` where unobserved.
    fn color(&self, node: [i32; 3]) -> Option<Color>;

    /// Gradient of the field per cell at an observed node: central differences, one-sided where only one neighbor along an
    /// axis was observed, 0 where none was.
    fn gradient(&self, node: [i32; 3]) -> [f32; 3] {
        careful_gradient(self, node)
    }

    /// Least distance of vertices from nodes (cells).
    #[inline(always)]
    fn margin(&self) -> f32 {
        MARGIN
    }

    /// The cubes (by their lowest node, x fastest) of a layer of the brick that may have surface.
    #[inline(always)]
    fn cubes(&self, _layer: usize) -> u64 {
        u64::MAX
    }

    /// The difference of the largest and the smallest sample of a cube; `None` where it has no surface, or is none of a dense
    /// array.
    fn cube_range(&self, _lowest: [i32; 3]) -> Option<f32> {
        None
    }

    /// The largest range of the cubes with surface around the edge that starts at `node`.
    fn range(&self, _node: [i32; 3], _axis: usize) -> f32 {
        0.0
    }
}

/// [`Samples::gradient`] where any node may be unobserved.
fn careful_gradient(samples: &(impl Samples + ?Sized), node: [i32; 3]) -> [f32; 3] {
    let here = samples.value(node);
    let mut gradient = [0.0; 3];
    for k in 0..3 {
        let (mut below, mut above) = (node, node);
        below[k] -= 1;
        above[k] += 1;
        gradient[k] = match (samples.observed(below), samples.observed(above)) {
            (Some(b), Some(a)) => 0.5 * (a - b),
            (Some(b), None) => here - b,
            (None, Some(a)) => a - here,
            (None, None) => 0.0,
        };
    }
    gradient
}

/// A brick and the 26 around it, x fastest; empty slices where missing or not needed.
pub(super) struct BrickSamples<'a> {
    distances: [&'a [f32]; 27],
    weights: [&'a [f32]; 27],
    colors: [&'a [[u16; 4]]; 27],
    threshold: f32,
}

/// The brick itself in the order of [`BrickSamples`].
pub(super) const MIDDLE: usize = 13;

/// The least weight of an observed cell: positive, and at least `min_weight`.
pub(super) fn threshold(min_weight: f32) -> f32 {
    const SMALLEST: f32 = f32::from_bits(1);
    if min_weight <= 0.0 { SMALLEST } else { min_weight }
}

impl<'a> BrickSamples<'a> {
    /// Cells with a weight of at least `threshold` are observed.
    pub(super) fn new(threshold: f32) -> Self {
        Self { distances: [&[]; 27], weights: [&[]; 27], colors: [&[]; 27], threshold }
    }

    /// Puts the bricks in place.
    #[inline]
    pub(super) fn set(&mut self, i: usize, brick: Option<&'a DistanceBrick>, color: Option<&'a ColorBrick>) {
        self.distances[i] = brick.map_or(&[], DistanceBrick::distances);
        self.weights[i] = brick.map_or(&[], DistanceBrick::weights);
        self.colors[i] = color.map_or(&[], ColorBrick::words);
    }

    /// The brick that holds a node, and the node's place in it.
    #[inline(always)]
    fn place([x, y, z]: [i32; 3]) -> (usize, usize) {
        let brick = (((x + 8) >> 3) + 3 * ((y + 8) >> 3) + 9 * ((z + 8) >> 3)) as usize;
        (brick, ((x & 7) | (y & 7) << 3 | (z & 7) << 6) as usize)
    }
}

impl Samples for BrickSamples<'_> {
    #[inline(always)]
    fn value(&self, node: [i32; 3]) -> f32 {
        let (brick, i) = Self::place(node);
        self.distances[brick].get(i).copied().unwrap_or(0.0)
    }

    #[inline]
    fn observed(&self, node: [i32; 3]) -> Option<f32> {
        let (brick, i) = Self::place(node);
        let weight = *self.weights[brick].get(i)?;
        (weight >= self.threshold).then(|| self.distances[brick][i])
    }

    /// Inside one brick the neighbors are at fixed distances in memory.
    #[inline]
    fn gradient(&self, node: [i32; 3]) -> [f32; 3] {
        let (brick, i) = Self::place(node);
        let inner = node[0] & 7 != 0 && node[0] & 7 != 7 && (72..440).contains(&i);
        if inner && node[1] & 7 != 0 && node[1] & 7 != 7 {
            let (from, d, w) = (i - 64, self.distances[brick], self.weights[brick]);
            if let (Some(d), Some(w)) = (d.get(from..from + 129), w.get(from..from + 129)) {
                let at = [(63, 65), (56, 72), (0, 128)];
                if at.iter().all(|&(b, a)| w[b] >= self.threshold && w[a] >= self.threshold) {
                    return at.map(|(b, a)| 0.5 * (d[a] - d[b]));
                }
            }
        }
        careful_gradient(self, node)
    }

    #[inline]
    fn color(&self, node: [i32; 3]) -> Option<Color> {
        let (brick, i) = Self::place(node);
        let &[r, g, b, weight] = self.colors[brick].get(i)?;
        (weight > 0).then_some(Color { rgb: [r, g, b], weight })
    }
}

/// A brick of a dense array.
pub(super) struct DenseSamples<'a> {
    pub(super) samples: &'a [f32],
    pub(super) shape: [usize; 3],
    pub(super) level: f64,
    /// 1 where smaller samples are inside, -1 where larger ones are.
    pub(super) sign: f32,
    pub(super) margin: f32,
    /// By the highest node of a cube: whether it may have surface.
    pub(super) cubes: Option<&'a [bool]>,
    /// Lowest node of the brick.
    pub(super) first: [usize; 3],
}

impl DenseSamples<'_> {
    #[inline(always)]
    fn index(&self, node: [i32; 3]) -> usize {
        let at = |k: usize| self.first[k].wrapping_add_signed(node[k] as isize);
        at(0).wrapping_add(self.shape[0].wrapping_mul(at(1).wrapping_add(self.shape[1].wrapping_mul(at(2)))))
    }
}

impl DenseSamples<'_> {
    /// A sample beside the level: negative inside. Subtracted in `f64`, so that the sign is right for every level.
    #[inline(always)]
    pub(super) fn relative(&self, sample: f32) -> f32 {
        self.sign * ((f64::from(sample) - self.level) as f32).clamp(f32::MIN, f32::MAX)
    }

    #[inline]
    fn finite(&self, node: [i32; 3]) -> bool {
        let inside = (0..3).all(|k| self.first[k].wrapping_add_signed(node[k] as isize) < self.shape[k]);
        inside && self.samples[self.index(node)].is_finite()
    }

    /// How far samples lie from each other in the four cubes around an edge away from the border; `None` where a sample is
    /// not finite.
    #[inline]
    fn range_inside(&self, node: [i32; 3], axis: usize) -> Option<f32> {
        let strides = [1, self.shape[0], self.shape[0] * self.shape[1]];
        let (along, u, v) = (strides[axis], strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
        let first = self.index(node).wrapping_sub(u + v);
        let (mut low, mut high, mut sum) = ([[0.0f32; 3]; 3], [[0.0f32; 3]; 3], 0.0);
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let at = first + i * u + j * v;
            let (a, b) = (self.samples[at], self.samples[at + along]);
            (low[i][j], high[i][j]) = if a < b { (a, b) } else { (b, a) };
            sum += 0.0 * (a + b);
        }
        if sum != 0.0 {
            return None;
        }
        let mut range = 0.0f32;
        for (i, j) in (0..2).flat_map(|i| (0..2).map(move |j| (i, j))) {
            let least = low[i][j].min(low[i + 1][j]).min(low[i][j + 1]).min(low[i + 1][j + 1]);
            let most = high[i][j].max(high[i + 1][j]).max(high[i][j + 1]).max(high[i + 1][j + 1]);
            range = range.max(most - least);
        }
        Some(range)
    }
}

impl Samples for DenseSamples<'_> {
    #[inline(always)]
    fn value(&self, node: [i32; 3]) -> f32 {
        let sample = self.samples.get(self.index(node)).copied().unwrap_or(0.0);
        self.relative(sample)
    }

    #[inline]
    fn observed(&self, node: [i32; 3]) -> Option<f32> {
        self.finite(node).then(|| self.value(node))
    }

    /// Away from the border the neighbors are at fixed distances in memory.
    #[inline]
    fn gradient(&self, node: [i32; 3]) -> [f32; 3] {
        let inner = |k: usize| {
            let at = self.first[k].wrapping_add_signed(node[k] as isize);
            at > 0 && at + 1 < self.shape[k]
        };
        if inner(0) && inner(1) && inner(2) {
            let (i, row) = (self.index(node), self.shape[0]);
            let half =
                |stride: usize| 0.5 * self.sign * (self.samples[i + stride] - self.samples[i - stride]);
            let gradient = [half(1), half(row), half(row * self.shape[1])];
            // A neighbor that is not finite makes the difference not finite.
            if gradient.iter().all(|v| v.is_finite()) {
                return gradient;
            }
        }
        careful_gradient(self, node)
    }

    fn color(&self, _: [i32; 3]) -> Option<Color> {
        None
    }

    #[inline(always)]
    fn margin(&self) -> f32 {
        self.margin
    }

    #[inline]
    fn cubes(&self, layer: usize) -> u64 {
        let Some(cubes) = self.cubes else { return u64::MAX };
        let mut word = 0;
        for i in 0..64 {
            let node = [self.first[0] + i % 8 + 1, self.first[1] + i / 8 + 1, self.first[2] + layer + 1];
            let inside = (0..3).all(|k| node[k] < self.shape[k]);
            let index = node[0] + self.shape[0] * (node[1] + self.shape[1] * node[2]);
            word |= u64::from(inside && cubes[index]) << i;
        }
        word
    }

    fn cube_range(&self, lowest: [i32; 3]) -> Option<f32> {
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        for c in 0..8 {
            let node = [lowest[0] + (c & 1), lowest[1] + (c >> 1 & 1), lowest[2] + (c >> 2)];
            if !self.finite(node) {
                return None;
            }
            let sample = self.samples[self.index(node)];
            (least, most) = (least.min(sample), most.max(sample));
        }
        let allowed = self.cubes.is_none_or(|cubes| cubes[self.index(lowest.map(|i| i + 1))]);
        allowed.then_some(most - least)
    }

    #[inline]
    fn range(&self, node: [i32; 3], axis: usize) -> f32 {
        let inner = |k: usize| {
            let at = self.first[k].wrapping_add_signed(node[k] as isize);
            k == axis || at > 0 && at + 1 < self.shape[k]
        };
        if self.cubes.is_none()
            && (0..3).all(inner)
            && let Some(range) = self.range_inside(node, axis)
        {
            return range;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let around = (0..4).filter_map(|i| {
            let mut lowest = node;
            lowest[u] -= i & 1;
            lowest[v] -= i >> 1;
            self.cube_range(lowest)
        });
        around.fold(0.0, f32::max)
    }
}
