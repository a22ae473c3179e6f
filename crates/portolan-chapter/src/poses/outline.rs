//! A planar scan prepared for matching: end points, normals, and a grid that finds the nearest of them.

use portolan::geom::Pose;
use portolan::geom::vector::{distance, dot, scale, sub};
use portolan::scan::Scan;
use portolan_sim::heading;

/// Points within this of a point say how its surface runs (meters).
const TANGENT_REACH: f64 = 0.2;
/// At most so many neighbors on either side.
const NEIGHBOURS: usize = 14;
/// Neighbouring end points further apart than this do not lie on one surface, at the least (meters).
const GAP: f64 = 0.12;
/// Edge of a cell of the grid (meters).
const CELL: f64 = 0.15;
/// Parts of the turn for which the free range is kept.
const PARTS: usize = 360;

/// The end points of a planar scan in the sensor's frame. Normals are those of lines fitted to neighboring beams,
/// towards the sensor; a point whose neighbors do not lie on a line has none and is matched by no one.
#[derive(Clone, Debug)]
pub struct Outline {
    points: Vec<[f64; 2]>,
    normals: Vec<Option<[f64; 2]>>,
    /// Lower corner of the grid (meters) and its cells along x and y.
    corner: [f64; 2],
    shape: [usize; 2],
    /// Where each cell's points begin in `members`; one more than cells.
    starts: Vec<u32>,
    members: Vec<u32>,
    /// The shortest hit in each part of the turn and its neighbors (meters); 0 without one.
    free: Vec<f64>,
}

impl Outline {
    /// The hits of a scan. Scans whose beams have no neighbors have no normals: nothing matches them. O(beams).
    pub fn of(scan: &Scan<2>) -> Self {
        let hits: Vec<usize> = (0..scan.len()).filter(|&i| scan.beam(i).is_hit()).collect();
        let end = |i: usize| scale(scan.beam(i).direction, scan.beam(i).range);
        let points: Vec<_> = hits.iter().map(|&i| end(i)).collect();
        let normals = hits.iter().map(|&i| normal(scan, i)).collect();
        let free = free_ranges(&points);
        let mut outline = Self {
            points,
            normals,
            corner: [0.0; 2],
            shape: [0; 2],
            starts: vec![0],
            members: Vec::new(),
            free,
        };
        outline.fill_grid();
        outline
    }

    /// End points (sensor's frame, meters), in the order of the beams.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// Unit normals towards the sensor, one per point; `None`: the neighborhood is not straight.
    pub fn normals(&self) -> &[Option<[f64; 2]>] {
        &self.normals
    }

    fn fill_grid(&mut self) {
        if self.points.is_empty() {
            return;
        }
        let fold =
            |f: fn(f64, f64) -> f64, k: usize| self.points.iter().map(|p| p[k]).reduce(f).unwrap_or(0.0);
        self.corner = [fold(f64::min, 0), fold(f64::min, 1)];
        // A stray reading at a kilometer must not cost memory: beyond so many cells the last one holds the rest.
        let cells = |k: usize| (((fold(f64::max, k) - self.corner[k]) / CELL) as usize).min(1023) + 1;
        self.shape = [cells(0), cells(1)];
        let bucket: Vec<usize> = self.points.iter().map(|p| self.bucket(*p)).collect();
        self.starts = vec![0; self.shape[0] * self.shape[1] + 1];
        bucket.iter().for_each(|&b| self.starts[b + 1] += 1);
        for b in 0..self.shape[0] * self.shape[1] {
            self.starts[b + 1] += self.starts[b];
        }
        let mut next = self.starts.clone();
        self.members = vec![0; self.points.len()];
        for (i, &b) in bucket.iter().enumerate() {
            self.members[next[b] as usize] = i as u32;
            next[b] += 1;
        }
    }

    fn cell(&self, p: [f64; 2]) -> [i64; 2] {
        [0, 1].map(|k| ((p[k] - self.corner[k]) / CELL).floor() as i64)
    }

    fn bucket(&self, p: [f64; 2]) -> usize {
        let c = self.cell(p);
        let inside = [0, 1].map(|k| c[k].clamp(0, self.shape[k] as i64 - 1) as usize);
        inside[1] * self.shape[0] + inside[0]
    }

    /// The nearest point no further than `reach` (meters), with its distance.
    pub fn nearest(&self, p: [f64; 2], reach: f64) -> Option<(usize, f64)> {
        if self.points.is_empty() || !p.iter().all(|v| v.is_finite()) {
            return None;
        }
        let (cell, rings) = (self.cell(p), (reach / CELL).ceil() as i64);
        let mut best: Option<(usize, f64)> = None;
        for ring in 0..=rings {
            // Cells of this ring are at least so far away.
            if best.is_some_and(|b| b.1 <= (ring - 1) as f64 * CELL) {
                break;
            }
            for y in cell[1] - ring..=cell[1] + ring {
                let edge = (y - cell[1]).abs() == ring;
                let step = if edge || ring == 0 { 1 } else { 2 * ring };
                let mut x = cell[0] - ring;
                while x <= cell[0] + ring {
                    self.look(p, [x, y], reach, &mut best);
                    x += step;
                }
            }
        }
        best
    }

    fn look(&self, p: [f64; 2], [x, y]: [i64; 2], reach: f64, best: &mut Option<(usize, f64)>) {
        if x < 0 || y < 0 || x >= self.shape[0] as i64 || y >= self.shape[1] as i64 {
            return;
        }
        let b = y as usize * self.shape[0] + x as usize;
        for &i in &self.members[self.starts[b] as usize..self.starts[b + 1] as usize] {
            let d = distance(p, self.points[i as usize]);
            if d <= reach && best.is_none_or(|best| d < best.1) {
                *best = Some((i as usize, d));
            }
        }
    }

    /// Whether the scan saw through a point, and at least `margin` meters beyond: nothing was there.
    pub fn sees_through(&self, p: [f64; 2], margin: f64) -> bool {
        distance(p, [0.0; 2]) + margin < self.free[part(p)]
    }

    /// How far two poses are from each other: distance (meters) and turn (radians).
    pub(crate) fn apart(a: &Pose<2>, b: &Pose<2>) -> [f64; 2] {
        let difference = a.inverse() * *b;
        [distance(difference.translation, [0.0; 2]), heading(&difference).abs()]
    }
}

/// The part of the turn that a point lies in.
fn part(p: [f64; 2]) -> usize {
    let turn = libm::atan2(p[1], p[0]) / std::f64::consts::TAU + 0.5;
    ((turn * PARTS as f64) as usize).min(PARTS - 1)
}

fn free_ranges(points: &[[f64; 2]]) -> Vec<f64> {
    let mut nearest = vec![f64::INFINITY; PARTS];
    for &p in points {
        let own = &mut nearest[part(p)];
        *own = own.min(distance(p, [0.0; 2]));
    }
    let around = |i: usize| {
        let three = [i + PARTS - 1, i, i + 1].map(|k| nearest[k % PARTS]);
        let shortest = three.into_iter().fold(f64::INFINITY, f64::min);
        if shortest.is_finite() && three[1].is_finite() { shortest } else { 0.0 }
    };
    (0..PARTS).map(around).collect()
}

/// The normal of the line through the neighborhood of beam `i`, by total least squares.
fn normal(scan: &Scan<2>, i: usize) -> Option<[f64; 2]> {
    let end = |i: usize| scale(scan.beam(i).direction, scan.beam(i).range);
    let centre = end(i);
    let mut near = vec![centre];
    type Step = fn(&Scan<2>, usize) -> Option<usize>;
    for step in [Scan::next as Step, Scan::previous as Step] {
        let mut last = i;
        let mut at = i;
        for _ in 0..NEIGHBOURS {
            let Some(next) = step(scan, at) else { break };
            at = next;
            // Lost beams are skipped, a jump ends the surface.
            if !scan.beam(at).is_hit() {
                continue;
            }
            let spacing =
                distance(scan.beam(at).direction, scan.beam(last).direction) * scan.beam(last).range;
            if distance(end(at), end(last)) > GAP.max(4.0 * spacing)
                || distance(end(at), centre) > TANGENT_REACH
            {
                break;
            }
            near.push(end(at));
            last = at;
        }
    }
    if near.len() < 3 {
        return None;
    }
    let n = near.len() as f64;
    let mean = scale(near.iter().fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]), 1.0 / n);
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for p in &near {
        let [x, y] = sub(*p, mean);
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let (half_trace, half_difference) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let root = (half_difference * half_difference + xy * xy).sqrt();
    let (large, small) = (half_trace + root, half_trace - root);
    // A line is long and thin: not a corner, not a leg of a table.
    if large < n * 4e-4 || small > 0.1 * large {
        return None;
    }
    let tangent = 0.5 * libm::atan2(2.0 * xy, xx - yy);
    let normal = [-libm::sin(tangent), libm::cos(tangent)];
    Some(if dot(normal, centre) > 0.0 { scale(normal, -1.0) } else { normal })
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan_sim::{Lidar, Random, apartment, lap_poses, scan_at};

    #[test]
    fn nearest_is_that_of_brute_force() {
        let world = apartment().world;
        let pose = lap_poses(200)[17];
        let outline = Outline::of(&scan_at(&world, &pose, &Lidar::default(), 1, 0));
        let mut random = Random::stream(5, 0);
        for _ in 0..2000 {
            let p = [12.0 * random.uniform() - 6.0, 12.0 * random.uniform() - 6.0];
            let reach = 0.8 * random.uniform();
            let want = outline.points().iter().map(|&q| distance(p, q)).fold(f64::INFINITY, f64::min);
            match outline.nearest(p, reach) {
                Some((i, d)) => assert!(d == want && distance(p, outline.points()[i]) == d),
                None => assert!(want > reach),
            }
        }
        assert_eq!(Outline::of(&Scan::from_beams([])).nearest([0.0; 2], 1.0), None);
    }

    #[test]
    fn normals_are_those_of_the_walls() {
        let world = apartment().world;
        let mut off = Vec::new();
        for (k, pose) in lap_poses(200).iter().enumerate().step_by(7) {
            let scan = scan_at(&world, pose, &Lidar::default(), 2, k as u64);
            let outline = Outline::of(&scan);
            for (p, n) in outline.points().iter().zip(outline.normals()) {
                let Some(n) = n else { continue };
                let [x, y] = pose.rotate(*n);
                // All walls are along the axes.
                off.push(libm::asin(x.abs().min(y.abs())).to_degrees());
                assert!(dot(*n, *p) <= 0.0);
            }
        }
        off.sort_by(f64::total_cmp);
        let (median, p95) = (off[off.len() / 2], off[off.len() * 95 / 100]);
        println!("{} normals, off by {median:.2} degrees in the median, {p95:.2} at 95 %", off.len());
        assert!(median < 3.0 && p95 < 15.0);
    }
}
