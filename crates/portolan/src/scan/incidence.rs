//! Under which angle beams meet the surface, from their neighbors.

use super::Scan;
use crate::geom::vector::{along, distance, dot, sub, unit};

/// Neighbors nearer than this say more about the noise than about the surface (meters).
const BASELINE: f64 = 0.1;
/// How many neighbors on either side are looked at for the baseline.
const REACH: usize = 5;
/// Neighboring hits belong to one surface up to this tangent of the incidence angle (80 degrees).
pub(crate) const MAX_SLOPE: f64 = 5.67;

/// Cosine of the angle between each beam and the surface's normal, in `[0, 1]`: 1 head-on. The tangent is
/// the chord between the nearest neighbors that are at least 10 cm apart and connected to the beam. Beams
/// whose neighborhood gives no surface (no fan, no hit, a lone point) get 1. `out` is cleared and refilled,
/// one entry per beam.
pub fn cos_incidence<const D: usize>(scan: &Scan<D>, out: &mut Vec<f32>) {
    out.clear();
    out.extend((0..scan.len()).map(|i| {
        let tangent = tangent(scan, i).unwrap_or([0.0; D]);
        let direction = scan.beam(i).direction;
        let sine = dot(tangent, direction);
        // The sine of the angle to the tangent is the cosine of the angle to the normal.
        (1.0 - sine * sine).max(0.0).sqrt() as f32
    }));
}

fn tangent<const D: usize>(scan: &Scan<D>, i: usize) -> Option<[f64; D]> {
    if !scan.beam(i).is_hit() {
        return None;
    }
    let point = |i: usize| along(scan.origin(i), scan.beam(i).direction, scan.beam(i).range);
    let (mut left, mut right) = (i, i);
    for _ in 0..REACH {
        let wider_left = scan.next(left).filter(|&n| connected(scan, left, n));
        let wider_right = scan.previous(right).filter(|&n| connected(scan, n, right));
        if wider_left.is_none() && wider_right.is_none() {
            break;
        }
        left = wider_left.unwrap_or(left);
        right = wider_right.unwrap_or(right);
        if distance(point(left), point(right)) >= BASELINE {
            break;
        }
    }
    unit(sub(point(left), point(right)))
}

/// Neighbors further apart than this know nothing of what is between them (sine of the angle, 11 degrees).
pub(crate) const MAX_OPENING: f64 = 0.2;

/// Whether two neighboring hits can belong to one surface: they are near to each other in angle, and the
/// chord between them is not steeper than 80 degrees of incidence.
pub(crate) fn connected<const D: usize>(scan: &Scan<D>, a: usize, b: usize) -> bool {
    let (a, b) = (scan.beam(a), scan.beam(b));
    if !a.is_hit() || !b.is_hit() {
        return false;
    }
    let opening = distance(a.direction, b.direction); // sine of the angle between them, for small angles
    opening <= MAX_OPENING && (a.range - b.range).abs() <= MAX_SLOPE * opening * a.range.min(b.range) + 0.03
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::RangeLimits;

    #[test]
    fn a_wall_is_met_under_the_bearing() {
        // A wall at x = 2, bearings from -60 to 60 degrees: incidence equals the bearing.
        let bearings: Vec<f64> = (-60..=60).map(|d| f64::from(d).to_radians()).collect();
        let ranges: Vec<f64> = bearings.iter().map(|b| 2.0 / b.cos()).collect();
        let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
        let mut cosines = Vec::new();
        cos_incidence(&scan, &mut cosines);
        for (b, c) in bearings.iter().zip(&cosines) {
            assert!((f64::from(*c) - b.cos()).abs() < 0.01, "{b}: {c}");
        }
    }

    #[test]
    fn a_lone_hit_is_taken_as_head_on() {
        let scan = Scan::from_laser(&[0.0, 0.01, 0.02], &[1.0, 5.0, 1.0], &RangeLimits::default());
        let mut cosines = Vec::new();
        cos_incidence(&scan, &mut cosines);
        assert_eq!(cosines[1], 1.0);
    }
}
