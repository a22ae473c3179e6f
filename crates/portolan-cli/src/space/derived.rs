//! What is made of the maps of space when all frames are fused.

use std::collections::BTreeMap;
use std::time::Instant;

use portolan::cell::LogOdds8;
use portolan::store::{Store, Tree};

use super::{Settings, SpaceMaps};
use crate::mapping::MapKind;

/// Octree, mesh and distance field, as far as they are wanted and there is something to derive them from.
#[derive(Default)]
pub(crate) struct Derived {
    pub(crate) tree: Option<Tree<LogOdds8, 3>>,
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
        Ok(derived)
    }

    /// Bytes of each derived field, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let tree = self.tree.iter().map(|t| ("octree", t.memory_bytes()));
        tree.collect()
    }
}
