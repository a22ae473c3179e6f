//! The nodes of the cubes of a brick: from bricks of a store, or from a dense array.

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
    pub(super) level: f32,
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

impl Samples for DenseSamples<'_> {
    #[inline(always)]
    fn value(&self, node: [i32; 3]) -> f32 {
        self.samples.get(self.index(node)).copied().unwrap_or(0.0) - self.level
    }

    #[inline]
    fn observed(&self, node: [i32; 3]) -> Option<f32> {
        let inside = (0..3).all(|k| self.first[k].wrapping_add_signed(node[k] as isize) < self.shape[k]);
        inside.then(|| self.value(node)).filter(|v| v.is_finite())
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
            let half = |stride: usize| 0.5 * (self.samples[i + stride] - self.samples[i - stride]);
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
}
