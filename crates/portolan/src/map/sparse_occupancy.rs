//! Occupancy of space in bricks: memory only where something was seen.

use super::MapError;
use super::error::{most_bricks, too_many};
use super::sparse_fuse::{free_reach, fuse, stats, union};
use crate::answer::Answer;
use crate::cell::{LogOdds8, LogOddsValue, OccupancyModel, Planes};
use crate::geom::{Aabb, Lattice, Pose, block_cells};
use crate::parallel;
use crate::scan::{Frame, LayoutFinder, Origin, PointScan, RangeImage, Scan, ScanStats, SphericalLayout};
use crate::store::{Bricks, BricksFull, Store};
use crate::sweep::occupancy::{Bits, CellBox, ExactRays, Guard, LONGEST_RAY, Projective, Ray};
use std::borrow::Cow;

/// Boxes of more bricks than this are not searched for free space: single readings from far away are cheaper as rays.
const PROJECTIVE_BRICKS: u64 = 1 << 27;

/// How a scan becomes evidence of hits and misses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OccupancySweep {
    /// Projective where a scan has rows and columns or gets them, exact otherwise.
    #[default]
    Auto,
    /// Every cell that a beam passes, exactly: the map that OctoMap makes.
    Exact,
    /// Misses through a range image, hits exact: faster, frees the space between beams, and carves grazing surfaces less.
    /// As `Auto`, said by name.
    Projective,
}

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
    sweep: OccupancySweep,
    bounds: Option<(Aabb<3>, CellBox)>,
    exact: ExactRays,
    guard: Guard,
    layout: LayoutFinder,
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
        Ok(Self {
            store,
            rule,
            lookup,
            model,
            sweep,
            bounds: None,
            exact: ExactRays::default(),
            guard: Guard::default(),
            layout: LayoutFinder::default(),
        })
    }

    /// Allows no more than `bytes` for the store from now on.
    pub fn set_limit(&mut self, bytes: usize) {
        self.store.set_limit(bytes);
    }

    /// Changes only cells in this box (world) from now on; `None`: everywhere. Snapped outwards to cells.
    pub fn set_bounds(&mut self, bounds: Option<Aabb<3>>) {
        let lattice = self.store.lattice();
        self.bounds = bounds.map(|b| CellBox::of(&b, lattice)).map(|cells| (cells.aabb(lattice), cells));
    }

    /// Rows and columns for scans of points that come without them; otherwise found in the first scan.
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
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
        let stats = match frame {
            Frame::Points(scan) => self.points(world_from_sensor, scan)?,
            Frame::Image(image) => {
                image.check().map_err(MapError::Image)?;
                self.image(world_from_sensor, image)?
            }
        };
        Ok(ScanStats { refused: stats.refused + frame.refused(), ..stats })
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
        let n = points_world.len();
        self.rays(n, n, None, |i| Ray { origin, end: points_world[i].into(), hit: true, passes: true })
    }

    fn has_place(&self, world_from_sensor: &Pose<3>) -> bool {
        world_from_sensor.is_rigid() && self.store.lattice().cell_of(world_from_sensor.translation).is_some()
    }

    fn points(&mut self, world_from_sensor: &Pose<3>, scan: &PointScan) -> Result<ScanStats, MapError> {
        let to_world = |p: [f32; 3]| world_from_sensor.transform_point(p.map(f64::from));
        let hits = scan.points.len();
        let (common, image) = match &scan.origin {
            Origin::Common(o) => (world_from_sensor.transform_point(*o), self.organised(scan, *o)?),
            Origin::PerPoint(_) => (world_from_sensor.translation, None),
        };
        let world_from_image = Pose { translation: common, ..*world_from_sensor };
        let view = image.as_deref().map(|image| (&world_from_image, image));
        let passes = view.is_none();
        self.rays(hits, hits + scan.free_ends.len(), view, |i| match i.checked_sub(hits) {
            Some(free) => {
                Ray { origin: common, end: to_world(scan.free_ends[free]), hit: false, passes: true }
            }
            None => {
                let origin = match &scan.origin {
                    Origin::Common(_) => common,
                    Origin::PerPoint(all) => all.get(i).map_or([f64::NAN; 3], |o| to_world(*o)),
                };
                Ray { origin, end: to_world(scan.points[i]), hit: true, passes }
            }
        })
    }

    /// Rows and columns of a scan about one origin, if the sweep wants them and the scan has or gets them.
    fn organised<'a>(
        &mut self,
        scan: &'a PointScan,
        origin: [f64; 3],
    ) -> Result<Option<Cow<'a, RangeImage>>, MapError> {
        if self.sweep == OccupancySweep::Exact {
            return Ok(None);
        }
        if let Some(image) = &scan.image {
            image.check().map_err(MapError::Image)?;
            return Ok(Some(Cow::Borrowed(image)));
        }
        Ok(self.layout.image(&scan.points, origin).map(Cow::Owned))
    }

    fn image(&mut self, world_from_sensor: &Pose<3>, image: &RangeImage) -> Result<ScanStats, MapError> {
        let passes = self.sweep == OccupancySweep::Exact;
        let rays: Vec<Ray> = image
            .readings()
            .map(|(origin, end, hit)| Ray {
                origin: world_from_sensor.transform_point(origin),
                end: world_from_sensor.transform_point(end),
                hit,
                passes,
            })
            .collect();
        let hits = rays.iter().filter(|r| r.hit).count();
        let view = (!passes).then_some((world_from_sensor, image));
        self.rays(hits, rays.len(), view, |i| rays[i])
    }

    /// Fuses `count` rays, `hits` of which end on surfaces, and what the range image of a view sees.
    fn rays(
        &mut self,
        hits: usize,
        count: usize,
        view: Option<(&Pose<3>, &RangeImage)>,
        ray: impl Fn(usize) -> Ray + Sync,
    ) -> Result<ScanStats, MapError> {
        let bounds = self.bounds.as_ref().map(|b| &b.0);
        let passes_by_view = view.is_some();
        let lattice = self.store.lattice();
        let longest = LONGEST_RAY * lattice.resolution;
        let further = view.map(|(pose, image)| free_reach(pose, image, longest)).unwrap_or_default();
        let limit = self.store.limit();
        let most = most_bricks(limit, size_of::<V>() * block_cells::<3>());
        let full = BricksFull { limit, bricks: self.store.len(), bytes: self.store.memory_bytes() };
        let guard = std::mem::take(&mut self.guard);
        let exact = &mut self.exact;
        let (planned, view) = parallel::join(
            || exact.plan(lattice, bounds, count, &ray, &further, most),
            || view.map(|(pose, image)| Projective::new(image, pose, lattice, guard)),
        );
        let mut tally = planned.map_err(|_| too_many(most, full))?;
        let view = view.filter(|_| self.exact.reach_bricks() <= PROJECTIVE_BRICKS);
        if view.is_none() && passes_by_view {
            let planned =
                self.exact.plan(lattice, bounds, count, |i| Ray { passes: true, ..ray(i) }, &[], most);
            tally = planned.map_err(|_| too_many(most, full))?;
        }
        let seen = match (&view, self.exact.reach()) {
            (Some(view), Some((first, last))) => view.bricks(first, last),
            _ => Vec::new(),
        };
        let (keys, parts) = union(self.exact.keys(), &seen);
        let exact = &self.exact;
        let bits = |i: usize| {
            let (marked, free): (Option<u32>, Option<bool>) = parts[i];
            let mut bits = marked.map_or_else(Bits::default, |slot| *exact.bits(slot as usize));
            let free = match (free, &view) {
                (Some(true), _) => [u64::MAX; 8],
                (Some(false), Some(view)) => view.free_cells(keys[i]),
                _ => return bits,
            };
            (0..8).for_each(|w| bits.miss[w] |= free[w]);
            bits
        };
        let cells = fuse(&mut self.store, &self.rule, self.bounds.map(|b| b.1), &keys, bits);
        self.guard = view.map(Projective::into_guard).unwrap_or_default();
        let cells = cells?;
        Ok(stats(hits, count, tally, cells))
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

    /// Fuses beams exactly, whatever the sweep: a [`Scan`] has no rows and columns. Where the limit of memory is met,
    /// what had room is fused; [`SparseOccupancy::integrate`] reports it.
    pub fn integrate_scan(&mut self, world_from_sensor: &Pose<3>, scan: &Scan<3>) -> ScanStats {
        if !self.has_place(world_from_sensor) {
            return ScanStats { refused_poses: 1, ..Default::default() };
        }
        let origin = world_from_sensor.translation;
        let rays: Vec<Ray> = scan
            .beams()
            .filter(|b| b.free_range() > 0.0)
            .map(|b| {
                let end = world_from_sensor.transform_point(b.direction.map(|d| d * b.range));
                Ray { origin, end, hit: b.is_hit(), passes: true }
            })
            .collect();
        let hits = rays.iter().filter(|r| r.hit).count();
        let mut beams = scan.counts();
        match self.rays(hits, rays.len(), None, |i| rays[i]) {
            Ok(fused) => {
                let refused_hits = (hits as u64).saturating_sub(fused.beams.hit);
                beams.hit -= refused_hits.min(beams.hit);
                beams.dropped += refused_hits;
                ScanStats { beams, refused: scan.refused() + fused.refused, ..fused }
            }
            Err(_) => ScanStats { scans: 1, beams, refused: scan.refused(), ..Default::default() },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::LogOdds32;
    use crate::geom::BlockKey;
    use crate::scan::{Beam, BeamKind, Pinhole, Projection, RefusedBeams};

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
            let values = vec![2.0, -1e6, 1e6, 2.0];
            let image = RangeImage {
                projection: Projection::Pinhole(Pinhole { fx: 2.0, fy: 2.0, cx: 0.5, cy: 0.5 }),
                columns: 2,
                rows: 2,
                values,
                colors: Vec::new(),
                refused: RefusedBeams::default(),
            };
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
        assert!(small.store().is_empty() && small.exact.keys().is_empty());
    }

    #[test]
    fn images_and_beams_without_a_surface() {
        let camera = Pinhole { fx: 20.0, fy: 20.0, cx: 15.5, cy: 11.5 };
        let values = (0..768)
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
        let image = RangeImage {
            projection: Projection::Pinhole(camera),
            columns: 32,
            rows: 24,
            values,
            colors: Vec::new(),
            refused: RefusedBeams { too_near: 3, ..Default::default() },
        };
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
