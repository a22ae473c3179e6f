//! Distance fields of saved maps.

use anyhow::{Context, ensure};
use portolan::Answer;
use portolan::cell::{DistancePlanes, LogOdds8};
use portolan::field::{
    Clearance, ClearanceField, Esdf, EsdfGrid, EsdfMethod, EsdfSettings, ObstacleCells, UnknownSpace,
};
use portolan::geom::{Grid, Lattice, vector};
use portolan::map::{Tsdf2, TsdfConfig};
use portolan::store::{Bricks, Dense, Store};
use portolan_io::{MapCell, MapFile, OccupancyBricks, TsdfBricks};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::error::bad_call;
use crate::mapping::Settings;

/// What distances are measured to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EsdfArg {
    /// Distances to the extracted surface
    #[default]
    Accurate,
    /// The textbook's: from cells near the surface, which keep their own estimates
    Seeded,
    /// Distances to the nearest cell of the other sign
    Mask,
}

impl EsdfArg {
    /// As the library has it.
    pub(crate) fn method(self) -> EsdfMethod {
        match self {
            Self::Accurate => EsdfMethod::Accurate,
            Self::Seeded => EsdfMethod::TEXTBOOK,
            Self::Mask => EsdfMethod::Mask,
        }
    }
}

/// How the distance field of a saved map is made.
#[derive(Clone, Copy)]
pub(crate) struct FieldHow {
    pub(crate) method: EsdfArg,
    /// Whether distances to unknown cells are wanted.
    pub(crate) unknown: bool,
    /// Share of beams that makes a cell an obstacle without a surface; 0: only surfaces are.
    pub(crate) thin: f64,
    /// Of 3-D fields (meters).
    pub(crate) max_distance: f64,
}

impl FieldHow {
    /// As a map with these settings makes it.
    pub(crate) fn of(settings: &Settings) -> Self {
        let max_distance = settings.max_distance;
        Self { method: settings.esdf, unknown: false, thin: settings.thin, max_distance }
    }

    fn settings(&self) -> EsdfSettings {
        EsdfSettings {
            max_distance: self.max_distance,
            method: self.method.method(),
            unknown: self.unknown,
            ..EsdfSettings::default()
        }
    }
}

/// A distance field of a map.
pub(crate) struct Field<const D: usize> {
    pub(crate) esdf: Esdf<D>,
    /// Cells that log odds alone, counts alone, and both call occupied ([`ObstacleCells::agreement`]); `None` where one of the
    /// two is not asked.
    pub(crate) agreement: Option<[usize; 3]>,
}

/// Whether some map of a file beside its signed distances says what stops beams.
pub(crate) fn keeps_thin<const D: usize>(file: &MapFile<D>) -> bool {
    let occupancy = file.grid.is_some() || file.tree.is_some() || file.occupancy_bricks.is_some();
    occupancy || file.attenuation.is_some()
}

/// What is to be said of the distances of a map without such maps.
pub(crate) const SURFACE_ALONE: &str = "distances are those to surfaces alone, which lose what is thinner than a cell or two: the map \
     holds neither occupancy nor attenuation, which keep it";

/// Refuses a share for thin obstacles where the method has none.
pub(crate) fn check_thin(given: bool, method: EsdfArg) -> anyhow::Result<()> {
    if given && method != EsdfArg::Accurate {
        return Err(bad_call(
            "--thin is only for --esdf accurate: the other methods measure to their own cells",
        ));
    }
    Ok(())
}

/// The field of a 2-D map, as far as the method reaches (509 cells where it is accurate), around the surface and what the
/// other maps of the file say stops beams.
///
/// # Errors
/// Where the maps of the file do not fit each other.
pub(crate) fn esdf_2d(file: &MapFile<2>, tsdf: &Tsdf2, how: &FieldHow) -> anyhow::Result<Field<2>> {
    let grid = tsdf.grid();
    let max_distance = vector::norm(grid.aabb().extent()).max(grid.lattice.resolution);
    let settings = EsdfSettings { max_distance, ..how.settings() };
    let (cells, both) = obstacle_cells_2d(file, tsdf, how.thin)?;
    let esdf = Esdf::with_obstacles(tsdf, &cells, &settings);
    Ok(Field { esdf, agreement: both.then(|| cells.agreement()) })
}

/// The field of a 3-D map, likewise, up to a largest distance.
pub(crate) fn esdf_3d(file: &MapFile<3>, tsdf: &TsdfBricks<3>, how: &FieldHow) -> anyhow::Result<Field<3>> {
    let mut cells = ObstacleCells::default();
    if let Some(map) = file.occupancy_bricks.as_ref().filter(|_| how.thin > 0.0) {
        ensure!(map.store.lattice() == tsdf.store.lattice(), LATTICES);
        cells.follow_occupancy(&map.store);
    }
    follow_attenuation(&mut cells, file, tsdf.store.lattice(), how.thin)?;
    let both = how.thin > 0.0 && file.occupancy_bricks.is_some() && file.attenuation.is_some();
    let esdf = Esdf::with_obstacles(tsdf, &cells, &how.settings());
    Ok(Field { esdf, agreement: both.then(|| cells.agreement()) })
}

/// The field of a 3-D map of points without rays: distances to the centers of the cells that hold them, in at most `memory`
/// bytes of cells. Nothing is known to be free: [`PointsAlone`] says so.
///
/// # Errors
/// Where it needs more memory.
pub(crate) fn esdf_of_points(
    map: &OccupancyBricks<3>,
    how: &FieldHow,
    memory: usize,
) -> anyhow::Result<Esdf<3>> {
    let cells = ObstacleCells::of_occupancy(&map.store);
    Esdf::of_obstacles(*map.store.lattice(), &cells, &how.settings(), memory)
        .context("it needs more memory than there is: give a smaller --max-distance")
}

/// Whether a map is one of points without rays.
pub(crate) fn is_of_points(saved: &Map<String, Value>) -> bool {
    Settings::of_saved(saved).shape.points_only
}

/// Distances to points in a world of which nothing is known to be free.
pub(crate) struct PointsAlone<'a, const D: usize>(pub(crate) &'a Esdf<D>);

impl<const D: usize> ClearanceField<D> for PointsAlone<'_, D> {
    fn clearance(&self, p_world: [f64; D], unknown: UnknownSpace) -> Answer<Clearance> {
        match unknown {
            UnknownSpace::Optimistic => self.0.clearance(p_world, unknown),
            UnknownSpace::Pessimistic => Answer::Unknown,
        }
    }

    fn distance_and_gradient(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])> {
        self.0.distance_and_gradient(p_world)
    }

    fn resolution(&self) -> f64 {
        self.0.lattice().resolution
    }
}

const LATTICES: &str = "the maps of the file have not the same cells";

/// With whether both kinds of map were asked.
fn obstacle_cells_2d(file: &MapFile<2>, tsdf: &Tsdf2, thin: f64) -> anyhow::Result<(ObstacleCells<2>, bool)> {
    let mut cells = ObstacleCells::default();
    if thin == 0.0 {
        return Ok((cells, false));
    }
    let lattice = *tsdf.lattice();
    let on_lattice = |dense: &Dense<LogOdds8, 2>| Bricks::of_dense(dense, lattice).context(LATTICES);
    let occupancy = match (&file.grid, &file.tree) {
        (Some(map), _) => Some(on_lattice(map.store())?),
        (None, Some(map)) => {
            let own = map.store().to_bricks(*map.store().lattice(), usize::MAX)?;
            Some(on_lattice(&Dense::of_bricks(&own, *tsdf.grid()).context(LATTICES)?)?)
        }
        (None, None) => None,
    };
    occupancy.iter().for_each(|map| cells.follow_occupancy(map));
    follow_attenuation(&mut cells, file, &lattice, thin)?;
    Ok((cells, occupancy.is_some() && file.attenuation.is_some()))
}

fn follow_attenuation<const D: usize>(
    cells: &mut ObstacleCells<D>,
    file: &MapFile<D>,
    lattice: &Lattice<D>,
    thin: f64,
) -> anyhow::Result<()> {
    if let Some(map) = file.attenuation.as_ref().filter(|_| thin > 0.0) {
        ensure!(map.store.lattice() == lattice, LATTICES);
        cells.follow_attenuation(&map.store, thin);
    }
    Ok(())
}

/// A 2-D field around the surface alone, where nothing else is known.
pub(crate) fn esdf_of_surface(tsdf: &Tsdf2) -> anyhow::Result<EsdfGrid<2>> {
    let how = FieldHow { thin: 0.0, ..FieldHow::of(&Settings::default()) };
    Ok(esdf_2d(&MapFile::default(), tsdf, &how)?.esdf.dense(tsdf.grid()))
}

/// The status plane of a file, where it holds more than NaN does.
pub(crate) fn status_plane<const D: usize>(dense: &EsdfGrid<D>) -> Option<Vec<u8>> {
    dense.is_saturated().then(|| dense.status_bytes())
}

/// A 2-D field of distances to occupied and free cells.
pub(crate) fn esdf_of_cells(grid: Grid<2>, cells: &[MapCell]) -> EsdfGrid<2> {
    EsdfGrid::from_mask(grid, |i| match cells[i] {
        MapCell::Occupied => Some(true),
        MapCell::Free => Some(false),
        MapCell::Unknown => None,
    })
}

/// Samples of a 2-D field as signed distances of weight 1, or 0 where they are NaN.
pub(crate) fn tsdf_of_samples(grid: Grid<2>, samples: &[f32]) -> anyhow::Result<Tsdf2> {
    let known = |d: &f32| if d.is_nan() { (0.0, 0.0) } else { (*d, 1.0) };
    let (distances, weights) = samples.iter().map(known).unzip();
    let planes = DistancePlanes::from_parts(distances, weights);
    let store = planes.and_then(|planes| Dense::from_planes(grid, planes));
    let store = store.context("the distance field has values that are not finite")?;
    Ok(Tsdf2::from_stores(store, None, TsdfConfig::default())?)
}
