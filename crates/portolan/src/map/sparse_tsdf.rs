//! Truncated signed distance fields of space in bricks.

use super::error::{check_lattice, most_bricks, too_many};
use super::sparse_tsdf_config::{PointSweep, SparseTsdfConfig};
use super::{Abilities, MapError};
use crate::answer::Answer;
use crate::cell::{
    Cell, Color, ColorRule, Colors, Distances, Evidence, FusionEvent, Planes, SignedDistance, TsdfRule,
};
use crate::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{Frame, LayoutFinder, Origin, PointScan, RangeImage, ScanStats, SphericalLayout};
use crate::store::{Bricks, BricksFull, Store};
use crate::sweep::{PlanError, PlanLimits, PlannedScan, PointRays, Projective};

/// A truncated signed distance field of space: per cell a scalar information filter of the signed distance to the nearest
/// surface (Curless & Levoy 1996), in bricks, which exist only where something was seen. Colours lie beside it in bricks of
/// their own, near surfaces only.
///
/// Distances are measured along rays and kept within the truncation: the map answers *where is the surface*, not *how far
/// is it*. Clones are snapshots: they share all bricks that neither side has changed since.
#[derive(Clone, Debug)]
pub struct SparseTsdf {
    config: SparseTsdfConfig,
    rule: TsdfRule,
    color_rule: ColorRule,
    distances: Bricks<SignedDistance, 3>,
    colors: Option<Bricks<Color, 3>>,
    bounds: Option<Aabb<3>>,
    limit: usize,
    layout: LayoutFinder,
    sweeps: Box<Sweeps>,
    watched: Vec<(BlockKey<3>, usize, [i32; 3])>,
    events: Vec<([i32; 3], FusionEvent)>,
}

/// The sweeps with their memory, which is kept from scan to scan.
#[derive(Clone, Debug)]
struct Sweeps {
    projective: Projective,
    rays: PointRays,
}

/// The sweep that has planned a scan.
enum Planned<'a> {
    Image(&'a Projective),
    Rays(&'a PointRays),
}

impl Planned<'_> {
    fn blocks(&self) -> &[BlockKey<3>] {
        match self {
            Self::Image(sweep) => sweep.blocks(),
            Self::Rays(sweep) => sweep.blocks(),
        }
    }

    fn evidence(&self, i: usize, out: &mut Distances) -> usize {
        match self {
            Self::Image(sweep) => sweep.evidence(i, out),
            Self::Rays(sweep) => sweep.evidence(i, out),
        }
    }

    fn colors(&self, i: usize, distances: &Distances, band: f32, out: &mut Colors) -> usize {
        match self {
            Self::Image(sweep) => sweep.colors(i, distances, band, out),
            Self::Rays(sweep) => sweep.colors(i, distances, band, out),
        }
    }

    /// Whether a block has no surface, for sure.
    fn is_free(&self, i: usize) -> bool {
        matches!(self, Self::Image(sweep) if sweep.is_free(i))
    }
}

impl SparseTsdf {
    /// A field in which nothing was observed.
    ///
    /// # Errors
    /// Where a setting is not possible.
    pub fn new(config: SparseTsdfConfig) -> Result<Self, MapError> {
        let lattice = Lattice::new(config.origin, config.resolution);
        let colors = config.color.then(|| Bricks::new(lattice));
        Self::from_stores(Bricks::new(lattice), colors, config)
    }

    /// A field of stored cells; resolution and origin are taken from the store, and whether there are colours.
    ///
    /// # Errors
    /// Where a setting is not possible, or the two stores have not the same lattice.
    pub fn from_stores(
        distances: Bricks<SignedDistance, 3>,
        colors: Option<Bricks<Color, 3>>,
        config: SparseTsdfConfig,
    ) -> Result<Self, MapError> {
        let lattice = *distances.lattice();
        check_lattice(&lattice)?;
        if colors.as_ref().is_some_and(|c| *c.lattice() != lattice) {
            return Err(MapError::Lattices);
        }
        let color = colors.is_some();
        let config =
            SparseTsdfConfig { resolution: lattice.resolution, origin: lattice.origin, color, ..config };
        let rule = config.rule()?;
        let settings = config.sweep_settings();
        let sweeps = Sweeps { projective: Projective::new(settings), rays: PointRays::new(settings) };
        Ok(Self {
            rule,
            color_rule: ColorRule { w_max: config.color_w_max },
            distances,
            colors,
            bounds: None,
            limit: usize::MAX,
            layout: LayoutFinder::default(),
            sweeps: Box::new(sweeps),
            watched: Vec::new(),
            events: Vec::new(),
            config,
        })
    }

    /// Fuses one scan taken at a known pose. O(cells seen), in parallel over bricks; the same bytes for any number of
    /// threads. A pose that is not rigid or has no cell refuses the scan, which is counted.
    ///
    /// # Errors
    /// [`MapError::Full`] where a brick would pass the limit: what was fused before it stays. Also where the search for bricks
    /// alone would take more: nothing is fused then. [`MapError::TooFar`] where it would never end. [`MapError::Image`] where
    /// an image contradicts itself.
    pub fn integrate(&mut self, world_from_sensor: &Pose<3>, frame: &Frame) -> Result<ScanStats, MapError> {
        self.events.clear();
        if !world_from_sensor.is_rigid() || self.lattice().cell_of(world_from_sensor.translation).is_none() {
            return Ok(ScanStats { refused_poses: 1, ..Default::default() });
        }
        match frame {
            Frame::Image(image) => self.integrate_image(world_from_sensor, image),
            Frame::Points(scan) => self.integrate_scan(world_from_sensor, scan),
        }
    }

    fn integrate_scan(
        &mut self,
        world_from_sensor: &Pose<3>,
        scan: &PointScan,
    ) -> Result<ScanStats, MapError> {
        let origin = match (&scan.origin, &scan.image, self.config.sweep) {
            (Origin::Common(origin), _, PointSweep::Projective) => *origin,
            // Parallel rays have no common origin; their image is in the frame of the points.
            (Origin::PerPoint(_), Some(image), PointSweep::Projective) if image.has_parallel_rays() => {
                let stats = self.integrate_image(world_from_sensor, image)?;
                return Ok(ScanStats { refused: stats.refused + scan.refused, ..stats });
            }
            _ => return self.integrate_rays(world_from_sensor, scan),
        };
        let at = Pose { translation: world_from_sensor.transform_point(origin), ..*world_from_sensor };
        let found = match &scan.image {
            Some(_) => None,
            None => self.organise(scan, origin),
        };
        let Some(image) = scan.image.as_ref().or(found.as_ref()) else {
            return self.integrate_rays(world_from_sensor, scan);
        };
        let mut stats = self.integrate_image(&at, image)?;
        stats.refused += scan.refused;
        if found.is_some() {
            // Pixels without a point are no readings; points beside another of their pixel are.
            let used = stats.beams.hit + stats.beams.max_range;
            stats.beams.dropped = ((scan.points.len() + scan.free_ends.len()) as u64).saturating_sub(used);
        }
        Ok(stats)
    }

    /// The image of a scan without rows and columns, where it can be given them. Not where points have colours to be fused:
    /// pixels have lost which point they come from.
    fn organise(&mut self, scan: &PointScan, origin: [f64; 3]) -> Option<RangeImage> {
        if self.config.color && !scan.colors.is_empty() {
            return None;
        }
        let mut image = self.layout.image(&scan.points, origin)?;
        if let Some(layout) = self.layout.layout().filter(|_| !scan.free_ends.is_empty()) {
            let free = layout.image(&scan.free_ends, origin);
            for (value, free) in image.values.iter_mut().zip(free.values) {
                *value = if *value == 0.0 { -free } else { *value };
            }
        }
        Some(image)
    }

    /// Fuses points (world, metres) seen from `origin_world`, in one call. Points that are not finite or lie on the origin
    /// are refused and counted.
    ///
    /// # Errors
    /// As [`SparseTsdf::integrate`].
    pub fn integrate_points(
        &mut self,
        points_world: &[[f64; 3]],
        origin_world: [f64; 3],
    ) -> Result<ScanStats, MapError> {
        // Relative to the sensor: far from zero f32 loses millimetres.
        let offset = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - origin_world[k]) as f32);
        let scan = PointScan::new(points_world.iter().map(offset), [0.0; 3]);
        let at = Pose { translation: origin_world, ..Pose::IDENTITY };
        self.events.clear();
        if !at.is_rigid() || self.lattice().cell_of(origin_world).is_none() {
            return Ok(ScanStats { refused_poses: 1, ..Default::default() });
        }
        // Ray by ray: which way the sensor's axis points is not known.
        self.integrate_rays(&at, &scan)
    }

    fn integrate_image(
        &mut self,
        world_from_image: &Pose<3>,
        image: &RangeImage,
    ) -> Result<ScanStats, MapError> {
        // A key, its octants, and what the search keeps of them.
        let most = most_bricks(self.limit, 1024);
        let (lattice, limits) = (*self.lattice(), self.plan_limits(most));
        let planned = self.sweeps.projective.plan(image, world_from_image, &lattice, &limits);
        let planned = planned.map_err(|e| self.plan_error(e, most))?;
        self.fuse(|sweeps| Planned::Image(&sweeps.projective), planned)
    }

    fn integrate_rays(&mut self, world_from_scan: &Pose<3>, scan: &PointScan) -> Result<ScanStats, MapError> {
        let most = most_bricks(self.limit, PointRays::BLOCK_BYTES);
        let (lattice, limits) = (*self.lattice(), self.plan_limits(most));
        let planned = self.sweeps.rays.plan(scan, world_from_scan, &lattice, &limits);
        let planned = planned.map_err(|e| self.plan_error(e, most))?;
        self.fuse(|sweeps| Planned::Rays(&sweeps.rays), planned)
    }

    fn plan_limits(&self, most_blocks: usize) -> PlanLimits<3> {
        PlanLimits { bounds: self.bounds, most_blocks, colors: self.config.color }
    }

    fn plan_error(&self, error: PlanError, most: usize) -> MapError {
        match error {
            PlanError::BadImage(why) => MapError::Image(why),
            PlanError::TooManyBlocks => too_many(most, self.full()),
        }
    }

    fn full(&self) -> BricksFull {
        BricksFull { limit: self.limit, bricks: self.distances.len(), bytes: self.memory_bytes() }
    }

    /// Fuses what a sweep has planned.
    fn fuse(
        &mut self,
        planned: impl Fn(&Sweeps) -> Planned<'_>,
        plan: PlannedScan,
    ) -> Result<ScanStats, MapError> {
        let sweep = planned(&self.sweeps);
        if !self.watched.is_empty() {
            self.events = look(&sweep, &self.watched, &self.distances, &self.rule);
        }
        let cells = block_cells::<3>();
        let others = self.colors.as_ref().map_or(0, Store::memory_bytes);
        self.distances.set_limit(self.limit.saturating_sub(others));
        let rule = &self.rule;
        let observed = self.distances.update(
            sweep.blocks(),
            || Distances::silent(cells),
            |i, brick, evidence| {
                let observed = sweep.evidence(i, evidence);
                if observed > 0 {
                    let brick = brick.get_or_insert_with(|| Planes::unobserved(cells));
                    SignedDistance::fuse_brick(brick, evidence, rule);
                }
                observed
            },
        );
        let observed = observed.map_err(|_| MapError::Full(self.full()))?;
        if let Some(colors) = &mut self.colors {
            colors.set_limit(self.limit.saturating_sub(self.distances.memory_bytes()));
            // Corners of the cells that a surface passes through are at most a diagonal away from it.
            let band = (1.75 * self.config.resolution).min(self.config.truncation) as f32;
            let rule = &self.color_rule;
            let colored = colors.update(
                sweep.blocks(),
                || (Distances::silent(cells), Colors::silent(cells)),
                |i, brick, (distances, evidence)| {
                    if sweep.is_free(i) || sweep.evidence(i, distances) == 0 {
                        return 0;
                    }
                    let observed = sweep.colors(i, distances, band, evidence);
                    if observed > 0 {
                        let brick = brick.get_or_insert_with(|| Planes::unobserved(cells));
                        Color::fuse_brick(brick, evidence, rule);
                    }
                    observed
                },
            );
            colored.map_err(|_| MapError::Full(self.full()))?;
        }
        let PlannedScan { beams, refused, hits_outside } = plan;
        Ok(ScanStats { scans: 1, beams, refused, cells: observed, hits_outside, ..Default::default() })
    }

    /// Watches these cells from now on, and no others: every scan leaves what it did to them in [`SparseTsdf::events`].
    /// What is not watched pays nothing.
    pub fn watch(&mut self, cells: impl IntoIterator<Item = [i32; 3]>) {
        self.watched =
            cells.into_iter().map(|cell| (BlockKey::of_cell(cell), BlockKey::offset(cell), cell)).collect();
        self.watched.sort_unstable();
        self.watched.dedup();
        self.events.clear();
    }

    /// What the last scan did to the watched cells that it observed, by [`Cell::fuse`] from the same evidence. In the order
    /// of blocks. (Where the memory limit stopped a scan, also what it would have done.)
    pub fn events(&self) -> &[([i32; 3], FusionEvent)] {
        &self.events
    }

    /// The estimate of the cell that holds a point; saturated at the truncation, where the field is a constant.
    /// Measured along rays, not Euclidean. Outside: beyond the bounds, or beyond what an index can hold.
    pub fn signed_distance(&self, p_world: impl Into<[f64; 3]>) -> Answer<f64> {
        let p = p_world.into();
        let outside = self.bounds.is_some_and(|b| !b.contains(p));
        let Some(cell) = self.lattice().cell_of(p).filter(|_| !outside) else { return Answer::Outside };
        let Some(cell) = self.distances.cell(cell) else { return Answer::Unknown };
        let limit = self.rule.truncation * (1.0 - 1e-4);
        if cell.distance.abs() < limit {
            Answer::Known(cell.distance.into())
        } else {
            Answer::Saturated(cell.distance.into())
        }
    }

    /// The colour of the cell that holds a point; `None` where none was seen.
    pub fn color(&self, p_world: impl Into<[f64; 3]>) -> Option<Color> {
        self.colors.as_ref()?.cell(self.lattice().cell_of(p_world.into())?)
    }

    /// 1 behind the surface, 0 in front of it: the sign of the estimate. `None`: never observed, or outside.
    pub fn occupancy(&self, p_world: [f64; 3]) -> Option<f64> {
        match self.signed_distance(p_world) {
            Answer::Known(d) | Answer::Saturated(d) => Some(if d < 0.0 { 1.0 } else { 0.0 }),
            Answer::Unknown | Answer::Outside => None,
        }
    }

    /// What it can answer at all: the sign, no distance.
    pub fn abilities(&self) -> Abilities {
        Abilities { occupancy: true, distance: false }
    }

    /// The distances.
    pub fn store(&self) -> &Bricks<SignedDistance, 3> {
        &self.distances
    }

    /// The colours beside them; `None` where the map keeps none.
    pub fn colors(&self) -> Option<&Bricks<Color, 3>> {
        self.colors.as_ref()
    }

    /// The stores of the map: distances, colours.
    pub fn into_stores(self) -> (Bricks<SignedDistance, 3>, Option<Bricks<Color, 3>>) {
        (self.distances, self.colors)
    }

    /// Allows no more than `bytes` for distances and colours together from now on.
    pub fn set_limit(&mut self, bytes: usize) {
        self.limit = bytes;
    }

    /// Rows and columns for scans of points that come without them; otherwise they are found: see [`LayoutFinder`].
    pub fn set_layout(&mut self, layout: SphericalLayout) {
        self.layout = LayoutFinder::of(layout);
    }

    /// Keeps to cells whose centre lies in a box (world) from now on; `None`: everywhere.
    pub fn set_bounds(&mut self, bounds: Option<Aabb<3>>) {
        self.bounds = bounds;
    }

    /// Bytes that the cells hold: measured, not estimated.
    pub fn memory_bytes(&self) -> usize {
        self.distances.memory_bytes() + self.colors.as_ref().map_or(0, Store::memory_bytes)
    }

    /// The settings.
    pub fn config(&self) -> &SparseTsdfConfig {
        &self.config
    }

    /// The filter.
    pub fn rule(&self) -> &TsdfRule {
        &self.rule
    }

    /// Index to metres.
    pub fn lattice(&self) -> &Lattice<3> {
        self.distances.lattice()
    }

    /// Number of cells with a weight of at least `min_weight` (and above 0).
    pub fn observed_cells(&self, min_weight: f32) -> usize {
        let of = |weights: &[f32]| weights.iter().filter(|&&w| w > 0.0 && w >= min_weight).count();
        self.distances.bricks_by_age().map(|(_, brick)| of(brick.weights())).sum()
    }
}

/// What the planned scan will do to the watched cells.
fn look(
    sweep: &Planned<'_>,
    watched: &[(BlockKey<3>, usize, [i32; 3])],
    store: &Bricks<SignedDistance, 3>,
    rule: &TsdfRule,
) -> Vec<([i32; 3], FusionEvent)> {
    let mut evidence = Distances::silent(block_cells::<3>());
    let mut events = Vec::new();
    for places in watched.chunk_by(|a, b| a.0 == b.0) {
        let Ok(i) = sweep.blocks().binary_search(&places[0].0) else { continue };
        sweep.evidence(i, &mut evidence);
        for &(_, at, cell) in places {
            if let Some(observation) = evidence.one(at) {
                events.push((cell, SignedDistance::fuse(store.cell(cell), observation, rule).1));
            }
        }
    }
    events
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Pinhole;

    #[test]
    fn a_scan_without_end_is_told_in_its_own_words() {
        // Pixels that look almost aside: what they see is a metre deep and a hundred thousand kilometres wide.
        let camera = Pinhole { fx: 1e-8, fy: 1e-8, cx: 0.5, cy: 0.5 };
        let image = RangeImage::from_depth(camera, 2, 2, [1.0; 4]);
        let mut map = SparseTsdf::new(SparseTsdfConfig::default()).unwrap();
        let error = map.integrate(&Pose::IDENTITY, &Frame::Image(image)).unwrap_err();
        assert!(matches!(error, MapError::TooFar { .. }), "{error}");
        assert!(map.store().is_empty());
    }

    #[test]
    fn rays_take_no_more_memory_than_the_limit_allows_for() {
        let config = SparseTsdfConfig { max_range: 2000.0, sweep: PointSweep::Rays, ..Default::default() };
        let points = (0..20).map(|i| {
            let a = 0.7 * i as f32;
            [1900.0 * a.cos(), 1900.0 * a.sin(), 0.0]
        });
        let frame = Frame::Points(PointScan::new(points, [0.0; 3]));
        let mut map = SparseTsdf::new(config).unwrap();
        map.set_limit(1 << 20);
        let error = map.integrate(&Pose::IDENTITY, &frame).unwrap_err();
        assert!(matches!(error, MapError::Full(_)), "{error}");
        assert!(map.sweeps.rays.blocks().len() <= (1 << 20) / 8192 + 4097);
    }
}
