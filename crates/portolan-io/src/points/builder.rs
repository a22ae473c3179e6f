//! Takes points in one by one and refuses those that no map could use.

use super::{CloudGrid, PointCloudFile};
use crate::bytes::Scalar;

/// Coordinates beyond this are refused (meters).
const FARTHEST: f64 = 1e8;
/// From here on points are kept about an offset (meters): an `f32` resolves 0.06 mm there.
pub(crate) const FAR: f64 = 1024.0;
/// So many points are looked at before the offset is chosen: one that lies far from the others shall not choose it.
const LOOKED_AT: usize = 1024;
/// Times that span more than this many seconds are nanoseconds: no scan lasts eleven days or less than a millisecond.
const LONGEST_SCAN: f64 = 1e6;

/// Builds a [`PointCloudFile`]. After a [`CloudBuilder::push`] that answers `true` the caller adds that point's entry to
/// the lists that the file has.
#[derive(Default)]
pub(crate) struct CloudBuilder {
    pub(crate) cloud: PointCloudFile,
    /// Times as the file has them (seconds).
    pub(crate) times: Vec<f64>,
    /// The first points as they came, until the offset is chosen.
    first: Vec<[f64; 3]>,
    is_placed: bool,
    /// Times are seconds, however far apart they are.
    pub(crate) in_seconds: bool,
    organized: bool,
}

/// Where the values of a point are, in whatever way a format says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PointFields<F> {
    pub(crate) position: [F; 3],
    pub(crate) intensity: Option<F>,
    pub(crate) color: Option<[F; 3]>,
    pub(crate) normal: Option<[F; 3]>,
    pub(crate) ring: Option<F>,
    pub(crate) time: Option<F>,
}

impl CloudBuilder {
    /// Takes the point of pixel `i` with all its values, each with its type; `false` where it is refused.
    #[inline(always)]
    pub(crate) fn push_fields<F: Copy>(
        &mut self,
        i: usize,
        fields: &PointFields<F>,
        value: impl Fn(F) -> (f64, Scalar),
    ) -> bool {
        let kept = self.push(i, fields.position.map(|f| value(f).0));
        if kept {
            self.cloud.intensity.extend(fields.intensity.map(|f| value(f).0 as f32));
            self.cloud.normals.extend(fields.normal.map(|all| all.map(|f| value(f).0 as f32)));
            self.cloud.rings.extend(fields.ring.map(|f| value(f).0 as u16));
            let byte = |f: F| channel(value(f).0, value(f).1);
            self.cloud.colors.extend(fields.color.map(|all| all.map(byte)));
            self.times.extend(fields.time.map(|f| value(f).0 * time_unit(value(f).1)));
        }
        kept
    }

    /// `fine`: coordinates may be far, so that they need an offset. Not where a format has only points about its sensor.
    pub(crate) fn new(fine: bool) -> Self {
        Self { is_placed: !fine, ..Self::default() }
    }

    /// Makes the points pixels of so many columns and rows.
    pub(crate) fn organize(&mut self, columns: usize, rows: usize) {
        self.cloud.grid = Some(CloudGrid { columns, rows, pixels: Vec::new() });
        self.organized = true;
    }

    /// Takes the point of pixel `i`; `false` where it is refused.
    #[inline]
    pub(crate) fn push(&mut self, i: usize, p: [f64; 3]) -> bool {
        if !p.iter().all(|v| v.abs() <= FARTHEST) {
            self.refuse(p);
            return false;
        }
        if !self.is_placed {
            self.first.push(p);
        }
        self.cloud.points.push(std::array::from_fn(|k| (p[k] - self.cloud.offset[k]) as f32));
        if self.first.len() == LOOKED_AT {
            self.place();
        }
        if self.organized
            && let Some(grid) = &mut self.cloud.grid
        {
            grid.pixels.push(i as u32);
        }
        true
    }

    /// Chooses the offset: the median of the first points, where that is far.
    #[cold]
    fn place(&mut self) {
        self.is_placed = true;
        let first = std::mem::take(&mut self.first);
        if first.is_empty() {
            return;
        }
        let middle: [f64; 3] = std::array::from_fn(|k| {
            let mut along: Vec<f64> = first.iter().map(|p| p[k]).collect();
            let half = along.len() / 2;
            *along.select_nth_unstable_by(half, f64::total_cmp).1
        });
        if middle.iter().any(|v| v.abs() > FAR) {
            self.cloud.offset = middle.map(f64::round);
            for (point, p) in self.cloud.points.iter_mut().zip(&first) {
                *point = std::array::from_fn(|k| (p[k] - self.cloud.offset[k]) as f32);
            }
        }
    }

    #[cold]
    fn refuse(&mut self, p: [f64; 3]) {
        let refused = &mut self.cloud.refused;
        *match (p.iter().all(|v| v.is_finite()), self.organized) {
            (true, _) => &mut refused.too_far,
            (false, true) => &mut refused.no_reading,
            (false, false) => &mut refused.not_finite,
        } += 1;
    }

    /// The cloud. Times become seconds since the earliest.
    pub(crate) fn finish(mut self) -> PointCloudFile {
        self.place();
        let finite = || self.times.iter().copied().filter(|t| t.is_finite());
        let (first, last) =
            (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if first <= last {
            let unit = if last - first > LONGEST_SCAN && !self.in_seconds { 1e-9 } else { 1.0 };
            self.cloud.start_time = first * unit;
            // A NaN time is taken as the start.
            let since = |t: f64| if t.is_finite() { ((t - first) * unit) as f32 } else { 0.0 };
            self.cloud.times = self.times.iter().map(|&t| since(t)).collect();
        }
        self.cloud
    }
}

/// Whether a field of this name holds times.
pub(crate) fn is_time(name: &str) -> bool {
    ["t", "time", "timestamp", "time_stamp", "gps_time", "offset_time"].contains(&name)
}

/// The factor to seconds of a time field: whole numbers are nanoseconds (Ouster, Livox), others seconds (Velodyne, Hesai).
fn time_unit(scalar: Scalar) -> f64 {
    if scalar.is_integer() { 1e-9 } else { 1.0 }
}

/// A channel of a color as a byte: whole numbers by their width, others from 0 to 1.
pub(crate) fn channel(value: f64, scalar: Scalar) -> u8 {
    // A cast of a float saturates, and makes NaN 0.
    match scalar {
        Scalar::F32 | Scalar::F64 => (value * 255.0).round() as u8,
        Scalar::U16 => (value / 257.0).round() as u8,
        _ => value as u8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_points_keep_their_millimetres() {
        let far = [[500_000.123, 4_000_000.456, 12.0], [500_001.5, 3_999_999.25, f64::NAN]];
        // A point at zero before hundreds of others does not choose the offset, nor does one that is farther.
        let mut builder = CloudBuilder::new(true);
        for p in [[0.0; 3], [9e7, 0.0, 0.0], far[0], far[0], far[0]] {
            assert!(builder.push(0, p));
        }
        let cloud = builder.finish();
        assert_eq!((cloud.offset, cloud.points.len()), ([500_000.0, 4_000_000.0, 12.0], 5));
        assert!((cloud.position(4)[1] - far[0][1]).abs() < 1e-6);
        let mut builder = CloudBuilder::new(true);
        assert_eq!(far.map(|p| builder.push(0, p)), [true, false]);
        assert!(!builder.push(0, [1e9, 0.0, 0.0]));
        let cloud = builder.finish();
        assert_eq!(cloud.offset, [500_000.0, 4_000_000.0, 12.0]);
        for k in 0..3 {
            assert!((cloud.position(0)[k] - far[0][k]).abs() < 1e-6);
        }
        assert_eq!((cloud.refused.not_finite, cloud.refused.too_far), (1, 1));
    }

    #[test]
    fn times_are_since_the_earliest() {
        let mut builder = CloudBuilder::new(false);
        builder.times = vec![1.7e9 + 0.5, 1.7e9, f64::NAN];
        let cloud = builder.finish();
        assert_eq!((cloud.start_time, cloud.times), (1.7e9, vec![0.5, 0.0, 0.0]));
        let mut builder = CloudBuilder::new(false);
        builder.times = vec![1.7e18, 1.7e18 + 1e8];
        let cloud = builder.finish();
        assert!((cloud.start_time - 1.7e9).abs() < 1e-3 && (cloud.times[1] - 0.1).abs() < 1e-6);
    }

    #[test]
    fn channels_of_every_width() {
        assert_eq!(channel(200.0, Scalar::U8), 200);
        assert_eq!(channel(65535.0, Scalar::U16), 255);
        assert_eq!(channel(1.0, Scalar::F32), 255);
        assert_eq!(channel(f64::NAN, Scalar::F32), 0);
    }
}
