//! Builds every representation from one log and measures it.

use super::accuracy::Truth;
use super::asker::{Asker, gradient, median, observed_free};
use super::costs::{contour_of_grid, contour_of_tree, zero_of};
use super::crossover::{CHAPTER_NODE, CloudCrossover, OUR_NODE, TreeCrossover};
use super::fields::{MeasuredField, against_contour, fields_of};
use super::probes::{Clock, points, seconds_of};
use super::row::{Cost, Row, Winner, Workload};
use crate::cell::OccupancyModel;
use crate::field::{EsdfGrid, EsdfSettings};
use crate::geom::{Grid, Pose, vector};
use crate::map::{
    Cloud, DerivedField, MapError, MapRepr, OccupancyGrid, Quadtree, SweepKind, Tsdf2, Tsdf2Config,
    inner_only_node_bytes,
};
use crate::scan::{Scan, ScanStats};
use crate::store::Store;
use crate::surface::{Contour, ContourSettings, marching_squares};

/// What to build and how hard to ask.
#[derive(Clone, Debug)]
pub struct GallerySettings {
    /// The cells of the dense maps.
    pub grid: Grid<2>,
    /// The TSDF; its grid is replaced by `grid`.
    pub tsdf: Tsdf2Config,
    /// The occupancy filter of grid and trees.
    pub model: OccupancyModel,
    /// Contour extraction.
    pub contour: ContourSettings,
    /// The distance transforms.
    pub esdf: EsdfSettings,
    /// Number of probes for direct answers; searches get a fiftieth.
    pub probes: usize,
    /// Length of all true surfaces, both sides of walls (metres), for the crossover formula; `None`: the
    /// length of the extracted contour.
    pub surface_length: Option<f64>,
}

/// Everything that was built and measured.
#[derive(Debug)]
pub struct Gallery {
    /// One row a representation.
    pub rows: Vec<Row>,
    /// Who is cheapest for each workload.
    pub winners: Vec<Winner>,
    /// Rows that win no workload.
    pub never_win: Vec<usize>,
    /// Trees against the dense array.
    pub trees: Vec<TreeCrossover>,
    /// The cloud against the ESDF.
    pub cloud_crossover: CloudCrossover,
    /// Median gradient norm of the raw TSDF (central differences) over observed free probes.
    pub tsdf_gradient: f64,
    /// Distance fields of the TSDF by every method, the accurate one first: the one of the rows.
    pub fields: [MeasuredField; 3],
    /// The grid, for pictures.
    pub occupancy: OccupancyGrid<2>,
    /// The tree on the grid's own lattice, for pictures.
    pub tree: Quadtree,
    /// The TSDF with carving, for pictures.
    pub tsdf: Tsdf2,
    /// The contour, for pictures.
    pub contour: Contour,
    /// The cloud, for pictures.
    pub cloud: Cloud<2>,
    /// The tree with the chapter's leaves.
    pub(super) chapter_tree: Quadtree,
    /// The TSDF by the chapter's march.
    pub(super) marched: Tsdf2,
    pub(super) contour_settings: ContourSettings,
}

impl Gallery {
    /// The accurate distance field.
    pub fn distance(&self) -> &EsdfGrid<2> {
        &self.fields[0].field
    }

    /// Bytes of everything that was built.
    pub fn memory_bytes(&self) -> usize {
        let others = self.fields[1..].iter().map(|f| DerivedField::memory_bytes(&f.field));
        self.rows.iter().map(|row| row.memory_bytes).sum::<usize>() + others.sum::<usize>()
    }
}

/// Runs the whole comparison. Scans are fused one after the other on the calling thread.
///
/// # Errors
/// Where the settings are not possible.
pub fn run(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
    truth: Option<&dyn Truth<2>>,
    clock: &mut Clock<'_>,
) -> Result<Gallery, MapError> {
    let grid = settings.grid;
    let mut gallery = build(log, settings, clock)?;
    let everywhere = points(&grid.aabb(), settings.probes);
    let min_weight = settings.esdf.min_weight.unwrap_or(gallery.tsdf.thresholds().observed);
    let free = observed_free(&gallery.tsdf, min_weight, truth);
    hold_against_truth(&mut gallery, &Asker { truth, free, everywhere: &everywhere, grid });
    for workload in Workload::ALL {
        gallery.measure(workload, settings.probes, clock);
    }
    Ok(gallery)
}

/// Fuses and derives everything. What updates cost is known then, and all that needs no probes.
fn build(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
    clock: &mut Clock<'_>,
) -> Result<Gallery, MapError> {
    let grid = settings.grid;
    let tsdf_config = settings.tsdf.with_grid(&grid);
    let march = Tsdf2Config { sweep: SweepKind::March, ..tsdf_config };

    let mut occupancy = OccupancyGrid::new(grid, settings.model)?;
    let grid_update = fuse_all(clock, log, |at, scan| occupancy.integrate(at, scan));
    let mut tree = Quadtree::covering(&grid, settings.model)?;
    let tree_update = fuse_all(clock, log, |at, scan| tree.integrate(at, scan));
    let mut chapter_tree = chapter_tree(&grid, settings.model)?;
    let chapter_tree_update = fuse_all(clock, log, |at, scan| chapter_tree.integrate(at, scan));
    let mut tsdf = Tsdf2::new(tsdf_config)?;
    let tsdf_update = fuse_all(clock, log, |at, scan| tsdf.integrate(at, scan, true));
    let mut banded = Tsdf2::new(tsdf_config)?;
    let banded_update = fuse_all(clock, log, |at, scan| banded.integrate(at, scan, false));
    let mut marched = Tsdf2::new(march)?;
    let marched_update = fuse_all(clock, log, |at, scan| marched.integrate(at, scan, true));
    let mut cloud = Cloud::new();
    let cloud_update = fuse_all(clock, log, |at, scan| cloud.integrate(at, scan));
    let (cloud_build, ()) = seconds_of(clock, || cloud.rebuild());
    let fields = fields_of(clock, &tsdf, &settings.esdf);
    let (contour_build, contour) = seconds_of(clock, || marching_squares(&tsdf, &settings.contour));

    let row = |name: &str, memory_bytes: usize, update: Option<Cost>, note: String| Row {
        name: name.into(),
        memory_bytes,
        update,
        note,
        ..Default::default()
    };
    let derived = |row: Row| Row { derived: true, ..row };
    let nodes =
        |map: &Quadtree| format!("{} nodes, {} of them inner", map.tree().nodes(), map.tree().inner_nodes());
    let segments = |map: &Tsdf2| marching_squares(map, &settings.contour).segments.len();
    // What a workload costs comes in this order, too: `costs.rs`.
    let rows = vec![
        row(
            "occupancy grid, 1 B/cell",
            occupancy.memory_bytes(),
            Cost::direct(grid_update),
            format!("{} cells observed", occupancy.observed_cells()),
        ),
        row(
            "quadtree, 9 B/inner node, same cells",
            tree.memory_bytes(),
            Cost::direct(tree_update),
            nodes(&tree),
        ),
        row(
            "quadtree, 6.25 cm leaves, 16 m root",
            chapter_tree.memory_bytes(),
            Cost::direct(chapter_tree_update),
            nodes(&chapter_tree),
        ),
        row(
            "TSDF, f32 D and W",
            tsdf.memory_bytes(),
            Cost::direct(tsdf_update),
            format!("{} ms without carving, {} segments there", format_ms(banded_update), segments(&banded)),
        ),
        row(
            "TSDF, the chapter's march",
            marched.memory_bytes(),
            Cost::direct(marched_update),
            format!("{} segments", segments(&marched)),
        ),
        derived(row(
            "ESDF, f32",
            DerivedField::memory_bytes(&fields[0].field),
            Cost::by(fields[0].seconds, "full rebuild"),
            "distances to the contour's segments".into(),
        )),
        derived(row(
            "extracted contour",
            DerivedField::memory_bytes(&contour),
            Cost::by(contour_build, "marching squares"),
            format!("{} segments, {:.1} m", contour.segments.len(), contour.length()),
        )),
        row(
            "point cloud, k-d tree",
            cloud.memory_bytes(),
            Cost::direct(cloud_update),
            format!("{} points, tree built in {} ms", cloud.points().len(), format_ms(cloud_build)),
        ),
    ];
    Ok(Gallery {
        rows,
        winners: Vec::new(),
        never_win: Vec::new(),
        trees: tree_crossovers(settings, &grid, &contour, &tree, &chapter_tree),
        cloud_crossover: CloudCrossover { measured: Vec::new(), points: None },
        tsdf_gradient: f64::NAN,
        fields,
        occupancy,
        tree,
        tsdf,
        contour,
        cloud,
        chapter_tree,
        marched,
        contour_settings: settings.contour,
    })
}

/// How wrong the answers are, row by row and field by field.
fn hold_against_truth(gallery: &mut Gallery, asker: &Asker<'_>) {
    let limit = vector::norm(asker.grid.aabb().extent());
    let (occupancy, contour, distance) = (&gallery.occupancy, &gallery.contour, &gallery.fields[0].field);
    let inside = |p| contour.is_inside(p).map(|inside| if inside { 1.0 } else { 0.0 });
    let wrong = [
        asker.occupancy_wrong(occupancy),
        asker.occupancy_wrong(&gallery.tree),
        asker.occupancy_wrong(&gallery.chapter_tree),
        asker.occupancy_wrong(&gallery.tsdf),
        asker.occupancy_wrong(&gallery.marched),
        asker.wrong(|p| DerivedField::occupancy(distance, p)),
        asker.wrong(inside),
        None,
    ];
    let distances = [
        asker.distance_error(|p| occupancy.search_distance_by_rings(p, limit)),
        None,
        None,
        None,
        None,
        asker.distance_error(|p| distance.distance(p).known()),
        asker.distance_error(|p| contour.nearest_distance(p)),
        asker.distance_error(|p| gallery.cloud.nearest_distance(p)),
    ];
    let surfaces = [
        asker.surface_error(&contour_of_grid(occupancy)),
        asker.surface_error(&contour_of_tree(&gallery.tree)),
        asker.surface_error(&contour_of_tree(&gallery.chapter_tree)),
        asker.surface_error(contour),
        asker.surface_error(&marching_squares(&gallery.marched, &gallery.contour_settings)),
        asker.surface_error(&zero_of(distance)),
        asker.surface_error(contour),
        None,
    ];
    for (i, row) in gallery.rows.iter_mut().enumerate() {
        (row.occupancy_wrong, row.distance_error, row.surface_error) = (wrong[i], distances[i], surfaces[i]);
    }
    let exact: Vec<Option<f64>> = asker.free.iter().map(|&p| gallery.contour.nearest_distance(p)).collect();
    for measured in &mut gallery.fields {
        measured.against_contour = against_contour(&measured.field, &asker.free, &exact);
        measured.against_truth = asker.distance_error(|p| measured.field.distance(p).known());
        let norms = asker.free.iter().filter_map(|&p| measured.field.gradient(p).known().map(vector::norm));
        measured.gradient = median(norms.collect());
    }
    gallery.tsdf_gradient = gradient(&gallery.tsdf, &asker.free);
}

/// Seconds a scan.
fn fuse_all(
    clock: &mut Clock<'_>,
    log: &[(Pose<2>, Scan<2>)],
    mut fuse: impl FnMut(&Pose<2>, &Scan<2>) -> ScanStats,
) -> f64 {
    let start = clock();
    for (pose, scan) in log {
        fuse(pose, scan);
    }
    (clock() - start) / log.len().max(1) as f64
}

/// The chapter's tree: leaves a 256th of a root of 16 m, or of as many doublings of it as the map needs.
fn chapter_tree(grid: &Grid<2>, model: OccupancyModel) -> Result<Quadtree, MapError> {
    let extent = grid.aabb().extent().into_iter().fold(0.0, f64::max);
    let doublings = (extent / 16.0).log2().ceil().max(0.0) as u32;
    Quadtree::new(grid.lattice.origin, 0.0625, 8 + doublings, model)
}

fn tree_crossovers(
    settings: &GallerySettings,
    grid: &Grid<2>,
    contour: &Contour,
    tree: &Quadtree,
    chapter_tree: &Quadtree,
) -> Vec<TreeCrossover> {
    let [width, height] = grid.aabb().extent();
    let plane = (settings.surface_length.unwrap_or(contour.length()), width * height);
    let dense = grid.len();
    let ours = inner_only_node_bytes::<2>(9.0);
    let (fine, coarse) = (grid.lattice.resolution, chapter_tree.tree().lattice().resolution);
    vec![
        TreeCrossover::new(CHAPTER_NODE, (20.0, coarse), plane, (20 * chapter_tree.tree().nodes(), dense)),
        TreeCrossover::new(OUR_NODE, (ours, fine), plane, (tree.memory_bytes(), dense)),
    ]
}

pub(super) fn format_ms(seconds: f64) -> String {
    format!("{:.3}", 1e3 * seconds)
}
