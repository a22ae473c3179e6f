//! The textbook's march: samples along every beam.

use super::touched::Touched;
use super::{
    LONGEST_RAY_CELLS, PlanError, PlanLimits, Sweep, Swept, SweptColors, WeightModel, beam_stats, clip,
};
use crate::cell::{DistanceObservation, Distances};
use crate::geom::vector::along;
use crate::geom::{BlockKey, Lattice, Pose};
use crate::scan::{Scan, ScanStats};

/// Marches along every beam in steps of half a cell and gives each cell `d = z - s` of the first sample `s`
/// that falls into it. The weight tapers linearly to 0 at `-truncation` behind the surface. The textbook's
/// `tsdf_integrate` (section 3.3; which textbook: docs/REFERENCES.md).
///
/// The sample is nearer to the sensor than the cell's center, on average, which puts surfaces about a quarter
/// of a cell too far away; [`super::CellCentre`] does not do that.
#[derive(Clone, Debug)]
pub struct March<const D: usize> {
    truncation: f64,
    carve_weight: f32,
    model: WeightModel,
    touched: Touched<Distances, D>,
    weights: Vec<f32>,
    cosines: Vec<f32>,
}

impl<const D: usize> March<D> {
    /// A march that says something within `truncation` meters of the surface, and about all free space up to
    /// there with `carve_weight` times the weight of a beam; 0: nothing.
    pub fn new(truncation: f64, carve_weight: f32, model: WeightModel) -> Self {
        Self {
            truncation,
            carve_weight,
            model,
            touched: Touched::new(),
            weights: Vec::new(),
            cosines: Vec::new(),
        }
    }
}

impl<const D: usize> Swept<D> for March<D> {
    type Evidence = Distances;
    type Scratch = ();

    fn scratch(&self) {}

    fn blocks(&self) -> &[BlockKey<D>] {
        self.touched.keys()
    }

    fn evidence<'a>(&'a self, i: usize, (): &'a mut ()) -> &'a Distances {
        self.touched.evidence(i)
    }
}

impl<const D: usize> SweptColors<D> for March<D> {}

impl<const D: usize> Sweep<D> for March<D> {
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
        self.model.weigh(scan, &mut self.cosines, &mut self.weights);
        let mut stats = beam_stats(scan, world_from_sensor, limits);
        let (tau, step) = (self.truncation, 0.5 * lattice.resolution);
        let carve = self.carve_weight > 0.0;
        for (i, (beam, &weight)) in scan.beams().zip(&self.weights).enumerate() {
            let origin = world_from_sensor.transform_point(scan.origin(i));
            let z = beam.free_range();
            if z <= 0.0 || (!beam.is_hit() && !carve) {
                continue;
            }
            let first = if carve { 0.5 * step } else { (z - tau).max(0.5 * step) };
            let last = if beam.is_hit() { z + tau } else { z };
            let direction = world_from_sensor.rotate(beam.direction);
            let Some((near, far)) = clip(&bounds, origin, direction, last) else { continue };
            if far - near > LONGEST_RAY_CELLS * lattice.resolution {
                stats.refuse_far(beam.is_hit());
                continue;
            }
            let skipped = ((near - first) / step).ceil().max(0.0);
            let mut n = 0.0;
            loop {
                let s = first + (skipped + n) * step;
                n += 1.0;
                if s > far {
                    break;
                }
                let d = if beam.is_hit() { z - s } else { tau };
                let w = match d {
                    // Without carving the first sample is at tau, or a rounding error beyond it.
                    d if (d > tau && carve) || !beam.is_hit() => weight * self.carve_weight,
                    d if d >= 0.0 => weight,
                    _ => weight * (1.0 + d / tau) as f32,
                };
                let Some(cell) = lattice.cell_of(along(origin, direction, s)) else { continue };
                let evidence = self.touched.of_cell(cell);
                let i = BlockKey::offset(cell);
                if w > 0.0 && !evidence.is_set(i) {
                    evidence.set(i, DistanceObservation { distance: d.min(tau) as f32, weight: w });
                }
            }
            if self.touched.keys().len() > limits.most_blocks {
                return Err(PlanError::TooManyBlocks);
            }
        }
        self.touched.sort();
        Ok(stats)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Aabb;
    use crate::geom::vector::unit;
    use crate::scan::{Beam, BeamKind};
    use crate::testing::said;
    use proptest::prelude::*;
    use std::collections::HashMap;

    fn equals_the_oracle<const D: usize>(beams: &[([f64; D], f64, bool)], carve: bool) {
        let scan =
            Scan::from_beams(beams.iter().filter(|b| unit(b.0).is_some()).map(|&(direction, range, hit)| {
                Beam { direction, range, kind: if hit { BeamKind::Hit } else { BeamKind::MaxRange } }
            }));
        let pose = Pose { translation: [0.013; D], ..Pose::IDENTITY };
        let lattice = Lattice::new([-0.3; D], 0.1);
        let tau = 0.3;
        let mut want: HashMap<[i32; D], (f32, f32)> = HashMap::new();
        for b in scan.beams().filter(|b| b.free_range() > 0.0 && (b.is_hit() || carve)) {
            let first = if carve { 0.025 } else { (b.range - tau).max(0.025) };
            let last = if b.is_hit() { b.range + tau } else { b.range };
            let mut n = 0.0;
            while first + n * 0.05 <= last {
                let s = first + n * 0.05;
                n += 1.0;
                let d = if b.is_hit() { b.range - s } else { tau };
                let w = if d >= 0.0 { 1.0 } else { (1.0 + d / tau) as f32 };
                if w > 0.0 {
                    let cell = lattice.cell_of(along(pose.translation, b.direction, s)).unwrap();
                    want.entry(cell).or_insert((d.min(tau) as f32, w));
                }
            }
        }
        let mut sweep = March::new(tau, if carve { 1.0 } else { 0.0 }, WeightModel::Constant);
        sweep.plan(&scan, &pose, &lattice, &PlanLimits::inside(Aabb::new([-100.0; D], [100.0; D]))).unwrap();
        let said: HashMap<_, _> =
            said(&sweep).into_iter().map(|(c, o)| (c, (o.distance, o.weight))).collect();
        assert_eq!(said, want);
    }

    proptest! {
        #[test]
        fn equals_a_hash_map_2d(
            beams in prop::collection::vec((prop::array::uniform2(-1.0..1.0f64), 0.0..3.0f64, any::<bool>()), 1..30),
            carve: bool,
        ) {
            equals_the_oracle(&beams, carve);
        }
        #[test]
        fn equals_a_hash_map_3d(
            beams in prop::collection::vec((prop::array::uniform3(-1.0..1.0f64), 0.0..3.0f64, any::<bool>()), 1..30),
            carve: bool,
        ) {
            equals_the_oracle(&beams, carve);
        }
    }
}
