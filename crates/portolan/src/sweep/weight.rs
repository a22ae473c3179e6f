//! How much a beam is trusted: variance modelling, not a heuristic.

use crate::scan::{Scan, cos_incidence};

/// Weight of a beam's observations, before the taper behind the surface
/// (Oleynikova et al. 2017, section III).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WeightModel {
    /// Every beam 1.
    #[default]
    Constant,
    /// `1 / z^2` for ranges beyond 1 m, else 1: range noise grows with the range.
    InverseSquare,
    /// `cos(theta)` of the incidence angle: grazing beams know their distance to the surface badly.
    CosIncidence,
    /// `cos(theta) / z^2`: both.
    InverseSquareCosIncidence,
}

impl WeightModel {
    /// What an ordinary distant beam weighs: the scale of thresholds on weights. 1 for equal weights, a tenth where
    /// the incidence counts, a hundredth (10 m) where the range does.
    pub fn typical_low(self) -> f32 {
        match self {
            Self::Constant => 1.0,
            Self::CosIncidence => 0.1,
            Self::InverseSquare => 0.01,
            Self::InverseSquareCosIncidence => 0.001,
        }
    }

    /// Whether the weight falls with the square of the range, and whether it is that of the incidence.
    pub(super) fn parts(self) -> (bool, bool) {
        match self {
            Self::Constant => (false, false),
            Self::InverseSquare => (true, false),
            Self::CosIncidence => (false, true),
            Self::InverseSquareCosIncidence => (true, true),
        }
    }

    /// One weight per beam of the scan, into `weights`; `cosines` is scratch. Incidence comes from neighbouring
    /// beams and is 1 where there are none.
    pub(super) fn weigh<const D: usize>(
        self,
        scan: &Scan<D>,
        cosines: &mut Vec<f32>,
        weights: &mut Vec<f32>,
    ) {
        let (square, cosine) = self.parts();
        weights.clear();
        weights.extend(
            scan.beams().map(|b| if square { (b.range.max(1.0).powi(2).recip()) as f32 } else { 1.0 }),
        );
        if cosine {
            cos_incidence(scan, cosines);
            // Never quite 0: a grazing beam still knows that there is something.
            weights.iter_mut().zip(cosines).for_each(|(w, c)| *w *= c.max(0.02));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::RangeLimits;

    fn weights(model: WeightModel, bearings: &[f64], ranges: &[f64]) -> Vec<f32> {
        let scan = Scan::from_laser(bearings, ranges, &RangeLimits::default());
        let mut weights = Vec::new();
        model.weigh(&scan, &mut Vec::new(), &mut weights);
        weights
    }

    #[test]
    fn weights_fall_with_the_square_of_the_range_from_1_m_on() {
        // A radian apart, so that no beam has a neighbor.
        let got = weights(WeightModel::InverseSquare, &[-2.0, -1.0, 0.0, 1.0], &[0.5, 1.0, 2.0, 10.0]);
        assert_eq!(got, [1.0, 1.0, 0.25, 0.01]);
        assert_eq!(weights(WeightModel::Constant, &[0.0, 1.0], &[2.0, 10.0]), [1.0, 1.0]);
    }

    #[test]
    fn weights_fall_with_the_incidence() {
        // A wall at x = 2 m is met under the bearing.
        let bearings: Vec<f64> = (-70..=70).map(|d| f64::from(d).to_radians()).collect();
        let ranges: Vec<f64> = bearings.iter().map(|b| 2.0 / b.cos()).collect();
        let cosines = weights(WeightModel::CosIncidence, &bearings, &ranges);
        let both = weights(WeightModel::InverseSquareCosIncidence, &bearings, &ranges);
        for (i, b) in bearings.iter().enumerate() {
            let want = b.cos();
            assert!((f64::from(cosines[i]) - want).abs() < 0.01, "{b}: {}", cosines[i]);
            assert!((f64::from(both[i]) - want * (0.5 * want).powi(2)).abs() < 0.003, "{b}: {}", both[i]);
        }
    }
}
