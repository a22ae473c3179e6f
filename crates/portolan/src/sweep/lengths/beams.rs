//! Hits and lengths of beams with kinds, in 2-D and 3-D.

use super::blocks::{HitBlocks, KnowsHits};
use super::rays::RayLengths;
use crate::cell::{Evidence, HitLengths};
use crate::geom::vector::along;
use crate::geom::{BlockKey, Lattice, Pose, block_cells};
use crate::scan::{Scan, ScanStats};
use crate::sweep::scan_rays::Ray;
use crate::sweep::{PlanError, PlanLimits, Sweep, Swept, beam_stats};

/// Walks every beam through the cells (Amanatides & Woo 1987), up to its end or as far as it is known to be free, and adds
/// its length in each; the cell of an end point gets a hit. O(cells passed).
///
/// In 3-D only the cells of blocks in which a beam ever ended are told apart; of the others it says the mean length.
///
/// Every beam counts, also where many pass a cell: what is observed is their length, and a cell that a hundred beams
/// crossed was tried a hundred times.
#[derive(Clone, Debug)]
pub struct BeamLengths<const D: usize> {
    rays: RayLengths<D>,
}

impl<const D: usize> BeamLengths<D> {
    /// A sweep that has seen nothing yet.
    pub fn new() -> Self {
        Self { rays: RayLengths::new() }
    }
}

impl<const D: usize> Default for BeamLengths<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> Swept<D> for BeamLengths<D> {
    type Evidence = HitLengths;
    type Scratch = HitLengths;

    fn scratch(&self) -> HitLengths {
        HitLengths::silent(block_cells::<D>())
    }

    fn blocks(&self) -> &[BlockKey<D>] {
        self.rays.keys()
    }

    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut HitLengths) -> &'a HitLengths {
        self.rays.evidence(i, scratch)
    }
}

impl<const D: usize> KnowsHits<D> for BeamLengths<D> {
    fn hit_blocks(&mut self) -> &mut HitBlocks<D> {
        &mut self.rays.hit
    }
}

impl<const D: usize> Sweep<D> for BeamLengths<D> {
    type Scan = Scan<D>;

    fn plan(
        &mut self,
        scan: &Scan<D>,
        world_from_sensor: &Pose<D>,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
    ) -> Result<ScanStats, PlanError> {
        let mut stats = beam_stats(scan, world_from_sensor, limits);
        let rays = scan.beams().enumerate().filter(|(_, b)| b.free_range() > 0.0).map(|(i, b)| {
            let origin = world_from_sensor.transform_point(scan.origin(i));
            let end = along(origin, world_from_sensor.rotate(b.direction), b.range);
            Ray { origin, end, hit: b.is_hit(), passes: true }
        });
        let tally = self.rays.plan(lattice, limits, rays)?;
        let refused = tally.refused.total();
        (0..refused).for_each(|i| stats.refuse_far(i < tally.refused_hits));
        Ok(stats)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::LENGTH_UNITS;
    use crate::scan::{Beam, BeamKind};
    use crate::testing::said;

    #[test]
    fn what_each_kind_of_beam_adds() {
        let adds = |kind| {
            let mut sweep = BeamLengths::<2>::new();
            let scan = Scan::from_beams([Beam { direction: [1.0, 0.0], range: 1.0, kind }]);
            let pose = Pose::<2>::new(0.05, 0.05, 0.0);
            sweep.plan(&scan, &pose, &Lattice::new([0.0; 2], 0.1), &PlanLimits::default()).unwrap();
            let said = said(&sweep);
            let length: u32 = said.values().map(|o| o.length).sum();
            (said.values().map(|o| o.hits).sum::<u32>(), length / LENGTH_UNITS, said.len())
        };
        assert_eq!(adds(BeamKind::Hit), (1, 10, 11));
        assert_eq!(adds(BeamKind::MaxRange), (0, 10, 11));
        assert_eq!(adds(BeamKind::NoReturn), (0, 10, 11));
        assert_eq!(adds(BeamKind::Dropped), (0, 0, 0));
        assert_eq!(adds(BeamKind::SelfHit), (0, 0, 0));
    }

    #[test]
    fn many_beams_through_a_cell_add_up() {
        let scan = Scan::from_beams((0..5).map(|i| {
            let kind = if i < 2 { BeamKind::Hit } else { BeamKind::MaxRange };
            Beam { direction: [1.0, 0.0], range: 0.5, kind }
        }));
        let mut sweep = BeamLengths::<2>::new();
        let pose = Pose::<2>::new(0.05, 0.05, 0.0);
        sweep.plan(&scan, &pose, &Lattice::new([0.0; 2], 0.1), &PlanLimits::default()).unwrap();
        let said = said(&sweep);
        assert_eq!((said[&[2, 0]].hits, said[&[2, 0]].length), (0, 5 * LENGTH_UNITS));
        assert_eq!((said[&[5, 0]].hits, said[&[5, 0]].length), (2, 5 * LENGTH_UNITS / 2));
    }
}
