//! Measures of the quality of a map, computed from its contour.

use super::Contour;
use crate::geom::interpolate;
use crate::geom::vector::{add, along, distance, dot, scale, sub, unit};
use crate::map::Tsdf2;
use rustc_hash::FxHashMap;

/// Length of contour with a second, parallel contour near it: a sign of inconsistent poses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DoubledLength {
    /// Length of the contour with a second one of the same orientation within reach (meters).
    pub doubled: f64,
    /// Length of the whole contour (meters).
    pub total: f64,
}

impl DoubledLength {
    /// Share of the contour that is doubled; 0 for an empty contour.
    pub fn share(&self) -> f64 {
        if self.total > 0.0 { self.doubled / self.total } else { 0.0 }
    }
}

/// Measures how much of a contour has a second contour of the same orientation (within 30 degrees) straight
/// behind or in front of it, no further than `reach` meters. Both sides of a wall face opposite ways and do not
/// count; two images of one wall face the same way and do. O(segments) with a hash of cells of edge `reach`.
pub fn doubled_length(contour: &Contour, reach: f64) -> DoubledLength {
    let bucket = |p: [f64; 2]| p.map(|v| (v / reach).floor() as i64);
    let parts: Vec<_> =
        contour.ends().map(|[a, b]| (scale(add(a, b), 0.5), unit(sub(b, a)), distance(a, b))).collect();
    let mut buckets: FxHashMap<[i64; 2], Vec<usize>> = FxHashMap::default();
    for (i, part) in parts.iter().enumerate() {
        buckets.entry(bucket(part.0)).or_default().push(i);
    }
    let mut measured = DoubledLength::default();
    for &(middle, direction, length) in &parts {
        measured.total += length;
        let Some(direction) = direction else { continue };
        let [x, y] = bucket(middle);
        let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        let doubled = near.filter_map(|b| buckets.get(&b)).flatten().any(|&j| {
            let (other, other_direction, other_length) = parts[j];
            let offset = sub(other, middle);
            let along = dot(offset, direction).abs();
            let aside = (offset[0] * direction[1] - offset[1] * direction[0]).abs();
            // Straight across: the other's extent covers this middle; a quarter of the reach away at least is
            // another line and not the same one going on.
            other_direction.is_some_and(|o| dot(o, direction) > 0.866)
                && along <= 0.5 * other_length + 1e-9
                && aside <= reach
                && aside >= 0.25 * reach
        });
        if doubled {
            measured.doubled += length;
        }
    }
    measured
}

/// Walls thinner than twice the truncation and observed from both sides: the updates from one side reach the surface of
/// the other and displace it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThinWalls {
    /// Length of contour with free space less than twice the truncation behind it (meters).
    pub thin: f64,
    /// Length of the whole contour (meters).
    pub total: f64,
    /// The least thickness found (meters); infinite without thin walls.
    pub thinnest: f64,
}

/// Searches behind every segment of a contour, in steps of half a cell along the normal, for free space within twice the
/// truncation. O(segments).
pub fn thin_walls(tsdf: &Tsdf2, contour: &Contour) -> ThinWalls {
    let grid = tsdf.grid();
    let strides = grid.strides();
    let planes = tsdf.store().planes();
    let step = 0.5 * grid.lattice.resolution;
    let limit = 2.0 * tsdf.config().truncation;
    let mut measured = ThinWalls { thinnest: f64::INFINITY, ..Default::default() };
    for [a, b] in contour.ends() {
        let length = distance(a, b);
        measured.total += length;
        let Some([dx, dy]) = unit(sub(b, a)) else { continue };
        let inward = [dy, -dx]; // free space lies on the left
        let middle = scale(add(a, b), 0.5);
        let mut inside = false;
        let mut s = step;
        while s < limit {
            let Some((base, fraction)) = grid.interpolation(along(middle, inward, s)) else { break };
            let Some(at) = grid.index(base) else { break };
            let observed = (0..4usize).all(|c| planes.weights()[at + (c & 1) + (c >> 1) * strides[1]] > 0.0);
            if !observed {
                break;
            }
            let d = interpolate(planes.distances(), &strides, at, &fraction).0;
            if inside && d >= 0.0 {
                measured.thin += length;
                measured.thinnest = measured.thinnest.min(s);
                break;
            }
            inside |= d < 0.0;
            s += step;
        }
    }
    measured
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parallel lines along x at these heights, running right (+) or left (-).
    fn lines(heights: &[(f64, bool)]) -> Contour {
        let mut c = Contour::default();
        for &(y, right) in heights {
            for k in 0..20 {
                let (x0, x1) = (f64::from(k) * 0.1, f64::from(k + 1) * 0.1);
                let n = c.vertices.len() as u32;
                c.vertices.extend(if right { [[x0, y], [x1, y]] } else { [[x1, y], [x0, y]] });
                c.segments.push([n, n + 1]);
            }
        }
        c
    }

    #[test]
    fn two_images_of_a_wall_are_seen_and_its_two_sides_are_not() {
        assert_eq!(doubled_length(&lines(&[(0.0, true)]), 0.15).share(), 0.0);
        assert_eq!(doubled_length(&lines(&[(0.0, true), (0.1, false)]), 0.15).share(), 0.0);
        assert!(doubled_length(&lines(&[(0.0, true), (0.1, true)]), 0.15).share() > 0.99);
        assert_eq!(doubled_length(&lines(&[(0.0, true), (0.3, true)]), 0.15).share(), 0.0);
        assert_eq!(doubled_length(&Contour::default(), 0.15).share(), 0.0);
    }
}
