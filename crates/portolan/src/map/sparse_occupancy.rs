//! Occupancy of space in bricks: memory only where something was seen.

use super::error::{most_bricks, too_many};
use super::{Abilities, MapError, MapRepr};
use crate::answer::Answer;
use crate::cell::{Evidence, HitMiss, LogOdds8, LogOddsValue, OccupancyModel, Planes};
use crate::geom::{Aabb, Lattice, Pose, block_cells};
use crate::scan::{Frame, Scan, ScanStats, SphericalLayout};
use crate::store::{Bricks, BricksFull, Store};
use crate::sweep::{HitMissSweep, OccupancySweep, PlanError, PlanLimits, PlannedScan};

/// Clamped log odds in hashed bricks of `8^3` cells; the map of space for lidars and depth cameras.
///
/// Each scan gives a cell at most one observation: hit where a beam ends in it, else miss where beams pass. Unbounded
/// unless told otherwise; works at UTM coordinates, since cells are counted from the lattice's origin.
///
/// ```
/// use portolan::geom::Lattice;
/// use portolan::map::{OccupancySweep, SparseOccupancy};
///
/// let mut map = SparseOccupancy::<portolan::cell::LogOdds8>::new(
///     Lattice::new([0.0; 3], 0.1), Default::default(), OccupancySweep::Auto)?;
/// map.integrate_points(&[[2.0, 0.0, 0.5], [2.0, 0.1, 0.5]], [0.0, 0.0, 0.5])?;
/// assert!(map.probability([2.05, 0.05, 0.55]).known() > Some(0.5));
/// assert!(map.probability([1.05, 0.05, 0.55]).known() < Some(0.5));
/// assert_eq!(map.probability([3.0, 0.0, 0.5]).known(), None);
/// # Ok::<(), portolan::map::MapError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SparseOccupancy<V: LogOddsValue = LogOdds8> {
    store: Bricks<V, 3>,
    rule: V::Rule,
    lookup: V::Lookup,
    model: OccupancyModel,
    bounds: Option<Aabb<3>>,
    sweep: HitMissSweep,
}

impl<V: LogOddsValue> SparseOccupancy<V> {
    /// A map in which nothing was observed. `model.wall_depth` is not used: the cell of an end point is hit and no other.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn new(lattice: Lattice<3>, model: OccupancyModel, sweep: OccupancySweep) -> Result<Self, MapError> {
        Self::from_store(Bricks::new(lattice), model, sweep)
    }

    /// A map from stored bricks.
    ///
    /// # Errors
    /// Where the lattice or the model is not possible.
    pub fn from_store(
        store: Bricks<V, 3>,
        model: OccupancyModel,
        sweep: OccupancySweep,
    ) -> Result<Self, MapError> {
        super::error::check_lattice(store.lattice())?;
        let rule = V::rule(&model)?;
        let lookup = V::lookup(&rule);
        Ok(Self { store, rule, lookup, model, bounds: None, sweep: HitMissSweep::new(sweep) })
    }

    /// Allows no more than `bytes` for the store from now on.
    pub fn set_limit(&mut self, bytes: usize) {
        self.store.set_limit(bytes);
    }

    /// Changes only cells in this box (world) from now on; `None`: everywhere. Snapped outwards to cells.
    pub fn set_bounds(&mut self, bounds: Option<Aabb<3>>) {
        self.bounds = bounds;
    }

    /// Rows and columns for scans of points that come without them; otherwise they are found.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.sweep.set_layout(layout);
    }

    /// Fuses what a sensor delivered at a known pose. A pose that is not rigid is refused and counted, and so is a ray that
    /// is not finite or longer than 2^20 cells (within the bounds, if there are any).
    ///
    /// # Errors
    /// [`MapError::Full`] where the limit of memory leaves no room; part of the scan is then fused. Also where its rays pass
    /// more bricks than the limit can ever hold (and 4096 more): nothing is fused then. [`MapError::TooFar`] where they pass
    /// more than 2^26, whatever the limit. [`MapError::Image`] where an image that is used contradicts itself.
    pub fn integrate(&mut self, world_from_sensor: &Pose<3>, frame: &Frame) -> Result<ScanStats, MapError> {
        if !self.has_place(world_from_sensor) {
            return Ok(ScanStats { refused_poses: 1, ..Default::default() });
        }
        self.fuse(|sweep, lattice, limits| sweep.plan(frame, world_from_sensor, lattice, limits))
    }

    /// Fuses surfaces seen from `origin` (both world, metres), in one call, with exact rays. Points that are not finite are refused and
    /// counted.
    ///
    /// # Errors
    /// As [`SparseOccupancy::integrate`].
    pub fn integrate_points(
        &mut self,
        points_world: &[impl Into<[f64; 3]> + Copy + Sync],
        origin_world: impl Into<[f64; 3]>,
    ) -> Result<ScanStats, MapError> {
        let origin = origin_world.into();
        if self.store.lattice().cell_of(origin).is_none() {
            return Ok(ScanStats { refused_poses: 1, ..Default::default() });
        }
        self.fuse(|sweep, lattice, limits| sweep.plan_points(points_world, origin, lattice, limits))
    }

    fn has_place(&self, world_from_sensor: &Pose<3>) -> bool {
        world_from_sensor.is_rigid() && self.store.lattice().cell_of(world_from_sensor.translation).is_some()
    }

    /// Plans a scan, and fuses its evidence block by block.
    fn fuse(
        &mut self,
        plan: impl FnOnce(&mut HitMissSweep, &Lattice<3>, &PlanLimits<3>) -> Result<PlannedScan, PlanError>,
    ) -> Result<ScanStats, MapError> {
        let limit = self.store.limit();
        let most = most_bricks(limit, size_of::<V>() * block_cells::<3>());
        let limits = PlanLimits { bounds: self.bounds, most_blocks: most, colors: false };
        let planned = plan(&mut self.sweep, self.store.lattice(), &limits).map_err(|error| match error {
            PlanError::BadImage(why) => MapError::Image(why),
            PlanError::TooManyBlocks => {
                let (bricks, bytes) = (self.store.len(), self.store.memory_bytes());
                too_many(most, BricksFull { limit, bricks, bytes })
            }
        });
        let PlannedScan { beams, refused, hits_outside } = planned?;
        let (sweep, rule) = (&self.sweep, &self.rule);
        let cells = self.store.update(
            sweep.blocks(),
            || HitMiss::silent(block_cells::<3>()),
            |i, brick, evidence| {
                let observed = sweep.evidence(i, evidence);
                if observed > 0 {
                    let brick = brick.get_or_insert_with(|| V::Brick::unobserved(block_cells::<3>()));
                    V::fuse_brick(brick, evidence, rule);
                }
                observed
            },
        )?;
        Ok(ScanStats { scans: 1, beams, refused, cells, hits_outside, ..Default::default() })
    }

    /// P(occupied) at a point. O(1).
    #[inline]
    pub fn probability(&self, p_world: impl Into<[f64; 3]>) -> Answer<f64> {
        let Some(cell) = self.store.lattice().cell_of(p_world.into()) else { return Answer::Outside };
        self.store.cell(cell).map_or(Answer::Unknown, |v| Answer::Known(v.look_up(&self.lookup)))
    }

    /// Whether a cell is more likely occupied than not; `None`: never observed.
    #[inline]
    pub fn is_occupied(&self, cell: [i32; 3]) -> Option<bool> {
        self.store.cell(cell).map(V::is_occupied)
    }

    /// Cells and where they are.
    pub fn store(&self) -> &Bricks<V, 3> {
        &self.store
    }

    /// The map's cells, taken out.
    pub fn into_store(self) -> Bricks<V, 3> {
        self.store
    }

    /// The model that the filter's numbers come from.
    pub fn model(&self) -> &OccupancyModel {
        &self.model
    }

    /// The filter.
    pub fn rule(&self) -> &V::Rule {
        &self.rule
    }

    /// Packs the bricks that did not change after `epoch` ([`Bricks::epoch`]; `None`: all): few values occur in a brick
    /// that was looked at for long. Answers stay the same; what is written to again unpacks itself. O(cells).
    pub fn pack(&mut self, epoch: Option<u64>) {
        let warm = epoch.map(|e| self.store.changed_since(e)).unwrap_or_default();
        let mut keys = self.store.keys();
        keys.retain(|key| warm.binary_search(key).is_err());
        let pack = |_: usize, brick: &mut Option<V::Brick>, (): &mut ()| {
            *brick = brick.as_ref().map(V::Brick::packed);
            0
        };
        let done = self.store.update(&keys, || (), pack);
        debug_assert!(done.is_ok(), "no brick was added");
    }

    /// Number of cells that were observed. O(cells).
    pub fn observed_cells(&self) -> usize {
        let observed = |brick: &V::Brick| (0..brick.len()).filter(|&i| brick.get(i).is_some()).count();
        self.store.bricks_by_age().map(|(_, brick)| observed(brick)).sum()
    }

    /// Bytes of the cells and of what finds them.
    pub fn memory_bytes(&self) -> usize {
        self.store.memory_bytes()
    }
}

impl<V: LogOddsValue> MapRepr<3> for SparseOccupancy<V> {
    /// Exactly, whatever the sweep: beams of a [`Scan`] have no rows and columns. Where the limit of memory is met, what had
    /// room is fused; [`SparseOccupancy::integrate`] tells of it.
    fn integrate_scan(&mut self, world_from_sensor: &Pose<3>, scan: &Scan<3>) -> ScanStats {
        if !self.has_place(world_from_sensor) {
            return ScanStats { refused_poses: 1, ..Default::default() };
        }
        let fused =
            self.fuse(|sweep, lattice, limits| sweep.plan_beams(scan, world_from_sensor, lattice, limits));
        let (beams, refused) = (scan.counts(), scan.refused());
        fused.unwrap_or(ScanStats { scans: 1, beams, refused, ..Default::default() })
    }

    fn occupancy(&self, p_world: [f64; 3]) -> Option<f64> {
        self.probability(p_world).known()
    }

    fn distance(&self, _: [f64; 3]) -> Option<f64> {
        None
    }

    fn memory_bytes(&self) -> usize {
        self.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        Abilities { occupancy: true, distance: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::LogOdds32;
    use crate::geom::BlockKey;
    use crate::scan::{Beam, BeamKind, Origin, Pinhole, PointScan, RangeImage};
    use crate::sweep::CellBox;

    type Map = SparseOccupancy<LogOdds8>;

    const UTM: [f64; 3] = [500_000.0, 4_000_000.0, 300.0];

    fn map(origin: [f64; 3]) -> Map {
        Map::new(Lattice::new(origin, 0.1), OccupancyModel::default(), OccupancySweep::Exact).unwrap()
    }

    fn shell(n: usize) -> Vec<[f32; 3]> {
        let at = |i: usize, a: f64| (0.5 + i as f64 * a).fract();
        (0..n)
            .map(|i| {
                let (z, a) =
                    (2.0 * at(i, 0.754_877_666_246_692_7) - 1.0, 6.3 * at(i, 0.569_840_290_998_053_2));
                let (r, across) = (2.0 + at(i, 0.618_033_988_7), (1.0 - z * z).sqrt());
                [r * across * a.cos(), r * across * a.sin(), r * z].map(|v| v as f32)
            })
            .collect()
    }

    fn cells<V: LogOddsValue>(map: &SparseOccupancy<V>) -> Vec<(BlockKey<3>, Vec<Option<V>>)> {
        let store = map.store();
        let of = |key| (0..512).map(|i| store.brick(key).unwrap().get(i)).collect();
        store.keys().into_iter().map(|key| (key, of(key))).collect()
    }

    #[test]
    fn every_way_in_is_the_same_map() {
        let (points, pose) = (shell(5000), Pose { translation: [0.3, 0.2, -0.1], ..Pose::IDENTITY });
        let scan = PointScan::new(points.iter().copied(), [0.0; 3]);
        let mut by_frame = map([0.0; 3]);
        let stats = by_frame.integrate(&pose, &Frame::Points(scan.clone())).unwrap();
        assert_eq!((stats.scans, stats.beams.hit, stats.refused.total()), (1, 5000, 0));
        assert_eq!(stats.cells, by_frame.observed_cells() as u64);

        let world: Vec<[f64; 3]> = points.iter().map(|p| pose.transform_point(p.map(f64::from))).collect();
        let mut by_points = map([0.0; 3]);
        by_points.integrate_points(&world, pose.translation).unwrap();
        assert_eq!(cells(&by_frame), cells(&by_points));

        let mut by_origins = map([0.0; 3]);
        let origins = PointScan { origin: Origin::PerPoint(vec![[0.0; 3]; 5000]), ..scan };
        by_origins.integrate(&pose, &Frame::Points(origins)).unwrap();
        assert_eq!(cells(&by_frame), cells(&by_origins));

        let mut wide = SparseOccupancy::<LogOdds32>::new(
            Lattice::new([0.0; 3], 0.1),
            OccupancyModel::default(),
            OccupancySweep::Exact,
        )
        .unwrap();
        wide.integrate_points(&world, pose.translation).unwrap();
        assert_eq!(wide.observed_cells(), by_frame.observed_cells());
        for p in &world {
            assert_eq!(wide.probability(*p).known().map(|v| (v * 1e6).round()), Some(700_000.0));
            assert!((by_frame.probability(*p).known().unwrap() - 0.7).abs() < 1e-3);
        }
    }

    #[test]
    fn far_from_zero_nothing_changes() {
        let (near, far) = (&mut map([0.0; 3]), &mut map(UTM));
        for (map, translation) in [(&mut *near, [0.0; 3]), (&mut *far, UTM)] {
            let pose = Pose { translation, ..Pose::IDENTITY };
            map.integrate(&pose, &Frame::Points(PointScan::new(shell(3000), [0.0; 3]))).unwrap();
        }
        // Coordinates of millions of metres are rounded to half a nanometre: a ray through a corner may differ.
        let same = cells(near).iter().zip(&cells(far)).filter(|(a, b)| a == b).count();
        assert_eq!(near.store().keys(), far.store().keys());
        assert!(same * 100 >= near.store().len() * 98, "{same} of {}", near.store().len());
    }

    #[test]
    fn what_cannot_be_fused_is_refused_and_counted() {
        let frame = Frame::Points(PointScan::new([[1.0, 0.0, 0.0]], [0.0; 3]));
        let mut map = map([0.0; 3]);
        for pose in [
            Pose { rotation: [[0.5; 3]; 3], translation: [0.0; 3] },
            Pose { translation: [f64::NAN; 3], ..Pose::IDENTITY },
            Pose { translation: [1e12; 3], ..Pose::IDENTITY },
        ] {
            let stats = map.integrate(&pose, &frame).unwrap();
            assert_eq!((stats.scans, stats.refused_poses), (0, 1));
        }
        let stats = map.integrate_points(&[[f64::NAN; 3], [1.0, 0.0, 0.0]], [0.0; 3]).unwrap();
        assert_eq!(stats.refused.not_finite, 1);
        assert_eq!(map.integrate_points(&[[1.0; 3]], [f64::NAN; 3]).unwrap().refused_poses, 1);
        assert!(
            Map::new(Lattice::new([0.0; 3], 0.0), OccupancyModel::default(), OccupancySweep::Auto).is_err()
        );
    }

    #[test]
    fn packed_maps_answer_and_go_on() {
        let frame = Frame::Points(PointScan::new(shell(3000), [0.0; 3]));
        let mut flat = map([0.0; 3]);
        flat.integrate(&Pose::IDENTITY, &frame).unwrap();
        let mut packed = flat.clone();
        let (epoch, bytes) = (packed.store().epoch(), packed.memory_bytes());
        packed.pack(Some(epoch - 1));
        assert_eq!(packed.memory_bytes(), bytes, "everything changed in the last epoch");
        packed.pack(None);
        assert!(packed.memory_bytes() * 2 < bytes);
        assert!(packed.store().changed_since(epoch).is_empty());
        assert_eq!(cells(&packed), cells(&flat));
        let moved = Pose { translation: [0.35, 0.0, 0.0], ..Pose::IDENTITY };
        flat.integrate(&moved, &frame).unwrap();
        packed.integrate(&moved, &frame).unwrap();
        assert_eq!(cells(&packed), cells(&flat));
        assert_eq!(packed.observed_cells(), flat.observed_cells());
    }

    #[test]
    fn a_sensor_inside_an_occupied_cell() {
        let mut map = map([0.0; 3]);
        map.integrate_points(&[[0.04, 0.04, 0.04], [1.0, 0.05, 0.05]], [0.05; 3]).unwrap();
        assert_eq!(map.is_occupied([0, 0, 0]), Some(true));
        assert_eq!(map.is_occupied([1, 0, 0]), Some(false));
    }

    #[test]
    fn bounds_and_limits_hold() {
        let frame = Frame::Points(PointScan::new(shell(3000), [0.0; 3]));
        let mut all = map([0.0; 3]);
        all.integrate(&Pose::IDENTITY, &frame).unwrap();
        let bounds = Aabb::new([-1.0, -1.03, 0.0], [5.0, 1.0, 0.52]);
        let mut part = map([0.0; 3]);
        part.set_bounds(Some(bounds));
        let stats = part.integrate(&Pose::IDENTITY, &frame).unwrap();
        assert!(stats.hits_outside > 1000);
        let inside = CellBox::of(&bounds, all.store().lattice());
        for (key, values) in cells(&part) {
            for (i, v) in values.iter().enumerate() {
                assert!(v.is_none() || inside.contains(key.cell(i)));
            }
        }
        // A ray that enters the box starts anew at its border: at a corner it may take the other cell.
        let (mut held, mut same) = (0, 0);
        for (key, values) in cells(&all) {
            for (i, v) in
                values.iter().enumerate().filter(|(i, v)| v.is_some() && inside.contains(key.cell(*i)))
            {
                held += 1;
                same += usize::from(part.store().cell(key.cell(i)) == *v);
            }
        }
        assert!(same * 100 >= held * 98, "{same} of {held}");

        let mut small = map([0.0; 3]);
        small.set_limit(60_000);
        assert!(matches!(small.integrate(&Pose::IDENTITY, &frame), Err(MapError::Full(_))));
        assert!(small.memory_bytes() <= 70_000 && small.observed_cells() > 0);
    }

    #[test]
    fn what_contradicts_itself_is_refused() {
        for sweep in [OccupancySweep::Auto, OccupancySweep::Exact] {
            for (image, why) in crate::scan::broken_images() {
                let mut map =
                    Map::new(Lattice::new([0.0; 3], 0.1), OccupancyModel::default(), sweep).unwrap();
                let mut scan = PointScan::new([[0.0, 0.0, 1.0]], [0.0; 3]);
                scan.image = Some(image.clone());
                let got = map.integrate(&Pose::IDENTITY, &Frame::Image(image));
                assert!(matches!(got, Err(MapError::Image(_))), "{why}");
                let got = map.integrate(&Pose::IDENTITY, &Frame::Points(scan));
                // Exact rays do not look at it.
                assert_eq!(got.is_ok(), sweep == OccupancySweep::Exact, "{why}");
            }
        }
        let mut map = map([0.0; 3]);
        let mut scan = PointScan::new([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]);
        scan.origin = Origin::PerPoint(vec![[0.0; 3]]);
        let stats = map.integrate(&Pose::IDENTITY, &Frame::Points(scan)).unwrap();
        assert_eq!((stats.refused.not_finite, stats.beams.hit, stats.beams.dropped), (2, 1, 2));
    }

    #[test]
    fn readings_that_are_too_far_cost_nothing_and_are_counted() {
        for sweep in [OccupancySweep::Auto, OccupancySweep::Exact] {
            let mut map = Map::new(Lattice::new([0.0; 3], 0.1), OccupancyModel::default(), sweep).unwrap();
            let mut points = shell(3000);
            points.extend([[1e6, 0.0, 0.0], [1e7, 1e7, 1e7], [1e20, 0.0, 0.0]]);
            let mut scan = PointScan::new(points, [0.0; 3]);
            scan.free_ends = vec![[-1e6, 0.0, 0.0], [0.0, 2.0, 0.0]];
            let stats = map.integrate(&Pose::IDENTITY, &Frame::Points(scan)).unwrap();
            assert_eq!((stats.refused.too_far, stats.refused.total()), (4, 4));
            assert_eq!((stats.beams.hit, stats.beams.max_range, stats.beams.dropped), (3000, 1, 4));
            assert!(map.store().len() < 1000, "{}", map.store().len());
            let camera = Pinhole { fx: 2.0, fy: 2.0, cx: 0.5, cy: 0.5 };
            let image = RangeImage::from_depth(camera, 2, 2, [2.0, -1e6, 1e6, 2.0]);
            let stats = map.integrate(&Pose::IDENTITY, &Frame::Image(image)).unwrap();
            assert_eq!((stats.refused.too_far, stats.beams.hit, stats.beams.dropped), (2, 2, 2));
        }
    }

    #[test]
    fn rays_that_pass_more_than_the_limit_holds_end_early() {
        let ends = (0..20).map(|i| {
            let a = f64::from(i);
            [5000.0 * a.cos(), 5000.0 * a.sin(), 0.0]
        });
        let ends: Vec<[f64; 3]> = ends.collect();
        let mut small = map([0.0; 3]);
        small.set_limit(60_000);
        let full = small.integrate_points(&ends, [0.0; 3]);
        assert!(matches!(full, Err(MapError::Full(_))));
        assert!(small.store().is_empty() && small.sweep.blocks().is_empty());
    }

    #[test]
    fn images_and_beams_without_a_surface() {
        let camera = Pinhole { fx: 20.0, fy: 20.0, cx: 15.5, cy: 11.5 };
        let values: Vec<f32> = (0..768)
            .map(|i| {
                if i % 32 < 16 {
                    2.0
                } else if i % 32 < 24 {
                    -1.0
                } else {
                    0.0
                }
            })
            .collect();
        let mut image = RangeImage::from_depth(camera, 32, 24, values);
        image.refused.too_near = 3;
        let mut by_image = map([0.0; 3]);
        let stats = by_image.integrate(&Pose::IDENTITY, &Frame::Image(image)).unwrap();
        assert_eq!((stats.beams.hit, stats.beams.max_range, stats.refused.too_near), (384, 192, 3));
        assert_eq!(by_image.is_occupied([-5, 0, 20]), Some(true));
        assert_eq!(by_image.is_occupied([1, 0, 8]), Some(false));
        assert_eq!(by_image.is_occupied([1, 0, 10]), None);

        let beam = |kind| Beam { direction: [1.0, 0.0, 0.0], range: 1.05, kind };
        let mut by_beams = map([0.0; 3]);
        let scan = Scan::from_beams([beam(BeamKind::NoReturn)]);
        let stats = by_beams.integrate_scan(&Pose::IDENTITY, &scan);
        assert_eq!((stats.beams.no_return, by_beams.observed_cells()), (1, 10));
        by_beams.integrate_scan(&Pose::IDENTITY, &Scan::from_beams([beam(BeamKind::Hit)]));
        assert_eq!(by_beams.is_occupied([10, 0, 0]), Some(true));
    }
}
