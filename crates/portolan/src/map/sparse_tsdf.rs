//! Truncated signed distance fields of space in bricks.

use super::sparse_error::{check_lattice, most_blocks};
use super::{Abilities, MapError};
use crate::answer::Answer;
use crate::cell::{
    Cell, Color, ColorRule, Colors, Distances, Evidence, FusionEvent, Planes, SignedDistance, TsdfRule,
};
use crate::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{BeamCounts, Frame, Origin, PointScan, RangeImage, ScanStats};
use crate::store::{Bricks, BricksFull, Store};
use crate::sweep::{PlanError, PointRays, Projective, ProjectiveSettings, WeightModel};

/// How a scan of points becomes observations of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointSweep {
    /// By its rows and columns where it has them, else ray by ray.
    #[default]
    Projective,
    /// Always ray by ray.
    Rays,
}

/// Settings of a [`SparseTsdf`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseTsdfConfig {
    /// Edge of a cell (metres).
    pub resolution: f64,
    /// Lower corner of cell 0 (world, metres): near to the map, and a multiple of the resolution, so that the lattices of
    /// two maps coincide.
    pub origin: [f64; 3],
    /// Truncation tau (metres): two to four cells, and less than half of the thinnest wall that is seen from both sides.
    pub truncation: f64,
    /// Clamp of the weight. Infinity: never forget.
    pub w_max: f32,
    /// Whether the free space up to the surfaces is fused too. It costs memory and time, and buys the difference between
    /// free and unknown, and that what has gone disappears.
    pub carve: bool,
    /// Weight of an observation of free space beyond the truncation, times that of its ray.
    pub carve_weight: f32,
    /// How much each ray is trusted. Behind a surface the weight falls linearly to 0 at the truncation.
    pub weights: WeightModel,
    /// How scans of points become observations.
    pub sweep: PointSweep,
    /// Surfaces nearer than this are not used (metres along the ray).
    pub min_range: f64,
    /// Surfaces further than this are not used, but the space up to there is free (metres along the ray).
    pub max_range: f64,
    /// Whether colours are fused beside distances, where scans have them.
    pub color: bool,
    /// Clamp of a colour's weight, at most 255.
    pub color_w_max: f32,
}

impl Default for SparseTsdfConfig {
    /// 5 cm, tau three cells, W_max 64, with carving.
    fn default() -> Self {
        Self {
            resolution: 0.05,
            origin: [0.0; 3],
            truncation: 0.15,
            w_max: 64.0,
            carve: true,
            carve_weight: 1.0,
            weights: WeightModel::default(),
            sweep: PointSweep::default(),
            min_range: 0.0,
            max_range: 100.0,
            color: false,
            color_w_max: 64.0,
        }
    }
}

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
        let rule = TsdfRule { truncation: config.truncation as f32, w_max: config.w_max };
        rule.validate()?;
        if !(config.carve_weight > 0.0 && config.carve_weight <= 1.0) {
            return Err(MapError::CarveWeight(config.carve_weight));
        }
        if !(config.color_w_max > 0.0) {
            return Err(crate::cell::TsdfRuleError::WeightClamp(config.color_w_max).into());
        }
        // Images are searched for blocks in a box of this many cells at most.
        const REACH: f64 = (1u32 << 20) as f64;
        let ranges = (config.min_range, config.max_range);
        if !(ranges.0 >= 0.0
            && ranges.1 > ranges.0
            && ranges.1 + config.truncation <= REACH * config.resolution)
        {
            return Err(MapError::Ranges { min: ranges.0, max: ranges.1, most: REACH * config.resolution });
        }
        let settings = ProjectiveSettings {
            truncation: config.truncation,
            carve_weight: if config.carve { config.carve_weight } else { 0.0 },
            weights: config.weights,
            min_range: config.min_range,
            max_range: config.max_range,
        };
        let sweeps = Sweeps { projective: Projective::new(settings), rays: PointRays::new(settings) };
        Ok(Self {
            rule,
            color_rule: ColorRule { w_max: config.color_w_max },
            distances,
            colors,
            bounds: None,
            limit: usize::MAX,
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
    /// [`MapError::Full`] where a brick would pass the limit: what was fused before it stays. [`MapError::Image`] where an
    /// image contradicts itself.
    pub fn integrate(&mut self, world_from_sensor: &Pose<3>, frame: &Frame) -> Result<ScanStats, MapError> {
        self.events.clear();
        if !world_from_sensor.is_rigid() || self.lattice().cell_of(world_from_sensor.translation).is_none() {
            return Ok(ScanStats { refused_poses: 1, ..Default::default() });
        }
        match frame {
            Frame::Image(image) => self.integrate_image(world_from_sensor, image),
            Frame::Points(scan) => match (&scan.image, &scan.origin, self.config.sweep) {
                (Some(image), Origin::Common(origin), PointSweep::Projective) => {
                    let at = Pose {
                        translation: world_from_sensor.transform_point(*origin),
                        ..*world_from_sensor
                    };
                    let mut stats = self.integrate_image(&at, image)?;
                    stats.refused += scan.refused;
                    Ok(stats)
                }
                _ => self.integrate_rays(world_from_sensor, scan),
            },
        }
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
        self.integrate(&Pose { translation: origin_world, ..Pose::IDENTITY }, &Frame::Points(scan))
    }

    fn integrate_image(
        &mut self,
        world_from_image: &Pose<3>,
        image: &RangeImage,
    ) -> Result<ScanStats, MapError> {
        let (lattice, how) = (*self.lattice(), self.how());
        let sweep = &mut self.sweeps.projective;
        let counted = sweep.plan(image, world_from_image, &lattice, self.bounds.as_ref(), how);
        let (beams, cleaned) = counted.map_err(|e| self.plan_error(e))?;
        let mut stats = self.fuse(|sweeps| Planned::Image(&sweeps.projective), beams)?;
        stats.refused = image.refused;
        stats.refused += cleaned;
        if let Some(bounds) = &self.bounds {
            let outside = |p: [f64; 3]| !bounds.contains(world_from_image.transform_point(p));
            stats.hits_outside = image.points().filter(|(_, p)| outside(*p)).count() as u64;
        }
        Ok(stats)
    }

    fn integrate_rays(&mut self, world_from_scan: &Pose<3>, scan: &PointScan) -> Result<ScanStats, MapError> {
        let (lattice, how) = (*self.lattice(), self.how());
        let sweep = &mut self.sweeps.rays;
        let counted = sweep.plan(scan, world_from_scan, &lattice, self.bounds.as_ref(), how);
        let (beams, cleaned) = counted.map_err(|e| self.plan_error(e))?;
        let mut stats = self.fuse(|sweeps| Planned::Rays(&sweeps.rays), beams)?;
        stats.refused = scan.refused;
        stats.refused += cleaned;
        if let Some(bounds) = &self.bounds {
            let outside = |p: &[f32; 3]| !bounds.contains(world_from_scan.transform_point(p.map(f64::from)));
            stats.hits_outside = scan.points.iter().filter(|p| outside(p)).count() as u64;
        }
        Ok(stats)
    }

    /// Whether colours are wanted, and how many blocks a scan may see at most.
    fn how(&self) -> (bool, usize) {
        (self.config.color, most_blocks(self.limit))
    }

    fn plan_error(&self, error: PlanError) -> MapError {
        match error {
            PlanError::BadImage(why) => MapError::Image(why),
            PlanError::TooManyBlocks => MapError::Full(self.full()),
        }
    }

    fn full(&self) -> BricksFull {
        BricksFull { limit: self.limit, bricks: self.distances.len(), bytes: self.memory_bytes() }
    }

    /// Fuses what a sweep has planned.
    fn fuse(
        &mut self,
        planned: impl Fn(&Sweeps) -> Planned<'_>,
        beams: BeamCounts,
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
        Ok(ScanStats { scans: 1, beams, cells: observed, ..Default::default() })
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
