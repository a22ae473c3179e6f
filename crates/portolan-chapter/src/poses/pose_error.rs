//! Errors of poses relative to ground truth.

use portolan::geom::Pose;
use portolan::geom::vector::norm;
use portolan_sim::heading;
use serde::Serialize;

/// Mean, root mean square, median and maximum of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorMeasures {
    /// The mean.
    pub mean: f64,
    /// The root mean square.
    pub rms: f64,
    /// The median.
    pub median: f64,
    /// The largest.
    pub max: f64,
}

impl ErrorMeasures {
    /// The measures of error sizes; zeros for an empty list.
    pub fn of(mut sizes: Vec<f64>) -> Self {
        if sizes.is_empty() {
            return Self::default();
        }
        sizes.sort_by(f64::total_cmp);
        let n = sizes.len() as f64;
        Self {
            mean: sizes.iter().sum::<f64>() / n,
            rms: (sizes.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            median: sizes[sizes.len() / 2],
            max: sizes[sizes.len() - 1],
        }
    }
}

/// Errors of many poses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseErrors {
    /// Number of poses (or pairs) compared.
    pub count: usize,
    /// Of the position (meters).
    pub translation: ErrorMeasures,
    /// Of the heading (radians).
    pub rotation: ErrorMeasures,
}

impl PoseErrors {
    /// The error of each pose. No alignment: both must have the same world frame. The surplus of the longer slice is ignored.
    pub fn absolute(world_from_robot: &[Pose<2>], truth: &[Pose<2>]) -> Self {
        Self::of(world_from_robot.iter().zip(truth).map(|(a, b)| b.inverse() * *a))
    }

    /// The error of each motion from one pose to the `step`-th next (Sturm et al. 2012, the relative pose error): the drift,
    /// independent of the world frame.
    pub fn relative(world_from_robot: &[Pose<2>], truth: &[Pose<2>], step: usize) -> Self {
        let n = world_from_robot.len().min(truth.len());
        let motion = |poses: &[Pose<2>], i: usize| poses[i].inverse() * poses[i + step];
        let pairs = 0..n.saturating_sub(step);
        Self::of(pairs.map(|i| motion(truth, i).inverse() * motion(world_from_robot, i)))
    }

    /// The measures of error poses.
    pub fn of(errors: impl IntoIterator<Item = Pose<2>>) -> Self {
        let (metres, radians): (Vec<f64>, Vec<f64>) =
            errors.into_iter().map(|e| (norm(e.translation), heading(&e).abs())).unzip();
        Self {
            count: metres.len(),
            translation: ErrorMeasures::of(metres),
            rotation: ErrorMeasures::of(radians),
        }
    }
}

impl std::fmt::Display for PoseErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (t, r) = (self.translation, self.rotation);
        write!(
            f,
            "{:.3} m mean, {:.3} rms, {:.3} median, {:.3} max; {:.2} degrees rms, {:.2} median, {:.2} max",
            t.mean,
            t.rms,
            t.median,
            t.max,
            r.rms.to_degrees(),
            r.median.to_degrees(),
            r.max.to_degrees()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_known_poses() {
        let truth: Vec<_> = (0..4).map(|k| Pose::<2>::new(f64::from(k), 0.0, 0.0)).collect();
        let moved: Vec<_> = truth.iter().map(|p| Pose::<2>::new(0.3, 0.4, 0.0) * *p).collect();
        let absolute = PoseErrors::absolute(&moved, &truth);
        assert_eq!((absolute.count, absolute.rotation.max), (4, 0.0));
        assert!(
            (absolute.translation.rms - 0.5).abs() < 1e-12 && (absolute.translation.max - 0.5).abs() < 1e-12
        );
        assert!(PoseErrors::relative(&moved, &truth, 1).translation.max < 1e-12);
        assert_eq!(PoseErrors::relative(&moved, &truth, 4).count, 0);
    }
}
