//! A planar fan of beams seen from the cells: which two beams a point lies between, and what they say of it.

use crate::cell::DistanceObservation;
use crate::geom::Pose;
use crate::geom::vector::{cross, distance};
use crate::scan::{BeamKind, MAX_OPENING, Scan, connected};

/// One beam in the world's axes, relative to the sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spoke {
    pub direction: [f32; 2],
    /// Free up to here (metres).
    pub range: f32,
    pub weight: f32,
    pub hit: bool,
}

/// The space between a beam and the next one, counter-clockwise.
#[derive(Clone, Copy, Debug)]
struct Wedge {
    a: Spoke,
    b: Spoke,
    /// From the end point of `a` to that of `b`.
    chord: [f32; 2],
    /// Cross product of the two end points.
    cross: f32,
    /// Mean weight of the two beams.
    weight: f32,
    /// The end points lie on one surface: ranges between them are those of the chord.
    joined: bool,
    /// Free up to here between the beams where they are not joined (metres).
    free: f32,
}

/// All wedges of a scan around the sensor, found by the direction of a point without trigonometry.
#[derive(Clone, Debug, Default)]
pub(super) struct Fan {
    wedges: Vec<Wedge>,
    /// Diamond angle of the first beam of each wedge, ascending.
    start: Vec<f32>,
    /// For each part of the circle, the wedge in which it begins.
    table: Vec<u32>,
    truncation: f32,
    carve: bool,
    /// A beam speaks for cells whose centres it passes within this distance (metres).
    reach_aside: f32,
}

/// A monotone stand-in for the angle, in `[0, 4)`: 0 along x, 1 along y. No trigonometry, so equal everywhere.
#[inline(always)]
fn diamond(x: f32, y: f32) -> f32 {
    let along = y / (x.abs() + y.abs());
    // NaN at the sensor itself: max() makes it 0.
    let angle = if x < 0.0 { 2.0 - along } else { along + if y < 0.0 { 4.0 } else { 0.0 } };
    angle.max(0.0)
}

impl Fan {
    /// Prepares a fan; the beams must be in angular order (`BeamOrder::Fan`), two at least. `spokes` receives
    /// the beams in the world's axes, in the scan's order.
    pub(super) fn rebuild<const D: usize>(
        &mut self,
        scan: &Scan<D>,
        world_from_sensor: &Pose<D>,
        weights: &[f32],
        (truncation, carve, resolution): (f64, bool, f64),
        spokes: &mut Vec<Spoke>,
    ) {
        (self.truncation, self.carve) = (truncation as f32, carve);
        self.reach_aside = (0.5 * resolution) as f32;
        spokes.clear();
        spokes.extend(scan.beams().zip(weights).map(|(beam, &weight)| {
            let direction = world_from_sensor.rotate(beam.direction);
            Spoke {
                direction: [direction[0] as f32, direction[1] as f32],
                range: beam.free_range() as f32,
                weight,
                hit: beam.kind == BeamKind::Hit,
            }
        }));
        let angle = |s: &Spoke| diamond(s.direction[0], s.direction[1]);
        // The beam with the smallest angle comes first; from there on the scan's order is ascending.
        let n = spokes.len();
        let first = (0..n).min_by(|&i, &j| angle(&spokes[i]).total_cmp(&angle(&spokes[j]))).unwrap_or(0);
        self.wedges.clear();
        self.start.clear();
        for k in 0..n {
            let i = (first + k) % n;
            let next = scan.next(i);
            let b = spokes[(i + 1) % n];
            let joined = next.is_some_and(|j| connected(scan, i, j));
            let narrow =
                next.is_some_and(|j| distance(scan.beam(i).direction, scan.beam(j).direction) <= MAX_OPENING);
            self.wedges.push(Wedge::new(spokes[i], b, joined, narrow));
            let lowest = self.start.last().copied().unwrap_or(0.0);
            self.start.push(angle(&spokes[i]).max(lowest)); // ascending, rounding included
        }
        self.fill_table();
    }

    fn fill_table(&mut self) {
        let bins = (4 * self.wedges.len()).next_power_of_two().min(1 << 16);
        self.table.clear();
        let mut wedge = 0;
        for bin in 0..bins {
            let angle = bin as f32 * 4.0 / bins as f32;
            while wedge + 1 < self.start.len() && self.start[wedge + 1] <= angle {
                wedge += 1;
            }
            self.table.push(wedge as u32);
        }
    }

    #[inline(always)]
    fn wedge_at(&self, x: f32, y: f32) -> &Wedge {
        let angle = diamond(x, y);
        // Before the first beam lies the wedge of the last one.
        if angle < self.start[0] {
            return &self.wedges[self.wedges.len() - 1];
        }
        let bin = (angle * (0.25 * self.table.len() as f32)) as usize;
        let mut wedge = self.table[bin.min(self.table.len() - 1)] as usize;
        while wedge + 1 < self.start.len() && self.start[wedge + 1] <= angle {
            wedge += 1;
        }
        &self.wedges[wedge]
    }

    /// What the scan says about a point relative to the sensor, in the world's axes.
    #[inline(always)]
    pub(super) fn observe(&self, x: f32, y: f32) -> Option<DistanceObservation> {
        let wedge = self.wedge_at(x, y);
        let r = (x * x + y * y).sqrt();
        if wedge.joined {
            // The ray through the point meets the chord at t times the point's own distance.
            let t = wedge.cross / (x * wedge.chord[1] - y * wedge.chord[0]);
            return self.at_surface((t - 1.0) * r, wedge.weight);
        }
        let along = |s: &Spoke| s.direction[0] * x + s.direction[1] * y;
        let near = if along(&wedge.a) >= along(&wedge.b) { &wedge.a } else { &wedge.b };
        let aside = (near.direction[0] * y - near.direction[1] * x).abs();
        if aside <= self.reach_aside && along(near) > 0.0 {
            if near.hit {
                return self.at_surface(near.range - r, near.weight);
            }
            return self.free(r <= near.range - self.truncation, near.weight);
        }
        self.free(r <= wedge.free - self.truncation, wedge.weight)
    }

    /// An observation at signed distance `d` from a surface: clamped in front, tapering to nothing behind.
    #[inline(always)]
    fn at_surface(&self, d: f32, weight: f32) -> Option<DistanceObservation> {
        let tau = self.truncation;
        if d > tau {
            return self.free(true, weight);
        }
        let weight = weight * (1.0 + d / tau).min(1.0);
        (weight > 0.0).then_some(DistanceObservation { distance: d, weight })
    }

    #[inline(always)]
    fn free(&self, seen: bool, weight: f32) -> Option<DistanceObservation> {
        (self.carve && seen).then_some(DistanceObservation { distance: self.truncation, weight })
    }
}

impl Wedge {
    fn new(a: Spoke, b: Spoke, joined: bool, narrow: bool) -> Self {
        let end = |s: &Spoke| s.direction.map(|v| f64::from(v) * f64::from(s.range));
        let (pa, pb) = (end(&a), end(&b));
        Self {
            a,
            b,
            chord: [(pb[0] - pa[0]) as f32, (pb[1] - pa[1]) as f32],
            cross: cross(pa, pb) as f32,
            weight: 0.5 * (a.weight + b.weight),
            joined,
            free: if narrow { a.range.min(b.range) } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diamonds_ascend_with_the_angle() {
        let mut last = -1.0;
        for i in 0..3600 {
            let angle = f64::from(i) * std::f64::consts::TAU / 3600.0;
            let d = diamond(angle.cos() as f32, angle.sin() as f32);
            assert!(d > last && (0.0..4.0).contains(&d), "{i}");
            last = d;
        }
        assert_eq!(diamond(0.0, 0.0), 0.0);
    }
}
