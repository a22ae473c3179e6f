//! What of a frame is used: limits of range, and the robot's own body.

use super::{BeamCounts, Frame, Origin, PointScan, Projection, RangeImage};
use crate::geom::Aabb;
use crate::geom::vector::{along, distance, norm, sub};

/// A part of the sensor's frame in which readings show the robot that carries the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    /// A box (metres).
    Box(Aabb<3>),
    /// A ball (metres).
    Sphere {
        /// Its centre.
        center: [f64; 3],
        /// Its radius.
        radius: f64,
    },
}

impl Body {
    /// Whether a point of the sensor's frame lies inside.
    pub fn contains(&self, p_sensor: [f64; 3]) -> bool {
        match self {
            Self::Box(b) => b.contains(p_sensor),
            Self::Sphere { center, radius } => distance(*center, p_sensor) <= *radius,
        }
    }
}

/// Which readings of a frame are used. The default uses all.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFilter {
    /// Readings up to this range are refused (metres).
    pub min_range: f64,
    /// Surfaces beyond this are not used; the space up to here is free (metres).
    pub max_range: f64,
    /// Readings inside of these say nothing about the world.
    pub body: Vec<Body>,
}

impl Default for FrameFilter {
    fn default() -> Self {
        Self { min_range: 0.0, max_range: f64::INFINITY, body: Vec::new() }
    }
}

/// What becomes of a reading.
#[derive(Clone, Copy, PartialEq)]
enum Use {
    Keep,
    TooNear,
    /// Free up to the limit, and what is behind it is not used.
    Cut,
    Body,
}

impl FrameFilter {
    /// The frame with what is used, and what its readings were: the self hits are those that were left out.
    ///
    /// Refused readings are counted in the frame itself. Times and colours stay with their points.
    pub fn apply(&self, frame: Frame) -> (Frame, BeamCounts) {
        let mut counts = BeamCounts::default();
        let frame = match frame {
            Frame::Image(image) => Frame::Image(self.image(image, &mut counts)),
            Frame::Points(scan) => Frame::Points(self.points(scan, &mut counts)),
        };
        (frame, counts)
    }

    fn uses_all(&self) -> bool {
        self.min_range <= 0.0 && self.max_range == f64::INFINITY && self.body.is_empty()
    }

    fn decide(&self, range: f64, p_sensor: [f64; 3]) -> Use {
        if range <= self.min_range {
            Use::TooNear
        } else if self.body.iter().any(|b| b.contains(p_sensor)) {
            Use::Body
        } else if range > self.max_range {
            Use::Cut
        } else {
            Use::Keep
        }
    }

    fn image(&self, mut image: RangeImage, counts: &mut BeamCounts) -> RangeImage {
        let orthographic = matches!(image.projection, Projection::Orthographic { .. });
        for i in 0..image.values.len() {
            let value = image.values[i];
            if value > 0.0 && !self.uses_all() {
                let p = image.point(i % image.columns, i / image.columns, f64::from(value));
                // Parallel rays have no origin to be far from: their values count.
                let range = if orthographic { f64::from(value) } else { norm(p) };
                image.values[i] = match self.decide(range, p) {
                    Use::Keep => value,
                    Use::TooNear => {
                        image.refused.too_near += 1;
                        0.0
                    }
                    Use::Body => {
                        counts.self_hit += 1;
                        0.0
                    }
                    Use::Cut => -(f64::from(value) * self.max_range / range) as f32,
                };
                if image.values[i] == 0.0 {
                    continue;
                }
            }
            match image.values[i] {
                v if v > 0.0 => counts.hit += 1,
                v if v < 0.0 => counts.max_range += 1,
                _ => counts.dropped += 1,
            }
        }
        counts.dropped += image.refused.too_near;
        image
    }

    fn points(&self, mut scan: PointScan, counts: &mut BeamCounts) -> PointScan {
        counts.max_range += scan.free_ends.len() as u64;
        counts.dropped += scan.refused.total();
        if self.uses_all() {
            counts.hit += scan.points.len() as u64;
            return scan;
        }
        // Rows and columns are of all readings: they are made anew from those that are used.
        scan.image = None;
        let mut kept = vec![false; scan.points.len()];
        for (i, keep) in kept.iter_mut().enumerate() {
            let (p, origin) = (scan.points[i].map(f64::from), scan.origin_of(i));
            let offset = sub(p, origin);
            let range = norm(offset);
            match self.decide(range, offset) {
                Use::Keep => {
                    *keep = true;
                    counts.hit += 1;
                }
                Use::TooNear => {
                    scan.refused.too_near += 1;
                    counts.dropped += 1;
                }
                Use::Body => counts.self_hit += 1,
                Use::Cut => {
                    counts.max_range += 1;
                    // Only rays of the common origin can be told as free ends.
                    if matches!(scan.origin, Origin::Common(_)) {
                        let end = along(origin, offset, self.max_range / range);
                        scan.free_ends.push(end.map(|v| v as f32));
                    }
                }
            }
        }
        retain(&mut scan.points, &kept);
        retain(&mut scan.times, &kept);
        retain(&mut scan.colors, &kept);
        if let Origin::PerPoint(origins) = &mut scan.origin {
            retain(origins, &kept);
        }
        scan
    }
}

/// Keeps the marked entries of a list that has one per point, or none at all.
fn retain<T>(list: &mut Vec<T>, kept: &[bool]) {
    let mut marks = kept.iter();
    if list.len() == kept.len() {
        list.retain(|_| marks.next().copied().unwrap_or(false));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Pinhole, RefusedBeams};

    fn filter() -> FrameFilter {
        let body = vec![
            Body::Sphere { center: [0.0, 0.0, 2.0], radius: 0.1 },
            Body::Box(Aabb::new([0.4, -0.1, 0.9], [0.6, 0.1, 1.1])),
        ];
        FrameFilter { min_range: 0.5, max_range: 4.0, body }
    }

    #[test]
    fn points_are_kept_cut_or_counted() {
        let mut scan = PointScan::new(
            [[0.0, 0.0, 1.0], [0.0, 0.0, 0.3], [0.0, 0.0, 2.05], [0.5, 0.0, 1.0], [0.0, 8.0, 0.0]],
            [0.0; 3],
        );
        scan.times = vec![0.0, 0.1, 0.2, 0.3, 0.4];
        let (frame, counts) = filter().apply(Frame::Points(scan.clone()));
        let Frame::Points(kept) = frame else { panic!("points stay points") };
        assert_eq!(kept.points, [[0.0, 0.0, 1.0]]);
        assert_eq!((kept.times.clone(), kept.free_ends.clone()), (vec![0.0], vec![[0.0, 4.0, 0.0]]));
        assert_eq!(kept.refused.too_near, 1);
        assert_eq!(counts, BeamCounts { hit: 1, max_range: 1, no_return: 0, dropped: 1, self_hit: 2 });
        let (all, counts) = FrameFilter::default().apply(Frame::Points(scan.clone()));
        assert_eq!((all, counts.hit), (Frame::Points(scan), 5));
    }

    #[test]
    fn pixels_are_kept_cut_or_counted() {
        let image = RangeImage {
            projection: Projection::Pinhole(Pinhole { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0 }),
            columns: 5,
            rows: 1,
            values: vec![1.0, 2.0, 0.0, 3.0, -1.5],
            colors: Vec::new(),
            refused: RefusedBeams::default(),
        };
        // Pixel 1 is (2, 0, 2), range 2.83; pixel 3 (9, 0, 3), range 9.49.
        let near = FrameFilter { min_range: 1.5, max_range: 4.0, body: Vec::new() };
        let (Frame::Image(image), counts) = near.apply(Frame::Image(image)) else {
            panic!("images stay images")
        };
        assert_eq!((image.values[0], image.values[1], image.values[4]), (0.0, 2.0, -1.5));
        let cut = -f64::from(image.values[3]);
        assert!((norm([3.0 * cut, 0.0, cut]) - 4.0).abs() < 1e-6);
        assert_eq!(image.refused.too_near, 1);
        assert_eq!(counts, BeamCounts { hit: 1, max_range: 2, no_return: 0, dropped: 2, self_hit: 0 });
    }
}
