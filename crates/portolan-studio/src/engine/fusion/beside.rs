//! What the default recipe fuses beside signed distances, and what distances take from it: where something stops beams.
//!
//! Made when it is asked for, by views that show distances and by files that hold them: a scan that is only looked at in the
//! view of fusion costs nothing more.

use portolan::cell::{AttenuationRule, TsdfRule};
use portolan::field::ObstacleCells;
use portolan::geom::Grid;
use portolan::map::{Occupancy, OccupancyGrid, TsdfConfig};
use portolan::mapper::{Mapper, MapperMaps, MapperSettings};
use portolan::store::Dense;
use portolan_io::{AttenuationBricks, MapFile};

use super::scans::Scans;
use crate::engine::Refusal;

/// Occupancy and hits per meter of the first scans.
#[derive(Clone)]
pub(in crate::engine) struct Beside {
    mapper: Mapper<2>,
    grid: Grid<2>,
    at: usize,
}

impl Beside {
    /// Maps of nothing, over the cells of a map of distances, which forget as it does.
    pub(super) fn new(grid: &Grid<2>, config: &TsdfConfig<2>) -> Result<Self, Refusal> {
        // A box that ends at a face of cells touches the next ones, too.
        let mut bounds = grid.aabb();
        bounds.max = bounds.max.map(|v| v - 1e-6 * grid.lattice.resolution);
        let filter = TsdfRule { truncation: config.truncation as f32, w_max: config.w_max };
        let mut mapper = Mapper::with(MapperSettings {
            origin: Some(grid.lattice.origin),
            truncation: Some(config.truncation),
            w_max: config.w_max,
            attenuation: Some(AttenuationRule::of_half_life(filter.half_life(1.0))),
            distances: false,
            bounds: Some(bounds),
            ..MapperSettings::new(config.resolution)
        });
        mapper.prepare(grid.lattice.origin).map_err(Refusal::new)?;
        Ok(Self { mapper, grid: *grid, at: 0 })
    }

    /// Fuses on until `to` scans are fused.
    pub(super) fn drive_to(&mut self, scans: &mut Scans, to: usize) -> Result<(), Refusal> {
        while self.at < to {
            let (pose, scan) = scans.scan(self.at);
            self.mapper.integrate(pose, scan).map_err(Refusal::new)?;
            self.at += 1;
        }
        Ok(())
    }

    /// Where something stops beams.
    pub(in crate::engine) fn cells(&mut self) -> &ObstacleCells<2> {
        self.mapper.obstacle_cells()
    }

    /// The chance of being occupied at a point, as `query` prints it; `None`: never observed or outside.
    pub(in crate::engine) fn occupancy(&self, p: [f64; 2]) -> Option<f64> {
        self.mapper.occupancy()?.probability(p).known()
    }

    /// Puts both maps into a file, as `map` does.
    pub(in crate::engine) fn store(&self, file: &mut MapFile<2>) -> Result<(), Refusal> {
        // Bricks are shared.
        let MapperMaps { occupancy, attenuation, .. } = self.mapper.clone().into_maps();
        if let Some(map) = occupancy {
            file.grid = Some(self.dense(map)?);
        }
        file.attenuation = attenuation.map(|map| {
            let rule = *map.rule();
            AttenuationBricks { store: map.into_store(), rule, more: Default::default() }
        });
        Ok(())
    }

    fn dense(&self, map: Occupancy<2>) -> Result<OccupancyGrid<2>, Refusal> {
        let cells = Dense::of_bricks(map.store(), self.grid);
        let cells =
            cells.ok_or_else(|| Refusal::new("the occupancy does not lie on the cells of the map"))?;
        OccupancyGrid::from_store(cells, *map.model()).map_err(Refusal::new)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.mapper.memory_bytes()
    }
}
