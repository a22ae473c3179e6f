//! The planes of one brick, shared between snapshots until one of them changes it.

use super::{DistanceObservation, LogOddsValue, Planes, SignedDistance};
use std::sync::Arc;

/// Log odds of a brick's cells, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct LogOddsBrick<V>(Arc<[V]>);

impl<V: LogOddsValue> LogOddsBrick<V> {
    /// The cells, x fastest, marks of never-observed ones included.
    pub fn cells(&self) -> &[V] {
        &self.0
    }

    /// The cells for writing; copied first where a snapshot shares them.
    pub fn cells_mut(&mut self) -> &mut [V] {
        Arc::make_mut(&mut self.0)
    }
}

impl<V: LogOddsValue> Planes<V> for LogOddsBrick<V> {
    fn unobserved(n: usize) -> Self {
        Self(std::iter::repeat_n(V::UNOBSERVED, n).collect())
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<V> {
        let v = self.0[i];
        (!v.is_unobserved()).then_some(v)
    }

    fn set(&mut self, i: usize, cell: Option<V>) {
        self.cells_mut()[i] = cell.unwrap_or(V::UNOBSERVED);
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0) + ARC_HEADER
    }
}

/// Signed distances and weights of a brick's cells: a plane of distances, then one of weights, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceBrick(Arc<[f32]>);

impl DistanceBrick {
    /// A brick from its two planes. `None` where the lengths differ or a pair is no state of the filter (weight
    /// negative or NaN, distance not finite).
    pub fn from_parts(distance: &[f32], weight: &[f32]) -> Option<Self> {
        let sane = |(&d, &w): (&f32, &f32)| d.is_finite() && w >= 0.0;
        (distance.len() == weight.len() && distance.iter().zip(weight).all(sane))
            .then(|| Self(distance.iter().chain(weight).copied().collect()))
    }

    /// `D` of every cell (metres); meaningless where the weight is 0.
    #[inline(always)]
    pub fn distances(&self) -> &[f32] {
        &self.0[..self.0.len() / 2]
    }

    /// `W` of every cell; 0: never observed.
    #[inline(always)]
    pub fn weights(&self) -> &[f32] {
        &self.0[self.0.len() / 2..]
    }

    /// Both planes for writing; copied first where a snapshot shares them.
    pub fn planes_mut(&mut self) -> (&mut [f32], &mut [f32]) {
        let half = self.0.len() / 2;
        Arc::make_mut(&mut self.0).split_at_mut(half)
    }
}

impl Planes<SignedDistance> for DistanceBrick {
    fn unobserved(n: usize) -> Self {
        // Zeroed memory and one copy: gathering from an iterator goes number by number.
        Self(vec![0.0; 2 * n].into())
    }

    fn len(&self) -> usize {
        self.0.len() / 2
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<SignedDistance> {
        let weight = self.weights()[i];
        (weight > 0.0).then(|| SignedDistance { distance: self.distances()[i], weight })
    }

    fn set(&mut self, i: usize, cell: Option<SignedDistance>) {
        let cell = cell.map_or(DistanceObservation { distance: 0.0, weight: 0.0 }, |c| DistanceObservation {
            distance: c.distance,
            weight: c.weight,
        });
        let (distance, weight) = self.planes_mut();
        distance[i] = cell.distance;
        weight[i] = cell.weight;
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0) + ARC_HEADER
    }
}

/// The two counters that an `Arc` keeps before its content.
pub(super) const ARC_HEADER: usize = 2 * size_of::<usize>();
