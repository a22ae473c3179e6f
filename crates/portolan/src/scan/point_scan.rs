//! 3-D scans as end points: what a lidar's driver delivers.

use super::{Delivered, RangeImage, RefusedBeams};

/// Where the rays of a [`PointScan`] begin, in the frame of its points.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// All in one point (meters).
    Common([f64; 3]),
    /// Each in its own point (meters): a sensor that moved while it scanned, or parallel rays. First those of the points,
    /// then those of the free ends. What lies beyond the end of this list has no origin: maps refuse and count it as not
    /// finite.
    PerPoint(Vec<[f32; 3]>),
    /// Nobody knows where: points of a map that was fused before, or of a survey. Only occupancy maps take them, as hits
    /// that free nothing; maps that need rays refuse and count them as not finite.
    Unknown,
}

/// End points of rays in one frame, as `f32`, which is what sensors deliver.
///
/// The frame is the sensor's or any other that is near (for points in the world's frame give the identity as the pose and
/// the sensor's position as the origin): far from its zero an `f32` loses millimeters.
#[derive(Clone, Debug, PartialEq)]
pub struct PointScan {
    /// Where rays begin.
    pub origin: Origin,
    /// Surfaces (meters).
    pub points: Vec<[f32; 3]>,
    /// Ends of rays that met no surface up to there (meters).
    pub free_ends: Vec<[f32; 3]>,
    /// When each point was measured, if the sensor says so: seconds after [`PointScan::start_time`], one per point and, where
    /// they are known, then one per free end. Empty: it does not.
    pub times: Vec<f32>,
    /// When `times` are zero (seconds, in the sensor's own clock).
    pub start_time: f64,
    /// Red, green, blue, one per point, if the sensor sees color. Empty: it does not.
    pub colors: Vec<[u8; 3]>,
    /// The same readings as rows and columns, where they have them.
    pub image: Option<RangeImage>,
    /// The same readings as they were delivered, where the motion of the sensor was taken out of them.
    pub delivered: Option<Box<Delivered>>,
    /// Readings that were refused when the scan was built, by cause.
    pub refused: RefusedBeams,
}

impl PointScan {
    /// A scan of points about a common origin, both in one frame. Points that are not finite, or that lie on the
    /// origin itself, are refused and counted.
    pub fn new(points: impl IntoIterator<Item = [f32; 3]>, origin: [f64; 3]) -> Self {
        let mut refused = RefusedBeams::default();
        let mut kept = Vec::new();
        for p in points {
            if !p.iter().all(|v| v.is_finite()) {
                refused.not_finite += 1;
            } else if (0..3).all(|k| f64::from(p[k]) == origin[k]) {
                refused.too_near += 1;
            } else {
                kept.push(p);
            }
        }
        Self {
            origin: Origin::Common(origin),
            points: kept,
            free_ends: Vec::new(),
            times: Vec::new(),
            start_time: 0.0,
            colors: Vec::new(),
            image: None,
            delivered: None,
            refused,
        }
    }

    /// The origin of point `i`, or of free end `i - points.len()`; `None` where the scan gives it none.
    #[inline(always)]
    pub fn origin_of(&self, i: usize) -> Option<[f64; 3]> {
        match &self.origin {
            Origin::Common(o) => Some(*o),
            Origin::PerPoint(all) => all.get(i).map(|o| o.map(f64::from)),
            Origin::Unknown => None,
        }
    }
}

/// One 3-D scan, in its own form.
#[derive(Clone, Debug, PartialEq)]
pub enum Frame {
    /// Rows and columns only: a depth camera, a range scanner.
    Image(RangeImage),
    /// End points, perhaps with rows and columns beside them.
    Points(PointScan),
}

impl Frame {
    /// Number of surfaces.
    pub fn hits(&self) -> usize {
        match self {
            Self::Image(image) => image.hits(),
            Self::Points(scan) => scan.points.len(),
        }
    }

    /// The surfaces alone, as points that nothing looked at: what is left where a scan is not to free any space.
    pub fn without_rays(self) -> Self {
        let scan = match self {
            Self::Points(scan) => scan,
            Self::Image(all) => {
                let hits = all.readings().filter(|(.., hit)| *hit).map(|(_, end, _)| end.map(|v| v as f32));
                PointScan { refused: all.refused, ..PointScan::new(hits, [f64::INFINITY; 3]) }
            }
        };
        let mut times = scan.times;
        times.truncate(scan.points.len());
        Self::Points(PointScan {
            origin: Origin::Unknown,
            image: None,
            delivered: None,
            free_ends: Vec::new(),
            times,
            ..scan
        })
    }

    /// Readings that were refused when the scan was built, by cause.
    pub fn refused(&self) -> RefusedBeams {
        match self {
            Self::Image(image) => image.refused,
            Self::Points(scan) => scan.refused,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_a_point_is_counted() {
        let scan = PointScan::new([[1.0, 2.0, 3.0], [f32::NAN, 0.0, 0.0], [0.5, 0.0, 0.0]], [0.5, 0.0, 0.0]);
        assert_eq!(scan.points, [[1.0, 2.0, 3.0]]);
        assert_eq!((scan.refused.not_finite, scan.refused.too_near), (1, 1));
        assert_eq!(Frame::Points(scan).hits(), 1);
    }
}
