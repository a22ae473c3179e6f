//! Evidence for signed distances: a distance and a weight per cell.

use super::Evidence;

/// One scan's observation of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceObservation {
    /// Signed distance (meters), positive in front of the surface.
    pub distance: f32,
    /// Weight: inverse variance up to a common factor. Positive.
    pub weight: f32,
}

/// Distances and weights of a block; weight 0: nothing is said about the cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Distances {
    distance: Box<[f32]>,
    weight: Box<[f32]>,
}

impl Distances {
    /// Sets the observation of cell `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, o: DistanceObservation) {
        self.distance[i] = o.distance;
        self.weight[i] = o.weight;
    }

    /// Whether cell `i` has an observation already.
    #[inline(always)]
    pub fn is_set(&self, i: usize) -> bool {
        self.weight[i] > 0.0
    }

    /// Distances (meters), one per cell of the block; meaningless where the weight is 0.
    #[inline(always)]
    pub fn distances(&self) -> &[f32] {
        &self.distance
    }

    /// Weights, one per cell of the block.
    #[inline(always)]
    pub fn weights(&self) -> &[f32] {
        &self.weight
    }

    /// Both planes for writing.
    #[inline(always)]
    pub fn planes_mut(&mut self) -> (&mut [f32], &mut [f32]) {
        (&mut self.distance, &mut self.weight)
    }
}

impl Evidence for Distances {
    type One = DistanceObservation;

    fn silent(cells: usize) -> Self {
        Self { distance: vec![0.0; cells].into(), weight: vec![0.0; cells].into() }
    }

    fn clear(&mut self) {
        self.weight.fill(0.0);
    }

    #[inline(always)]
    fn one(&self, i: usize) -> Option<DistanceObservation> {
        let weight = self.weight[i];
        (weight > 0.0).then(|| DistanceObservation { distance: self.distance[i], weight })
    }

    fn observed(&self) -> usize {
        // Summed as u32, which stands in vectors of the same width as the weights.
        self.weight.iter().map(|&w| u32::from(w > 0.0)).sum::<u32>() as usize
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        self.weight.iter_mut().enumerate().filter(|(i, _)| !inside(*i)).for_each(|(_, w)| *w = 0.0);
    }
}
