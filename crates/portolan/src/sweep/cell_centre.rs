//! The default sweep for distances: at cell centers, with the range interpolated between beams.

use super::fan::{Fan, Spoke};
use super::fan_plan::{BlockBitmap, Outline, Stretch};
use super::nearest_ray::{NearestRay, Ray};
use super::{PlanError, PlanLimits, Sweep, Swept, SweptColors, WeightModel, beam_stats};
use crate::cell::{Distances, Evidence};
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{BeamOrder, Scan, ScanStats, connected};

/// Gives every cell the distance at its **center**.
///
/// Where the scan knows its neighbours (a planar fan), a center lies between two beams. If both end on one
/// surface, the range at the center's bearing is that of the chord between their end points; else the nearer
/// beam speaks for the cells that it passes within half a cell, and between the two there is free space up to
/// the shorter one, less the truncation. The cost is that of the cells, not of the beams: no cell is looked at
/// twice. Scans without neighbourhood give each cell the beam that passes nearest to its center. A fan whose sensor moved is
/// looked at as [`Scan::deskew`] says.
///
/// Against [`super::March`] this removes a bias of about a quarter of a cell away from the sensor.
#[derive(Clone, Debug)]
pub struct CellCentre<const D: usize> {
    truncation: f64,
    carve_weight: f32,
    model: WeightModel,
    weights: Vec<f32>,
    cosines: Vec<f32>,
    spokes: Vec<Spoke>,
    fan: Fan,
    bitmap: BlockBitmap,
    outline: Outline,
    keys: Vec<BlockKey<D>>,
    /// Center of the first cell of the lattice, relative to the sensor.
    first_centre: [f64; D],
    resolution: f64,
    rays: NearestRay<D>,
    ordered: bool,
}

impl<const D: usize> CellCentre<D> {
    /// A sweep that says something within `truncation` meters of the surface, and about all free space up to
    /// there with `carve_weight` times the weight of a beam; 0: nothing.
    pub fn new(truncation: f64, carve_weight: f32, model: WeightModel) -> Self {
        Self {
            truncation,
            carve_weight,
            model,
            weights: Vec::new(),
            cosines: Vec::new(),
            spokes: Vec::new(),
            fan: Fan::default(),
            bitmap: BlockBitmap::default(),
            outline: Outline::default(),
            keys: Vec::new(),
            first_centre: [0.0; D],
            resolution: 1.0,
            rays: NearestRay::new(),
            ordered: false,
        }
    }

    fn plan_fan(
        &mut self,
        scan: &Scan<D>,
        world_from_sensor: &Pose<D>,
        lattice: &Lattice<D>,
        bounds: &Aabb<D>,
    ) -> Result<(), PlanError> {
        let settings = (self.truncation, self.carve_weight, lattice.resolution);
        self.fan.rebuild(scan, world_from_sensor, &self.weights, settings, &mut self.spokes);
        let origin = world_from_sensor.translation;
        self.resolution = lattice.resolution;
        self.first_centre = std::array::from_fn(|k| lattice.origin[k] + 0.5 * lattice.resolution - origin[k]);

        let reach = scan.reach() + self.truncation + lattice.resolution;
        let window = bounds.intersection(Aabb::new(origin, origin).grown(reach));
        self.keys.clear();
        if !self.bitmap.reset(lattice, &window) {
            return Err(PlanError::TooManyBlocks);
        }
        self.outline_beams(scan, lattice, origin);
        self.bitmap.collect(&mut self.keys);
        Ok(())
    }

    /// Marks the blocks between neighbouring beams, a few beams at a time.
    fn outline_beams(&mut self, scan: &Scan<D>, lattice: &Lattice<D>, origin: [f64; D]) {
        /// Beams in one outline: more are cheaper to mark, but cover more blocks that no beam sees.
        const TOGETHER: usize = 6;
        let inverse = 1.0 / (lattice.resolution * BLOCK_EDGE as f64);
        let zero: [f64; 2] = [0, 1].map(|k| (origin[k] - lattice.origin[k]) * inverse);
        // A cell around every beam: centers are seen, not corners, and torn beams speak half a cell aside.
        self.outline.reset(&self.bitmap, lattice.resolution * inverse);
        let mut last: Option<(Stretch, [[f64; 2]; 2])> = None;
        let mut together = 0;
        let n = self.spokes.len();
        let carve = self.carve_weight > 0.0;
        let closing = usize::from(scan.next(n - 1).is_some());
        for i in (0..n).chain(0..closing) {
            let spoke = &self.spokes[i];
            let stretch = Stretch::of(spoke, self.truncation, carve);
            let ends = stretch.map(|s| {
                [s.from, s.to].map(|s| [0, 1].map(|k| zero[k] + f64::from(spoke.direction[k]) * s * inverse))
            });
            // Without carving there is nothing between two bands that do not overlap, unless a steep surface joins them.
            let continues = match (&last, &stretch) {
                (Some((before, _)), Some(now)) => {
                    let overlap = before.from <= now.to && now.from <= before.to;
                    carve || overlap || connected(scan, (i + n - 1) % n, i)
                }
                _ => false,
            };
            if let (Some((_, before)), Some(now), true) = (&last, &ends, continues) {
                self.outline.edge(before[1], now[1]);
                if !carve {
                    self.outline.edge(before[0], now[0]);
                }
                together += 1;
            }
            if !continues || together == TOGETHER {
                if let Some((_, [from, to])) = last {
                    self.outline.edge(from, to);
                }
                self.outline.mark(&mut self.bitmap);
                together = 0;
                if let Some([from, to]) = ends {
                    self.outline.edge(from, to);
                }
            }
            last = stretch.zip(ends);
        }
        if let Some((_, [from, to])) = last {
            self.outline.edge(from, to);
        }
        self.outline.mark(&mut self.bitmap);
    }
}

impl<const D: usize> Sweep<D> for CellCentre<D> {
    type Scan = Scan<D>;

    fn plan(
        &mut self,
        scan: &Scan<D>,
        world_from_sensor: &Pose<D>,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
    ) -> Result<ScanStats, PlanError> {
        let seen = scan.seen_from_zero();
        self.ordered = matches!(seen.order(), BeamOrder::Fan { .. }) && Fan::can_hold(seen.len());
        self.model.weigh(if self.ordered { &seen } else { scan }, &mut self.cosines, &mut self.weights);
        let bounds = limits.bounds_or_everywhere();
        if self.ordered {
            self.plan_fan(&seen, world_from_sensor, lattice, &bounds)?;
        } else {
            let rays = scan.beams().zip(&self.weights).enumerate().map(|(i, (beam, &weight))| Ray {
                origin: world_from_sensor.transform_point(scan.origin(i)),
                direction: world_from_sensor.rotate(beam.direction),
                range: beam.free_range(),
                hit: beam.is_hit(),
                weight,
            });
            let how = (self.truncation, self.carve_weight);
            if !self.rays.plan(rays, (lattice, &bounds), how, limits.most_blocks) {
                return Err(PlanError::TooManyBlocks);
            }
        }
        if self.blocks().len() > limits.most_blocks {
            return Err(PlanError::TooManyBlocks);
        }
        Ok(beam_stats(scan, world_from_sensor, limits))
    }
}

impl<const D: usize> SweptColors<D> for CellCentre<D> {}

impl<const D: usize> Swept<D> for CellCentre<D> {
    type Evidence = Distances;
    type Scratch = Distances;

    fn scratch(&self) -> Distances {
        Distances::silent(block_cells::<D>())
    }

    fn blocks(&self) -> &[BlockKey<D>] {
        if self.ordered { &self.keys } else { self.rays.keys() }
    }

    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut Distances) -> &'a Distances {
        if !self.ordered {
            return &self.rays.evidence(i).distances;
        }
        let cell = self.keys[i].first_cell();
        // From the lattice to the sensor in f64, then f32: near a UTM origin nothing is lost.
        let corner: [f32; D] =
            std::array::from_fn(|k| (self.first_centre[k] + f64::from(cell[k]) * self.resolution) as f32);
        let step = self.resolution as f32;
        let (distance, weight) = scratch.planes_mut();
        // Fans exist in 2-D only, where a block has exactly so many cells.
        if let (Ok(distance), Ok(weight)) = (distance.try_into(), weight.try_into()) {
            self.fan.observe_block([corner[0], corner[1]], step, distance, weight);
        }
        scratch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Beam, BeamKind, RangeLimits};
    use crate::testing::said;
    use proptest::prelude::*;
    use std::collections::HashMap;

    fn laser(readings: &[f64], no_return: f64) -> Scan<2> {
        let n = readings.len();
        let bearings: Vec<f64> = (0..n).map(|i| i as f64 * std::f64::consts::TAU / n as f64 - 3.0).collect();
        let limits = RangeLimits { no_return, ..Default::default() };
        Scan::from_laser(&bearings, readings, &limits)
    }

    /// The definition, for every cell of a large square: no block may be missing from the plan.
    fn oracle(
        scan: &Scan<2>,
        pose: &Pose<2>,
        lattice: &Lattice<2>,
        tau: f64,
        carve: bool,
    ) -> HashMap<[i32; 2], f64> {
        let mut all = HashMap::new();
        for x in -80..80 {
            for y in -80..80 {
                let cell = [x, y];
                let p = crate::geom::vector::sub(lattice.center(cell), pose.translation);
                let r = crate::geom::vector::norm(p);
                let bearing = p[1].atan2(p[0]);
                let angle = |i: usize| {
                    let d = pose.rotate(scan.beam(i).direction);
                    (bearing - d[1].atan2(d[0])).rem_euclid(std::f64::consts::TAU)
                };
                // The beam last passed going counter-clockwise.
                let Some(a) = (0..scan.len()).min_by(|&i, &j| angle(i).total_cmp(&angle(j))) else {
                    continue;
                };
                let b = scan.next(a);
                let d = if let Some(b) = b.filter(|&b| crate::scan::connected(scan, a, b)) {
                    let end = |i: usize| {
                        crate::geom::vector::scale(pose.rotate(scan.beam(i).direction), scan.beam(i).range)
                    };
                    let (ea, eb) = (end(a), end(b));
                    let chord = crate::geom::vector::sub(eb, ea);
                    r * (crate::geom::vector::cross(ea, eb) / crate::geom::vector::cross(p, chord) - 1.0)
                } else {
                    let b = b.unwrap_or((a + 1) % scan.len());
                    let dir = |i: usize| pose.rotate(scan.beam(i).direction);
                    let along = |i: usize| crate::geom::vector::dot(p, dir(i));
                    let near = if along(a) >= along(b) { a } else { b };
                    let aside = crate::geom::vector::cross(dir(near), p).abs();
                    let (za, zb) = (scan.beam(a).free_range(), scan.beam(b).free_range());
                    if (aside - 0.5 * lattice.resolution).abs() < 1e-5 || (along(a) - along(b)).abs() < 1e-5 {
                        continue; // rounding decides
                    }
                    if aside <= 0.5 * lattice.resolution && along(near) > 0.0 {
                        let beam = scan.beam(near);
                        if beam.is_hit() {
                            beam.range - r
                        } else if r <= beam.free_range() - tau {
                            tau
                        } else {
                            continue;
                        }
                    } else if scan.next(a).is_some() && r <= za.min(zb) - tau {
                        tau
                    } else {
                        continue;
                    }
                };
                if d > -tau + 1e-4 && (d < tau - 1e-4 || (carve && d > tau - 1e-5)) {
                    all.insert(cell, d.min(tau));
                }
            }
        }
        all
    }

    /// Six smooth walls with jumps between them and holes of no return.
    fn matches_the_definition(walls: &[f64], jitter: f64, gaps: &[bool], carve: bool, pose: &Pose<2>) {
        let reading = |i: usize| {
            let rough = jitter * ((i * 7) % 5) as f64 / 5.0;
            if gaps[i] && i.is_multiple_of(4) { 99.0 } else { walls[i / 15] + rough }
        };
        let scan = laser(&(0..90).map(reading).collect::<Vec<_>>(), 90.0);
        let lattice = Lattice::new([0.0; 2], 0.05);
        let mut sweep = CellCentre::new(0.15, if carve { 1.0 } else { 0.0 }, WeightModel::Constant);
        sweep.plan(&scan, pose, &lattice, &PlanLimits::inside(Aabb::new([-4.0; 2], [4.0; 2]))).unwrap();
        assert!(sweep.blocks().is_sorted());
        let said = said(&sweep);
        let want = oracle(&scan, pose, &lattice, 0.15, carve);
        for (cell, d) in &want {
            let got = said.get(cell).unwrap_or_else(|| panic!("{cell:?} is missing, want {d}"));
            // Wedge borders decide alike up to rounding; next to a jump the two sides differ.
            assert!((f64::from(got.distance) - d).abs() < 2e-3, "{cell:?}: {got:?} {d}");
        }
        // Nothing is said where the definition says nothing, up to cells at the very limits.
        let surplus = said.keys().filter(|c| !want.contains_key(*c)).count();
        assert!(surplus * 50 <= said.len() + 50, "{surplus} of {}", said.len());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn equals_the_definition_at_every_cell(
            walls in prop::collection::vec(0.3..3.0f64, 6), jitter in 0.0..0.05f64,
            gaps in prop::collection::vec(any::<bool>(), 90), carve: bool,
            (x, y, theta) in (-0.5..0.5f64, -0.5..0.5f64, -3.0..3.0f64),
        ) {
            matches_the_definition(&walls, jitter, &gaps, carve, &Pose::<2>::new(x, y, theta));
        }
    }

    /// Two neighbouring beams on one wall whose bands do not overlap: what is between them is still that wall.
    #[test]
    fn a_steep_wall_is_whole_without_carving() {
        let walls = [0.3, 2.018_205_864_863_922_7, 2.798_232_942_112_267, 0.3, 0.3, 0.3];
        let pose = Pose::<2>::new(-0.137_291_603_921_797_15, 0.0, 1.424_148_157_486_693_2);
        matches_the_definition(&walls, 0.0, &[false; 90], false, &pose);
    }

    /// What each kind of beam says to the cells of a fan: half a turn of beams of one kind.
    #[test]
    fn what_each_kind_of_beam_says() {
        let bearings: Vec<f64> = (0..181).map(|d| f64::from(d - 90).to_radians()).collect();
        let directions: Vec<[f64; 2]> = bearings.iter().map(|b| [b.cos(), b.sin()]).collect();
        let said_by = |kind, carve_weight| {
            let beams = directions.iter().map(|&direction| Beam { direction, range: 2.0, kind }).collect();
            let scan = Scan::from_fan(&bearings, beams);
            let mut sweep = CellCentre::new(0.15, carve_weight, WeightModel::Constant);
            let pose = Pose::<2>::new(0.0, 0.0, 0.0);
            let limits = PlanLimits::inside(Aabb::new([-4.0; 2], [4.0; 2]));
            sweep.plan(&scan, &pose, &Lattice::new([0.0; 2], 0.05), &limits).unwrap();
            said(&sweep)
        };
        let cells = |area: f64| (area / 0.05f64.powi(2)) as usize;
        let half_disc = |radius: f64| 0.5 * std::f64::consts::PI * radius * radius;
        let hit = said_by(BeamKind::Hit, 1.0);
        assert!(hit.values().any(|o| o.distance < 0.0));
        assert!(hit.len().abs_diff(cells(half_disc(2.15))) < cells(0.2));
        // Free up to the range less the truncation, never a surface; with the weight that free space has.
        for kind in [BeamKind::MaxRange, BeamKind::NoReturn] {
            let free = said_by(kind, 0.3);
            assert!(free.values().all(|o| o.distance == 0.15 && o.weight == 0.3), "{kind:?}");
            assert!(free.len().abs_diff(cells(half_disc(1.85))) < cells(0.2), "{kind:?}: {}", free.len());
            assert!(said_by(kind, 0.0).is_empty(), "{kind:?}");
        }
        for kind in [BeamKind::Dropped, BeamKind::SelfHit] {
            assert!(said_by(kind, 1.0).is_empty(), "{kind:?}");
        }
        assert!(said_by(BeamKind::Hit, 0.0).values().all(|o| o.distance.abs() <= 0.15 && o.weight > 0.0));
    }

    fn unordered_cells_take_the_nearest_beam<const D: usize>() {
        let mut ahead = [0.0; D];
        ahead[0] = 1.0;
        let scan = Scan::from_points(&[ahead]);
        let pose = Pose { translation: [0.05; D], ..Pose::IDENTITY };
        let mut sweep = CellCentre::<D>::new(0.25, 1.0, WeightModel::Constant);
        let limits = PlanLimits::inside(Aabb::new([-3.0; D], [3.0; D]));
        sweep.plan(&scan, &pose, &Lattice::new([0.0; D], 0.1), &limits).unwrap();
        let said = said(&sweep);
        let mut cell = [0; D];
        cell[0] = 9;
        let o = said[&cell];
        assert!((o.distance - 0.1).abs() < 1e-6 && o.weight == 1.0);
        cell[0] = 11;
        let o = said[&cell];
        assert!((o.distance + 0.1).abs() < 1e-6 && (o.weight - 0.6).abs() < 1e-6);
        assert_eq!(said.len(), 13);
    }

    #[test]
    fn unordered_cells_take_the_nearest_beam_2d_and_3d() {
        unordered_cells_take_the_nearest_beam::<2>();
        unordered_cells_take_the_nearest_beam::<3>();
    }
}
