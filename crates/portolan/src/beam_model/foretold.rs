//! Evaluation of a map of hits per meter by the ranges that it foretells for scans that were not fused into it.

use super::RangeDistribution;
use crate::cell::HitLength;
use crate::geom::Pose;
use crate::geom::vector::{distance, sub, unit};
use crate::map::Attenuation;
use crate::parallel;
use crate::scan::{Frame, Scan};
use crate::store::Store;

/// What a range may be besides what the map foretells: uniform up to the largest range, so that no reading is impossible
/// and a single one does not decide a mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeFloor {
    /// Share of the uniform part.
    pub outliers: f64,
    /// Largest range (meters).
    pub max_range: f64,
}

impl RangeFloor {
    /// 5 % up to this range (meters).
    pub fn up_to(max_range: f64) -> Self {
        Self { outliers: 0.05, max_range }
    }

    /// Logarithm of the density of a reading (nats, densities per meter).
    pub fn log_density(&self, foretold: f64) -> f64 {
        ((1.0 - self.outliers) * foretold + self.outliers / self.max_range).ln()
    }
}

/// What a map foretold of readings, ray by ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForetoldRanges {
    /// Of each ray in order: the density at its reading (1/m), without a floor.
    pub densities: Vec<f64>,
    /// Of each ray in order: the median of the foretold range, without one the largest range, and the reading (meters).
    pub medians: Vec<[f64; 2]>,
}

/// How well ranges were foretold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForetoldScore {
    /// Mean log density of the readings (nats a beam), with the floor.
    pub log_density: f64,
    /// Median of |foretold median - reading| (meters).
    pub median_error: f64,
    /// Share of rays whose foretold median is within 10 cm of the reading.
    pub within_10_cm: f64,
}

impl ForetoldRanges {
    /// What a map foretells of the hits of a 2-D scan, taken at a pose; ranges up to `max_range` (meters).
    pub fn add_scan<const D: usize, S: Store<HitLength, D> + Sync>(
        &mut self,
        map: &Attenuation<D, S>,
        world_from_sensor: &Pose<D>,
        scan: &Scan<D>,
        max_range: f64,
    ) {
        let hits = scan.beams().enumerate().filter(|(_, b)| b.is_hit());
        let origin = |i: usize| world_from_sensor.transform_point(scan.origin(i));
        let rays: Vec<_> =
            hits.map(|(i, b)| (origin(i), world_from_sensor.rotate(b.direction), b.range)).collect();
        self.add(map, &rays, max_range);
    }

    /// What a map foretells of the hits of a frame, or of `at_most` of them, evenly spaced; ranges up to `max_range`
    /// (meters). An image that fails [`RangeImage::check`](crate::scan::RangeImage::check) and points without an origin are
    /// skipped.
    pub fn add_frame<S: Store<HitLength, 3> + Sync>(
        &mut self,
        map: &Attenuation<3, S>,
        world_from_sensor: &Pose<3>,
        frame: &Frame,
        at_most: usize,
        max_range: f64,
    ) {
        let seen = crate::surface::hit_rays(frame);
        let taken = at_most.min(seen.len());
        let rays: Vec<_> = (0..taken)
            .filter_map(|i| {
                let (origin, end) = seen[i * seen.len() / taken];
                let direction = world_from_sensor.rotate(unit(sub(end, origin))?);
                Some((world_from_sensor.transform_point(origin), direction, distance(origin, end)))
            })
            .collect();
        self.add(map, &rays, max_range);
    }

    /// Rays: origin, direction (world), reading. Runs on all cores with the feature `parallel`.
    fn add<const D: usize, S: Store<HitLength, D> + Sync>(
        &mut self,
        map: &Attenuation<D, S>,
        rays: &[([f64; D], [f64; D], f64)],
        max_range: f64,
    ) {
        let foretold = parallel::map(rays, 64, |&(origin, direction, reading)| {
            let ranges = RangeDistribution::along(map, origin, direction, max_range)?;
            Some((ranges.density(reading), [ranges.median().unwrap_or(max_range), reading]))
        });
        for (density, pair) in foretold.into_iter().flatten() {
            self.densities.push(density);
            self.medians.push(pair);
        }
    }

    /// Number of rays.
    pub fn rays(&self) -> usize {
        self.densities.len()
    }

    /// How well they were foretold; `None` without rays. O(n log n).
    pub fn score(&self, floor: &RangeFloor) -> Option<ForetoldScore> {
        let n = self.rays();
        if n == 0 {
            return None;
        }
        let mut errors: Vec<f64> = self.medians.iter().map(|[a, b]| (a - b).abs()).collect();
        errors.sort_unstable_by(f64::total_cmp);
        Some(ForetoldScore {
            log_density: self.densities.iter().map(|d| floor.log_density(*d)).sum::<f64>() / n as f64,
            median_error: errors[(n - 1) / 2],
            within_10_cm: errors.partition_point(|e| *e <= 0.1) as f64 / n as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::AttenuationRule;
    use crate::geom::Lattice;
    use crate::scan::{Beam, BeamKind, PointScan};

    #[test]
    fn scores_are_those_of_the_readings() {
        let mut map = Attenuation::<3>::new(Lattice::new([0.0; 3], 0.1), AttenuationRule::NEVER).unwrap();
        let beam = |range, kind| Beam { direction: [1.0, 0.0, 0.0], range, kind };
        let pose = Pose { translation: [0.05; 3], ..Pose::IDENTITY };
        map.integrate(&pose, &Scan::from_beams((0..500).map(|_| beam(2.0, BeamKind::Hit)))).unwrap();
        let mut foretold = ForetoldRanges::default();
        let scan = Scan::from_beams([
            beam(2.0, BeamKind::Hit),
            beam(1.5, BeamKind::MaxRange),
            beam(0.7, BeamKind::Hit),
        ]);
        foretold.add_scan(&map, &pose, &scan, 10.0);
        let frame = Frame::Points(PointScan::new([[2.0, 0.0, 0.0]; 40], [0.0; 3]));
        foretold.add_frame(&map, &pose, &frame, 6, 10.0);
        assert_eq!((foretold.rays(), foretold.medians[1][1]), (8, 0.7));
        let floor = RangeFloor::up_to(10.0);
        let score = foretold.score(&floor).unwrap();
        assert_eq!(score.within_10_cm, 7.0 / 8.0);
        assert!(score.median_error < 0.1);
        // A beam that comes this far ends within half a cell, in the middle of which the reading is.
        let wall = (0.95 * foretold.densities[0] + 0.005).ln();
        assert!(
            foretold.densities[0] > 5.0 && (wall - floor.log_density(foretold.densities[0])).abs() < 1e-12
        );
        let short = floor.log_density(foretold.densities[1]);
        assert!(0.005f64.ln() < short && short < wall - 3.0, "{short} {wall}");
        assert!((score.log_density - (7.0 * wall + short) / 8.0).abs() < 1e-9);
        assert_eq!(ForetoldRanges::default().score(&floor), None);
    }
}
