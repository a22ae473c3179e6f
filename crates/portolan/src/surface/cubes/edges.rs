//! The edges along one axis in one layer of a brick of an array without holes: what their crossings are like.
//!
//! The same as [`crossing`](super::vertex::crossing) bit for bit; away from the border the samples are read at fixed
//! distances.

use super::samples::{DenseSamples, Samples};
use super::vertex::crossing_beyond;

/// Edges from the nodes of one layer.
pub(super) struct Edges<'a, const AXIS: usize> {
    samples: &'a DenseSamples<'a>,
    /// Layer of the brick.
    z: usize,
    /// Place of its lowest node in memory.
    lowest: usize,
    /// From node to node along each axis.
    strides: [usize; 3],
    /// The brick's lowest node.
    first: [f32; 3],
    /// Whether all numbers of nodes are exact as `f32`: then sums need no `f64`.
    exact: bool,
    /// Whether the layer is away from the border.
    inner: bool,
}

/// Places of nodes in a brick.
const STEPS: [f32; 8] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl<'a, const AXIS: usize> Edges<'a, AXIS> {
    #[inline(always)]
    pub(super) fn new(samples: &'a DenseSamples<'a>, z: usize) -> Self {
        let ([nx, ny, nz], [x, y, layer]) = (samples.shape, samples.first);
        let layer = layer + z;
        Self {
            samples,
            z,
            lowest: x + nx * (y + ny * layer),
            strides: [1, nx, nx * ny],
            first: samples.first.map(|k| k as f32),
            exact: samples.shape.iter().all(|n| *n <= 1 << 24),
            inner: layer > 0 && layer + 1 + usize::from(AXIS == 2) < nz,
        }
    }

    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> usize {
        self.lowest + x + self.strides[1] * y
    }

    /// Where the edge from a node crosses the level, in cells from the node.
    #[inline(always)]
    pub(super) fn crossing(&self, x: usize, y: usize) -> f32 {
        let at = self.at(x, y);
        let (a, b) = (self.samples.samples[at], self.samples.samples[at + self.strides[AXIS]]);
        crossing_beyond(self.samples.margin, self.samples.relative(a), self.samples.relative(b))
    }

    /// The position of the crossing at `t`.
    #[inline(always)]
    pub(super) fn position(&self, x: usize, y: usize, t: f32) -> [f32; 3] {
        let mut inner = [STEPS[x & 7], STEPS[y & 7], STEPS[self.z & 7]];
        inner[AXIS] += t;
        for k in 0..3 {
            // The sum in `f64`, rounded to `f32`, is the same: the first is a whole number of 24 bits, and next to it a
            // fraction that `f64` cannot hold is too small to matter.
            inner[k] = if self.exact {
                self.first[k] + inner[k]
            } else {
                (self.samples.first[k] as f64 + f64::from(inner[k])) as f32
            };
        }
        inner
    }

    /// Whether all neighbors of both ends are in the array.
    #[inline(always)]
    fn inside(&self, x: usize, y: usize) -> bool {
        let [nx, ny, _] = self.samples.shape;
        let (x, y) = (self.samples.first[0] + x, self.samples.first[1] + y);
        let (right, back) = (x + 1 + usize::from(AXIS == 0) < nx, y + 1 + usize::from(AXIS == 1) < ny);
        self.inner && x > 0 && right && y > 0 && back
    }

    /// The gradient at the crossing, between those of the ends.
    #[inline(always)]
    pub(super) fn gradient(&self, x: usize, y: usize, t: f32) -> [f32; 3] {
        if self.inside(x, y) {
            let (at, half) = (self.at(x, y), 0.5 * self.samples.sign);
            let samples = self.samples.samples;
            let difference =
                |at: usize, k: usize| half * (samples[at + self.strides[k]] - samples[at - self.strides[k]]);
            let (mut gradient, mut all) = ([0.0; 3], 0.0);
            for k in 0..3 {
                let (a, b) = (difference(at, k), difference(at + self.strides[AXIS], k));
                gradient[k] = a + t * (b - a);
                all += 0.0 * a + 0.0 * b;
            }
            // What overflows makes it NaN.
            if all == 0.0 {
                return gradient;
            }
        }
        let mut ends = [[x, y, self.z].map(|k| k as i32); 2];
        ends[1][AXIS] += 1;
        let [a, b] = ends.map(|node| self.samples.gradient(node));
        [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]))
    }

    /// The largest difference of two samples of one of the four cubes around the edge.
    #[inline(always)]
    pub(super) fn range(&self, x: usize, y: usize) -> f32 {
        if !self.inside(x, y) {
            return self.samples.range([x, y, self.z].map(|k| k as i32), AXIS);
        }
        let (along, u, v) = (self.strides[AXIS], self.strides[(AXIS + 1) % 3], self.strides[(AXIS + 2) % 3]);
        let first = self.at(x, y) - u - v;
        // Of both ends, by row along u and column along v; then of rows beside each other, and of columns.
        let (mut low, mut high) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let at = first + i * u + j * v;
                let (a, b) = (self.samples.samples[at], self.samples.samples[at + along]);
                (low[i][j], high[i][j]) = (least(a, b), most(a, b));
            }
        }
        let mut range = 0.0;
        for i in 0..2 {
            for j in 0..3 {
                low[i][j] = least(low[i][j], low[i + 1][j]);
                high[i][j] = most(high[i][j], high[i + 1][j]);
            }
            for j in 0..2 {
                range = most(range, most(high[i][j], high[i][j + 1]) - least(low[i][j], low[i][j + 1]));
            }
        }
        range
    }
}

/// Of two numbers: one instruction, where [`f32::min`] heeds NaN.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
