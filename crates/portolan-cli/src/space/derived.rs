//! What is made of the maps of space when all frames are fused.

use std::collections::BTreeMap;
use std::time::Instant;

use portolan::cell::LogOdds8;
use portolan::field::{Esdf, EsdfSettings};
use portolan::map::Thresholds;
use portolan::store::{Store, Tree};
use portolan::surface::{Mesh, MeshSettings, marching_cubes};
use portolan::sweep::WeightModel;
use portolan_io::MapFile;

use super::Settings;
use crate::arguments::shown_bytes;
use crate::mapping::MapKind;

/// Octree, mesh and distance field, as far as they are wanted and there is something to derive them from.
#[derive(Default)]
pub(crate) struct Derived {
    pub(crate) tree: Option<Tree<LogOdds8, 3>>,
    pub(crate) mesh: Option<Mesh>,
    pub(crate) esdf: Option<Esdf<3>>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// What was not made, and why.
    pub(crate) notes: Vec<String>,
}

impl Derived {
    /// `memory`: what maps and fields may take together (bytes).
    pub(crate) fn of(file: &MapFile<3>, settings: &Settings, memory: usize) -> Self {
        let mut derived = Self::default();
        if let Some(map) = &file.occupancy_bricks {
            let start = Instant::now();
            derived.tree = Tree::from_bricks(&map.store);
            if derived.tree.is_none() {
                derived.notes.push("the octree was not made: the map spans more than 2^28 cells".to_owned());
            }
            derived.seconds.insert("octree", start.elapsed().as_secs_f64());
        }
        let Some(tsdf) = &file.tsdf_bricks else { return derived };
        if settings.wants(MapKind::Mesh) {
            let start = Instant::now();
            let colors = file.color_bricks.as_ref().map(|c| &c.store).filter(|store| !store.is_empty());
            derived.mesh = Some(marching_cubes(&tsdf.store, colors, &mesh_settings(settings.weights)));
            derived.seconds.insert("mesh", start.elapsed().as_secs_f64());
        }
        if settings.wants(MapKind::Esdf) {
            let start = Instant::now();
            let held = tsdf.store.memory_bytes()
                + file.occupancy_bricks.as_ref().map_or(0, |o| o.store.memory_bytes());
            // The field, and as much again while it is made.
            let needed = 2 * tsdf.store.len() * 512 * size_of::<f32>();
            if held.saturating_add(needed) > memory {
                let needed = shown_bytes(needed as f64);
                derived
                    .notes
                    .push(format!("the esdf was not made: it needs {needed} more than --memory leaves"));
                return derived;
            }
            let mut how = esdf_settings(settings.weights, settings.carve_weight, settings.max_distance);
            how.method = settings.esdf.method();
            derived.esdf = Some(Esdf::of(&tsdf.store, &how));
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
    let min_weight = Some(Thresholds::of(weights, 1.0).surface);
    MeshSettings { min_weight, ..MeshSettings::default() }
}

/// A `W_min` of half of what one ordinary observation of free space weighs: what was seen free once is known.
pub(crate) fn esdf_settings(weights: WeightModel, carve_weight: f32, max_distance: f64) -> EsdfSettings {
    let min_weight = Some(Thresholds::of(weights, carve_weight).observed);
    EsdfSettings { min_weight, max_distance, ..EsdfSettings::default() }
}
