//! Where a brick's cubes read their nodes: bricks of a store, or one dense array.

use crate::cell::{Color, ColorBrick, DistanceBrick};

/// The nodes around a brick. Node (0, 0, 0) is its lowest one; -1 to 9 may be asked for along each axis.
pub(super) trait Samples {
    /// Value at a node that was observed; anything elsewhere.
    fn value(&self, node: [i32; 3]) -> f32;

    /// Value at a node, where it was observed.
    fn observed(&self, node: [i32; 3]) -> Option<f32>;

    /// Colour at a node, where one was observed.
    fn color(&self, node: [i32; 3]) -> Option<Color>;

    /// Derivative of the field per cell at an observed node: half the difference between its two neighbours along an
    /// axis, the whole one to the neighbour that was observed, 0 where neither was.
    fn gradient(&self, node: [i32; 3]) -> [f32; 3] {
        let here = self.value(node);
        std::array::from_fn(|k| {
            let (mut below, mut above) = (node, node);
            below[k] -= 1;
            above[k] += 1;
            match (self.observed(below), self.observed(above)) {
                (Some(b), Some(a)) => 0.5 * (a - b),
                (Some(b), None) => here - b,
                (None, Some(a)) => a - here,
                (None, None) => 0.0,
            }
        })
    }
}

/// A brick and the 26 around it, x fastest; empty slices where there is none.
pub(super) struct BrickSamples<'a> {
    distances: [&'a [f32]; 27],
    weights: [&'a [f32]; 27],
    colors: [&'a [[u16; 4]]; 27],
    min_weight: f32,
}

/// The brick itself in the order of [`BrickSamples`].
pub(super) const MIDDLE: usize = 13;

impl<'a> BrickSamples<'a> {
    pub(super) fn new(
        bricks: impl Fn(usize) -> Option<&'a DistanceBrick>,
        colors: impl Fn(usize) -> Option<&'a ColorBrick>,
        min_weight: f32,
    ) -> Self {
        let bricks: [_; 27] = std::array::from_fn(bricks);
        Self {
            distances: bricks.map(|b| b.map_or(&[][..], DistanceBrick::distances)),
            weights: bricks.map(|b| b.map_or(&[][..], DistanceBrick::weights)),
            colors: std::array::from_fn(|i| colors(i).map_or(&[][..], ColorBrick::words)),
            min_weight,
        }
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
        (weight > 0.0 && weight >= self.min_weight).then(|| self.distances[brick][i])
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
        let [x, y, z] = [0, 1, 2].map(|k| self.first[k].wrapping_add_signed(node[k] as isize));
        x + self.shape[0] * (y + self.shape[1] * z)
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

    fn color(&self, _: [i32; 3]) -> Option<Color> {
        None
    }
}
