//! What is made of the maps of space when all frames are fused.

use std::collections::BTreeMap;
use std::time::Instant;

use portolan::cell::LogOdds8;
use portolan::field::{SparseEsdf, SparseEsdfSettings};
use portolan::store::{Store, Tree};
use portolan::surface::{Mesh, MeshSettings, marching_cubes};

use super::{Settings, SpaceMaps};
use crate::mapping::MapKind;

/// Octree, mesh and distance field, as far as they are wanted and there is something to derive them from.
#[derive(Default)]
pub(crate) struct Derived {
    pub(crate) tree: Option<Tree<LogOdds8, 3>>,
    pub(crate) mesh: Option<Mesh>,
    pub(crate) esdf: Option<SparseEsdf>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
}

impl Derived {
    pub(crate) fn of(maps: &SpaceMaps, settings: &Settings) -> anyhow::Result<Self> {
        let mut derived = Self::default();
        if let Some(map) = &maps.occupancy {
            let start = Instant::now();
            derived.tree = Tree::from_bricks(map.store());
            derived.seconds.insert("octree", start.elapsed().as_secs_f64());
        }
        let Some(tsdf) = &maps.tsdf else { return Ok(derived) };
        let one_beam = settings.weights.typical_low();
        if settings.wants(MapKind::Mesh) {
            let start = Instant::now();
            let how = MeshSettings { min_weight: 0.5 * one_beam, ..MeshSettings::default() };
            derived.mesh = Some(marching_cubes(tsdf.store(), tsdf.colors(), &how));
            derived.seconds.insert("mesh", start.elapsed().as_secs_f64());
        }
        if settings.wants(MapKind::Esdf) {
            let start = Instant::now();
            let how = SparseEsdfSettings {
                min_weight: 0.5 * one_beam * settings.carve_weight,
                max_distance: settings.max_distance,
                ..SparseEsdfSettings::default()
            };
            derived.esdf = Some(SparseEsdf::from_tsdf(tsdf.store(), &how));
            derived.seconds.insert("esdf", start.elapsed().as_secs_f64());
        }
        Ok(derived)
    }

    /// Bytes of each derived field, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let tree = self.tree.iter().map(|t| ("octree", t.memory_bytes()));
        let mesh = self.mesh.iter().map(|m| ("mesh", m.memory_bytes()));
        tree.chain(mesh).chain(self.esdf.iter().map(|e| ("esdf", e.memory_bytes()))).collect()
    }
}
