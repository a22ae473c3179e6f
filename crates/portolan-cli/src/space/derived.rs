//! What is made of the maps of space when all frames are fused.

use std::collections::BTreeMap;
use std::time::Instant;

use portolan::cell::LogOdds8;
use portolan::field::{SparseEsdf, SparseEsdfSettings};
use portolan::store::{Store, Tree};
use portolan::surface::{Mesh, MeshSettings, marching_cubes};
use portolan::sweep::WeightModel;

use super::{Settings, SpaceMaps};
use crate::mapping::MapKind;

/// Octree, mesh and distance field, as far as they are wanted and there is something to derive them from.
#[derive(Default)]
pub(crate) struct Derived {
    pub(crate) tree: Option<Tree<LogOdds8, 3>>,
    pub(crate) mesh: Option<Mesh>,
    pub(crate) esdf: Option<SparseEsdf<3>>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
}

impl Derived {
    pub(crate) fn of(maps: &SpaceMaps, settings: &Settings) -> Self {
        let mut derived = Self::default();
        if let Some(map) = &maps.occupancy {
            let start = Instant::now();
            derived.tree = Tree::from_bricks(map.store());
            derived.seconds.insert("octree", start.elapsed().as_secs_f64());
        }
        let Some(tsdf) = &maps.tsdf else { return derived };
        if settings.wants(MapKind::Mesh) {
            let start = Instant::now();
            derived.mesh =
                Some(marching_cubes(tsdf.store(), tsdf.colors(), &mesh_settings(settings.weights)));
            derived.seconds.insert("mesh", start.elapsed().as_secs_f64());
        }
        if settings.wants(MapKind::Esdf) {
            let start = Instant::now();
            let how = esdf_settings(settings.weights, settings.carve_weight, settings.max_distance);
            derived.esdf = Some(SparseEsdf::of(tsdf.store(), &how));
            derived.seconds.insert("esdf", start.elapsed().as_secs_f64());
        }
        derived
    }

    /// Bytes of each derived field, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let tree = self.tree.iter().map(|t| ("octree", t.memory_bytes()));
        let mesh = self.mesh.iter().map(|m| ("mesh", m.memory_bytes()));
        tree.chain(mesh).chain(self.esdf.iter().map(|e| ("esdf", e.memory_bytes()))).collect()
    }
}

/// A `W_min` of half of what one ordinary ray weighs: what was seen once is a surface.
pub(crate) fn mesh_settings(weights: WeightModel) -> MeshSettings {
    MeshSettings { min_weight: 0.5 * weights.typical_low(), ..MeshSettings::default() }
}

/// A `W_min` of half of what one ordinary observation of free space weighs: what was seen free once is known.
pub(crate) fn esdf_settings(
    weights: WeightModel,
    carve_weight: f32,
    max_distance: f64,
) -> SparseEsdfSettings {
    let min_weight = 0.5 * weights.typical_low() * carve_weight;
    SparseEsdfSettings { min_weight, max_distance, ..SparseEsdfSettings::default() }
}
