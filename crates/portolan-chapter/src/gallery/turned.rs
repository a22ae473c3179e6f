//! How true the answers are where the walls do not lie on borders of cells.
//!
//! The Apartment's measures are multiples of a cell, and how its faces fall on the lattice decides some errors. So the same
//! scans are mapped again in worlds that are turned and shifted against the lattice, and what is said of accuracy is the
//! median over those.

use super::against_truth::hold_against_truth;
use super::asker::{Asker, candidates, observed_free};
use super::build::build;
use super::measured::{Gallery, GallerySettings};
use super::probes::points;
use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::MapError;
use portolan::scan::Scan;
use portolan_sim::{ErrorSummary, Truth};
use serde::Serialize;

/// A pose of the world against the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Turn {
    /// Turned by this angle (degrees, to the left).
    pub degrees: f64,
    /// Then shifted by these parts of a cell.
    pub shift: [f64; 2],
}

impl Turn {
    /// The angles that are taken where none are given (degrees).
    pub const USUAL: [f64; 5] = [0.0, 10.0, 17.0, 30.0, 45.0];

    /// One pose for each angle; the shifts cover the cell evenly (additive recurrence of Roberts 2018) and are never zero.
    pub fn all(degrees: &[f64]) -> Vec<Self> {
        let part = |i: usize, step: f64| ((i + 1) as f64 * step).fract();
        let turn = |(i, &degrees): (usize, &f64)| Self {
            degrees,
            shift: [part(i, 0.754_877_666), part(i, 0.569_840_291)],
        };
        degrees.iter().enumerate().map(turn).collect()
    }

    /// From the world as it is drawn into the turned one, with cells of this edge (meters).
    pub fn pose(&self, resolution: f64) -> Pose<2> {
        let [x, y] = self.shift.map(|s| s * resolution);
        Pose::new(x, y, self.degrees.to_radians())
    }

    /// The same lap in the turned world.
    pub fn of_log(&self, log: &[(Pose<2>, Scan<2>)], resolution: f64) -> Vec<(Pose<2>, Scan<2>)> {
        let turned = self.pose(resolution);
        log.iter().map(|(pose, scan)| (turned * *pose, scan.clone())).collect()
    }
}

/// A world behind a pose.
pub struct TurnedTruth<'a> {
    truth: &'a (dyn Truth<2> + Sync),
    drawn_from_turned: Pose<2>,
}

impl<'a> TurnedTruth<'a> {
    /// The world as this pose has it.
    pub fn new(truth: &'a (dyn Truth<2> + Sync), turned_from_drawn: &Pose<2>) -> Self {
        Self { truth, drawn_from_turned: turned_from_drawn.inverse() }
    }
}

impl Truth<2> for TurnedTruth<'_> {
    fn signed_distance(&self, p_world: [f64; 2]) -> f64 {
        self.truth.signed_distance(self.drawn_from_turned.transform_point(p_world))
    }
}

/// What the answers of one row are worth; the fields are those of [`Row`](super::Row).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RowAccuracy {
    /// Share of wrong answers to "is this point occupied?".
    pub occupancy_wrong: Option<f64>,
    /// Error of distances (meters).
    pub distance_error: Option<ErrorSummary>,
    /// Distance of the surface from the true one (meters).
    pub surface_error: Option<ErrorSummary>,
}

/// What one distance field is worth; the fields are those of [`MeasuredField`](super::MeasuredField).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FieldAccuracy {
    /// Against the extracted contour (meters).
    pub against_contour: Option<ErrorSummary>,
    /// Against the true world (meters).
    pub against_truth: Option<ErrorSummary>,
    /// Median gradient norm.
    pub gradient: f64,
}

/// Everything that is said of accuracy, in one world or as the median over several.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Accuracy {
    /// In the order of [`Gallery::rows`].
    pub rows: Vec<RowAccuracy>,
    /// In the order of [`Gallery::fields`].
    pub fields: [FieldAccuracy; 3],
    /// Median gradient norm of the raw TSDF.
    pub tsdf_gradient: f64,
}

/// The medians over worlds that are turned and shifted against the lattice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Turned {
    /// The worlds.
    pub turns: Vec<Turn>,
    /// Each number is the median over them: of medians the median, of worst errors the median.
    #[serde(flatten)]
    pub accuracy: Accuracy,
}

impl Accuracy {
    /// Of a gallery as it stands.
    pub fn of(gallery: &Gallery) -> Self {
        let row = |r: &super::Row| RowAccuracy {
            occupancy_wrong: r.occupancy_wrong,
            distance_error: r.distance_error,
            surface_error: r.surface_error,
        };
        let field = |k: usize| {
            let f = &gallery.fields[k];
            FieldAccuracy {
                against_contour: f.against_contour,
                against_truth: f.against_truth,
                gradient: f.gradient,
            }
        };
        Self {
            rows: gallery.rows.iter().map(row).collect(),
            fields: std::array::from_fn(field),
            tsdf_gradient: gallery.tsdf_gradient,
        }
    }

    fn median_of(worlds: &[Self]) -> Self {
        let number = |of: &dyn Fn(&Self) -> Option<f64>| median(worlds.iter().filter_map(of).collect());
        let error = |of: &dyn Fn(&Self) -> Option<ErrorSummary>| {
            ErrorSummary::median_of(&worlds.iter().filter_map(of).collect::<Vec<_>>())
        };
        let rows = (0..worlds.first().map_or(0, |w| w.rows.len())).map(|i| RowAccuracy {
            occupancy_wrong: number(&|w| w.rows[i].occupancy_wrong),
            distance_error: error(&|w| w.rows[i].distance_error),
            surface_error: error(&|w| w.rows[i].surface_error),
        });
        let field = |k: usize| FieldAccuracy {
            against_contour: error(&|w| w.fields[k].against_contour),
            against_truth: error(&|w| w.fields[k].against_truth),
            gradient: number(&|w| Some(w.fields[k].gradient)).unwrap_or(f64::NAN),
        };
        Self {
            rows: rows.collect(),
            fields: std::array::from_fn(field),
            tsdf_gradient: number(&|w| Some(w.tsdf_gradient)).unwrap_or(f64::NAN),
        }
    }
}

/// The lower one of two in the middle: a number that was measured. `None` of nothing.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied()
}

/// Maps the log in each of the turned worlds, a thread for each, and holds the answers against the truth there. Nothing is
/// timed. Costs about as much as a gallery for every world.
///
/// # Errors
/// Where the settings are not possible.
pub fn turned(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
    truth: &(dyn Truth<2> + Sync),
    turns: &[Turn],
) -> Result<Turned, MapError> {
    let worlds: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> =
            turns.iter().map(|turn| scope.spawn(|| in_world(log, settings, truth, turn))).collect();
        let joined = threads.into_iter().map(|t| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p)));
        joined.collect::<Result<_, MapError>>()
    })?;
    Ok(Turned { turns: turns.to_vec(), accuracy: Accuracy::median_of(&worlds) })
}

/// The accuracy in one world.
fn in_world(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
    truth: &(dyn Truth<2> + Sync),
    turn: &Turn,
) -> Result<Accuracy, MapError> {
    let (drawn, resolution) = (settings.grid.aabb(), settings.grid.lattice.resolution);
    let pose = turn.pose(resolution);
    let mut turned = Aabb::EMPTY;
    for corner in [drawn.min, drawn.max, [drawn.min[0], drawn.max[1]], [drawn.max[0], drawn.min[1]]] {
        turned.include(pose.transform_point(corner));
    }
    let candidates = candidates(&settings.grid);
    let grid = Grid::covering(turned, resolution).ok_or(MapError::Resolution(resolution))?;
    let settings = GallerySettings { grid, ..settings.clone() };
    let truth = TurnedTruth::new(truth, &pose);
    let mut gallery = build(&turn.of_log(log, resolution), &settings, &mut || 0.0)?;
    // The same questions as in the world as it is drawn.
    let asked =
        |points: Vec<[f64; 2]>| points.into_iter().map(|p| pose.transform_point(p)).collect::<Vec<_>>();
    let (everywhere, candidates) = (asked(points(&drawn, settings.probes)), asked(candidates));
    let min_weight = settings.esdf.min_weight.unwrap_or(gallery.tsdf.min_weight());
    let free = observed_free(&gallery.tsdf, candidates, min_weight, Some(&truth));
    hold_against_truth(&mut gallery, &Asker { truth: Some(&truth), free, everywhere: &everywhere, grid });
    Ok(Accuracy::of(&gallery))
}
