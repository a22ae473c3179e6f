//! The distribution of the range along one ray.

use crate::cell::HitLength;
use crate::geom::RayWalk;
use crate::map::{Attenuation, hits_per_cell};
use crate::store::Store;
use crate::sweep::LONGEST_RAY_CELLS;

/// The distribution of the range that a sensor reads along a ray: a beam ends in every bit of length with the probability
/// that the map's hits per meter give, so that the density at a range is `sigma exp(-depth)` with the depth summed up over
/// the cells before *(Schaefer, Luft & Burgard 2017; the weights of a volume renderer)*.
///
/// Cells that were never observed count as the map believes before it looks
/// ([`Attenuation::hit_probability`]), so that no range is impossible in them. Beams that meet nothing up to the largest
/// range are a share of their own, [`RangeDistribution::passing`].
#[derive(Clone, Debug, PartialEq)]
pub struct RangeDistribution {
    /// By cell: arc length at which the ray leaves it (meters), its density (1/m), depth summed up to there.
    pieces: Vec<Piece>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    exit: f64,
    per_meter: f64,
    depth: f64,
}

impl RangeDistribution {
    /// Along a ray (world, unit direction) up to `max_range` meters. `None` where the ray is not finite, begins where the
    /// lattice has no cells, or is longer than 2^20 cells. O(cells passed).
    pub fn along<const D: usize, S: Store<HitLength, D>>(
        map: &Attenuation<D, S>,
        origin: [f64; D],
        direction: [f64; D],
        max_range: f64,
    ) -> Option<Self> {
        let lattice = map.store().lattice();
        let r = lattice.resolution;
        let square: f64 = direction.iter().map(|v| v * v).sum();
        let sane = (square - 1.0).abs() < 1e-6 && max_range >= 0.0 && max_range <= LONGEST_RAY_CELLS * r;
        let mut walk = RayWalk::new(lattice, origin, direction).filter(|_| sane)?;
        let mut pieces: Vec<Piece> = Vec::with_capacity((1.5 * max_range / r) as usize + 2);
        let (mut entry, mut depth) = (0.0, 0.0);
        loop {
            let exit = walk.exit().min(max_range);
            let per_meter = hits_per_cell(map.store().cell(walk.cell())) / r;
            depth += per_meter * (exit - entry).max(0.0);
            pieces.push(Piece { exit, per_meter, depth });
            if exit >= max_range {
                return Some(Self { pieces });
            }
            entry = exit;
            walk.advance();
        }
    }

    /// The piece that holds a range, and the depth up to it; `None`: the range is beyond the last one, or no range.
    fn at(&self, range: f64) -> Option<(Piece, f64)> {
        let i = self.pieces.partition_point(|p| p.exit < range);
        let piece = *self.pieces.get(i).filter(|_| range >= 0.0)?;
        Some((piece, piece.depth - piece.per_meter * (piece.exit - range)))
    }

    /// Density at a range (1/m): 0 beyond the largest one. O(log cells).
    pub fn density(&self, range: f64) -> f64 {
        self.at(range).map_or(0.0, |(piece, depth)| piece.per_meter * (-depth).exp())
    }

    /// Probability that the range is this or less; beyond the largest one that of any. O(log cells).
    pub fn cumulative(&self, range: f64) -> f64 {
        if range < 0.0 {
            return 0.0;
        }
        -(-self.at(range).map_or_else(|| self.depth(), |(_, depth)| depth)).exp_m1()
    }

    /// Probability that nothing is met up to the largest range.
    pub fn passing(&self) -> f64 {
        (-self.depth()).exp()
    }

    fn depth(&self) -> f64 {
        self.pieces.last().map_or(0.0, |p| p.depth)
    }

    /// The range that so many of all beams do not exceed (meters), those that meet nothing counted as longer. `None` where
    /// the share is none, or fewer end at all. O(log cells).
    pub fn quantile(&self, share: f64) -> Option<f64> {
        if !(0.0..1.0).contains(&share) {
            return None;
        }
        let depth = -(-share).ln_1p();
        let i = self.pieces.partition_point(|p| p.depth < depth);
        let piece = self.pieces.get(i)?;
        let entry = i.checked_sub(1).map_or(0.0, |before| self.pieces[before].exit);
        let before = i.checked_sub(1).map_or(0.0, |before| self.pieces[before].depth);
        // In an empty piece, which holds its quantile only at its start, nothing is added.
        let inside = if piece.per_meter > 0.0 { (depth - before) / piece.per_meter } else { 0.0 };
        Some((entry + inside).min(piece.exit))
    }

    /// The range that half of all beams do not exceed (meters); `None` where fewer end.
    pub fn median(&self) -> Option<f64> {
        self.quantile(0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::AttenuationRule;
    use crate::geom::vector::unit;
    use crate::geom::{Lattice, Pose};
    use crate::scan::{Beam, BeamKind, Scan};
    use crate::testing::{Random, point};

    /// A wall at 2 m behind a curtain at 1 m that stops one beam in three.
    fn curtain<const D: usize>() -> Attenuation<D> {
        let mut map = Attenuation::<D>::new(Lattice::new([0.0; D], 0.1), AttenuationRule::NEVER).unwrap();
        let mut direction = [0.0; D];
        direction[0] = 1.0;
        let beams = (0..300).map(|i| {
            let range = if i % 3 == 0 { 1.0 } else { 2.0 } - 0.05 + 0.1 * (f64::from(i) * 0.618).fract();
            Beam { direction, range, kind: BeamKind::Hit }
        });
        let pose = Pose { translation: [0.05; D], ..Pose::IDENTITY };
        map.integrate(&pose, &Scan::from_beams(beams)).unwrap();
        map
    }

    fn foretells_what_was_seen<const D: usize>() {
        let map = curtain::<D>();
        let mut direction = [0.0; D];
        direction[0] = 1.0;
        let d = RangeDistribution::along(&map, [0.05; D], direction, 5.0).unwrap();
        // In 3-D the line of beams is spread over blocks that it passes, where the map keeps a little of its doubt.
        let slack = if D == 2 { 0.01 } else { 0.03 };
        assert!((d.cumulative(1.2) - 1.0 / 3.0).abs() < slack, "{}", d.cumulative(1.2));
        assert!((d.quantile(0.2).unwrap() - 1.0).abs() < 0.051);
        assert!((d.median().unwrap() - 2.0).abs() < 0.1 && d.cumulative(1.9) < 1.0 / 3.0 + slack);
        assert!(d.passing() < 0.2 && d.density(1.5) < 0.01 * d.density(1.0));
        assert_eq!((d.density(6.0), d.density(-1.0), d.cumulative(-1.0)), (0.0, 0.0, 0.0));
        assert_eq!((d.quantile(1.0), d.quantile(f64::NAN)), (None, None));
    }

    #[test]
    fn foretells_what_was_seen_2d_and_3d() {
        foretells_what_was_seen::<2>();
        foretells_what_was_seen::<3>();
    }

    /// Density, cumulative and quantiles are those of one distribution, along any ray.
    fn fits_together<const D: usize>() {
        let map = curtain::<D>();
        let mut random = Random(3);
        for _ in 0..40 {
            let mut any = || point::<D>([0; 3].map(|_| f64::from(random.value())));
            let (origin, Some(direction)) = (any(), unit(any())) else { continue };
            let d = RangeDistribution::along(&map, origin, direction, 4.0).unwrap();
            let steps = 40_000;
            let mut sum = 0.0;
            for i in 0..steps {
                let range = 4.0 * (f64::from(i) + 0.5) / f64::from(steps);
                sum += d.density(range) * 4.0 / f64::from(steps);
                if i % 4001 == 0 {
                    let cumulative = d.cumulative(range);
                    assert!((sum - cumulative).abs() < 2e-3, "{range} {sum} {cumulative}");
                    if let Some(back) = d.quantile(cumulative) {
                        assert!((d.cumulative(back) - cumulative).abs() < 1e-9);
                    }
                }
            }
            assert!((sum + d.passing() - 1.0).abs() < 2e-3);
        }
    }

    #[test]
    fn fits_together_2d_and_3d() {
        fits_together::<2>();
        fits_together::<3>();
    }

    #[test]
    fn rays_that_are_none() {
        let map = curtain::<2>();
        let along = |o, d, far| RangeDistribution::along(&map, o, d, far).is_some();
        assert!(along([0.0; 2], [1.0, 0.0], 5.0) && along([0.0; 2], [1.0, 0.0], 0.0));
        assert!(!along([f64::NAN, 0.0], [1.0, 0.0], 5.0) && !along([0.0; 2], [1.0, 1.0], 5.0));
        assert!(!along([0.0; 2], [1.0, 0.0], 1e9) && !along([0.0; 2], [1.0, 0.0], -1.0));
        assert!(!along([0.0; 2], [f64::NAN, 0.0], 5.0) && !along([0.0; 2], [1.0, 0.0], f64::NAN));
    }
}
