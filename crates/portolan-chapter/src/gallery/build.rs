//! Fuses one log into every representation and derives the fields.

use super::crossover::{CHAPTER_NODE, CloudCrossover, OUR_NODE, Plane, TreeCrossover};
use super::fields::{MeasuredField, fields_of};
use super::measured::{Gallery, GallerySettings, HitGrid};
use super::probes::{Clock, seconds_of};
use super::row::{Cost, Row};
use crate::memory::inner_only_node_bytes;
use portolan::cell::{AttenuationRule, OccupancyModel};
use portolan::geom::{Grid, Lattice, Pose};
use portolan::map::{Attenuation, BeamSweep, Cloud, MapError, OccupancyGrid, Quadtree, Tsdf2, TsdfConfig};
use portolan::scan::{Scan, ScanStats};
use portolan::store::Store;
use portolan::surface::{Contour, marching_squares};

/// A map, and what fusing one scan into it took (seconds).
struct Fused<M> {
    map: M,
    update: f64,
}

impl<M> Fused<M> {
    fn new(
        clock: &mut Clock<'_>,
        log: &[(Pose<2>, Scan<2>)],
        mut map: M,
        mut fuse: impl FnMut(&mut M, &Pose<2>, &Scan<2>) -> Result<ScanStats, MapError>,
    ) -> Result<Self, MapError> {
        let start = clock();
        for (pose, scan) in log {
            fuse(&mut map, pose, scan)?;
        }
        let update = (clock() - start) / log.len().max(1) as f64;
        Ok(Self { map, update })
    }

    fn row(&self, name: &str, memory_bytes: fn(&M) -> usize, note: String) -> Row {
        row(name, memory_bytes(&self.map), Cost::direct(self.update), note)
    }
}

/// Every map of the log.
struct Maps {
    occupancy: Fused<OccupancyGrid<2>>,
    tree: Fused<Quadtree>,
    chapter_tree: Fused<Quadtree>,
    tsdf: Fused<Tsdf2>,
    /// Without carving.
    banded: Fused<Tsdf2>,
    marched: Fused<Tsdf2>,
    hits: Fused<HitGrid>,
    cloud: Fused<Cloud<2>>,
    /// Seconds that the cloud's tree took.
    cloud_build: f64,
}

impl Maps {
    fn fuse(
        log: &[(Pose<2>, Scan<2>)],
        settings: &GallerySettings,
        clock: &mut Clock<'_>,
    ) -> Result<Self, MapError> {
        let (grid, model) = (settings.grid, settings.model);
        let carving = TsdfConfig { carve: true, ..settings.tsdf };
        let banded = TsdfConfig { carve: false, ..settings.tsdf };
        let march = TsdfConfig { beams: BeamSweep::March, ..carving };
        let in_tree = |map: &mut Quadtree, at: &Pose<2>, scan: &Scan<2>| map.integrate(at, scan);
        let in_tsdf = |map: &mut Tsdf2, at: &Pose<2>, scan: &Scan<2>| map.integrate(at, scan);

        let grid_of_bytes = OccupancyGrid::covering(&grid, model)?;
        let occupancy = Fused::new(clock, log, grid_of_bytes, |map, at, scan| map.integrate(at, scan))?;
        let tree = Fused::new(clock, log, Quadtree::covering(&grid, model)?, in_tree)?;
        let chapter_tree = Fused::new(clock, log, chapter_tree(&grid, model)?, in_tree)?;
        let tsdf = Fused::new(clock, log, Tsdf2::covering(&grid, carving)?, in_tsdf)?;
        let banded = Fused::new(clock, log, Tsdf2::covering(&grid, banded)?, in_tsdf)?;
        let marched = Fused::new(clock, log, Tsdf2::covering(&grid, march)?, in_tsdf)?;
        let hits = Attenuation::covering(&grid, AttenuationRule::NEVER)?;
        let hits = Fused::new(clock, log, hits, |map, at, scan| map.integrate(at, scan))?;
        let mut cloud = Fused::new(clock, log, Cloud::new(), |map, at, scan| Ok(map.integrate(at, scan)))?;
        let (cloud_build, ()) = seconds_of(clock, || cloud.map.rebuild());
        Ok(Self { occupancy, tree, chapter_tree, tsdf, banded, marched, hits, cloud, cloud_build })
    }

    /// The rows of the maps themselves; what a workload costs comes in the same order: `costs.rs`.
    fn rows(&self, segments: impl Fn(&Tsdf2) -> usize) -> Vec<Row> {
        let tree = |name, fused: &Fused<Quadtree>| {
            let store = fused.map.store();
            let note = format!("{} nodes, {} of them inner", store.nodes(), store.inner_nodes());
            fused.row(name, Quadtree::memory_bytes, note)
        };
        let observed = format!("{} cells observed", self.occupancy.map.observed_cells());
        let banded = format!(
            "{} ms without carving, {} segments there",
            format_ms(self.banded.update),
            segments(&self.banded.map)
        );
        let marched = format!("{} segments", segments(&self.marched.map));
        let passed = format!("{} cells that beams ended in or passed", self.hits.map.observed_cells());
        let points = self.cloud.map.points().len();
        let built = format!("{points} points, tree built in {} ms", format_ms(self.cloud_build));
        vec![
            self.occupancy.row("occupancy grid, 1 B/cell", OccupancyGrid::memory_bytes, observed),
            tree("quadtree, 9 B/inner node, same cells", &self.tree),
            tree("quadtree, 6.25 cm leaves, 16 m root", &self.chapter_tree),
            self.tsdf.row("TSDF, f32 D and W", Tsdf2::memory_bytes, banded),
            self.marched.row("TSDF, the chapter's march", Tsdf2::memory_bytes, marched),
            self.hits.row("hits per meter, counts and lengths", HitGrid::memory_bytes, passed),
            self.cloud.row("point cloud, k-d tree", Cloud::memory_bytes, built),
        ]
    }
}

/// Fuses and derives everything. What updates cost is known then, and all that needs no probes.
pub(super) fn build(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
    clock: &mut Clock<'_>,
) -> Result<Gallery, MapError> {
    let maps = Maps::fuse(log, settings, clock)?;
    let fields = fields_of(clock, &maps.tsdf.map, &settings.esdf);
    let (contour_build, contour) = seconds_of(clock, || marching_squares(&maps.tsdf.map, &settings.contour));

    let mut rows = maps.rows(|map| marching_squares(map, &settings.contour).segments.len());
    let cloud = rows.len() - 1;
    rows.splice(cloud..cloud, derived_rows(&fields, &contour, contour_build));
    Ok(Gallery {
        rows,
        winners: Vec::new(),
        never_win: Vec::new(),
        trees: tree_crossovers(settings, &contour, &maps),
        cloud_crossover: CloudCrossover { measured: Vec::new(), points: None },
        tsdf_gradient: f64::NAN,
        fields,
        occupancy: maps.occupancy.map,
        tree: maps.tree.map,
        tsdf: maps.tsdf.map,
        contour,
        hits: maps.hits.map,
        cloud: maps.cloud.map,
        chapter_tree: maps.chapter_tree.map,
        marched: maps.marched.map,
        contour_settings: settings.contour,
        turned: None,
    })
}

/// The rows of what is derived from the TSDF.
fn derived_rows(fields: &[MeasuredField; 3], contour: &Contour, contour_build: f64) -> [Row; 2] {
    let accurate = &fields[0];
    let esdf = row(
        "ESDF, f32",
        accurate.field.memory_bytes(),
        Cost::by(accurate.seconds, "full rebuild"),
        "distances to the contour's segments".into(),
    );
    let lines = row(
        "extracted contour",
        contour.memory_bytes(),
        Cost::by(contour_build, "marching squares"),
        format!("{} segments, {:.1} m", contour.segments.len(), contour.length()),
    );
    [esdf, lines].map(|row| Row { derived: true, ..row })
}

fn row(name: &str, memory_bytes: usize, update: Option<Cost>, note: String) -> Row {
    Row { name: name.into(), memory_bytes, update, note, ..Default::default() }
}

/// The chapter's tree: leaves a 256th of a root of 16 m, or of as many doublings of it as the map needs.
pub(super) fn chapter_tree(grid: &Grid<2>, model: OccupancyModel) -> Result<Quadtree, MapError> {
    let extent = grid.aabb().extent().into_iter().fold(0.0, f64::max);
    let doublings = (extent / 16.0).log2().ceil().max(0.0) as u32;
    Quadtree::with_depth(Lattice::new(grid.lattice.origin, 0.0625), 8 + doublings, model)
}

fn tree_crossovers(settings: &GallerySettings, contour: &Contour, maps: &Maps) -> Vec<TreeCrossover> {
    let (grid, tree, chapter_tree) = (&settings.grid, &maps.tree.map, &maps.chapter_tree.map);
    let [width, height] = grid.aabb().extent();
    let surface = settings.surface_length.unwrap_or(contour.length());
    let plane = Plane { surface, area: width * height, dense_cells: grid.len() };
    let ours = inner_only_node_bytes::<2>(9.0);
    let (fine, coarse) = (grid.lattice.resolution, chapter_tree.store().lattice().resolution);
    vec![
        plane.against(CHAPTER_NODE, 20.0, coarse, 20 * chapter_tree.store().nodes()),
        plane.against(OUR_NODE, ours, fine, tree.memory_bytes()),
    ]
}

pub(super) fn format_ms(seconds: f64) -> String {
    format!("{:.3}", 1e3 * seconds)
}
