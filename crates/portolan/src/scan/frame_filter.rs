//! What of a frame is used: limits of range, and the robot's own body.

use super::{BeamCounts, Frame, Origin, PointScan, RangeImage};
use crate::geom::Aabb;
use crate::geom::vector::{along, distance, norm, sub};

/// A part of the sensor's frame in which readings show the robot that carries the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    /// A box (meters).
    Box(Aabb<3>),
    /// A ball (meters).
    Sphere {
        /// Its center.
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
///
/// Ranges are measured from a ray's own origin. Parallel rays have no meaningful one: the limits of range do not
/// apply to them (to an image of parallel rays, and to the points beside one), only the body does.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFilter {
    /// Readings up to this range are refused (meters).
    pub min_range: f64,
    /// Surfaces beyond this are not used; the space up to here is free (meters).
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
    NotFinite,
    TooNear,
    /// Free up to the limit, and what is behind it is not used.
    Cut,
    Body,
}

impl FrameFilter {
    /// The frame with what is used, and what its readings were: the self hits are those that were left out.
    ///
    /// Refused readings are counted in the frame itself. Times and colors stay with their points; the image beside points
    /// is filtered by the same rules. Bodies are compared with points relative to a common origin, else with the points
    /// themselves. A free end keeps the origin and the time of its point. An image that contradicts itself ([`RangeImage::check`]) stays as it is, and is not counted: maps refuse it.
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

    /// `range` is `None` where no limit applies.
    fn decide(&self, range: Option<f64>, p_sensor: [f64; 3]) -> Use {
        if !(range.unwrap_or(0.0).is_finite() && p_sensor.iter().all(|v| v.is_finite())) {
            Use::NotFinite
        } else if range.is_some_and(|r| r <= self.min_range) {
            Use::TooNear
        } else if self.body.iter().any(|b| b.contains(p_sensor)) {
            Use::Body
        } else if range.is_some_and(|r| r > self.max_range) {
            Use::Cut
        } else {
            Use::Keep
        }
    }

    fn image(&self, mut image: RangeImage, counts: &mut BeamCounts) -> RangeImage {
        if image.check().is_err() {
            return image;
        }
        let parallel = image.has_parallel_rays();
        for i in 0..image.values.len() {
            let value = image.values[i];
            let p = image.point(i % image.columns, i / image.columns, f64::from(value));
            let range = norm(p);
            let what = match value {
                v if v > 0.0 && !self.uses_all() => self.decide((!parallel).then_some(range), p),
                v if v.is_finite() => Use::Keep,
                _ => Use::NotFinite,
            };
            image.values[i] = match what {
                Use::Keep => value,
                Use::Cut => -(f64::from(value) * self.max_range / range) as f32,
                // What is not finite stays where all is used, for the map to refuse.
                Use::NotFinite if self.uses_all() => value,
                Use::NotFinite | Use::TooNear | Use::Body => 0.0,
            };
            match what {
                Use::NotFinite => {
                    image.refused.not_finite += u64::from(!self.uses_all());
                    counts.dropped += 1;
                }
                Use::TooNear => {
                    image.refused.too_near += 1;
                    counts.dropped += 1;
                }
                Use::Body => counts.self_hit += 1,
                Use::Cut => counts.max_range += 1,
                Use::Keep if value > 0.0 => counts.hit += 1,
                Use::Keep if value < 0.0 => counts.max_range += 1,
                // What was refused before is among these.
                Use::Keep => counts.dropped += 1,
            }
        }
        image
    }

    fn points(&self, mut scan: PointScan, counts: &mut BeamCounts) -> PointScan {
        counts.max_range += scan.free_ends.len() as u64;
        counts.dropped += scan.refused.total();
        if self.uses_all() {
            let origins = match &scan.origin {
                Origin::Common(_) | Origin::Unknown => scan.points.len(),
                Origin::PerPoint(all) => all.len().min(scan.points.len()),
            };
            counts.hit += origins as u64;
            counts.dropped += (scan.points.len() - origins) as u64;
            return scan;
        }
        // What is left out would still be in it.
        scan.delivered = None;
        let parallel = scan.image.as_ref().is_some_and(RangeImage::has_parallel_rays);
        scan.image = scan.image.map(|image| {
            // The same readings as the points, which are counted.
            let refused = image.refused;
            RangeImage { refused, ..self.image(image, &mut BeamCounts::default()) }
        });
        let mut kept = vec![false; scan.points.len()];
        let timed_ends = scan.times.len() == scan.points.len() + scan.free_ends.len();
        // What is beyond the points belongs to the free ends.
        let mut end_times = scan.times.split_off(scan.points.len().min(scan.times.len()));
        let mut end_origins = match &mut scan.origin {
            Origin::Common(_) | Origin::Unknown => Vec::new(),
            Origin::PerPoint(all) => all.split_off(scan.points.len().min(all.len())),
        };
        for (i, keep) in kept.iter_mut().enumerate() {
            let p = scan.points[i].map(f64::from);
            let common = matches!(scan.origin, Origin::Common(_));
            // Without an origin there is no range to limit.
            let ranged = !parallel && scan.origin != Origin::Unknown;
            let origin = match &scan.origin {
                Origin::Unknown => [0.0; 3],
                _ => scan.origin_of(i).unwrap_or([f64::NAN; 3]),
            };
            let offset = sub(p, origin);
            let range = norm(offset);
            let what = if range.is_finite() {
                self.decide(ranged.then_some(range), if common { offset } else { p })
            } else {
                Use::NotFinite
            };
            match what {
                Use::Keep => {
                    *keep = true;
                    counts.hit += 1;
                }
                Use::NotFinite => {
                    scan.refused.not_finite += 1;
                    counts.dropped += 1;
                }
                Use::TooNear => {
                    scan.refused.too_near += 1;
                    counts.dropped += 1;
                }
                Use::Body => counts.self_hit += 1,
                Use::Cut => {
                    counts.max_range += 1;
                    let end = along(origin, offset, self.max_range / range);
                    scan.free_ends.push(end.map(|v| v as f32));
                    end_origins.extend((!common).then_some(origin.map(|v| v as f32)));
                    end_times.extend(scan.times.get(i).filter(|_| timed_ends));
                }
            }
        }
        retain(&mut scan.points, &kept);
        retain(&mut scan.times, &kept);
        retain(&mut scan.colors, &kept);
        scan.times.extend(end_times);
        if let Origin::PerPoint(origins) = &mut scan.origin {
            // Points without an origin were at the end, and are gone.
            let mut marks = kept.iter();
            origins.retain(|_| marks.next().copied().unwrap_or(false));
            origins.extend(end_origins);
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
    use crate::scan::{Orthographic, Pinhole, Projection};

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
        // The free end was measured when its point was.
        assert_eq!((kept.times.clone(), kept.free_ends.clone()), (vec![0.0, 0.4], vec![[0.0, 4.0, 0.0]]));
        assert_eq!(kept.refused.too_near, 1);
        assert_eq!(
            counts,
            BeamCounts { hit: 1, max_range: 1, no_return: 0, dropped: 1, self_hit: 2, mover: 0 }
        );
        let (all, counts) = FrameFilter::default().apply(Frame::Points(scan.clone()));
        assert_eq!((all, counts.hit), (Frame::Points(scan), 5));
    }

    #[test]
    fn pixels_are_kept_cut_or_counted() {
        let camera = Pinhole { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0 };
        let mut image = RangeImage::from_depth(camera, 5, 1, [1.0, 2.0, 0.0, 3.0, -1.5]);
        // The pixel without a value was refused before.
        image.refused.too_near = 1;
        // Pixel 1 is (2, 0, 2), range 2.83; pixel 3 (9, 0, 3), range 9.49.
        let near = FrameFilter { min_range: 1.5, max_range: 4.0, body: Vec::new() };
        let (Frame::Image(image), counts) = near.apply(Frame::Image(image)) else {
            panic!("images stay images")
        };
        assert_eq!((image.values[0], image.values[1], image.values[4]), (0.0, 2.0, -1.5));
        let cut = -f64::from(image.values[3]);
        assert!((norm([3.0 * cut, 0.0, cut]) - 4.0).abs() < 1e-6);
        assert_eq!(image.refused.too_near, 2);
        assert_eq!(
            counts,
            BeamCounts { hit: 1, max_range: 2, no_return: 0, dropped: 2, self_hit: 0, mover: 0 }
        );
    }
    fn ground(values: Vec<f32>) -> RangeImage {
        let rays = Orthographic { first: [0.0; 2], step: [0.5; 2] };
        RangeImage::new(Projection::Orthographic { rays, top: 10.0 }, values.len(), 1, values)
    }

    #[test]
    fn the_image_beside_points_is_filtered_with_them() {
        let camera = Pinhole { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0 };
        let image = RangeImage::from_depth(camera, 4, 1, [1.0, 0.25, 3.0, 0.0]);
        let origin = [5.0, 0.0, 0.0];
        let points: Vec<_> =
            image.points().map(|(_, p)| [p[0] + 5.0, p[1], p[2]].map(|v| v as f32)).collect();
        let mut scan = PointScan::new(points, origin);
        scan.image = Some(image);
        // Points at 1, 0.35 and 6.7 m.
        let (Frame::Points(scan), counts) = filter().apply(Frame::Points(scan)) else { panic!("points") };
        let image = scan.image.unwrap();
        assert_eq!((&image.values[..2], image.values[3]), (&[1.0, 0.0][..], 0.0));
        assert!((norm([2.0, 0.0, 1.0]) * f64::from(-image.values[2]) - 4.0).abs() < 1e-6);
        assert_eq!((scan.points.len(), scan.free_ends.len()), (1, 1));
        assert_eq!((scan.refused.too_near, image.refused.total()), (1, 0));
        assert_eq!(counts, BeamCounts { hit: 1, max_range: 1, dropped: 1, ..Default::default() });
    }

    #[test]
    fn parallel_rays_have_no_limits_of_range_but_a_body() {
        // At x = 0 and 1 m, z = 9.7 m and 1 m; the second of three in the body.
        let image = ground(vec![0.3, 9.0, 9.0]);
        let body = vec![Body::Box(Aabb::new([0.4, -0.1, 0.9], [0.6, 0.1, 1.1]))];
        let filter = FrameFilter { min_range: 0.5, max_range: 4.0, body };
        let want = BeamCounts { hit: 2, self_hit: 1, ..Default::default() };
        let (Frame::Image(kept), counts) = filter.apply(Frame::Image(image.clone())) else { panic!("image") };
        assert_eq!((kept.values, counts), (vec![0.3, 0.0, 9.0], want));
        let ends = image.points().map(|(_, p)| p.map(|v| v as f32));
        let mut scan = PointScan::new(ends, [0.0, 0.0, 100.0]);
        scan.origin = Origin::PerPoint(image.readings().map(|(o, ..)| o.map(|v| v as f32)).collect());
        scan.image = Some(image);
        let (Frame::Points(kept), counts) = filter.apply(Frame::Points(scan)) else { panic!("points") };
        assert_eq!((kept.image.unwrap().values, counts), (vec![0.3, 0.0, 9.0], want));
        assert_eq!(kept.origin, Origin::PerPoint(vec![[0.0, 0.0, 10.0], [1.0, 0.0, 10.0]]));
    }

    #[test]
    fn origins_of_their_own_stay_with_what_is_cut_and_may_be_missing() {
        let mut scan =
            PointScan::new([[0.0, 0.0, 1.0], [0.0, 9.0, 0.0], [0.5, 0.0, 1.0], [3.0, 0.0, 0.0]], [0.0; 3]);
        scan.origin = Origin::PerPoint(vec![[0.0; 3], [0.0, 1.0, 0.0], [0.5, 0.0, 3.0]]);
        let (all, counts) = FrameFilter::default().apply(Frame::Points(scan.clone()));
        assert_eq!((all, counts.hit, counts.dropped), (Frame::Points(scan.clone()), 3, 1));
        let (Frame::Points(kept), counts) = filter().apply(Frame::Points(scan)) else { panic!("points") };
        let origins = Origin::PerPoint(vec![[0.0; 3], [0.0, 1.0, 0.0]]);
        assert_eq!((kept.points, kept.origin), (vec![[0.0, 0.0, 1.0]], origins));
        assert_eq!((kept.refused.not_finite, kept.free_ends), (1, vec![[0.0, 5.0, 0.0]]));
        assert_eq!(
            counts,
            BeamCounts { hit: 1, max_range: 1, dropped: 1, self_hit: 1, ..Default::default() }
        );
    }

    #[test]
    fn images_that_contradict_themselves_pass_untouched() {
        for (image, why) in crate::scan::broken_images() {
            let (frame, counts) = filter().apply(Frame::Image(image.clone()));
            // Values that are NaN are not equal to themselves.
            let words = |f: &Frame| format!("{f:?}");
            assert_eq!((words(&frame), counts.total()), (words(&Frame::Image(image.clone())), 0), "{why}");
            let mut scan = PointScan::new([[0.0, 0.0, 1.0]], [0.0; 3]);
            scan.image = Some(image);
            let (after, counts) = filter().apply(Frame::Points(scan.clone()));
            assert_eq!((words(&after), counts.hit), (words(&Frame::Points(scan)), 1), "{why}");
        }
    }
}
