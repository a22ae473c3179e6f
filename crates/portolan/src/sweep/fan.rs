//! A planar fan of beams seen from the cells: which two beams a point lies between, and what they say of it.

use crate::cell::DistanceObservation;
use crate::geom::vector::{cross, distance};
use crate::geom::{BLOCK_EDGE, Pose};
use crate::scan::{BeamKind, MAX_OPENING, Scan, connected};
use crate::sets::bits;

/// Cells of a 2-D block.
pub(super) const CELLS: usize = BLOCK_EDGE * BLOCK_EDGE;

/// One beam in the world's axes, relative to the sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spoke {
    pub direction: [f32; 2],
    /// Free up to here (meters).
    pub range: f32,
    pub weight: f32,
    pub hit: bool,
}

/// The space between a beam and the next one, counter-clockwise, where the two do not end on one surface.
#[derive(Clone, Copy, Debug)]
struct Wedge {
    a: Spoke,
    b: Spoke,
    /// Free up to here between the beams (meters).
    free: f32,
}

/// The same where they do: ranges between them are those of the chord between their end points.
#[derive(Clone, Copy, Debug)]
struct Chord {
    /// From the end point of the first beam to that of the second.
    x: f32,
    y: f32,
    /// Cross product of the two end points.
    cross: f32,
    /// Mean weight of the two beams; negative where the beams are not joined and this is no chord.
    weight: f32,
}

/// All wedges of a scan around the sensor, found by the direction of a point without trigonometry.
#[derive(Clone, Debug, Default)]
pub(super) struct Fan {
    wedges: Vec<Wedge>,
    /// Per wedge, up to where everything is free whatever the bearing (meters); 0 where that is not known.
    clear: Vec<f32>,
    /// The weight that all beams share, if they do.
    common_weight: Option<f32>,
    chords: Vec<Chord>,
    /// Diamond angle of the first beam of each wedge, ascending, and a last one that no angle reaches.
    start: Vec<f32>,
    /// For each part of the circle, the wedge in which it begins.
    table: Vec<u16>,
    truncation: f32,
    /// Weight of an observation of free space beyond the truncation, times the beam's; 0: none is made.
    carve_weight: f32,
    /// A beam speaks for cells whose centers it passes within this distance (meters).
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
    /// Prepares a fan; the beams must be in angular order (`BeamOrder::Fan`), see [`Fan::can_hold`]. `spokes` receives
    /// the beams in the world's axes, in the scan's order.
    pub(super) fn rebuild<const D: usize>(
        &mut self,
        scan: &Scan<D>,
        world_from_sensor: &Pose<D>,
        weights: &[f32],
        (truncation, carve_weight, resolution): (f64, f32, f64),
        spokes: &mut Vec<Spoke>,
    ) {
        (self.truncation, self.carve_weight) = (truncation as f32, carve_weight);
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
        // The beam with the smallest angle comes first; from there on the scan's order is ascending.
        let n = spokes.len();
        let angles = spokes.iter().map(|s| diamond(s.direction[0], s.direction[1])).enumerate();
        let first = angles.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |least| least.0);
        self.wedges.clear();
        self.chords.clear();
        self.clear.clear();
        let weight = weights.first().copied().unwrap_or(0.0);
        self.common_weight = weights.iter().all(|&w| w == weight).then_some(weight);
        self.start.clear();
        let mut lowest = 0.0;
        for k in 0..n {
            let i = (first + k) % n;
            let next = scan.next(i);
            let a = spokes[i];
            let joined = next.is_some_and(|j| connected(scan, i, j));
            let narrow = joined
                || next
                    .is_some_and(|j| distance(scan.beam(i).direction, scan.beam(j).direction) <= MAX_OPENING);
            let b = spokes[(i + 1) % n];
            let free = if narrow { a.range.min(b.range) } else { 0.0 };
            self.wedges.push(Wedge { a, b, free });
            // A chord comes nearer than its ends by less than 1 % up to the opening at which beams are neighbours.
            self.clear.push(0.99 * free);
            self.chords.push(Chord::new(&a, &b, joined));
            // Ascending, rounding included.
            lowest = diamond(a.direction[0], a.direction[1]).max(lowest);
            self.start.push(lowest);
        }
        self.start.push(f32::INFINITY);
        self.fill_table();
    }

    /// Whether a scan has few enough beams for the table's entries.
    pub(super) fn can_hold(beams: usize) -> bool {
        (2..usize::from(u16::MAX)).contains(&beams)
    }

    fn fill_table(&mut self) {
        // Eight parts a beam: hardly ever does a second beam begin in a part.
        let parts = (8 * self.wedges.len()).next_power_of_two().min(1 << 16);
        self.table.clear();
        self.table.resize(parts, 0);
        let scale = 0.25 * parts as f32;
        for wedge in 0..self.wedges.len() {
            // The first part that begins at or after this wedge, up to the next wedge's.
            let part = |w: usize| ((self.start[w] * scale).ceil() as usize).min(parts);
            let end = if wedge + 1 < self.wedges.len() { part(wedge + 1) } else { parts };
            let from = part(wedge).min(end);
            self.table[from..end].fill(wedge as u16);
        }
    }

    /// The wedge that holds a direction.
    #[inline(always)]
    fn wedge_at(&self, angle: f32) -> usize {
        // Before the first beam lies the wedge of the last one.
        if angle < self.start[0] {
            return self.wedges.len() - 1;
        }
        let part = (angle * (0.25 * self.table.len() as f32)) as usize;
        let mut wedge = usize::from(self.table[part.min(self.table.len() - 1)]);
        while self.start[wedge + 1] <= angle {
            wedge += 1;
        }
        wedge
    }

    /// The weight of a block that lies wholly in free space, nearer than all surfaces by more than the
    /// truncation: such blocks need no look at their cells. The sensor must see it under a narrow angle that does
    /// not cross the x axis, or nothing is said.
    fn free_block(&self, corner: [f32; 2], step: f32) -> Option<f32> {
        let weight = self.carve_weight * self.common_weight?;
        let size = step * (BLOCK_EDGE - 1) as f32;
        let ([x0, y0], [x1, y1]) = (corner, [corner[0] + size, corner[1] + size]);
        if x1 > 0.0 && y0 <= 0.0 && y1 >= 0.0 {
            return None;
        }
        // The angles of a box are those of its corners, as long as it does not hold the sensor.
        let angles = [diamond(x0, y0), diamond(x1, y0), diamond(x0, y1), diamond(x1, y1)];
        let from = angles.into_iter().fold(f32::INFINITY, f32::min);
        let to = angles.into_iter().fold(0.0, f32::max);
        if to - from >= 1.0 {
            return None;
        }
        let far = x0.abs().max(x1.abs()).hypot(y0.abs().max(y1.abs()));
        let first = self.wedge_at(from);
        let needed = far + self.truncation;
        let mut clear = self.clear[first] > needed;
        let mut wedge = if from < self.start[0] { 0 } else { first + 1 };
        while clear && self.start[wedge] <= to {
            clear = self.clear[wedge] > needed;
            wedge += 1;
        }
        clear.then_some(weight)
    }

    /// What the scan says about the 64 cells of a block whose first center lies at `corner` relative to the
    /// sensor, in the world's axes, `step` apart; weight 0: nothing.
    ///
    /// In passes over the block, so that all but the search for the wedge runs in vectors: cells between joined
    /// beams are the rule, and the others are done one by one afterwards.
    pub(super) fn observe_block(
        &self,
        corner: [f32; 2],
        step: f32,
        distance: &mut [f32; CELLS],
        weight: &mut [f32; CELLS],
    ) {
        if let Some(free) = self.free_block(corner, step) {
            distance.fill(self.truncation);
            weight.fill(free);
            return;
        }
        let (mut x, mut y) = ([0.0f32; CELLS], [0.0f32; CELLS]);
        let mut angle = [0.0f32; CELLS];
        for i in 0..CELLS {
            x[i] = corner[0] + (i % BLOCK_EDGE) as f32 * step;
            y[i] = corner[1] + (i / BLOCK_EDGE) as f32 * step;
            angle[i] = diamond(x[i], y[i]);
        }
        let mut found = [0u16; CELLS];
        let (mut chord_x, mut chord_y) = ([0.0f32; CELLS], [0.0f32; CELLS]);
        let (mut cross, mut trust) = ([0.0f32; CELLS], [0.0f32; CELLS]);
        let mut torn = 0u64;
        for i in 0..CELLS {
            let w = self.wedge_at(angle[i]);
            let chord = &self.chords[w];
            found[i] = w as u16;
            (chord_x[i], chord_y[i]) = (chord.x, chord.y);
            (cross[i], trust[i]) = (chord.cross, chord.weight);
            torn |= u64::from(chord.weight < 0.0) << i;
        }
        let tau = self.truncation;
        for i in 0..CELLS {
            let r = (x[i] * x[i] + y[i] * y[i]).sqrt();
            // The ray through the point meets the chord at t times the point's own distance.
            let t = cross[i] / (x[i] * chord_y[i] - y[i] * chord_x[i]);
            let d = (t - 1.0) * r;
            // Written so that NaN, at the sensor itself, counts as free space.
            let before = if d <= tau { 1.0 } else { self.carve_weight };
            let behind = (1.0 + d / tau).clamp(0.0, 1.0);
            weight[i] = trust[i] * before * behind;
            distance[i] = d.min(tau);
        }
        for i in bits(torn) {
            let said = self.observe_torn(&self.wedges[usize::from(found[i])], x[i], y[i]);
            (distance[i], weight[i]) = said.map_or((0.0, 0.0), |o| (o.distance, o.weight));
        }
    }

    /// Between beams that do not end on one surface, the nearer beam speaks for the cells that it passes.
    #[inline(never)]
    fn observe_torn(&self, wedge: &Wedge, x: f32, y: f32) -> Option<DistanceObservation> {
        let r = (x * x + y * y).sqrt();
        let along = |s: &Spoke| s.direction[0] * x + s.direction[1] * y;
        let near = if along(&wedge.a) >= along(&wedge.b) { &wedge.a } else { &wedge.b };
        let aside = (near.direction[0] * y - near.direction[1] * x).abs();
        if aside <= self.reach_aside && along(near) > 0.0 {
            if near.hit {
                return self.at_surface(near.range - r, near.weight);
            }
            return self.free(r <= near.range - self.truncation, near.weight);
        }
        self.free(r <= wedge.free - self.truncation, 0.5 * (wedge.a.weight + wedge.b.weight))
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
        let weight = weight * self.carve_weight;
        (weight > 0.0 && seen).then_some(DistanceObservation { distance: self.truncation, weight })
    }
}

impl Chord {
    fn new(a: &Spoke, b: &Spoke, joined: bool) -> Self {
        let end = |s: &Spoke| s.direction.map(|v| f64::from(v) * f64::from(s.range));
        let (pa, pb) = (end(a), end(b));
        Self {
            x: (pb[0] - pa[0]) as f32,
            y: (pb[1] - pa[1]) as f32,
            cross: cross(pa, pb) as f32,
            weight: if joined { 0.5 * (a.weight + b.weight) } else { -1.0 },
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
