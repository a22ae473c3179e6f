//! The lap's poses: true, as the wheels have them, and as the pose graph corrects them.

use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::{MapError, Tsdf2, TsdfConfig};
use portolan::scan::Scan;
use portolan::surface::{ContourSettings, marching_squares};
use portolan_graph::GraphError;
use portolan_sim::ErrorSummary;
use portolan_sim::{Lap, LapConfig, Truth, World, lap, measure_motions};
use serde_json::{Value, json};

use crate::gallery::{Turn, TurnedTruth};
use crate::poses::{CorrectedLap, CorrectionSettings, PoseErrors, correct};

/// Which poses the maps are made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseSet {
    /// Those of the simulator.
    True,
    /// Those that the wheels lead to.
    Odometry,
    /// Those of the pose graph.
    Optimised,
}

impl PoseSet {
    /// All three, in the order of tables.
    pub const ALL: [Self; 3] = [Self::True, Self::Odometry, Self::Optimised];

    /// A name for files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::True => "true",
            Self::Odometry => "odometry",
            Self::Optimised => "optimised",
        }
    }

    /// What a picture calls them.
    pub fn poses(self) -> &'static str {
        match self {
            Self::True => "true poses",
            Self::Odometry => "odometry's poses",
            Self::Optimised => "optimised poses",
        }
    }
}

/// A map that drifts has room for so much on each side of the world (meters).
const ROOM: f64 = 1.5;

/// One lap, driven and corrected.
pub struct Drift {
    /// The true poses.
    pub truth: Vec<Pose<2>>,
    /// The lap by odometry and after the pose graph.
    pub lap: CorrectedLap,
    /// The poses that the maps are made with.
    pub chosen: PoseSet,
    /// Error of the odometry's poses.
    pub before: PoseErrors,
    /// Error of the optimized poses.
    pub after: PoseErrors,
    /// Distance of the contour from the true walls, for each of [`PoseSet::ALL`]: the median over the turned worlds; `None`
    /// without a contour.
    pub contours: [Option<ErrorSummary>; 3],
    /// The same in the world as it is drawn.
    pub contours_as_drawn: [Option<ErrorSummary>; 3],
}

impl Drift {
    /// Drives a lap, and corrects what the wheels measured of it. Also the scans, at the poses that were chosen.
    ///
    /// # Errors
    /// Where the pose graph cannot be solved.
    pub fn drive(world: &World, config: &LapConfig, chosen: PoseSet) -> Result<(Self, Lap), GraphError> {
        let (truth, scans): (Vec<_>, Vec<_>) = lap(world, config).into_iter().unzip();
        let settings = CorrectionSettings::default();
        let motions = measure_motions(&truth, &settings.odometry, config.seed);
        let start = truth.first().copied().unwrap_or(Pose::IDENTITY);
        let lap = correct(start, &motions, &scans, &settings)?;
        let before = PoseErrors::absolute(&lap.odometry, &truth);
        let after = PoseErrors::absolute(&lap.poses, &truth);
        let drift =
            Self { truth, lap, chosen, before, after, contours: [None; 3], contours_as_drawn: [None; 3] };
        let log = drift.poses(chosen).iter().copied().zip(scans).collect();
        Ok((drift, log))
    }

    /// The poses of a set.
    pub fn poses(&self, set: PoseSet) -> &[Pose<2>] {
        match set {
            PoseSet::True => &self.truth,
            PoseSet::Odometry => &self.lap.odometry,
            PoseSet::Optimised => &self.lap.poses,
        }
    }

    /// Maps the same scans with each set of poses, carving, and measures the contours, in the world as it is drawn and in
    /// turned ones (none: as drawn counts). Of `config` all is taken but the cells.
    ///
    /// # Errors
    /// Where the settings of the map are not possible.
    pub fn measure_maps(
        &mut self,
        log: &Lap,
        world: &World,
        config: &TsdfConfig<2>,
        turns: &[Turn],
    ) -> Result<(), MapError> {
        for (k, set) in PoseSet::ALL.into_iter().enumerate() {
            let off = |turned: &Pose<2>| self.contour_off(set, log, world, config, turned);
            let drawn = off(&Pose::IDENTITY)?;
            let turned: Vec<_> =
                turns.iter().map(|t| off(&t.pose(config.resolution))).collect::<Result<_, _>>()?;
            let turned: Vec<_> = turned.into_iter().flatten().collect();
            self.contours[k] = ErrorSummary::median_of(&turned).or(drawn);
            self.contours_as_drawn[k] = drawn;
        }
        Ok(())
    }

    /// Distance of the contour from the true walls, with a set of poses in a world behind a pose.
    fn contour_off(
        &self,
        set: PoseSet,
        log: &Lap,
        world: &World,
        config: &TsdfConfig<2>,
        turned: &Pose<2>,
    ) -> Result<Option<ErrorSummary>, MapError> {
        let seen = world.aabb().grown(ROOM);
        let mut extent = Aabb::EMPTY;
        for corner in [seen.min, seen.max, [seen.min[0], seen.max[1]], [seen.max[0], seen.min[1]]] {
            extent.include(turned.transform_point(corner));
        }
        // A multiple of cells around the box of the maps: the lattices coincide.
        let Some(grid) = Grid::covering(extent, config.resolution) else { return Ok(None) };
        let mut tsdf = Tsdf2::covering(&grid, *config)?;
        for (pose, (_, scan)) in self.poses(set).iter().zip(log) {
            tsdf.integrate(&(*turned * *pose), scan)?;
        }
        let contour = marching_squares(&tsdf, &ContourSettings::default());
        let truth = TurnedTruth::new(world, turned);
        Ok(ErrorSummary::of(contour.vertices.iter().map(|&v| truth.signed_distance(v)).collect()))
    }

    /// Closures that the optimized poses do not agree with.
    pub fn disagreeing(&self) -> usize {
        self.lap.agrees.iter().filter(|agrees| !**agrees).count()
    }

    /// Everything that was ever seen from a set of poses.
    pub fn end_points<'a>(&self, set: PoseSet, scans: impl Iterator<Item = &'a Scan<2>>) -> Vec<[f64; 2]> {
        let ends = self.poses(set).iter().zip(scans);
        ends.flat_map(|(pose, scan)| scan.hits_world(pose).collect::<Vec<_>>()).collect()
    }

    /// The box of a set of poses.
    pub fn extent(&self) -> Aabb<2> {
        let mut seen = Aabb::EMPTY;
        PoseSet::ALL.iter().for_each(|&set| self.poses(set).iter().for_each(|p| seen.include(p.translation)));
        seen
    }

    /// Meters and radians.
    pub fn to_json(&self) -> Value {
        let errors = |e: &PoseErrors| json!({ "translation": e.translation, "rotation": e.rotation });
        let relative = |set| errors(&PoseErrors::relative(self.poses(set), &self.truth, 10));
        let error = |e: ErrorSummary| json!({ "median": e.median, "p95": e.p95 });
        let contour = |k: usize| self.contours[k].map(error);
        let drawn = |k: usize| self.contours_as_drawn[k].map(error);
        let rounds = self.lap.rounds.iter().map(|r| {
            json!({
                "candidates": r.candidates, "closures": r.closures, "refused": r.refused,
                "iterations": r.report.iterations,
                "chi_square": [r.report.chi_square.first(), r.report.chi_square.last()],
            })
        });
        json!({
            "used": self.chosen.name(),
            "odometry": errors(&self.before),
            "optimised": errors(&self.after),
            "relative_over_10_scans": {
                "odometry": relative(PoseSet::Odometry), "optimised": relative(PoseSet::Optimised),
            },
            "odometry_noise": CorrectionSettings::default().odometry,
            "closures": self.lap.closures.len(),
            "closures_disagreeing": self.disagreeing(),
            "rounds": rounds.collect::<Vec<_>>(),
            "contour": { "true": contour(0), "odometry": contour(1), "optimised": contour(2) },
            "contour_as_drawn": { "true": drawn(0), "odometry": drawn(1), "optimised": drawn(2) },
        })
    }

    /// The same for people.
    pub fn lines(&self) -> Vec<String> {
        let closures = self.lap.closures.len();
        let refused = self.lap.rounds.last().map_or(0, |r| r.refused);
        let mut lines = vec![
            format!("odometry:  {}", self.before),
            format!("optimised: {}   ({closures} loop closures, {refused} refused)", self.after),
        ];
        let contours = PoseSet::ALL.into_iter().zip(self.contours);
        let told: Vec<_> = contours
            .filter_map(|(set, e)| {
                e.map(|e| format!("{} {:.1} / {:.1} mm", set.poses(), 1e3 * e.median, 1e3 * e.p95))
            })
            .collect();
        if !told.is_empty() {
            lines.push(format!("contour off the true walls, median / 95 %: {}", told.join(", ")));
        }
        lines
    }
}
