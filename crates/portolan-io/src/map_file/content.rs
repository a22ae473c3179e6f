//! What a `map.portolan` holds.

use std::borrow::Cow;

use portolan::Ledger;
use portolan::cell::{AttenuationRule, Color, HitLength, LogOdds8, OccupancyModel, SignedDistance};
use portolan::geom::Pose;
use portolan::map::{DenseTsdf, DistanceMap, OccupancyGrid, OccupancyTree, least_weight};
use portolan::store::Bricks;
use portolan::sweep::WeightModel;
use serde_json::{Map, Value};

use super::{MapHeader, UnknownChunk};

/// The content of a `map.portolan` of dimension `D`: at most one map of each kind.
#[derive(Clone, Debug, Default)]
pub struct MapFile<const D: usize> {
    /// What the writer noted about it.
    pub header: MapHeader,
    /// Occupancy in a dense array.
    pub grid: Option<OccupancyGrid<D>>,
    /// Occupancy in a quadtree or octree.
    pub tree: Option<OccupancyTree<D>>,
    /// The truncated signed distance field in a dense array.
    pub tsdf: Option<DenseTsdf<D>>,
    /// Occupancy in bricks.
    pub occupancy_bricks: Option<OccupancyBricks<D>>,
    /// The truncated signed distance field in bricks.
    pub tsdf_bricks: Option<TsdfBricks<D>>,
    /// Colors of the surface in bricks.
    pub color_bricks: Option<ColorBricks<D>>,
    /// Hits per meter in bricks, in 2-D and 3-D.
    pub attenuation: Option<AttenuationBricks<D>>,
    /// Maps of sums. A file that holds them is written with nothing else: the maps beside them are made of them.
    pub ledger: Option<Ledger<D>>,
    /// Poses of the sensor at the fused scans, `world_from_sensor`.
    pub poses: Vec<Pose<D>>,
    pub(super) unknown_maps: Vec<Value>,
    pub(super) unknown_chunks: Vec<UnknownChunk>,
}

impl<const D: usize> MapFile<D> {
    /// Whether a map of it is an array or a tree over a box.
    pub fn has_arrays(&self) -> bool {
        self.grid.is_some() || self.tree.is_some() || self.tsdf.is_some()
    }

    /// Whether a map of it is in bricks, besides hits per meter, which always are.
    pub fn has_bricks(&self) -> bool {
        self.occupancy_bricks.is_some() || self.tsdf_bricks.is_some() || self.color_bricks.is_some()
    }
}

/// Occupancy in bricks, and how it was fused.
#[derive(Clone, Debug)]
pub struct OccupancyBricks<const D: usize> {
    /// The cells.
    pub store: Bricks<LogOdds8, D>,
    /// By how much a hit and a miss change a cell.
    pub model: OccupancyModel,
    /// Further settings.
    pub more: Map<String, Value>,
}

/// A truncated signed distance field in bricks, and how it was fused.
#[derive(Clone, Debug)]
pub struct TsdfBricks<const D: usize> {
    /// The cells.
    pub store: Bricks<SignedDistance, D>,
    /// Truncation (meters).
    pub truncation: f64,
    /// Clamp of the weight; infinity: never forget.
    pub w_max: f32,
    /// Weight of free space beyond the truncation, times the beam's.
    pub carve_weight: f32,
    /// How much each beam is trusted.
    pub weights: WeightModel,
    /// Further settings.
    pub more: Map<String, Value>,
}

impl<const D: usize> DistanceMap<D> for TsdfBricks<D> {
    fn min_weight(&self) -> f32 {
        least_weight(self.weights, self.carve_weight)
    }

    fn bricks(&self) -> Cow<'_, Bricks<SignedDistance, D>> {
        Cow::Borrowed(&self.store)
    }
}

/// Colors in bricks, and how they were fused.
#[derive(Clone, Debug)]
pub struct ColorBricks<const D: usize> {
    /// The cells.
    pub store: Bricks<Color, D>,
    /// Clamp of the weight.
    pub w_max: f32,
    /// Further settings.
    pub more: Map<String, Value>,
}

/// Hits per meter in bricks, and how they forget.
#[derive(Clone, Debug)]
pub struct AttenuationBricks<const D: usize> {
    /// The cells.
    pub store: Bricks<HitLength, D>,
    /// How they forget.
    pub rule: AttenuationRule,
    /// Further settings.
    pub more: Map<String, Value>,
}
