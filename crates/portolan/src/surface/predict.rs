//! Evaluation of a map by the ranges it predicts for scans that were not fused into it.

use super::{RayCast, RayCaster};
use crate::geom::Pose;
use crate::geom::vector::{distance, sub, unit};
use crate::parallel;
use crate::scan::Frame;

/// The distribution of measured ranges given predicted ones: a Gaussian around the predicted surface and a uniform part for
/// outliers *(Thrun, Burgard & Fox 2005, section 6.3, without short readings)*:
///
/// `p(r) = (1 - outliers) N(r; predicted, sigma^2) + outliers / max_range`.
///
/// A ray without a predicted surface is uniform: `1 / max_range`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeNoise {
    /// Standard deviation of the sensor and the map together (meters).
    pub sigma: f64,
    /// Share of outliers.
    pub outliers: f64,
    /// Range of the uniform part (meters).
    pub max_range: f64,
}

impl RangeNoise {
    /// A standard deviation of half a cell, 5 % outliers, this range (meters).
    pub fn of_cells(resolution: f64, max_range: f64) -> Self {
        Self { sigma: 0.5 * resolution, outliers: 0.05, max_range }
    }

    /// `-ln p(measured)` in nats.
    pub fn negative_log_likelihood(&self, predicted: Option<f64>, measured: f64) -> f64 {
        let uniform = 1.0 / self.max_range;
        let density = match predicted {
            None => uniform,
            Some(predicted) => {
                let z = (measured - predicted) / self.sigma;
                let peak = 1.0 / (self.sigma * std::f64::consts::TAU.sqrt());
                (1.0 - self.outliers) * peak * (-0.5 * z * z).exp() + self.outliers * uniform
            }
        };
        -density.ln()
    }
}

/// Predicted and measured ranges of scans, ray by ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RangePredictions {
    /// Predicted and measured range of each ray with a predicted surface (meters), in order.
    pub pairs: Vec<[f64; 2]>,
    /// Measured ranges of rays that end in unknown space (meters).
    pub unknown: Vec<f64>,
    /// Measured ranges of rays that leave the map (meters).
    pub outside: Vec<f64>,
    /// Measured ranges of rays in free space up to the largest range (meters).
    pub free: Vec<f64>,
}

/// The errors of predicted ranges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictionScore {
    /// Median of |predicted - measured| (meters).
    pub median_error: f64,
    /// 95th percentile of |predicted - measured| (meters).
    pub p95_error: f64,
    /// Median of predicted - measured (meters).
    pub bias: f64,
    /// Share of the predicted ranges within one cell of the measured ones.
    pub within_one_cell: f64,
    /// Share of the predicted ranges within two cells of the measured ones.
    pub within_two_cells: f64,
    /// Mean negative log-likelihood of all rays, with or without a predicted surface (nats).
    pub negative_log_likelihood: f64,
}

impl RangePredictions {
    /// Casts a ray for each hit of a frame, or for `at_most` of them, evenly spaced, and appends the predictions in order. Runs
    /// on all cores with the feature `parallel`. An image that fails
    /// [`RangeImage::check`](crate::scan::RangeImage::check) and points without an origin are skipped.
    pub fn add(
        &mut self,
        rays: &RayCaster<'_, 3>,
        world_from_sensor: &Pose<3>,
        frame: &Frame,
        at_most: usize,
    ) {
        let seen = hit_rays(frame);
        let taken = at_most.min(seen.len());
        let taken: Vec<_> = (0..taken).map(|i| seen[i * seen.len() / taken]).collect();
        let casts = parallel::map(&taken, 64, |&(origin, end)| {
            let direction = unit(sub(end, origin))?;
            let origin_world = world_from_sensor.transform_point(origin);
            Some((rays.cast(origin_world, world_from_sensor.rotate(direction)), distance(origin, end)))
        });
        for (cast, measured) in casts.into_iter().flatten() {
            match cast {
                RayCast::Hit(predicted) => self.pairs.push([predicted, measured]),
                RayCast::Unknown(_) => self.unknown.push(measured),
                RayCast::Outside(_) => self.outside.push(measured),
                RayCast::Free => self.free.push(measured),
            }
        }
    }

    /// Number of rays cast.
    pub fn rays(&self) -> usize {
        self.pairs.len() + self.unknown.len() + self.outside.len() + self.free.len()
    }

    /// The errors, with a cell size of `resolution` (meters); `None` without predicted surfaces.
    pub fn score(&self, resolution: f64, noise: &RangeNoise) -> Option<PredictionScore> {
        let n = self.pairs.len();
        if n == 0 {
            return None;
        }
        let mut signed: Vec<f64> =
            self.pairs.iter().map(|[predicted, measured]| predicted - measured).collect();
        signed.sort_unstable_by(f64::total_cmp);
        let mut absolute: Vec<f64> = signed.iter().map(|e| e.abs()).collect();
        absolute.sort_unstable_by(f64::total_cmp);
        // The nearest rank, which is always one of the numbers.
        let at = |sorted: &[f64], q: f64| sorted[((q * n as f64).ceil() as usize).clamp(1, n) - 1];
        let within = |cells: f64| absolute.partition_point(|e| *e <= cells * resolution) as f64 / n as f64;
        let predicted = self.pairs.iter().map(|&[p, m]| noise.negative_log_likelihood(Some(p), m));
        let others = self.unknown.iter().chain(&self.outside).chain(&self.free);
        let others = others.map(|&m| noise.negative_log_likelihood(None, m));
        Some(PredictionScore {
            median_error: at(&absolute, 0.5),
            p95_error: at(&absolute, 0.95),
            bias: at(&signed, 0.5),
            within_one_cell: within(1.0),
            within_two_cells: within(2.0),
            negative_log_likelihood: predicted.chain(others).sum::<f64>() / self.rays() as f64,
        })
    }
}

/// Origin and end of every ray of a frame with a hit, in the sensor's frame.
pub(crate) fn hit_rays(frame: &Frame) -> Vec<([f64; 3], [f64; 3])> {
    match frame {
        Frame::Image(image) if image.check().is_err() => Vec::new(),
        Frame::Image(image) => image.readings().filter(|r| r.2).map(|r| (r.0, r.1)).collect(),
        Frame::Points(scan) => {
            let ends = scan.points.iter().enumerate();
            ends.filter_map(|(i, p)| Some((scan.origin_of(i)?, p.map(f64::from)))).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::SignedDistance;
    use crate::geom::{BlockKey, Lattice};
    use crate::scan::PointScan;
    use crate::store::Bricks;
    use crate::surface::RayCastSettings;

    /// Free space up to a wall at x = 1.03, in bricks on the near side of y = 0.8.
    fn wall() -> Bricks<SignedDistance, 3> {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let mut store = Bricks::new(lattice);
        for key in [[0, 0, 0], [1, 0, 0]].map(BlockKey) {
            let distance = |i| (1.03 - lattice.center(key.cell(i))[0]).clamp(-0.3, 0.3) as f32;
            store.insert(key, crate::testing::brick::<3>(|i| Some((distance(i), 1.0)))).unwrap();
        }
        store
    }

    #[test]
    fn a_plane_is_predicted_where_it_is() {
        let store = wall();
        let rays = RayCaster::new(&store, RayCastSettings::default());
        // The sensor stands in the map; the wall is measured 4 cm too near, but for a reading that is 25 cm too far.
        let pose = Pose::<3>::from_quaternion([0.2, 0.4, 0.4], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let mut points: Vec<[f32; 3]> = (0..9).map(|i| [0.79, 0.01 * i as f32, 0.0]).collect();
        points.push([1.08, 0.0, 0.0]);
        points.push([0.0, 5.0, 0.0]);
        let frame = Frame::Points(PointScan::new(points, [0.0; 3]));
        let mut predictions = RangePredictions::default();
        predictions.add(&rays, &pose, &frame, usize::MAX);
        assert_eq!((predictions.pairs.len(), predictions.rays()), (10, 11));
        let noise = RangeNoise { sigma: 0.04, outliers: 0.1, max_range: 10.0 };
        let score = predictions.score(0.1, &noise).unwrap();
        assert!((score.median_error - 0.04).abs() < 1e-3 && (score.bias - 0.04).abs() < 1e-3, "{score:?}");
        assert!((score.p95_error - 0.25).abs() < 1e-3);
        assert_eq!((score.within_one_cell, score.within_two_cells), (0.9, 0.9));
        // Nine at one sigma, one unexplained, one not predicted.
        let near = -(0.9 * (-0.5f64).exp() / (0.04 * std::f64::consts::TAU.sqrt()) + 0.01).ln();
        let want = (9.0 * near - 0.01f64.ln() - 0.1f64.ln()) / 11.0;
        assert!(
            (score.negative_log_likelihood - want).abs() < 0.02,
            "{} {want}",
            score.negative_log_likelihood
        );
        let mut some = RangePredictions::default();
        some.add(&rays, &pose, &frame, 4);
        assert_eq!(some.rays(), 4);
        assert_eq!(RangePredictions::default().score(0.1, &noise), None);
    }

    #[test]
    fn frames_that_contradict_themselves_are_not_cast() {
        let store = wall();
        let rays = RayCaster::new(&store, RayCastSettings::default());
        let mut predictions = RangePredictions::default();
        for (image, _) in crate::scan::broken_images() {
            predictions.add(&rays, &Pose::IDENTITY, &Frame::Image(image), usize::MAX);
        }
        assert_eq!(predictions, RangePredictions::default());
        let mut scan = PointScan::new([[0.5, 0.4, 0.4]; 3], [0.0; 3]);
        scan.origin = crate::scan::Origin::PerPoint(vec![[0.2, 0.4, 0.4]]);
        predictions.add(&rays, &Pose::IDENTITY, &Frame::Points(scan), usize::MAX);
        assert_eq!(predictions.rays(), 1);
    }

    #[test]
    fn the_noise_model_is_a_density() {
        let noise = RangeNoise::of_cells(0.1, 20.0);
        let steps = 200_000;
        let mass: f64 = (0..steps)
            .map(|i| 20.0 * (f64::from(i) + 0.5) / f64::from(steps))
            .map(|r| (-noise.negative_log_likelihood(Some(7.3), r)).exp() * 20.0 / f64::from(steps))
            .sum();
        assert!((mass - 1.0).abs() < 1e-6, "{mass}");
    }
}
