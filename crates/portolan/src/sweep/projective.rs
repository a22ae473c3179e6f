//! The sweep for organised scans of space: every cell's centre is looked up in the range image.

use super::lens::{BAD_IMAGE, LANES, Lens, Window};
use super::observe::{Centres, Octants, View, cell_of, nearest, observe_block, places};
use super::padded_image::{Cleaning, PaddedImage};
use super::range_pyramid::RangePyramid;
use super::{PlanError, PlanLimits, Sweep, Swept, SweptColors, WeightModel};
use crate::cell::{ColorObservation, Colors, Distances, Evidence};
use crate::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice, Pose, block_cells};
use crate::parallel;
use crate::scan::{RangeImage, ScanStats};

/// How a range image becomes distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectiveSettings {
    /// Truncation tau (metres): nothing is said further behind a surface.
    pub truncation: f64,
    /// Weight of free space before the truncation, times that of its ray; 0: nothing is said of it.
    pub carve_weight: f32,
    /// How much each ray is trusted.
    pub weights: WeightModel,
    /// Surfaces nearer than this are not used (metres along the ray).
    pub min_range: f64,
    /// Surfaces further than this are not used; the space up to there is free (metres along the ray).
    pub max_range: f64,
    /// Whether colors are kept for [`SweptColors::colors`].
    pub color: bool,
}

/// Gives every cell the distance at its **centre**, measured along the ray through it.
///
/// The centre is projected into the image. If the four pixels around it are of one surface, the range there is
/// interpolated between them: `1 / z` linearly, which is exact on a plane. (Along a steep surface linear depths would be
/// off by centimetres.) Else the nearest pixel speaks, of its surface no further aside than half a cell, so that nothing is
/// drawn across gaps and thin things stay. Depths become distances along the ray, so that weights and truncation mean the
/// same in the image's corners as in its middle.
///
/// Blocks are found from the other side: boxes of blocks are projected, largest first, and compared with the
/// smallest and the largest depth that the image has there. No block that is seen can be missing.
#[derive(Clone, Debug)]
pub struct Projective {
    settings: ProjectiveSettings,
    lens: Option<Lens>,
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
    /// A sweep with these settings, which has seen nothing yet.
    pub fn new(settings: ProjectiveSettings) -> Self {
        Self {
            settings,
            lens: None,
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

    fn carves(&self) -> bool {
        self.settings.carve_weight > 0.0
    }

    fn find_blocks(&mut self, world_from_image: &Pose<3>, most: usize) -> Result<(), PlanError> {
        let Some(lens) = &self.lens else { return Ok(()) };
        let whole = self.pyramid.extremes([0, self.image.columns + 2], [0, self.image.rows + 1]);
        let farthest = f64::from(whole[1]);
        if farthest <= 0.0 {
            return Ok(());
        }
        let tau = self.settings.truncation;
        let (low, high) = lens.reach(farthest + tau, tau);
        let mut seen = Aabb::EMPTY;
        for corner in 0..8 {
            let p = std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
            seen.include(world_from_image.transform_point(p));
        }
        let mut seen = seen.grown(self.lattice.resolution);
        if let Some(bounds) = &self.bounds {
            for k in 0..3 {
                seen.min[k] = seen.min[k].max(bounds.min[k]);
                seen.max[k] = seen.max[k].min(bounds.max[k]);
            }
        }
        if seen.is_empty() {
            return Ok(());
        }
        let edge = self.lattice.resolution * BLOCK_EDGE as f64;
        let block = |p: [f64; 3], k: usize| ((p[k] - self.lattice.origin[k]) / edge).floor();
        // Indices that cells may have, with room for their neighbours.
        const LIMIT: f64 = (1u32 << 27) as f64;
        let first: [i64; 3] = std::array::from_fn(|k| block(seen.min, k).max(-LIMIT) as i64);
        let last: [i64; 3] = std::array::from_fn(|k| block(seen.max, k).min(LIMIT - 1.0) as i64);
        let span = (0..3).map(|k| last[k] - first[k] + 1).fold(i64::MIN, i64::max);
        if (0..3).any(|k| last[k] < first[k]) {
            return Ok(());
        }
        if span > 1 << 20 {
            return Err(PlanError::TooManyBlocks);
        }
        let spread = self.image_from_world.map(|row| row[0].abs() + row[1].abs() + row[2].abs());
        let search = Search { sweep: self, lens, first, last, most, spread };
        let found = search.run(span);
        if found.len() > most {
            return Err(PlanError::TooManyBlocks);
        }
        self.keys.extend(found.iter().map(|&(packed, _)| {
            let index = |k: usize| ((packed >> (20 * k)) & 0xf_ffff) as i64;
            BlockKey(std::array::from_fn(|k| (first[k] + index(k)) as i32))
        }));
        self.octants.extend(found.iter().map(|(_, octants)| *octants));
        Ok(())
    }

    fn view<'a>(&'a self, lens: &'a Lens) -> View<'a> {
        View {
            lens,
            image: &self.image,
            truncation: self.settings.truncation as f32,
            carve_weight: self.settings.carve_weight,
            inverse_square: self.settings.weights.parts().0,
            aside: 0.5 * self.lattice.resolution as f32,
        }
    }

    /// From the lattice to the sensor in f64, then f32: near a UTM origin nothing is lost.
    fn centres(&self, key: BlockKey<3>) -> Centres {
        let centre = self.lattice.center(key.first_cell());
        let offset: [f64; 3] = std::array::from_fn(|k| centre[k] - self.origin[k]);
        let rows = &self.image_from_world;
        Centres {
            first: rows.map(|row| (0..3).map(|k| row[k] * offset[k]).sum::<f64>() as f32),
            steps: std::array::from_fn(|axis| rows.map(|row| (row[axis] * self.lattice.resolution) as f32)),
        }
    }

    /// The evidence about the `i`-th planned block, into `evidence`.
    fn observe(&self, i: usize, evidence: &mut Distances) {
        let Some(lens) = &self.lens else { return };
        let (distance, weight) = evidence.planes_mut();
        let mut octants = self.octants[i];
        if self.settings.weights != WeightModel::Constant {
            // What is free has weights of its own too.
            octants = Octants { free: 0, mixed: octants.mixed | octants.free };
        }
        let (Ok(distance), Ok(weight)) = (distance.try_into(), TryInto::<&mut [f32; _]>::try_into(weight))
        else {
            return;
        };
        observe_block(&self.view(lens), &self.centres(self.keys[i]), octants, distance, weight);
    }
}

impl Sweep<3> for Projective {
    type Scan = RangeImage;

    fn plan(
        &mut self,
        image: &RangeImage,
        world_from_image: &Pose<3>,
        lattice: &Lattice<3>,
        limits: &PlanLimits<3>,
    ) -> Result<ScanStats, PlanError> {
        self.keys.clear();
        self.octants.clear();
        let lens = Lens::of(image).ok_or(PlanError::BadImage(BAD_IMAGE))?;
        let tau = self.settings.truncation;
        let cleaning = Cleaning {
            min_range: self.settings.min_range,
            max_range: self.settings.max_range,
            step: (0.5 * tau).min(0.03),
            weights: self.settings.weights,
            colors: self.settings.color,
        };
        let (beams, cleaned) = self.image.fill(image, &lens, &cleaning);
        self.pyramid.build(self.image.stride, &self.image.value, !self.carves());
        self.lens = Some(lens);
        self.lattice = *lattice;
        self.origin = world_from_image.translation;
        self.image_from_world = world_from_image.inverse().rotation;
        self.bounds = limits.bounds;
        self.find_blocks(world_from_image, limits.most_blocks)?;
        let outside = |bounds: Aabb<3>| {
            let is_outside = |p: [f64; 3]| !bounds.contains(world_from_image.transform_point(p));
            image.points().filter(|(_, p)| is_outside(*p)).count() as u64
        };
        Ok(ScanStats {
            scans: 1,
            beams,
            refused: image.refused + cleaned,
            hits_outside: limits.bounds.map_or(0, outside),
            ..Default::default()
        })
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
        let Some(lens) = self.lens.as_ref().filter(|_| !self.image.colors.is_empty()) else { return };
        let near = |cell: usize| distances.weights()[cell] > 0.0 && distances.distances()[cell].abs() <= band;
        let centres = self.centres(self.keys[i]);
        let image = &self.image;
        for octant in 0..8 {
            if !(0..LANES).any(|l| near(cell_of(octant, l))) {
                continue;
            }
            let seen = lens.project(&centres.octant(octant));
            let at = places(&seen.u, &seen.v, image.stride);
            for l in 0..LANES {
                let cell = cell_of(octant, l);
                let pixel = nearest(at.index[l] as usize, at.right[l], at.below[l], image.stride);
                if near(cell) && image.value[pixel] > 0.0 {
                    let (row, column) = (pixel / image.stride - 1, pixel % image.stride);
                    let column = (column + image.columns - 1) % image.columns;
                    let rgb = image.colors[row * image.columns + column];
                    colors.set(cell, ColorObservation { rgb, weight: distances.weights()[cell] });
                }
            }
        }
    }
}

/// The search for blocks, from large boxes of blocks to single ones.
struct Search<'a> {
    sweep: &'a Projective,
    lens: &'a Lens,
    first: [i64; 3],
    last: [i64; 3],
    most: usize,
    /// Half edges along the sensor's axes of a box of half edge 1 along the map's.
    spread: [f64; 3],
}

/// What the image says of a box of blocks.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Class {
    Nothing,
    Free,
    Mixed,
}

/// A cube of `2^level` octants of blocks from `at`, counted from the search's first block.
#[derive(Clone, Copy)]
struct Node {
    at: [i64; 3],
    level: u32,
}

/// The level at which a node is a block.
const BLOCK: u32 = 1;

impl Node {
    fn children(self) -> impl Iterator<Item = Self> {
        let (level, half) = (self.level - 1, 1i64 << (self.level - 1));
        (0..8).map(move |c| Self { at: std::array::from_fn(|k| self.at[k] + half * (c >> k & 1)), level })
    }

    /// Indices of a block in 20 bits each, in the order of keys.
    fn packed(self) -> u64 {
        let [x, y, z] = self.at.map(|v| (v >> BLOCK) as u64);
        (z << 40) | (y << 20) | x
    }
}

/// Extremes of a window that could hold any values: nearest 0, farthest infinitely far. Of neither is anything sure.
const ANYTHING: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// A block that is seen: its packed indices, and what is known of its octants.
type Found = (u64, Octants);

impl Search<'_> {
    /// In the order of keys. `span` is the number of blocks along the longest axis.
    fn run(&self, span: i64) -> Vec<Found> {
        let level = BLOCK + span.max(1).ilog2() + u32::from(span.count_ones() > 1);
        let mut nodes = vec![(Node { at: [0; 3], level }, ANYTHING)];
        // Enough parts for every core, the same ones for any number of them.
        const LEAST: u32 = BLOCK + 2;
        while nodes.len() < 256 && nodes.iter().any(|(n, _)| n.level > LEAST) {
            nodes = nodes
                .into_iter()
                .flat_map(|(n, known)| match (n.level > LEAST).then(|| self.class(n, known)) {
                    None => vec![(n, known)],
                    Some((Class::Nothing, _)) => vec![],
                    Some((_, known)) => n.children().map(|child| (child, known)).collect(),
                })
                .collect();
        }
        let parts = parallel::map(&nodes, 1, |(node, known): &(Node, [f32; 2])| {
            let mut found = Vec::new();
            self.descend(*node, *known, &mut found);
            found
        });
        let mut all = parts.concat();
        all.sort_unstable_by_key(|found| found.0);
        all
    }

    fn descend(&self, node: Node, known: [f32; 2], found: &mut Vec<Found>) {
        if found.len() > self.most {
            return;
        }
        let (class, known) = self.class(node, known);
        match class {
            Class::Nothing => {}
            Class::Free => self.all(node, found),
            Class::Mixed if node.level == BLOCK => {
                let mut octants = Octants::default();
                for (bit, octant) in node.children().enumerate() {
                    match self.class(octant, known).0 {
                        Class::Nothing => {}
                        Class::Free => octants.free |= 1 << bit,
                        Class::Mixed => octants.mixed |= 1 << bit,
                    }
                }
                if octants != Octants::default() {
                    found.push((node.packed(), octants));
                }
            }
            Class::Mixed => node.children().for_each(|child| self.descend(child, known, found)),
        }
    }

    /// All blocks of a node that is free.
    fn all(&self, node: Node, found: &mut Vec<Found>) {
        if !self.is_inside(node) || found.len() > self.most {
        } else if node.level == BLOCK {
            found.push((node.packed(), Octants { free: 0xff, mixed: 0 }));
        } else {
            node.children().for_each(|child| self.all(child, found));
        }
    }

    fn is_inside(&self, node: Node) -> bool {
        (0..3).all(|k| node.at[k] >> BLOCK <= self.last[k] - self.first[k])
    }

    /// What the image says of a node, and the extremes of its window: those of the window of its parent are `known`.
    fn class(&self, node: Node, known: [f32; 2]) -> (Class, [f32; 2]) {
        let sweep = self.sweep;
        if !self.is_inside(node) {
            return (Class::Nothing, known);
        }
        const OCTANT: i64 = BLOCK_EDGE as i64 / 2;
        let edge = OCTANT << node.level;
        let r = sweep.lattice.resolution;
        let offset: [f64; 3] = std::array::from_fn(|k| {
            let cell = self.first[k] * BLOCK_EDGE as i64 + node.at[k] * OCTANT;
            (sweep.lattice.origin[k] - sweep.origin[k]) + (cell as f64 + 0.5 * edge as f64) * r
        });
        // The box of the centres of its cells.
        let half = 0.5 * (edge - 1) as f64 * r;
        let (mut centre, mut halves) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let row = &sweep.image_from_world[k];
            centre[k] = row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2];
            halves[k] = half * self.spread[k];
        }
        let depth = self.lens.depth(centre, halves, || {
            let (mut near, mut far) = (0.0, 0.0);
            for o in offset.map(f64::abs) {
                let (low, high) = ((o - half).max(0.0), o + half);
                (near, far) = (near + low * low, far + high * high);
            }
            [near.sqrt(), far.sqrt()]
        });
        // No corner is further away than the way to it along the axes.
        let far = offset[0].abs() + offset[1].abs() + offset[2].abs() + 3.0 * half;
        let (tau, slack) = (sweep.settings.truncation, 1e-4 * r + 1e-6 * (depth[1].abs() + far));
        let class = |[least, most]: [f32; 2]| {
            let before = depth[1] < f64::from(least) - tau - slack;
            if depth[0] > f64::from(most) + tau + slack || (before && !sweep.carves()) {
                Class::Nothing
            } else if before && depth[0] >= 0.0 {
                // (What lies behind a camera is before everything, too.)
                Class::Free
            } else {
                Class::Mixed
            }
        };
        // Mostly the parent's window is enough, which costs nothing.
        match class(known) {
            Class::Mixed => match self.lens.window(centre, halves) {
                None => (Class::Nothing, known),
                Some(window) => {
                    let extremes = self.extremes(&window);
                    (class(extremes), extremes)
                }
            },
            sure => (sure, known),
        }
    }

    fn extremes(&self, window: &Window) -> [f32; 2] {
        let (pyramid, columns) = (&self.sweep.pyramid, self.sweep.image.columns);
        let [from, to] = window.columns;
        if to <= columns + 2 {
            return pyramid.extremes([from, to], window.rows);
        }
        // Past the seam: the rest is at the other end.
        let a = pyramid.extremes([from.min(columns + 1), columns + 1], window.rows);
        let b = pyramid.extremes([1, (to - columns).min(columns + 1)], window.rows);
        [a[0].min(b[0]), a[1].max(b[1])]
    }
}
