//! Builds every representation from one log and measures it.

use super::accuracy::{ErrorSummary, Truth};
use super::crossover::{CloudCrossover, TreeCrossover, cloud_crossover};
use super::fields::{MeasuredField, against_contour, fields_of};
use super::probes::{Clock, points, seconds_of, seconds_per_probe};
use super::row::{Cost, Row, Winner, winners};
use crate::cell::OccupancyModel;
use crate::field::{Esdf2, EsdfSettings};
use crate::geom::{Aabb, Grid, Pose, vector};
use crate::map::{
    Cloud, MapError, MapRepr, OccupancyGrid, Quadtree, SweepKind, Tsdf2, Tsdf2Config, inner_only_node_bytes,
};
use crate::scan::{Scan, ScanStats};
use crate::store::Store;
use crate::surface::{Ambiguity, Contour, ContourSettings, level_set, marching_squares};

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
}

impl Gallery {
    /// The accurate distance field.
    pub fn distance(&self) -> &Esdf2 {
        &self.fields[0].field
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
    let min_weight = settings.esdf.min_weight;
    let mut fields = fields_of(clock, &tsdf, &settings.esdf);
    let (contour_build, contour) = seconds_of(clock, || marching_squares(&tsdf, &settings.contour));

    let everywhere = points(&grid.aabb(), settings.probes);
    let few = &everywhere[..everywhere.len().div_ceil(50)];
    let asker = Asker { truth, free: observed_free(&tsdf, min_weight, truth), everywhere: &everywhere, grid };

    let limit = vector::norm(grid.aabb().extent());
    let mut rows = Vec::new();
    let (grid_surface, grid_contour) =
        seconds_of(clock, || occupancy_contour(&grid, |c| occupancy_value(&occupancy, c)));
    rows.push(Row {
        name: "occupancy grid, 1 B/cell".into(),
        memory_bytes: occupancy.memory_bytes(),
        update: Cost::direct(grid_update),
        occupancy: Cost::direct(asker.time_occupancy(clock, &occupancy)),
        distance: Cost::by(
            seconds_per_probe(clock, few, |p| occupancy.search_distance_by_rings(p, limit).unwrap_or(0.0)),
            "ring search",
        ),
        surface: Cost::by(grid_surface, "marching squares"),
        occupancy_wrong: asker.occupancy_wrong(&occupancy),
        distance_error: asker.distance_error(|p| occupancy.search_distance_by_rings(p, limit)),
        surface_error: asker.surface_error(&grid_contour),
        note: format!("{} cells observed", occupancy.observed_cells()),
        ..Default::default()
    });
    for (name, map, update) in [
        ("quadtree, 9 B/inner node, same cells", &tree, tree_update),
        ("quadtree, 6.25 cm leaves, 16 m root", &chapter_tree, chapter_tree_update),
    ] {
        let own = Grid { lattice: *map.tree().lattice(), shape: map.tree().grid().shape };
        let (surface, extracted) =
            seconds_of(clock, || occupancy_contour(&own, |c| map.tree().cell(c).map(|v| v.0)));
        rows.push(Row {
            name: name.into(),
            memory_bytes: map.memory_bytes(),
            update: Cost::direct(update),
            occupancy: Cost::direct(asker.time_occupancy(clock, map)),
            surface: Cost::by(surface, "marching squares"),
            occupancy_wrong: asker.occupancy_wrong(map),
            surface_error: asker.surface_error(&extracted),
            note: format!("{} nodes, {} of them inner", map.tree().nodes(), map.tree().inner_nodes()),
            ..Default::default()
        });
    }
    let (marched_build, marched_contour) =
        seconds_of(clock, || marching_squares(&marched, &settings.contour));
    let banded_contour = marching_squares(&banded, &settings.contour);
    for (name, map, update, extraction, extracted, note) in [
        (
            "TSDF, f32 D and W",
            &tsdf,
            tsdf_update,
            contour_build,
            &contour,
            format!(
                "{} ms without carving, {} segments there",
                format_ms(banded_update),
                banded_contour.segments.len()
            ),
        ),
        (
            "TSDF, the chapter's march",
            &marched,
            marched_update,
            marched_build,
            &marched_contour,
            format!("{} segments", marched_contour.segments.len()),
        ),
    ] {
        rows.push(Row {
            name: name.into(),
            memory_bytes: map.memory_bytes(),
            update: Cost::direct(update),
            occupancy: Cost::by(asker.time_occupancy(clock, map), "sign of D"),
            surface: Cost::by(extraction, "marching squares"),
            occupancy_wrong: asker.occupancy_wrong(map),
            surface_error: asker.surface_error(extracted),
            note,
            ..Default::default()
        });
    }
    let distance = &fields[0].field;
    let observed = |i: usize| !distance.samples()[i].is_nan();
    let (zero_build, zero) =
        seconds_of(clock, || level_set(&grid, distance.samples(), observed, Ambiguity::Decide));
    let esdf_occupancy = |p| crate::map::DerivedField::occupancy(distance, p);
    rows.push(Row {
        name: "ESDF, f32".into(),
        memory_bytes: crate::map::DerivedField::memory_bytes(distance),
        derived: true,
        update: Cost::by(fields[0].seconds, "full rebuild"),
        occupancy: Cost::by(
            seconds_per_probe(clock, &everywhere, |p| esdf_occupancy(p).unwrap_or(0.0)),
            "sign of d",
        ),
        distance: Cost::direct(seconds_per_probe(clock, &everywhere, |p| {
            distance.distance(p).known().unwrap_or(0.0)
        })),
        surface: Cost::by(zero_build, "marching squares"),
        occupancy_wrong: asker.wrong(esdf_occupancy),
        distance_error: asker.distance_error(|p| distance.distance(p).known()),
        surface_error: asker.surface_error(&zero),
        note: "distances to the contour's segments".into(),
    });
    rows.push(Row {
        name: "extracted contour".into(),
        memory_bytes: crate::map::DerivedField::memory_bytes(&contour),
        derived: true,
        update: Cost::by(contour_build, "marching squares"),
        occupancy: Cost::by(
            seconds_per_probe(clock, few, |p| f64::from(u8::from(contour.is_inside(p) == Some(true)))),
            "crossing count",
        ),
        distance: Cost::by(
            seconds_per_probe(clock, few, |p| contour.nearest_distance(p).unwrap_or(0.0)),
            "brute force",
        ),
        surface: Cost::direct(0.0),
        occupancy_wrong: asker.wrong(|p| contour.is_inside(p).map(|inside| if inside { 1.0 } else { 0.0 })),
        distance_error: asker.distance_error(|p| contour.nearest_distance(p)),
        surface_error: asker.surface_error(&contour),
        note: format!("{} segments, {:.1} m", contour.segments.len(), contour.length()),
    });
    rows.push(Row {
        name: "point cloud, k-d tree".into(),
        memory_bytes: cloud.memory_bytes(),
        update: Cost::direct(cloud_update),
        distance: Cost::direct(seconds_per_probe(clock, few, |p| cloud.nearest_distance(p).unwrap_or(0.0))),
        distance_error: asker.distance_error(|p| cloud.nearest_distance(p)),
        note: format!("{} points, tree built in {} ms", cloud.points().len(), format_ms(cloud_build)),
        ..Default::default()
    });

    let esdf_seconds =
        rows.iter().find(|r| r.name.starts_with("ESDF")).and_then(|r| r.distance).map_or(0.0, |c| c.seconds);
    let cloud_crossover = cloud_crossover(clock, cloud.points(), few, esdf_seconds);
    for measured in &mut fields {
        measured.against_contour = against_contour(&measured.field, &contour, &asker.free);
        measured.against_truth = asker.distance_error(|p| measured.field.distance(p).known());
        let norms = asker.free.iter().filter_map(|&p| measured.field.gradient(p).known().map(vector::norm));
        measured.gradient = median(norms.collect());
    }
    let tsdf_gradient = gradient(&tsdf, &asker.free);
    let (winners, never_win) = winners(&rows);
    let trees = tree_crossovers(settings, &grid, &contour, &tree, &chapter_tree);
    Ok(Gallery {
        rows,
        winners,
        never_win,
        trees,
        cloud_crossover,
        tsdf_gradient,
        fields,
        occupancy,
        tree,
        tsdf,
        contour,
        cloud,
    })
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

fn occupancy_value(map: &OccupancyGrid<2>, cell: [i32; 2]) -> Option<i8> {
    map.store().cell(cell).map(|v| v.0)
}

/// The boundary between free and occupied cells: log odds as a field, occupied negative.
fn occupancy_contour(grid: &Grid<2>, value: impl Fn([i32; 2]) -> Option<i8>) -> Contour {
    let samples: Vec<f32> =
        (0..grid.len()).map(|i| value(grid.cell(i)).map_or(f32::NAN, |v| 0.5 - f32::from(v))).collect();
    level_set(grid, &samples, |i| !samples[i].is_nan(), Ambiguity::Decide)
}

/// Centres of cells that were seen free, more than 5 cm from any surface.
fn observed_free(tsdf: &Tsdf2, min_weight: f32, truth: Option<&dyn Truth<2>>) -> Vec<[f64; 2]> {
    let inside = Aabb::new(tsdf.grid().aabb().min, tsdf.grid().aabb().max).grown(-tsdf.config().resolution);
    let candidates = points(&inside, 16_000).into_iter();
    let free = |p: &[f64; 2]| {
        tsdf.grid()
            .index_of(*p)
            .and_then(|i| tsdf.store().at(i))
            .is_some_and(|c| c.weight >= min_weight && c.distance > 0.0)
    };
    candidates
        .filter(free)
        .filter(|&p| truth.is_none_or(|t| t.signed_distance(p) > 0.05))
        .take(4000)
        .collect()
}

struct Asker<'a> {
    truth: Option<&'a dyn Truth<2>>,
    free: Vec<[f64; 2]>,
    everywhere: &'a [[f64; 2]],
    grid: Grid<2>,
}

impl Asker<'_> {
    fn time_occupancy(&self, clock: &mut Clock<'_>, map: &impl MapRepr<2>) -> f64 {
        seconds_per_probe(clock, self.everywhere, |p| map.occupancy(p).unwrap_or(0.0))
    }

    fn occupancy_wrong(&self, map: &impl MapRepr<2>) -> Option<f64> {
        self.wrong(|p| map.occupancy(p))
    }

    /// Share of wrong answers among those given clearly on one side of a true surface.
    fn wrong(&self, occupancy: impl Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
        let truth = self.truth?;
        let clear = 0.5 * self.grid.lattice.resolution;
        let (mut wrong, mut answered) = (0usize, 0usize);
        for &p in self.everywhere.iter().take(20_000) {
            let d = truth.signed_distance(p);
            if let Some(o) = occupancy(p).filter(|_| d.abs() > clear) {
                answered += 1;
                wrong += usize::from((o > 0.5) != (d < 0.0));
            }
        }
        (answered > 0).then(|| wrong as f64 / answered as f64)
    }

    fn distance_error(&self, distance: impl Fn([f64; 2]) -> Option<f64>) -> Option<ErrorSummary> {
        let truth = self.truth?;
        let errors =
            self.free.iter().filter_map(|&p| Some(distance(p)?.abs() - truth.signed_distance(p).abs()));
        ErrorSummary::of(errors.collect())
    }

    /// Signed so that a surface in front of the true one is positive.
    fn surface_error(&self, contour: &Contour) -> Option<ErrorSummary> {
        let truth = self.truth?;
        ErrorSummary::of(contour.vertices.iter().map(|&v| truth.signed_distance(v)).collect())
    }
}

/// Median gradient norm over probes around which the map was observed.
fn gradient(tsdf: &Tsdf2, probes: &[[f64; 2]]) -> f64 {
    let h = tsdf.config().resolution;
    let value =
        |p: [f64; 2]| tsdf.grid().index_of(p).and_then(|i| tsdf.store().at(i)).map(|c| f64::from(c.distance));
    let slope = |p: [f64; 2], k: usize| {
        let (mut low, mut high) = (p, p);
        low[k] -= h;
        high[k] += h;
        Some((value(high)? - value(low)?) / (2.0 * h))
    };
    median(probes.iter().filter_map(|&p| Some(slope(p, 0)?.hypot(slope(p, 1)?))).collect())
}

/// NaN of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
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
        TreeCrossover::new(
            "chapter's node, 20 B",
            (20.0, coarse),
            plane,
            (20 * chapter_tree.tree().nodes(), dense),
        ),
        TreeCrossover::new("our node, 9 B an inner one", (ours, fine), plane, (tree.memory_bytes(), dense)),
    ]
}

pub(super) fn format_ms(seconds: f64) -> String {
    format!("{:.3}", 1e3 * seconds)
}
