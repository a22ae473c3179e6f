//! Readings of what moved, taken out of scans: the space up to them stays free, and nothing is built of them.

use super::{BeamKind, Frame, Origin, PointScan, RangeImage, Scan};
use crate::geom::vector::{add, along};

/// A scan whose readings can turn out to be of something that moved.
pub trait Movable<const D: usize>: Sized {
    /// The scan in which surfaces at the points where `moved` holds are none: they free the space up to them. And these points.
    /// All in the sensor's frame (meters). The pixels of an image beside points are asked by themselves.
    #[must_use]
    fn without(self, moved: &(dyn Fn([f64; D]) -> bool + Sync)) -> (Self, Vec<[f64; D]>);
}

impl<const D: usize> Movable<D> for Scan<D> {
    fn without(mut self, moved: &(dyn Fn([f64; D]) -> bool + Sync)) -> (Self, Vec<[f64; D]>) {
        let mut gone = Vec::new();
        for i in 0..self.len() {
            let beam = self.beam(i);
            let end = along(self.origin(i), beam.direction, beam.range);
            if beam.is_hit() && moved(end) {
                self.kinds[i] = BeamKind::Mover;
                gone.push(end);
            }
        }
        (self, gone)
    }
}

impl Movable<3> for RangeImage {
    fn without(mut self, moved: &(dyn Fn([f64; 3]) -> bool + Sync)) -> (Self, Vec<[f64; 3]>) {
        let gone: Vec<(usize, [f64; 3])> = self.points().filter(|(_, point)| moved(*point)).collect();
        gone.iter().for_each(|(pixel, _)| self.values[*pixel] *= -1.0);
        (self, gone.into_iter().map(|(_, point)| point).collect())
    }
}

impl Movable<3> for PointScan {
    fn without(mut self, moved: &(dyn Fn([f64; 3]) -> bool + Sync)) -> (Self, Vec<[f64; 3]>) {
        let gone: Vec<bool> = self.points.iter().map(|p| moved(p.map(f64::from))).collect();
        if let (Some(image), Origin::Common(origin)) = (self.image.take(), &self.origin) {
            self.image = Some(image.without(&|p| moved(add(p, *origin))).0);
        }
        let ends = chosen(&self.points, &gone, true);
        self.times = moved_over(&self.times, &gone, self.free_ends.len());
        if let Origin::PerPoint(origins) = &mut self.origin {
            *origins = moved_over(origins, &gone, self.free_ends.len());
        }
        if let Some(delivered) = self.delivered.as_deref_mut() {
            delivered.free_ends.extend(chosen(&delivered.points, &gone, true));
            delivered.points = chosen(&delivered.points, &gone, false);
        }
        self.colors = chosen(&self.colors, &gone, false);
        self.points = chosen(&self.points, &gone, false);
        self.free_ends.extend(&ends);
        (self, ends.into_iter().map(|p| p.map(f64::from)).collect())
    }
}

impl Movable<3> for Frame {
    fn without(self, moved: &(dyn Fn([f64; 3]) -> bool + Sync)) -> (Self, Vec<[f64; 3]>) {
        match self {
            Self::Image(image) => {
                let (image, gone) = image.without(moved);
                (Self::Image(image), gone)
            }
            Self::Points(scan) => {
                let (scan, gone) = scan.without(moved);
                (Self::Points(scan), gone)
            }
        }
    }
}

/// Those of the items that are gone, or those that are not.
fn chosen<T: Copy>(items: &[T], gone: &[bool], which: bool) -> Vec<T> {
    items.iter().zip(gone).filter(|(_, gone)| **gone == which).map(|(item, _)| *item).collect()
}

/// Items of points, then of free ends: those of points that are gone come last, if free ends have such items at all.
fn moved_over<T: Copy>(items: &[T], gone: &[bool], free_ends: usize) -> Vec<T> {
    let (points, ends) = items.split_at(gone.len().min(items.len()));
    let mut all = chosen(points, gone, false);
    all.extend(ends);
    if ends.len() == free_ends {
        all.extend(chosen(points, gone, true));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Trajectory;
    use crate::geom::{Pose, vector::distance};
    use crate::scan::{Beam, Fingerprint, Pinhole, RangeLimits};

    #[test]
    fn beams_that_moved_free_space_up_to_there() {
        let bearings: Vec<f64> = (0..8).map(|i| f64::from(i) * 0.1).collect();
        let scan =
            Scan::from_laser(&bearings, &[1.0, 2.0, 1.0, 0.0, 2.0, 3.0, 1.0, 9.0], &RangeLimits::default());
        let (rest, gone) = scan.clone().without(&|p: [f64; 2]| distance(p, [0.0; 2]) < 1.5);
        let kinds: Vec<_> = rest.beams().map(|b| b.kind).collect();
        use BeamKind::{Dropped, Hit, Mover};
        assert_eq!(kinds, [Mover, Hit, Mover, Dropped, Hit, Hit, Mover, Hit]);
        assert_eq!((rest.counts().mover, rest.counts().total(), gone.len()), (3, 8, 3));
        let free = |b: Beam<2>| b.free_range();
        assert!(rest.beams().map(free).eq(scan.beams().map(free)), "they free what they freed");
        assert_eq!(rest.order(), scan.order());
        assert!(rest.fingerprint() != scan.fingerprint());
        assert_eq!(scan.clone().without(&|_| false), (scan, vec![]));
    }

    #[test]
    fn pixels_that_moved_free_space_up_to_there() {
        let camera = Pinhole { fx: 2.0, fy: 2.0, cx: 0.5, cy: 0.0 };
        let image = RangeImage::from_depth(camera, 4, 1, vec![2.0, 0.0, 1.0, -3.0]);
        let (rest, gone) = image.without(&|p| p[2] < 1.5);
        assert_eq!((rest.values, gone.len()), (vec![2.0, 0.0, -1.0, -3.0], 1));
    }

    /// Everything that a scan of points can have beside them: times, colors, origins, an image, what was delivered.
    #[test]
    fn what_goes_with_points_goes_with_them() {
        let points = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, 0.0, 0.0]];
        let near = |p: [f64; 3]| p[0] > 1.5 && p[0] < 3.5;
        let scan = PointScan {
            free_ends: vec![[0.0, 9.0, 0.0]],
            times: vec![0.1, 0.2, 0.3, 0.4, 0.9],
            colors: vec![[1; 3], [2; 3], [3; 3], [4; 3]],
            ..PointScan::new(points, [0.5, 0.0, 0.0])
        };
        let (rest, gone) = scan.clone().without(&near);
        assert_eq!(gone, [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
        assert_eq!(rest.points, [[1.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
        assert_eq!(rest.free_ends, [[0.0, 9.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
        assert_eq!((rest.times, rest.colors), (vec![0.1, 0.4, 0.9, 0.2, 0.3], vec![[1; 3], [4; 3]]));
        // Free ends without times stay without.
        let timed = PointScan { times: vec![0.1, 0.2, 0.3, 0.4], ..scan.clone() };
        assert_eq!(timed.without(&near).0.times, [0.1, 0.4]);
        let own: Vec<[f32; 3]> = (0..5).map(|i| [0.0, 0.1 * i as f32, 0.0]).collect();
        let many = PointScan { origin: Origin::PerPoint(own.clone()), ..scan.clone() };
        assert_eq!(many.without(&near).0.origin, Origin::PerPoint([0, 3, 4, 1, 2].map(|i| own[i]).to_vec()));

        let path = Trajectory::new((0..40).map(|i| (0.05 * f64::from(i), Pose::<3>::IDENTITY))).unwrap();
        let mut moving = scan;
        moving.deskew(&Pose::IDENTITY, &mut path.motion(f64::INFINITY), 0.0).unwrap();
        let moving = moving.without(&near).0;
        let (points, ends, _) = moving.delivered.as_deref().unwrap().rays();
        assert_eq!((points.len(), ends.len()), (2, 3));
        assert!(points.iter().all(|p| !near(p.map(f64::from))));
    }

    #[test]
    fn the_image_beside_points_loses_the_same() {
        let camera = Pinhole { fx: 2.0, fy: 2.0, cx: 0.0, cy: 0.0 };
        let image = RangeImage::from_depth(camera, 3, 1, vec![1.0, 2.0, 3.0]);
        let points: Vec<[f32; 3]> =
            image.points().map(|(_, p)| add(p, [0.0, 0.0, 5.0]).map(|v| v as f32)).collect();
        let scan = PointScan { image: Some(image), ..PointScan::new(points, [0.0, 0.0, 5.0]) };
        let (rest, gone) = scan.without(&|p| p[2] > 6.5 && p[2] < 7.5);
        assert_eq!((gone.len(), rest.points.len()), (1, 2));
        assert_eq!(rest.image.unwrap().values, [1.0, -2.0, 3.0]);
    }
}
