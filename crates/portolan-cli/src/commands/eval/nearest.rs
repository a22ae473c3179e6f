//! Nearest segment by a grid of buckets.

use std::collections::HashMap;

use portolan::geom::vector::{distance, point_segment};

/// Segments by the buckets that their boxes touch.
pub(super) struct SegmentIndex<'a> {
    segments: &'a [[[f64; 2]; 2]],
    edge: f64,
    buckets: HashMap<[i64; 2], Vec<u32>>,
    /// Lowest and highest bucket in use.
    range: [[i64; 2]; 2],
}

impl<'a> SegmentIndex<'a> {
    /// An index over segments. Long segments are put into every bucket of their box, so buckets are as large as
    /// the longest segment at least.
    pub(super) fn new(segments: &'a [[[f64; 2]; 2]]) -> Self {
        let longest = segments.iter().map(|[a, b]| distance(*a, *b)).fold(0.0, f64::max);
        let edge = longest.max(0.25);
        let mut index =
            Self { segments, edge, buckets: HashMap::new(), range: [[i64::MAX; 2], [i64::MIN; 2]] };
        for (i, [a, b]) in segments.iter().enumerate() {
            let (p, q) = (index.bucket(*a), index.bucket(*b));
            for x in p[0].min(q[0])..=p[0].max(q[0]) {
                for y in p[1].min(q[1])..=p[1].max(q[1]) {
                    index.buckets.entry([x, y]).or_default().push(i as u32);
                    index.range[0] = [index.range[0][0].min(x), index.range[0][1].min(y)];
                    index.range[1] = [index.range[1][0].max(x), index.range[1][1].max(y)];
                }
            }
        }
        index
    }

    fn bucket(&self, p: [f64; 2]) -> [i64; 2] {
        p.map(|v| (v / self.edge).floor() as i64)
    }

    /// Distance to the nearest segment; `None` without segments.
    pub(super) fn nearest_distance(&self, p: [f64; 2]) -> Option<f64> {
        let center = self.bucket(p);
        // Rings that miss all buckets are passed over, those behind them need not be looked at.
        let off = |k: usize| (self.range[0][k] - center[k]).max(center[k] - self.range[1][k]).max(0);
        let far = |k: usize| (center[k] - self.range[0][k]).max(self.range[1][k] - center[k]);
        if self.segments.is_empty() {
            return None;
        }
        let mut best = f64::INFINITY;
        for ring in off(0).max(off(1))..=far(0).max(far(1)) {
            if (ring - 1) as f64 * self.edge > best {
                break;
            }
            for x in (center[0] - ring).max(self.range[0][0])..=(center[0] + ring).min(self.range[1][0]) {
                let on_side = (x - center[0]).abs() == ring;
                let step = if on_side || ring == 0 { 1 } else { 2 * ring };
                let mut y = center[1] - ring;
                while y <= center[1] + ring {
                    for &i in self.buckets.get(&[x, y]).into_iter().flatten() {
                        let [a, b] = self.segments[i as usize];
                        best = best.min(point_segment(p, a, b).0);
                    }
                    y += step;
                }
            }
        }
        Some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_brute_force() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / (1u64 << 31) as f64 * 10.0
        };
        let segments: Vec<_> = (0..200)
            .map(|_| {
                let p = [random(), random()];
                [p, [p[0] + 0.3 * random() / 10.0, p[1] - 0.2]]
            })
            .collect();
        let index = SegmentIndex::new(&segments);
        for _ in 0..500 {
            let p = [3.0 * random() - 10.0, 3.0 * random() - 10.0];
            let want = segments.iter().map(|[a, b]| point_segment(p, *a, *b).0).fold(f64::INFINITY, f64::min);
            assert!((index.nearest_distance(p).unwrap() - want).abs() < 1e-12);
        }
        assert_eq!(SegmentIndex::new(&[]).nearest_distance([0.0, 0.0]), None);
    }
}
