//! Exact rays: every cell that a beam passes through.

use super::touched::Touched;
use super::{LONGEST_RAY_CELLS, PlanError, PlanLimits, Sweep, Swept, beam_stats, clip};
use crate::cell::HitMiss;
use crate::geom::vector::{along, distance};
use crate::geom::{Aabb, BlockKey, Lattice, Pose, RayWalk};
use crate::scan::{Beam, Scan, ScanStats};

/// Walks every beam through the cells (Amanatides & Woo 1987) and marks hits and misses.
///
/// With `r` the distance of a cell's centre from the sensor, a cell on a beam of range `z` is hit where
/// `|r - z| < wall_depth / 2`, missed where `r < z`, else nothing is said. The cell that holds the end point
/// is hit in any case. A hit by any beam overrules the misses of all others: the order of the beams does not
/// matter. (The textbook takes the first beam that touches a cell, so that there it does.)
#[derive(Clone, Debug)]
pub struct Rays<const D: usize> {
    wall_depth: f64,
    touched: Touched<HitMiss, D>,
}

impl<const D: usize> Rays<D> {
    /// A sweep that calls a depth of `wall_depth` meters around each end point occupied.
    pub fn new(wall_depth: f64) -> Self {
        Self { wall_depth, touched: Touched::new() }
    }

    /// Marks the cells of one beam (in the world's frame) that frees or hits something; `false` where it is too long to
    /// be walked, and nothing is marked.
    fn walk(
        &mut self,
        lattice: &Lattice<D>,
        bounds: &Aabb<D>,
        origin: [f64; D],
        beam: &Beam<D>,
        most: usize,
    ) -> Result<bool, PlanError> {
        let (direction, z, hit) = (beam.direction, beam.range, beam.is_hit());
        let half = 0.5 * self.wall_depth;
        let length = if hit { z + half } else { z };
        let Some((near, far)) = clip(bounds, origin, direction, length) else { return Ok(true) };
        if far - near > LONGEST_RAY_CELLS * lattice.resolution {
            return Ok(false);
        }
        let start = if near > 0.0 { along(origin, direction, near) } else { origin };
        let Some(mut walk) = RayWalk::new(lattice, start, direction) else { return Ok(true) };
        // Up to here every center is nearer than z - half, whatever the angle: no square root needed.
        let diagonal = 0.5 * lattice.resolution * (D as f64).sqrt();
        let surely_missed = z - half - diagonal;
        while near + walk.exit() < surely_missed.min(far) {
            let cell = walk.cell();
            self.touched.of_cell(cell).mark_miss(BlockKey::offset(cell));
            walk.advance();
        }
        let end = if hit { lattice.cell_of(along(origin, direction, z)) } else { None };
        loop {
            let cell = walk.cell();
            let r = distance(lattice.center(cell), origin);
            if hit && ((r - z).abs() < half || Some(cell) == end) {
                self.touched.of_cell(cell).mark_hit(BlockKey::offset(cell));
            } else if r < z {
                self.touched.of_cell(cell).mark_miss(BlockKey::offset(cell));
            }
            if near + walk.exit() >= far {
                break;
            }
            walk.advance();
        }
        if self.touched.keys().len() > most { Err(PlanError::TooManyBlocks) } else { Ok(true) }
    }
}

impl<const D: usize> Swept<D> for Rays<D> {
    type Evidence = HitMiss;
    type Scratch = ();

    fn scratch(&self) {}

    fn blocks(&self) -> &[BlockKey<D>] {
        self.touched.keys()
    }

    fn evidence<'a>(&'a self, i: usize, (): &'a mut ()) -> &'a HitMiss {
        self.touched.evidence(i)
    }
}

impl<const D: usize> Sweep<D> for Rays<D> {
    type Scan = Scan<D>;

    fn plan(
        &mut self,
        scan: &Scan<D>,
        world_from_sensor: &Pose<D>,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
    ) -> Result<ScanStats, PlanError> {
        self.touched.clear();
        let bounds = limits.bounds_or_everywhere();
        let mut stats = beam_stats(scan, world_from_sensor, limits);
        for (i, beam) in scan.beams().enumerate().filter(|(_, b)| b.free_range() > 0.0) {
            let beam = Beam { direction: world_from_sensor.rotate(beam.direction), ..beam };
            let origin = world_from_sensor.transform_point(scan.origin(i));
            if !self.walk(lattice, &bounds, origin, &beam, limits.most_blocks)? {
                stats.refuse_far(beam.is_hit());
            }
        }
        self.touched.sort();
        Ok(stats)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Endpoint;
    use crate::geom::vector::unit;
    use crate::scan::BeamKind;
    use crate::testing::{point, said};
    use proptest::prelude::*;
    use std::collections::HashMap;

    /// The definition, cell by cell in a hash map, straight from the documentation.
    fn oracle<const D: usize>(
        scan: &Scan<D>,
        pose: &Pose<D>,
        lattice: &Lattice<D>,
        depth: f64,
    ) -> HashMap<[i32; D], Endpoint> {
        let mut said = HashMap::new();
        for beam in scan.beams().filter(|b| b.free_range() > 0.0) {
            let (z, origin, direction) = (beam.range, pose.translation, pose.rotate(beam.direction));
            let length = if beam.is_hit() { z + depth / 2.0 } else { z };
            let end = lattice.cell_of(along(origin, direction, z));
            let mut walk = RayWalk::new(lattice, origin, direction).unwrap();
            loop {
                let cell = walk.cell();
                let r = distance(lattice.center(cell), origin);
                if beam.is_hit() && ((r - z).abs() < depth / 2.0 || Some(cell) == end) {
                    said.insert(cell, Endpoint::Hit);
                } else if r < z {
                    said.entry(cell).or_insert(Endpoint::Miss);
                }
                if walk.exit() >= length {
                    break;
                }
                walk.advance();
            }
        }
        said
    }

    fn equals_the_oracle<const D: usize>(beams: &[([f64; 3], f64, u8)], origin: [f64; 3], depth: f64) {
        let kinds = [BeamKind::Hit, BeamKind::Hit, BeamKind::MaxRange, BeamKind::NoReturn, BeamKind::Dropped];
        let scan = Scan::from_beams(
            beams.iter().map(|&(d, range, kind)| (point(d), range, kinds[usize::from(kind)])).filter_map(
                |(direction, range, kind)| unit(direction).map(|_| Beam { direction, range, kind }),
            ),
        );
        let pose = Pose { translation: point(origin), ..Pose::IDENTITY };
        let lattice = Lattice::new([-0.3; D], 0.1);
        let mut sweep = Rays::<D>::new(depth);
        let everywhere = Aabb::new([-100.0; D], [100.0; D]);
        for _ in 0..2 {
            sweep.plan(&scan, &pose, &lattice, &PlanLimits::inside(everywhere)).unwrap();
        }
        assert!(sweep.blocks().is_sorted());
        assert_eq!(said(&sweep), oracle(&scan, &pose, &lattice, depth));
    }

    proptest! {
        #[test]
        fn equals_a_hash_map_2d_and_3d(
            beams in prop::collection::vec((prop::array::uniform3(-1.0..1.0f64), 0.0..3.0f64, 0u8..5), 1..40),
            o in prop::array::uniform3(-1.0..1.0f64), depth in 0.0..0.3f64,
        ) {
            equals_the_oracle::<2>(&beams, o, depth);
            equals_the_oracle::<3>(&beams, o, depth);
        }
    }

    #[test]
    fn what_each_kind_of_beam_marks() {
        let limits = PlanLimits::inside(Aabb::new([0.0; 2], [5.0; 2]));
        let marks = |kind| {
            let mut sweep = Rays::<2>::new(0.1);
            let scan = Scan::from_beams([Beam { direction: [1.0, 0.0], range: 1.0, kind }]);
            let pose = Pose::<2>::new(0.05, 0.05, 0.0);
            sweep.plan(&scan, &pose, &Lattice::new([0.0; 2], 0.1), &limits).unwrap();
            let said = said(&sweep);
            let hits = said.values().filter(|o| **o == Endpoint::Hit).count();
            (hits, said.len() - hits)
        };
        assert_eq!(marks(BeamKind::Hit), (1, 10));
        assert_eq!(marks(BeamKind::MaxRange), (0, 10));
        assert_eq!(marks(BeamKind::NoReturn), (0, 10));
        assert_eq!(marks(BeamKind::Dropped), (0, 0));
        assert_eq!(marks(BeamKind::SelfHit), (0, 0));
    }

    #[test]
    fn a_far_sensor_costs_nothing_outside_the_bounds() {
        let mut sweep = Rays::<2>::new(0.1);
        let scan = Scan::from_beams([Beam { direction: [1.0, 0.0], range: 1e7, kind: BeamKind::Hit }]);
        let pose = Pose::<2>::new(-5e6, 0.5, 0.0);
        let limits = PlanLimits::inside(Aabb::new([0.0; 2], [5.0; 2]));
        sweep.plan(&scan, &pose, &Lattice::new([0.0; 2], 0.1), &limits).unwrap();
        assert_eq!(sweep.blocks().len(), 7);
    }
}
