//! The sweep for distances through a range image: every cell's center is looked up in it.

use super::depth_bounds::DepthBounds;
use super::lanes::LANES;
use super::observe::{BlockCenters, ImageLookup, cell_of, nearest, observe_block, places};
use super::padded_image::{Cleaning, PaddedImage};
use super::project::LEAST_COSINE;
use super::projector::Projector;
use super::range_pyramid::RangePyramid;
use super::search::{BlockBox, LONGEST_EDGE, Octants, find_blocks};
use crate::cell::{ColorObservation, Colors, Distances, Evidence};
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice, Pose, block_cells};
use crate::scan::{RangeImage, ScanStats};
use crate::sweep::{PlanError, PlanLimits, Sweep, Swept, SweptColors, WeightModel};

/// How a range image becomes distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectiveSettings {
    /// Truncation tau (meters): cells further behind a surface get nothing, measured across it (up to 66 degrees of incidence).
    pub truncation: f64,
    /// Weight of free space before the truncation, times that of its ray; 0: free space gets nothing.
    pub carve_weight: f32,
    /// How much each ray is trusted.
    pub weights: WeightModel,
    /// Surfaces nearer than this are not used (meters along the ray).
    pub min_range: f64,
    /// Surfaces further than this are not used; the space up to there is free (meters along the ray).
    pub max_range: f64,
    /// Whether colors are looked up too, where the scan has them.
    pub color: bool,
}

/// Gives every cell the distance at its **center**, measured along the ray through it.
///
/// The center is projected into the image. If the four pixels around it are of one surface, the range there is
/// interpolated between them: `1 / z` linearly, which is exact on a plane. (Along a steep surface linear depths would be
/// off by centimeters.) Else the nearest pixel counts, with its surface no further aside than half a cell, so that nothing is
/// drawn across gaps and thin things stay.
///
/// The truncation is measured across the surface that the four pixels show: cells around a surface that is met at a slant are further
/// from it along the ray than across, and without them one view shows only what it meets head-on. Distances stay those
/// along the ray, between minus and plus the truncation. Depths become distances along the ray, so that weights and truncation mean the
/// same in the image's corners as in its middle.
///
/// Blocks are found from the other side: boxes of blocks are projected, largest first, and compared with the
/// smallest and the largest depth that the image has there. No block that is seen can be missing.
#[derive(Clone, Debug)]
pub struct Projective {
    settings: ProjectiveSettings,
    projector: Option<Projector>,
    image: PaddedImage,
    pyramid: RangePyramid,
    lattice: Lattice<3>,
    /// Where the sensor is (world).
    origin: [f64; 3],
    image_from_world: [[f64; 3]; 3],
    bounds: Option<Aabb<3>>,
    keys: Vec<BlockKey<3>>,
    octants: Vec<Octants>,
}

impl Projective {
    /// A sweep with these settings.
    pub fn new(settings: ProjectiveSettings) -> Self {
        Self {
            settings,
            projector: None,
            image: PaddedImage::default(),
            pyramid: RangePyramid::default(),
            lattice: Lattice::new([0.0; 3], 1.0),
            origin: [0.0; 3],
            image_from_world: Pose::<3>::IDENTITY.rotation,
            bounds: None,
            keys: Vec::new(),
            octants: Vec::new(),
        }
    }

    /// The truncation along the ray, where the surface is met at the steepest incidence that counts.
    fn longest(&self) -> f64 {
        self.settings.truncation / f64::from(LEAST_COSINE)
    }

    fn carves(&self) -> bool {
        self.settings.carve_weight > 0.0
    }

    fn find_blocks(
        &mut self,
        projector: &Projector,
        world_from_image: &Pose<3>,
        most: usize,
    ) -> Result<(), PlanError> {
        let Some(whole) = self.reach(projector, world_from_image) else { return Ok(()) };
        if (0..3).any(|k| i64::from(whole.last[k]) - i64::from(whole.first[k]) >= LONGEST_EDGE) {
            return Err(PlanError::TooManyBlocks);
        }
        let (mut keys, mut octants) = (std::mem::take(&mut self.keys), std::mem::take(&mut self.octants));
        let bounds = DepthBounds {
            projector,
            pyramid: &self.pyramid,
            lattice: self.lattice,
            origin: self.origin,
            image_from_world: self.image_from_world,
            truncation: self.longest(),
            carves: self.carves(),
        };
        let fits = find_blocks(&bounds, whole, most, &mut keys, &mut octants);
        (self.keys, self.octants) = (keys, octants);
        if fits { Ok(()) } else { Err(PlanError::TooManyBlocks) }
    }

    /// A box that holds all blocks that the image sees.
    fn reach(&self, projector: &Projector, world_from_image: &Pose<3>) -> Option<BlockBox> {
        let whole = self.pyramid.extremes([0, self.image.columns + 2], [0, self.image.rows + 1]);
        let farthest = f64::from(whole[1]);
        if farthest <= 0.0 {
            return None;
        }
        let tau = self.longest();
        let (low, high) = projector.reach(farthest + tau, tau);
        let mut seen = Aabb::EMPTY;
        for corner in 0..8 {
            let p = std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
            seen.include(world_from_image.transform_point(p));
        }
        let mut seen = seen.grown(self.lattice.resolution);
        if let Some(bounds) = &self.bounds {
            seen = seen.intersection(*bounds);
        }
        if seen.is_empty() {
            return None;
        }
        let edge = self.lattice.resolution * BLOCK_EDGE as f64;
        let block = |p: [f64; 3], k: usize| ((p[k] - self.lattice.origin[k]) / edge).floor();
        // Indices that cells may have, with room for their neighbors.
        const LIMIT: f64 = (1u32 << 27) as f64;
        let first: [i32; 3] = std::array::from_fn(|k| block(seen.min, k).max(-LIMIT) as i32);
        let last: [i32; 3] = std::array::from_fn(|k| block(seen.max, k).min(LIMIT - 1.0) as i32);
        (0..3).all(|k| first[k] <= last[k]).then_some(BlockBox { first, last })
    }

    fn lookup<'a>(&'a self, projector: &'a Projector) -> ImageLookup<'a> {
        ImageLookup {
            projector,
            image: &self.image,
            truncation: self.settings.truncation as f32,
            carve_weight: self.settings.carve_weight,
            inverse_square: self.settings.weights.parts().0,
            aside: 0.5 * self.lattice.resolution as f32,
        }
    }

    /// From the lattice to the sensor in f64, then f32: near a UTM origin nothing is lost.
    fn centers(&self, key: BlockKey<3>) -> BlockCenters {
        let center = self.lattice.center(key.first_cell());
        let offset: [f64; 3] = std::array::from_fn(|k| center[k] - self.origin[k]);
        let rows = &self.image_from_world;
        BlockCenters {
            first: rows.map(|row| (0..3).map(|k| row[k] * offset[k]).sum::<f64>() as f32),
            steps: std::array::from_fn(|axis| rows.map(|row| (row[axis] * self.lattice.resolution) as f32)),
        }
    }

    /// The evidence about the `i`-th planned block, into `evidence`.
    fn observe(&self, i: usize, evidence: &mut Distances) {
        let Some(projector) = &self.projector else { return };
        let (distance, weight) = evidence.planes_mut();
        let mut octants = self.octants[i];
        if self.settings.weights != WeightModel::Constant {
            // What is free has weights of its own too.
            octants = Octants { mixed: octants.mixed | octants.free, ..Octants::default() };
        }
        if let (Ok(distance), Ok(weight)) = (distance.try_into(), TryInto::<&mut [f32; _]>::try_into(weight))
        {
            observe_block(&self.lookup(projector), &self.centers(self.keys[i]), octants, distance, weight);
        }
    }
}

impl Sweep<3> for Projective {
    type Scan = RangeImage;

    /// O(pixels + blocks), in parallel.
    fn plan(
        &mut self,
        image: &RangeImage,
        world_from_image: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        self.keys.clear();
        self.octants.clear();
        image.check().map_err(PlanError::BadImage)?;
        let projector = self.projector.take().filter(|p| p.is_of(image));
        let projector = projector.unwrap_or_else(|| Projector::of(image));
        let tau = self.settings.truncation;
        let cleaning = Cleaning {
            min_range: self.settings.min_range,
            max_range: self.settings.max_range,
            step: (0.5 * tau).min(0.03),
            weights: self.settings.weights,
            colors: self.settings.color,
        };
        let mut stats = self.image.fill(image, &projector, &cleaning);
        stats.refused += image.refused;
        if let Some(bounds) = &limits.bounds {
            let outside = |p: [f64; 3]| !bounds.contains(world_from_image.transform_point(p));
            stats.hits_outside = image.points().filter(|(_, p)| outside(*p)).count() as u64;
        }
        self.pyramid.build(self.image.stride, &self.image.value, !self.carves());
        self.lattice = *lattice;
        self.origin = world_from_image.translation;
        self.image_from_world = world_from_image.inverse().rotation;
        self.bounds = limits.bounds;
        let found = self.find_blocks(&projector, world_from_image, limits.most_blocks);
        self.projector = Some(projector);
        found.map(|()| stats)
    }
}

impl Swept<3> for Projective {
    type Evidence = Distances;
    type Scratch = Distances;

    fn scratch(&self) -> Distances {
        Distances::silent(block_cells::<3>())
    }

    fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    fn evidence<'a>(&'a self, i: usize, scratch: &'a mut Distances) -> &'a Distances {
        self.observe(i, scratch);
        scratch
    }
}

impl SweptColors<3> for Projective {
    fn is_free(&self, i: usize) -> bool {
        self.octants[i].mixed == 0
    }

    /// Those of the nearest pixels.
    fn colors(&self, i: usize, distances: &Distances, band: f32, colors: &mut Colors) {
        colors.clear();
        let Some(projector) = self.projector.as_ref().filter(|_| !self.image.colors.is_empty()) else {
            return;
        };
        let near = |cell: usize| distances.weights()[cell] > 0.0 && distances.distances()[cell].abs() <= band;
        let centers = self.centers(self.keys[i]);
        let image = &self.image;
        for octant in 0..8 {
            if !(0..LANES).any(|l| near(cell_of(octant, l))) {
                continue;
            }
            let seen = projector.project(&centers.octant(octant));
            let at = places(&seen.u, &seen.v, image.stride);
            for l in 0..LANES {
                let cell = cell_of(octant, l);
                let pixel = nearest(at.index[l] as usize, at.right[l], at.below[l], image.stride);
                if near(cell) && image.value[pixel] > 0.0 {
                    let (row, column) = (pixel / image.stride - 1, pixel % image.stride);
                    let column = (column + image.columns - 1) % image.columns;
                    let at = row * image.columns + column;
                    if image.colored.get(at).copied().unwrap_or(true) {
                        let rgb = image.colors[at];
                        colors.set(cell, ColorObservation { rgb, weight: distances.weights()[cell] });
                    }
                }
            }
        }
    }
}
