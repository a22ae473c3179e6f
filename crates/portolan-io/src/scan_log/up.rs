//! Which way is up in the world of a log, as far as its sensors say it.

use portolan::geom::vector::{add, norm, scale};

use super::ScanLog;

/// Poses that are looked at: more add nothing new.
const POSES: usize = 200;
/// The cosine to an axis from which a mean direction is taken for the axis: cameras look down more often than up.
const AXIS: f64 = 0.85;
/// The length of the mean of unit vectors from which they are said to agree.
const AGREE: f64 = 0.7;

impl ScanLog {
    /// The unit vector that points up in the world, by how the sensors were held: the mean of cameras' up, which is an axis
    /// of the world where it is near one. A lidar may be mounted in any way, and its world usually has z up: another axis is
    /// up only where the sensors' z agree on it, as in a world that is that of a camera. O(1).
    pub fn up(&self) -> [f64; 3] {
        let z = [0.0, 0.0, 1.0];
        let own = if self.camera().is_some() { [0.0, -1.0, 0.0] } else { z };
        let step = self.len().div_ceil(POSES).max(1);
        let ups: Vec<[f64; 3]> = (0..self.len()).step_by(step).map(|i| self.pose(i).rotate(own)).collect();
        let mean = scale(ups.iter().copied().fold([0.0; 3], add), 1.0 / ups.len() as f64);
        let (length, nearest) = (norm(mean), nearest_axis(mean));
        if self.camera().is_some() {
            return if length > 1e-9 { nearest.unwrap_or(scale(mean, 1.0 / length)) } else { z };
        }
        if length > AGREE { nearest.unwrap_or(z) } else { z }
    }
}

/// The axis, with its sign, that a direction nearly is.
fn nearest_axis(direction: [f64; 3]) -> Option<[f64; 3]> {
    let length = norm(direction);
    let k = (0..3).max_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs()))?;
    (direction[k].abs() > AXIS * length)
        .then(|| std::array::from_fn(|axis| if axis == k { direction[k].signum() } else { 0.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_nearly_an_axis_is_the_axis() {
        assert_eq!(nearest_axis([0.1, -0.9, 0.2]), Some([0.0, -1.0, 0.0]));
        assert_eq!(nearest_axis([0.0, -2.0, 1.9]), None);
        assert_eq!(nearest_axis([0.0; 3]), None);
    }
}
