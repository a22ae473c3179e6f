//! Scans of planar lasers: bearings and ranges.

use super::{Beam, BeamKind, BeamOrder, RefusedBeams, Scan};

/// How raw readings become beams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeLimits {
    /// Readings nearer than this are refused (meters).
    pub min: f64,
    /// Returns beyond this are not used as surfaces: the beam becomes [`BeamKind::MaxRange`] at this range.
    pub max: f64,
    /// Readings at or above this mean that the sensor got no echo (meters); sensors have different codes.
    pub no_return: f64,
    /// Free length along a beam without an echo (meters), if the caller has a reason to assume one; 0: unknown.
    pub no_return_free: f64,
}

impl Default for RangeLimits {
    /// Every positive finite reading is a hit.
    fn default() -> Self {
        Self { min: 0.0, max: f64::INFINITY, no_return: f64::INFINITY, no_return_free: 0.0 }
    }
}

impl RangeLimits {
    /// The beam of one reading; refused readings are counted by cause.
    pub fn beam<const D: usize>(
        &self,
        direction: [f64; D],
        reading: f64,
        refused: &mut RefusedBeams,
    ) -> Beam<D> {
        let (kind, range) = if reading.is_nan() {
            refused.not_finite += 1;
            (BeamKind::Dropped, 0.0)
        } else if reading < 0.0 {
            refused.negative += 1;
            (BeamKind::Dropped, 0.0)
        } else if reading >= self.no_return {
            (BeamKind::NoReturn, self.no_return_free.min(self.max))
        } else if reading.is_infinite() {
            refused.not_finite += 1;
            (BeamKind::Dropped, 0.0)
        } else if reading <= self.min {
            refused.too_near += 1;
            (BeamKind::Dropped, 0.0)
        } else if reading > self.max {
            (BeamKind::MaxRange, self.max)
        } else {
            (BeamKind::Hit, reading)
        };
        Beam { direction, range, kind }
    }
}

impl Scan<2> {
    /// A planar laser scan: one bearing (radians, counter-clockwise from the sensor's x axis) and one reading
    /// (meters) per beam. Extra entries of the longer slice are ignored.
    ///
    /// Bearings that ascend within one turn make the beams neighbors ([`BeamOrder::Fan`]); any other order
    /// makes a scan without neighborhood.
    pub fn from_laser(bearings: &[f64], readings: &[f64], limits: &RangeLimits) -> Self {
        let directions: Vec<_> = bearings.iter().map(|b| [b.cos(), b.sin()]).collect();
        Self::from_laser_directions(bearings, &directions, readings, limits)
    }

    /// [`Scan::from_laser`] for callers that bring the unit vectors of the bearings (the simulator, to be
    /// equal on every platform; readers, to compute them once per log).
    pub fn from_laser_directions(
        bearings: &[f64],
        directions: &[[f64; 2]],
        readings: &[f64],
        limits: &RangeLimits,
    ) -> Self {
        let mut refused = RefusedBeams::default();
        let beams: Vec<_> =
            directions.iter().zip(readings).map(|(&d, &z)| limits.beam(d, z, &mut refused)).collect();
        let mut scan = Self::from_fan(bearings, beams);
        scan.refuse(refused);
        scan
    }

    /// A planar scan of beams whose kinds are known, with their bearings (radians), one per beam. Bearings that
    /// ascend within one turn make the beams neighbors.
    pub fn from_fan(bearings: &[f64], beams: Vec<Beam<2>>) -> Self {
        let order = fan_order(&bearings[..beams.len().min(bearings.len())]);
        Self::from_beams(beams).with_order(order)
    }
}

/// Whether beams of these bearings (radians) are neighbors.
pub(super) fn fan_order(bearings: &[f64]) -> BeamOrder {
    let ascending = bearings.windows(2).all(|w| w[0] < w[1]);
    let [first, .., last] = bearings else { return BeamOrder::Unordered };
    let span = last - first;
    let widest = bearings.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
    // A full turn may name its seam twice. Neighbors half a turn apart have no wedge between them.
    if !ascending || span > std::f64::consts::TAU + 1e-6 || widest >= std::f64::consts::PI {
        return BeamOrder::Unordered;
    }
    BeamOrder::Fan { closed: std::f64::consts::TAU - span <= 1.5 * widest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn readings_become_the_kinds_they_mean() {
        let limits = RangeLimits { min: 0.1, max: 30.0, no_return: 81.0, no_return_free: 5.0 };
        let readings = [1.0, 0.05, 0.0, 40.0, 81.83, f64::INFINITY, f64::NAN, -2.0];
        let bearings: Vec<f64> = (0..8).map(|i| f64::from(i) * 0.1).collect();
        let scan = Scan::from_laser(&bearings, &readings, &limits);
        use BeamKind::*;
        let kinds: Vec<_> = scan.beams().map(|b| (b.kind, b.range)).collect();
        assert_eq!(
            kinds,
            [
                (Hit, 1.0),
                (Dropped, 0.0),
                (Dropped, 0.0),
                (MaxRange, 30.0),
                (NoReturn, 5.0),
                (NoReturn, 5.0),
                (Dropped, 0.0),
                (Dropped, 0.0)
            ]
        );
        assert_eq!(scan.refused(), RefusedBeams { not_finite: 1, negative: 1, too_near: 2, too_far: 0 });
    }

    #[test]
    fn fans_know_their_neighbours() {
        let half: Vec<f64> = (0..180).map(|i| -PI / 2.0 + f64::from(i) * PI / 180.0).collect();
        let full: Vec<f64> = (0..360).map(|i| f64::from(i) * TAU / 360.0).collect();
        let ones = vec![1.0; 360];
        let scan = Scan::from_laser(&half, &ones, &RangeLimits::default());
        assert_eq!((scan.next(0), scan.next(179), scan.previous(0)), (Some(1), None, None));
        let scan = Scan::from_laser(&full, &ones, &RangeLimits::default());
        assert_eq!((scan.next(359), scan.previous(0)), (Some(0), Some(359)));
        let mixed = Scan::from_laser(&[0.0, 0.2, 0.1], &ones, &RangeLimits::default());
        assert_eq!((mixed.order(), mixed.next(0)), (BeamOrder::Unordered, None));
    }
}
