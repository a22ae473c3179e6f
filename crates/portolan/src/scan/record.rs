//! A scan: beams from the zero of the sensor's frame, or from where the sensor was when it moved.

use super::{Beam, BeamCounts, BeamKind, RefusedBeams};
use crate::geom::{Pose, vector};

/// What is known about the neighborhood of beams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamOrder {
    /// Nothing: a bag of beams.
    Unordered,
    /// Bearings ascend counter-clockwise (2-D), so that consecutive beams are neighbors; with `closed` the
    /// last is a neighbor of the first.
    Fan {
        /// Whether the fan goes all the way round.
        closed: bool,
    },
}

/// A scan of a range sensor in the sensor's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan<const D: usize> {
    pub(super) directions: Vec<[f64; D]>,
    ranges: Vec<f64>,
    pub(super) kinds: Vec<BeamKind>,
    /// Where each beam begins; empty: all in the zero.
    pub(super) origins: Vec<[f64; D]>,
    pub(super) order: BeamOrder,
    refused: RefusedBeams,
    time: Option<f64>,
}

impl<const D: usize> Scan<D> {
    /// A scan of beams without a known order.
    ///
    /// Beams that no map could use (a direction or a range that is NaN or infinite, a negative range) become
    /// [`BeamKind::Dropped`] and are counted in [`Scan::refused`]. Directions are normalised.
    pub fn from_beams(beams: impl IntoIterator<Item = Beam<D>>) -> Self {
        let mut scan = Self {
            directions: Vec::new(),
            ranges: Vec::new(),
            kinds: Vec::new(),
            origins: Vec::new(),
            order: BeamOrder::Unordered,
            refused: RefusedBeams::default(),
            time: None,
        };
        for beam in beams {
            scan.push(beam);
        }
        scan
    }

    /// A scan of end points in the sensor's frame (meters), each a hit: the one call for point clouds.
    pub fn from_points(points_sensor: &[impl Into<[f64; D]> + Copy]) -> Self {
        Self::from_beams(points_sensor.iter().map(|&p| {
            let p: [f64; D] = p.into();
            let range = vector::norm(p);
            Beam { direction: p, range, kind: BeamKind::Hit }
        }))
    }

    fn push(&mut self, beam: Beam<D>) {
        let mut usable = beam;
        match vector::unit(beam.direction) {
            Some(direction) if beam.range.is_finite() => {
                usable.direction = direction;
                if beam.range < 0.0 {
                    self.refused.negative += 1;
                    usable.kind = BeamKind::Dropped;
                }
            }
            // A point on the sensor itself has no direction: it is too near, not broken.
            None if beam.range == 0.0 => {
                self.refused.too_near += 1;
                usable.kind = BeamKind::Dropped;
            }
            _ => {
                self.refused.not_finite += 1;
                usable.kind = BeamKind::Dropped;
            }
        }
        if usable.kind == BeamKind::Dropped {
            usable.range = 0.0;
            if vector::unit(usable.direction).is_none() {
                usable.direction = [0.0; D];
                usable.direction[0] = 1.0;
            }
        }
        self.directions.push(usable.direction);
        self.ranges.push(usable.range);
        self.kinds.push(usable.kind);
    }

    pub(super) fn with_order(mut self, order: BeamOrder) -> Self {
        self.order = order;
        self
    }

    pub(super) fn refuse(&mut self, causes: RefusedBeams) {
        self.refused += causes;
    }

    /// The same scan with the time at which it was taken (seconds, in the log's own clock).
    pub fn at_time(mut self, seconds: f64) -> Self {
        self.time = Some(seconds);
        self
    }

    /// When the scan was taken (seconds, in the log's own clock), if the log has it.
    pub fn time(&self) -> Option<f64> {
        self.time
    }

    /// Number of beams, the dropped ones included.
    pub fn len(&self) -> usize {
        self.ranges.len()
    }

    /// Whether the scan has no beam.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// Beam `i`. Panics where `i` is out of range.
    #[inline(always)]
    pub fn beam(&self, i: usize) -> Beam<D> {
        Beam { direction: self.directions[i], range: self.ranges[i], kind: self.kinds[i] }
    }

    /// Where beam `i` begins in the sensor's frame (meters): its zero, unless the sensor moved while it scanned and that was taken
    /// out ([`Scan::deskew`]). Panics where `i` is out of range and beams have origins of their own.
    #[inline(always)]
    pub fn origin(&self, i: usize) -> [f64; D] {
        if self.origins.is_empty() { [0.0; D] } else { self.origins[i] }
    }

    /// All beams in order.
    pub fn beams(&self) -> impl ExactSizeIterator<Item = Beam<D>> + '_ {
        (0..self.len()).map(|i| self.beam(i))
    }

    /// What is known about which beams are neighbors.
    pub fn order(&self) -> BeamOrder {
        self.order
    }

    /// The neighbor after beam `i`, if the order gives one.
    #[inline(always)]
    pub fn next(&self, i: usize) -> Option<usize> {
        match self.order {
            BeamOrder::Unordered => None,
            BeamOrder::Fan { closed } if i + 1 == self.len() => closed.then_some(0),
            BeamOrder::Fan { .. } => Some(i + 1),
        }
    }

    /// The neighbor before beam `i`, if the order gives one.
    #[inline(always)]
    pub fn previous(&self, i: usize) -> Option<usize> {
        match self.order {
            BeamOrder::Unordered => None,
            BeamOrder::Fan { closed } if i == 0 => closed.then(|| self.len() - 1),
            BeamOrder::Fan { .. } => Some(i - 1),
        }
    }

    /// End points of the hits in the world frame.
    pub fn hits_world<'a>(&'a self, world_from_sensor: &'a Pose<D>) -> impl Iterator<Item = [f64; D]> + 'a {
        self.beams().enumerate().filter(|(_, b)| b.is_hit()).map(|(i, b)| {
            world_from_sensor.transform_point(vector::along(self.origin(i), b.direction, b.range))
        })
    }

    /// The distance from the zero of the sensor's frame up to which any beam has something to say (meters), hits included.
    pub fn reach(&self) -> f64 {
        let reach = |(i, b): (usize, Beam<D>)| match b.free_range() {
            range if range > 0.0 => vector::norm(self.origin(i)) + range,
            _ => 0.0,
        };
        self.beams().enumerate().map(reach).fold(0.0, f64::max)
    }

    /// Beams by kind.
    pub fn counts(&self) -> BeamCounts {
        let mut counts = BeamCounts::default();
        self.kinds.iter().for_each(|&k| counts.count(k));
        counts
    }

    /// Readings that were refused when the scan was built, by cause.
    pub fn refused(&self) -> RefusedBeams {
        self.refused
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_map_could_use_is_refused_and_counted() {
        let beam = |range, x| Beam { direction: [x, 0.0, 0.0], range, kind: BeamKind::Hit };
        let scan = Scan::from_beams([
            beam(1.0, 2.0),
            beam(f64::NAN, 1.0),
            beam(f64::INFINITY, 1.0),
            beam(-1.0, 1.0),
            beam(1.0, f64::NAN),
        ]);
        assert_eq!(scan.refused(), RefusedBeams { not_finite: 3, negative: 1, ..Default::default() });
        assert_eq!(scan.counts(), BeamCounts { hit: 1, dropped: 4, ..Default::default() });
        assert_eq!(scan.beam(0).direction, [1.0, 0.0, 0.0]);
        assert_eq!(scan.reach(), 1.0);
    }

    #[test]
    fn points_become_hits_where_they_are() {
        let scan = Scan::from_points(&[[3.0, 4.0], [0.0, 0.0]]);
        let pose = Pose::<2>::new(1.0, 1.0, 0.0);
        let hits: Vec<_> = scan.hits_world(&pose).collect();
        assert_eq!(hits.len(), 1);
        assert!(vector::distance(hits[0], [4.0, 5.0]) < 1e-12);
        assert_eq!(scan.refused().too_near, 1);
    }
}
