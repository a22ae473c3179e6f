//! A field of balls with deliberately slack bounds and exact ground truth.

use crate::answer::Answer;
use crate::field::{Clearance, ClearanceField, UnknownSpace};
use crate::geom::Aabb;
use crate::geom::vector::{distance, norm};
pub(super) use crate::testing::point;
use proptest::prelude::*;

/// Balls in a box. Beyond the box is outside; a smaller box was never observed, nor was anything outside.
#[derive(Clone, Debug)]
pub(super) struct Scene<const D: usize> {
    pub(super) balls: Vec<([f64; D], f64)>,
    pub(super) hole: Aabb<D>,
    pub(super) bounds: Aabb<D>,
    /// Bounds are off by up to so much (meters), differently at every point.
    pub(super) slack: f64,
    /// Distances are maintained up to here (meters).
    pub(super) most: f64,
}

impl<const D: usize> Scene<D> {
    pub(super) fn empty() -> Self {
        let bounds = Aabb::new([-5.0; D], [5.0; D]);
        Self { balls: vec![], hole: Aabb::EMPTY, bounds, slack: 0.0, most: f64::INFINITY }
    }

    /// Signed distance to the balls.
    pub(super) fn signed(&self, p: [f64; D]) -> f64 {
        self.balls.iter().map(|(c, r)| distance(p, *c) - r).fold(f64::INFINITY, f64::min)
    }

    /// The true clearance of a point in known space; `None` in what was not observed or outside, unless that is no
    /// obstacle.
    pub(super) fn truth(&self, p: [f64; D], unknown: UnknownSpace) -> Option<f64> {
        let surface = self.signed(p);
        if unknown == UnknownSpace::Optimistic {
            return Some(surface);
        }
        if !self.bounds.contains(p) || self.hole.contains(p) {
            return None;
        }
        let beyond = |k: usize| (self.bounds.max[k] - p[k]).min(p[k] - self.bounds.min[k]);
        let nearest = (0..D).map(beyond).fold(surface, f64::min);
        let off: [f64; D] =
            std::array::from_fn(|k| (self.hole.min[k] - p[k]).max(p[k] - self.hole.max[k]).max(0.0));
        Some(if self.hole.is_empty() { nearest } else { nearest.min(norm(off)) })
    }
}

impl<const D: usize> ClearanceField<D> for Scene<D> {
    fn clearance(&self, p: [f64; D], unknown: UnknownSpace) -> Answer<Clearance> {
        let Some(truth) = self.truth(p, unknown).filter(|_| self.bounds.contains(p)) else {
            return if self.bounds.contains(p) { Answer::Unknown } else { Answer::Outside };
        };
        let inside = self.signed(p) < 0.0;
        // Anything between 0 and 1 that changes from point to point.
        let noise = |a: f64| p.iter().fold(a, |n, v| n * 1.7 + v * 977.31).sin().abs();
        let lower = (truth.abs() - self.slack * noise(0.3)).max(0.0);
        if lower >= self.most {
            return Answer::Saturated(Clearance { lower: self.most, upper: f64::INFINITY, inside });
        }
        Answer::Known(Clearance { lower, upper: truth.abs() + self.slack * noise(0.7), inside })
    }

    fn distance_and_gradient(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
        Answer::Known((self.signed(p), [0.0; D]))
    }

    fn resolution(&self) -> f64 {
        0.05
    }
}

/// Scenes of up to eight balls, sometimes with a hole.
pub(super) fn scenes<const D: usize>() -> impl Strategy<Value = Scene<D>> {
    let ball = (prop::array::uniform3(-4.0..4.0f64), 0.05..0.8f64);
    let hole = (any::<bool>(), prop::array::uniform3(-4.0..4.0f64), prop::array::uniform3(0.1..1.5f64));
    let most = prop_oneof![Just(f64::INFINITY), 0.3..2.0f64];
    (prop::collection::vec(ball, 0..8), hole, prop_oneof![Just(0.0), 0.0..0.1f64], most).prop_map(
        |(balls, (is_there, low, size), slack, most)| Scene {
            balls: balls.into_iter().map(|(c, r)| (std::array::from_fn(|k| c[k]), r)).collect(),
            hole: if is_there {
                Aabb::new(std::array::from_fn(|k| low[k]), std::array::from_fn(|k| low[k] + size[k]))
            } else {
                Aabb::EMPTY
            },
            slack,
            most,
            ..Scene::empty()
        },
    )
}
