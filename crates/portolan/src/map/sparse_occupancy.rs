//! Occupancy of space in bricks: memory only where something was seen.

use super::{Abilities, MapError, MapRepr};
use crate::answer::Answer;
use crate::cell::{Evidence, HitMiss, LogOdds8, LogOddsValue, OccupancyModel, Planes};
use crate::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{BeamCounts, Frame, Origin, PointScan, RangeImage, Scan, ScanStats};
use crate::store::{Bricks, Store};
use crate::sweep::occupancy::{Bits, CellBox, ExactRays, Ray, Tally};

/// How a scan becomes evidence of hits and misses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum OccupancySweep {
    /// What fits the scan best.
    #[default]
    Auto,
    /// Every cell that a beam passes, exactly.
    Exact,
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
        Ok(Self { store, rule, lookup, model, sweep, bounds: None, exact: ExactRays::default() })
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

    /// Fuses what a sensor delivered at a known pose. A pose that is not rigid is refused and counted.
    ///
    /// # Errors
    /// [`MapError::Full`] where the limit of memory leaves no room; part of the scan is then fused.
    pub fn integrate(&mut self, world_from_sensor: &Pose<3>, frame: &Frame) -> Result<ScanStats, MapError> {
        if !self.has_place(world_from_sensor) {
            return Ok(ScanStats { refused_poses: 1, ..Default::default() });
        }
        let stats = match frame {
            Frame::Points(scan) => self.points_exact(world_from_sensor, scan)?,
            Frame::Image(image) => self.image_exact(world_from_sensor, image)?,
        };
        Ok(ScanStats { refused: stats.refused + frame.refused(), ..stats })
    }

    /// Fuses surfaces seen from `origin` (both world, metres), in one call. Points that are not finite are refused and
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
        self.rays(points_world.len(), points_world.len(), |i| Ray {
            origin,
            end: points_world[i].into(),
            hit: true,
        })
    }

    fn has_place(&self, world_from_sensor: &Pose<3>) -> bool {
        world_from_sensor.is_rigid() && self.store.lattice().cell_of(world_from_sensor.translation).is_some()
    }

    fn points_exact(&mut self, world_from_sensor: &Pose<3>, scan: &PointScan) -> Result<ScanStats, MapError> {
        let to_world = |p: [f32; 3]| world_from_sensor.transform_point(p.map(f64::from));
        let hits = scan.points.len();
        let common = match &scan.origin {
            Origin::Common(o) => world_from_sensor.transform_point(*o),
            Origin::PerPoint(_) => world_from_sensor.translation,
        };
        self.rays(hits, hits + scan.free_ends.len(), |i| match i.checked_sub(hits) {
            Some(free) => Ray { origin: common, end: to_world(scan.free_ends[free]), hit: false },
            None => {
                let origin = match &scan.origin {
                    Origin::Common(_) => common,
                    Origin::PerPoint(all) => to_world(all[i]),
                };
                Ray { origin, end: to_world(scan.points[i]), hit: true }
            }
        })
    }

    fn image_exact(
        &mut self,
        world_from_sensor: &Pose<3>,
        image: &RangeImage,
    ) -> Result<ScanStats, MapError> {
        let rays: Vec<Ray> = image
            .readings()
            .map(|(origin, end, hit)| Ray {
                origin: world_from_sensor.transform_point(origin),
                end: world_from_sensor.transform_point(end),
                hit,
            })
            .collect();
        let hits = rays.iter().filter(|r| r.hit).count();
        self.rays(hits, rays.len(), |i| rays[i])
    }

    /// Fuses `count` rays, `hits` of which end on surfaces.
    fn rays(
        &mut self,
        hits: usize,
        count: usize,
        ray: impl Fn(usize) -> Ray + Sync,
    ) -> Result<ScanStats, MapError> {
        let bounds = self.bounds.as_ref().map(|b| &b.0);
        let tally = self.exact.plan(self.store.lattice(), bounds, count, ray);
        let exact = &self.exact;
        let cells =
            fuse(&mut self.store, &self.rule, self.bounds.map(|b| b.1), exact.keys(), |i| *exact.bits(i))?;
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

/// Fuses bits brick by brick; returns the number of cells.
fn fuse<V: LogOddsValue>(
    store: &mut Bricks<V, 3>,
    rule: &V::Rule,
    bounds: Option<CellBox>,
    keys: &[BlockKey<3>],
    bits: impl Fn(usize) -> Bits + Sync + Send,
) -> Result<u64, MapError> {
    let change = |i: usize, brick: &mut Option<V::Brick>, (): &mut ()| {
        let mut bits = bits(i);
        if let Some(mask) = bounds.and_then(|b| b.mask(keys[i])) {
            for w in 0..8 {
                bits.hit[w] &= mask[w];
                bits.miss[w] &= mask[w];
            }
        }
        let evidence = HitMiss::from_words(bits.hit, bits.miss);
        let observed = evidence.observed();
        if observed > 0 {
            V::fuse_brick(
                brick.get_or_insert_with(|| V::Brick::unobserved(block_cells::<3>())),
                &evidence,
                rule,
            );
        }
        observed
    };
    Ok(store.update(keys, || (), change)?)
}

fn stats(hits: usize, count: usize, tally: Tally, cells: u64) -> ScanStats {
    let mut stats = ScanStats { scans: 1, cells, hits_outside: tally.hits_outside, ..Default::default() };
    stats.beams = BeamCounts { hit: hits as u64, max_range: (count - hits) as u64, ..Default::default() };
    stats.refused.not_finite = tally.unusable;
    stats
}

impl<V: LogOddsValue> MapRepr<3> for SparseOccupancy<V> {
    /// Exactly, whatever the sweep: beams of a [`Scan`] have no rows and columns. Where the limit of memory is met, what had
    /// room is fused; [`SparseOccupancy::integrate`] tells of it.
    fn integrate_scan(&mut self, world_from_sensor: &Pose<3>, scan: &Scan<3>) -> ScanStats {
        if !self.has_place(world_from_sensor) {
            return ScanStats { refused_poses: 1, ..Default::default() };
        }
        let origin = world_from_sensor.translation;
        let rays: Vec<Ray> = scan
            .beams()
            .filter(|b| b.free_range() > 0.0)
            .map(|b| {
                let end = world_from_sensor.transform_point(b.direction.map(|d| d * b.range));
                Ray { origin, end, hit: b.is_hit() }
            })
            .collect();
        let fused =
            self.rays(0, rays.len(), |i| rays[i]).unwrap_or(ScanStats { scans: 1, ..Default::default() });
        ScanStats { beams: scan.counts(), refused: scan.refused(), ..fused }
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
        small.set_limit(20_000);
        assert!(matches!(small.integrate(&Pose::IDENTITY, &frame), Err(MapError::Full(_))));
        assert!(small.memory_bytes() <= 20_000 && small.observed_cells() > 0);
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
