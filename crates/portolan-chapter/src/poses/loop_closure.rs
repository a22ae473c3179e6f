//! From odometry and scans to poses: places seen again, and a pose graph of them.

use super::{MatchSettings, Outline, ScanMatch, match_scans};
use portolan::geom::Pose;
use portolan::scan::Scan;
use portolan_graph::{Edge, EdgeKind, GraphError, Information, Kernel, PoseGraph, Report, Settings};
use portolan_sim::{OdometryNoise, dead_reckon};

/// How a lap is corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrectionSettings {
    /// What the wheels' errors are believed to be.
    pub odometry: OdometryNoise,
    /// The matcher.
    pub matching: MatchSettings,
    /// Scans nearer in the log than this do not close a loop.
    pub min_lag: usize,
    /// Poses further apart than this, as far as is known, are no candidates (meters).
    pub radius: f64,
    /// Candidates for each scan at most, nearest first.
    pub candidates: usize,
    /// A match must be found from both sides: forth and back may differ by this (meters, radians).
    pub round_trip: [f64; 2],
    /// How often candidates are looked for, each time with the poses of the last optimization.
    pub rounds: usize,
    /// What an edge that disagrees with the others may still pull.
    pub kernel: Kernel,
}

impl Default for CorrectionSettings {
    fn default() -> Self {
        Self {
            odometry: OdometryNoise::default(),
            matching: MatchSettings::default(),
            min_lag: 3,
            radius: 0.8,
            candidates: 6,
            round_trip: [0.02, 0.01],
            rounds: 2,
            kernel: Kernel::Dcs(3.4),
        }
    }
}

/// A place seen again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure {
    /// Index of the earlier scan.
    pub earlier: usize,
    /// Index of the later scan.
    pub later: usize,
    /// The match of the later scan to the earlier one.
    pub found: ScanMatch,
}

/// One round of proposing, matching and optimizing.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// Pairs that were matched.
    pub candidates: usize,
    /// Those of them that were believed.
    pub closures: usize,
    /// The others.
    pub refused: usize,
    /// What the optimizer did.
    pub report: Report,
}

/// A lap with its poses corrected.
#[derive(Clone, Debug)]
pub struct CorrectedLap {
    /// The poses that odometry alone leads to.
    pub odometry: Vec<Pose<2>>,
    /// The poses of the optimized graph.
    pub poses: Vec<Pose<2>>,
    /// The graph: vertex `k` is scan `k`, the first one is fixed; odometry first, then the closures.
    pub graph: PoseGraph<2>,
    /// The closures of the last round, in the order of their edges.
    pub closures: Vec<Closure>,
    /// For each of them, whether the optimized poses agree with it (chi-square below 11.3, 99 % of three degrees).
    pub agrees: Vec<bool>,
    /// What happened in each round.
    pub rounds: Vec<Round>,
}

/// Corrects a lap: dead reckoning from `start`, closures between scans that are near each other as far as is known,
/// and a pose graph of both; then again from the better poses. `motions` are `previous_from_next`, one fewer than
/// scans; scans or motions beyond that are left out. Without closures the result is the odometry.
///
/// # Errors
/// [`GraphError`], where a motion is not finite or the settings are not possible.
pub fn correct(
    start: Pose<2>,
    motions: &[Pose<2>],
    scans: &[Scan<2>],
    settings: &CorrectionSettings,
) -> Result<CorrectedLap, GraphError> {
    let motions = &motions[..motions.len().min(scans.len().saturating_sub(1))];
    let odometry = dead_reckon(start, motions);
    let outlines: Vec<_> = scans[..scans.len().min(odometry.len())].iter().map(Outline::of).collect();
    let mut lap = CorrectedLap {
        poses: odometry.clone(),
        graph: odometry_graph(&odometry, motions, &settings.odometry)?,
        odometry,
        closures: Vec::new(),
        agrees: Vec::new(),
        rounds: Vec::new(),
    };
    for _ in 0..settings.rounds {
        let (closures, candidates) = find_closures(&lap.poses, &outlines, settings);
        let mut graph = odometry_graph(&lap.poses, motions, &settings.odometry)?;
        for c in &closures {
            graph.add_edge(Edge {
                i: c.earlier as u64,
                j: c.later as u64,
                i_from_j: c.found.reference_from_scan,
                information: c.found.information,
                kind: EdgeKind::Closure,
            })?;
        }
        let report = graph.optimize(&Settings { kernel: settings.kernel, ..Settings::default() })?;
        lap.poses = graph.vertices().iter().map(|v| v.world_from_vertex).collect();
        lap.agrees = graph.edge_chi_squares()[motions.len()..].iter().map(|&c| c < 11.3).collect();
        let refused = candidates - closures.len();
        lap.rounds.push(Round { candidates, closures: closures.len(), refused, report });
        (lap.graph, lap.closures) = (graph, closures);
    }
    Ok(lap)
}

/// The poses as vertices, the first fixed, and the motions as edges.
fn odometry_graph(
    poses: &[Pose<2>],
    motions: &[Pose<2>],
    noise: &OdometryNoise,
) -> Result<PoseGraph<2>, GraphError> {
    let mut graph = PoseGraph::new();
    for (k, pose) in poses.iter().enumerate() {
        graph.add_vertex(k as u64, *pose)?;
    }
    graph.set_fixed(0, true)?;
    for (k, motion) in motions.iter().enumerate() {
        let [position, heading] = noise.sigmas(motion);
        graph.add_edge(Edge {
            i: k as u64,
            j: k as u64 + 1,
            i_from_j: *motion,
            information: Information::from_sigmas(position, heading)?,
            kind: EdgeKind::Odometry,
        })?;
    }
    Ok(graph)
}

/// Matches every scan to the nearest earlier ones; also the number of candidates.
fn find_closures(
    poses: &[Pose<2>],
    outlines: &[Outline],
    settings: &CorrectionSettings,
) -> (Vec<Closure>, usize) {
    let (mut closures, mut candidates) = (Vec::new(), 0);
    for later in settings.min_lag..poses.len() {
        let distance = |earlier: &usize| poses[*earlier].translation_to(&poses[later]);
        let mut near: Vec<usize> =
            (0..=later - settings.min_lag).filter(|e| distance(e) <= settings.radius).collect();
        near.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        near.truncate(settings.candidates);
        candidates += near.len();
        closures.extend(near.into_iter().filter_map(|earlier| {
            let guess = poses[earlier].inverse() * poses[later];
            let found = closure(&outlines[earlier], &outlines[later], &guess, settings)?;
            Some(Closure { earlier, later, found })
        }));
    }
    (closures, candidates)
}

/// The match, if it is believed and the same from both sides.
fn closure(
    earlier: &Outline,
    later: &Outline,
    guess: &Pose<2>,
    settings: &CorrectionSettings,
) -> Option<ScanMatch> {
    let forth = match_scans(earlier, later, guess, &settings.matching).ok()?;
    let back = match_scans(later, earlier, &guess.inverse(), &settings.matching).ok()?;
    let [metres, radians] = Outline::apart(&forth.reference_from_scan.inverse(), &back.reference_from_scan);
    let [metres_allowed, radians_allowed] = settings.round_trip;
    (metres <= metres_allowed && radians <= radians_allowed).then_some(forth)
}
