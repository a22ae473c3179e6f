//! The maps of space that frames are fused into, and how they lie in a file.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::bail;
use portolan::geom::{Aabb, Pose};
use portolan::map::{MapError, Occupancy, Tsdf3};
use portolan::scan::{Frame, ScanStats};
use portolan::store::Store;
use portolan_io::{ColorBricks, MapFile, OccupancyBricks, TsdfBricks};
use serde_json::Map;

use super::{Fusion, Settings};
use crate::mapping::MapKind;

/// The maps that frames are fused into.
#[derive(Default)]
pub(crate) struct SpaceMaps {
    pub(crate) occupancy: Option<Occupancy>,
    pub(crate) tsdf: Option<Tsdf3>,
}

impl SpaceMaps {
    /// Bytes of each map, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let occupancy = self.occupancy.iter().map(|m| ("tree", m.memory_bytes()));
        occupancy.chain(self.tsdf.iter().map(|m| ("tsdf", m.memory_bytes()))).collect()
    }

    /// Bytes of all maps.
    pub(crate) fn total(&self) -> usize {
        self.bytes().values().sum()
    }

    /// Nothing outside of this box is fused from now on.
    pub(crate) fn set_bounds(&mut self, bounds: Option<Aabb<3>>) {
        if let Some(map) = &mut self.occupancy {
            map.set_bounds(bounds);
        }
        if let Some(map) = &mut self.tsdf {
            map.set_bounds(bounds);
        }
    }

    /// One frame into every map; together they may take `memory` bytes.
    pub(super) fn integrate(
        &mut self,
        pose: &Pose<3>,
        frame: &Frame,
        memory: usize,
        report: &mut Fusion,
    ) -> Result<ScanStats, MapError> {
        let mut stats = ScanStats::default();
        let start = Instant::now();
        if self.occupancy.is_some() {
            let others = self.tsdf.as_ref().map_or(0, Tsdf3::memory_bytes);
            if let Some(map) = &mut self.occupancy {
                map.set_limit(memory.saturating_sub(others));
                stats = map.integrate(pose, frame)?;
                report.add("tree", start, &stats);
            }
        }
        let start = Instant::now();
        if self.tsdf.is_some() {
            let others = self.occupancy.as_ref().map_or(0, Occupancy::memory_bytes);
            if let Some(map) = &mut self.tsdf {
                map.set_limit(memory.saturating_sub(others));
                stats = map.integrate(pose, frame)?;
                report.add("tsdf", start, &stats);
            }
        }
        Ok(stats)
    }

    /// The maps of a file, to go on with; they are taken out of it.
    pub(crate) fn take_from(file: &mut MapFile<3>, settings: &Settings, name: &str) -> anyhow::Result<Self> {
        let missing = match (&file.occupancy_bricks, &file.tsdf_bricks) {
            (None, _) if settings.wants(MapKind::Tree) => Some("tree"),
            (_, None) if settings.wants(MapKind::Tsdf) => Some("tsdf"),
            _ => None,
        };
        if let Some(missing) = missing {
            bail!(
                "{name}: the {missing} is missing in the map; leave it out of --maps, or write to another folder"
            );
        }
        let occupancy = file
            .occupancy_bricks
            .take()
            .map(|o| Occupancy::from_store(o.store, o.model, settings.sweep));
        let tsdf = file.tsdf_bricks.take().map(|t| {
            let config = settings.tsdf_config(t.store.lattice().origin);
            Tsdf3::from_stores(t.store, file.color_bricks.take().map(|c| c.store), config)
        });
        Ok(Self { occupancy: occupancy.transpose()?, tsdf: tsdf.transpose()? })
    }

    /// Puts the maps into a file.
    pub(crate) fn store_into(self, file: &mut MapFile<3>) {
        file.occupancy_bricks = self.occupancy.map(|map| {
            let model = *map.model();
            OccupancyBricks { store: map.into_store(), model, more: Map::new() }
        });
        if let Some(map) = self.tsdf {
            let config = *map.config();
            let (store, colors) = map.into_stores();
            file.color_bricks =
                colors.map(|store| ColorBricks { store, w_max: config.color_w_max, more: Map::new() });
            file.tsdf_bricks = Some(TsdfBricks {
                store,
                truncation: config.truncation,
                w_max: config.w_max,
                carve_weight: config.carve_weight,
                weights: config.weights,
                more: Map::new(),
            });
        }
    }
}
