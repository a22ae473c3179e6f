//! Fields whose surfaces are extracted and asked for, and exact distances to those surfaces in f64.

use portolan::cell::{DistanceBrick, SignedDistance};
use portolan::geom::{BlockKey, Lattice, block_cells, vector};
use portolan::store::Bricks;
use portolan::surface::Contour;
use std::collections::HashMap;

/// SplitMix64 *(Steele, Lea, Flood 2014)*.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normally distributed, deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// Bricks of `n^D` cells from cell `first` on; not observed where the value (meters, at the center in cells from
/// `first`) is NaN.
pub(crate) fn bricks<const D: usize>(
    lattice: Lattice<D>,
    first: [i32; D],
    n: i32,
    mut value: impl FnMut([f64; D]) -> f64,
) -> Bricks<SignedDistance, D> {
    let mut store = Bricks::new(lattice);
    let low: [i32; D] = BlockKey::of_cell(first).0;
    let count = (n + 7) / 8 + 1;
    for b in 0..count.pow(D as u32) {
        let key = BlockKey(std::array::from_fn(|k| low[k] + b / count.pow(k as u32) % count));
        let (mut distance, mut weight) = (vec![0.0f32; block_cells::<D>()], vec![0.0f32; block_cells::<D>()]);
        for i in 0..block_cells::<D>() {
            let at: [i32; D] = std::array::from_fn(|k| key.cell(i)[k] - first[k]);
            if at.iter().all(|v| (0..n).contains(v)) {
                let d = value(at.map(|v| f64::from(v) + 0.5)) as f32;
                if !d.is_nan() {
                    (distance[i], weight[i]) = (d, 1.0);
                }
            }
        }
        if weight.iter().any(|w| *w > 0.0) {
            store.insert(key, DistanceBrick::from_parts(&distance, &weight).unwrap()).unwrap();
        }
    }
    store
}

/// How a room's values are spoiled.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Spoiled {
    /// Noise of 5 mm near the surface.
    Noisy,
    /// Rounded to a quarter of a cell: crossings exactly at nodes everywhere.
    Rounded,
}

/// A room of `n^3` cells of 5 cm: floor, rotated boxes, balls, a rotated wall of 8 cm with a door, and a box in a corner
/// that was never observed. Values in meters; truncated at three cells.
pub(crate) fn room(
    n: i32,
    first: [i32; 3],
    lattice: Lattice<3>,
    spoiled: Spoiled,
) -> Bricks<SignedDistance, 3> {
    let mut random = Random(17);
    let size = f64::from(n);
    let mut at = |margin: f64| margin + random.unit() * (size - 2.0 * margin);
    let balls: Vec<([f64; 3], f64)> =
        (0..6).map(|i| ([at(10.0), at(10.0), at(10.0)], size * (0.04 + 0.01 * f64::from(i)))).collect();
    let boxes: Vec<([f64; 3], [f64; 3], f64)> = (0..10)
        .map(|i| {
            (
                [at(10.0), at(10.0), at(6.0)],
                [at(0.0) * 0.12 + 2.0, at(0.0) * 0.1 + 2.0, at(0.0) * 0.15 + 3.0],
                f64::from(i),
            )
        })
        .collect();
    let turned = |p: [f64; 3], c: [f64; 3], angle: f64| {
        let [x, y, z] = vector::sub(p, c);
        let (sin, cos) = angle.sin_cos();
        [cos * x + sin * y, cos * y - sin * x, z]
    };
    let cuboid = |p: [f64; 3], half: [f64; 3]| {
        let q: [f64; 3] = std::array::from_fn(|k| p[k].abs() - half[k]);
        vector::norm(q.map(|v| v.max(0.0))) + q[0].max(q[1]).max(q[2]).min(0.0)
    };
    let middle = [0.55 * size, 0.5 * size, 0.0];
    let mut noise = Random(5);
    bricks(lattice, first, n, |p| {
        if (0..3).all(|k| p[k] > 0.78 * size) {
            return f64::NAN;
        }
        let floor = p[2] - 4.3;
        let mut d = floor;
        for (c, radius) in &balls {
            d = d.min(vector::distance(p, *c) - radius);
        }
        for (c, half, angle) in &boxes {
            d = d.min(cuboid(turned(p, *c, *angle), *half));
        }
        let q = turned(p, middle, 0.4);
        let wall = cuboid(q, [0.8, 0.45 * size, 0.6 * size]);
        let door = cuboid([q[0], q[1] - 6.0, q[2]], [4.0, 9.0, 0.35 * size]);
        let metres = 0.05 * d.min(wall.max(-door)).clamp(-3.0, 3.0);
        match spoiled {
            Spoiled::Noisy if metres.abs() < 0.15 => metres + 0.005 * noise.normal(),
            Spoiled::Noisy => metres,
            Spoiled::Rounded => (metres / 0.0125).round() * 0.0125,
        }
    })
}

/// The segments of a contour in buckets: exact distances in f64.
pub(crate) struct Segments {
    edge: f64,
    buckets: HashMap<[i64; 2], Vec<[[f64; 2]; 2]>>,
    reach: i64,
}

impl Segments {
    pub(crate) fn of(contour: &Contour, edge: f64) -> Self {
        let mut buckets: HashMap<_, Vec<_>> = HashMap::new();
        let key = |p: [f64; 2]| p.map(|v| (v / edge).floor() as i64);
        for s in contour.ends() {
            // Shorter than a bucket: the middle is within half a bucket of all of it.
            buckets.entry(key(std::array::from_fn(|k| 0.5 * (s[0][k] + s[1][k])))).or_default().push(s);
        }
        Self { edge, buckets, reach: 400 }
    }

    pub(crate) fn distance(&self, p: [f64; 2]) -> Option<f64> {
        let at = p.map(|v| (v / self.edge).floor() as i64);
        let mut best = f64::INFINITY;
        for ring in 0..self.reach {
            // Middles in this ring are at least so far; the segments half a bucket nearer at most.
            if (ring as f64 - 1.5) * self.edge > best {
                break;
            }
            for (x, y) in (-ring..=ring).flat_map(|x| (-ring..=ring).map(move |y| (x, y))) {
                if x.abs().max(y.abs()) == ring {
                    for [a, b] in self.buckets.get(&[at[0] + x, at[1] + y]).into_iter().flatten() {
                        best = best.min(vector::point_segment(p, *a, *b).0);
                    }
                }
            }
        }
        best.is_finite().then_some(best)
    }
}
