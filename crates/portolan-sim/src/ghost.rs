//! The ghost of the chair: how long a map believes in what is no longer there, and what forgetting costs.
//!
//! The lap is driven until every cell of the chair's place that can saturate has done so; then the chair is moved and
//! the laps go on. Of each cell the error against the new truth is followed from re-observation to
//! re-observation. Filter theory says: it halves every `ln 2 / ln(1 + w / W_max)` of them.

use crate::drive::{LapConfig, lap};
use crate::{CHAIR_MOVE, StaticNoise, World, apartment, static_noise};
use portolan::cell::{FusionEvent, TsdfRule};
use portolan::geom::{Aabb, Grid};
use portolan::map::{MapError, SweepKind, Tsdf, TsdfConfig};
use portolan::sweep::WeightModel;

/// How the experiment is done.
#[derive(Clone, Debug, PartialEq)]
pub struct GhostSettings {
    /// Clamps of the weight, one run each.
    pub w_max: Vec<f32>,
    /// Edge of a cell (metres).
    pub resolution: f64,
    /// Truncation (metres).
    pub truncation: f64,
    /// How scans become observations.
    pub sweep: SweepKind,
    /// How much each beam is trusted.
    pub weights: WeightModel,
    /// One lap.
    pub lap: LapConfig,
    /// After so many laps the chair moves, saturated or not.
    pub max_laps_before: usize,
    /// The run ends after so many laps with the moved chair, at the latest.
    pub max_laps_after: usize,
    /// The run goes on until every measured cell was re-observed for so many predicted half-lives.
    pub half_lives: f64,
    /// Laps of a world in which nothing moves over which the noise of the map is measured, after half as many to
    /// forget the beginning; 0 or 1: not measured.
    pub noise_laps: usize,
}

impl Default for GhostSettings {
    /// The chapter's map (5 cm, tau 15 cm), `W_max` of 4, 24 and 64, four laps, three half-lives.
    fn default() -> Self {
        Self {
            w_max: vec![4.0, 24.0, 64.0],
            resolution: 0.05,
            truncation: 0.15,
            sweep: SweepKind::default(),
            weights: WeightModel::default(),
            lap: LapConfig::default(),
            max_laps_before: 4,
            max_laps_after: 16,
            half_lives: 3.0,
            noise_laps: 16,
        }
    }
}

/// The whole experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Ghost {
    /// One run for each clamp, in the order asked for.
    pub per_w_max: Vec<GhostRun>,
}

/// What one map remembered.
#[derive(Clone, Debug, PartialEq)]
pub struct GhostRun {
    /// The clamp.
    pub w_max: f32,
    /// Laps driven before the chair moved.
    pub laps_before: usize,
    /// Laps after which every cell of the chair's place was saturated; `None`: some were not after the last one.
    pub laps_until_saturated: Option<usize>,
    /// Laps driven afterwards.
    pub laps_after: usize,
    /// Cells of the abandoned place where the prediction should hold: saturated when the chair moved, and only
    /// ever seen as free from then on.
    pub measured: GhostGroup,
    /// Those that had not reached `W_max`: their gain is higher than the clamp's, and they forget faster.
    pub unclamped: GhostGroup,
    /// Cells, here and at the chair's new place, of which at least one re-observation lay behind a surface, where the
    /// weight tapers to 0: they learn slower than beams of full weight would teach them, and what they are told is
    /// a distance along a beam, not the truth.
    pub tapered: GhostGroup,
    /// What this clamp costs where nothing moves, if it was asked for.
    pub static_noise: Option<StaticNoise>,
}

/// Cells that share a fate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GhostGroup {
    /// Number of cells.
    pub cells: usize,
    /// Those that have lost half of their error when the run ends.
    pub halved: usize,
    /// Re-observations until half of the error was lost: the median over the cells, those that never do included as
    /// infinite. NaN without cells.
    pub half_life_measured: f64,
    /// `ln 2 / ln(1 + w / W_max)` for the median weight of a full observation. NaN without cells.
    pub half_life_predicted: f64,
    /// The same for the weights that the cells really received (their mean gain in the logarithm, weight before
    /// included): the median over the cells. NaN without cells.
    pub half_life_of_gains: f64,
    /// Median weight that a re-observation carried. NaN without cells.
    pub weight: f64,
    /// Median number of re-observations of a cell in one lap. NaN without cells.
    pub observations_per_lap: f64,
    /// Median weight that the cells had when the chair moved. NaN without cells.
    pub weight_at_move: f64,
    /// `[re-observations, median of the error as a part of the error when the chair moved]`.
    pub curve: Vec<[f64; 2]>,
}

/// A followed cell.
struct Followed {
    /// Distance of the new world (metres), clamped to the truncation.
    truth: f64,
    appears: bool,
    distance_at_move: f64,
    weight_at_move: f64,
    events: Vec<FusionEvent>,
}

struct Run {
    w_max: f32,
    tsdf: Tsdf<2>,
    saturated_after: Option<usize>,
    laps_before: usize,
    laps_after: usize,
    cells: Vec<([i32; 2], Followed)>,
    done: bool,
}

/// Does the experiment: all maps see the same laps. Driving costs as much as fusing; some seconds in all.
///
/// # Errors
/// Where resolution, truncation or a clamp is not possible.
pub fn ghost(settings: &GhostSettings) -> Result<Ghost, MapError> {
    let before = apartment().world;
    let after = before.with_moved("chair", CHAIR_MOVE);
    let places = [&before, &after].map(chair);
    let region = places[0].union(places[1]).grown(settings.truncation + 2.0 * settings.resolution);
    let grid =
        Grid::covering(region, settings.resolution).ok_or(MapError::Resolution(settings.resolution))?;
    let mut runs = Vec::new();
    for &w_max in &settings.w_max {
        runs.push(Run {
            w_max,
            tsdf: Tsdf::new(config(settings, w_max).with_grid(&grid))?,
            saturated_after: None,
            laps_before: 0,
            laps_after: 0,
            cells: Vec::new(),
            done: false,
        });
    }

    for k in 0..settings.max_laps_before {
        let scans = lap(&before, &lap_config(settings, k));
        for run in runs.iter_mut().filter(|r| r.saturated_after.is_none()) {
            for (pose, scan) in &scans {
                run.tsdf.integrate(pose, scan, true);
            }
            run.laps_before = k + 1;
            let all = old_place(&run.tsdf, places[0]);
            let full = |c: &[i32; 2]| run.tsdf.store_cell(*c).is_some_and(|s| s.weight >= run.w_max);
            if all.iter().all(full) {
                run.saturated_after = Some(k + 1);
            }
        }
    }
    for run in &mut runs {
        run.follow(&after, places);
    }
    for k in 0..settings.max_laps_after {
        if runs.iter().all(|r| r.done) {
            break;
        }
        // Laps of another number than any before: other noise.
        let scans = lap(&after, &lap_config(settings, (1 << 20) + k));
        for run in runs.iter_mut().filter(|r| !r.done) {
            run.drive(&scans, settings);
        }
    }
    let mut per_w_max: Vec<_> = runs.into_iter().map(Run::tell).collect();
    if settings.noise_laps > 1 {
        let noise = static_noise(settings, settings.noise_laps / 2, settings.noise_laps)?;
        per_w_max.iter_mut().zip(noise).for_each(|(run, noise)| run.static_noise = Some(noise));
    }
    Ok(Ghost { per_w_max })
}

fn config(settings: &GhostSettings, w_max: f32) -> TsdfConfig<2> {
    TsdfConfig {
        w_max,
        truncation: settings.truncation,
        sweep: settings.sweep,
        weights: settings.weights,
        ..Default::default()
    }
}

fn lap_config(settings: &GhostSettings, k: usize) -> LapConfig {
    LapConfig { first_index: settings.lap.first_index + (k * settings.lap.scans) as u64, ..settings.lap }
}

fn chair(world: &World) -> Aabb<2> {
    world.solids().iter().filter(|s| s.name == "chair").fold(Aabb::EMPTY, |b, s| b.union(s.aabb()))
}

/// Cells of the chair's place: centre in the chair or within a cell of it, estimated as behind or near its surface.
fn old_place(tsdf: &Tsdf<2>, place: Aabb<2>) -> Vec<[i32; 2]> {
    let near = place.grown(tsdf.grid().lattice.resolution);
    let limit = (0.5 * tsdf.config().truncation) as f32;
    cells_in(tsdf, near).filter(|&c| tsdf.store_cell(c).is_some_and(|s| s.distance < limit)).collect()
}

fn cells_in(tsdf: &Tsdf<2>, place: Aabb<2>) -> impl Iterator<Item = [i32; 2]> + '_ {
    let grid = tsdf.grid();
    (0..grid.len()).map(|i| grid.cell(i)).filter(move |&c| place.contains(grid.lattice.center(c)))
}

/// Shorter words for what is asked often.
trait StoreCell {
    fn store_cell(&self, cell: [i32; 2]) -> Option<portolan::cell::SignedDistance>;
}

impl StoreCell for Tsdf<2> {
    fn store_cell(&self, cell: [i32; 2]) -> Option<portolan::cell::SignedDistance> {
        self.store().at(self.grid().index(cell)?)
    }
}

impl Run {
    /// Chooses the cells and watches them from now on.
    fn follow(&mut self, after: &World, [old, new]: [Aabb<2>; 2]) {
        let tau = self.tsdf.config().truncation;
        let mut chosen: Vec<_> = old_place(&self.tsdf, old).into_iter().map(|c| (c, false)).collect();
        // At the new place all that was free and comes to lie in the chair.
        chosen.extend(cells_in(&self.tsdf, new).map(|c| (c, true)));
        for (cell, appears) in chosen {
            let Some(state) = self.tsdf.store_cell(cell) else { continue };
            let truth = after.signed_distance(self.tsdf.grid().lattice.center(cell)).clamp(-tau, tau);
            self.cells.push((
                cell,
                Followed {
                    truth,
                    appears,
                    distance_at_move: state.distance.into(),
                    weight_at_move: state.weight.into(),
                    events: Vec::new(),
                },
            ));
        }
        self.cells.sort_by_key(|c| c.0);
        self.tsdf.watch(self.cells.iter().map(|c| c.0));
    }

    /// One more lap; done when all measured cells were seen often enough.
    fn drive(
        &mut self,
        scans: &[(portolan::geom::Pose<2>, portolan::scan::Scan<2>)],
        settings: &GhostSettings,
    ) {
        for (pose, scan) in scans {
            self.tsdf.integrate(pose, scan, true);
            for (cell, event) in self.tsdf.events() {
                if let Ok(i) = self.cells.binary_search_by_key(cell, |c| c.0) {
                    self.cells[i].1.events.push(*event);
                }
            }
        }
        self.laps_after += 1;
        let w_max = self.w_max;
        let mut measured = self.cells.iter().filter(|c| c.1.fate(w_max) == Fate::Measured).peekable();
        // Without a cell that is seen again the run goes on to its last lap.
        self.done = measured.peek().is_some()
            && measured.all(|(_, c)| {
                let weight = median(c.events.iter().map(weight_of).collect());
                let half_life = self.tsdf.rule().half_life(weight);
                c.events.len() as f64 >= settings.half_lives * half_life
            });
    }

    fn tell(self) -> GhostRun {
        let group = |fate: Fate| {
            let cells = self.cells.iter().map(|c| &c.1).filter(|c| c.fate(self.w_max) == fate);
            GhostGroup::of(&cells.collect::<Vec<_>>(), self.tsdf.rule(), self.laps_after)
        };
        GhostRun {
            w_max: self.w_max,
            laps_before: self.laps_before,
            laps_until_saturated: self.saturated_after,
            laps_after: self.laps_after,
            measured: group(Fate::Measured),
            unclamped: group(Fate::Unclamped),
            tapered: group(Fate::Tapered),
            static_noise: None,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Fate {
    Measured,
    Unclamped,
    Tapered,
    /// Never seen again, or at the new place never behind a surface: says nothing.
    Silent,
}

impl Followed {
    fn fate(&self, w_max: f32) -> Fate {
        let behind = self.events.iter().any(|e| e.observation < 0.0);
        if self.events.is_empty() || (self.appears && !behind) {
            Fate::Silent
        } else if behind {
            Fate::Tapered
        } else if self.weight_at_move < f64::from(w_max) {
            Fate::Unclamped
        } else {
            Fate::Measured
        }
    }

    /// Error after `n` re-observations as a part of the error when the chair moved.
    fn error(&self, n: usize) -> Option<f64> {
        let distance = if n == 0 { self.distance_at_move } else { self.events.get(n - 1)?.after };
        Some((distance - self.truth).abs() / (self.distance_at_move - self.truth).abs())
    }

    /// Re-observations until half of the error was lost, interpolated in the logarithm; infinite where never.
    fn half_life(&self) -> f64 {
        let mut last = 1.0;
        for n in 1..=self.events.len() {
            let Some(error) = self.error(n) else { break };
            if error <= 0.5 {
                let part = if error > 0.0 { libm::log(2.0 * last) / libm::log(last / error) } else { 1.0 };
                return (n - 1) as f64 + part;
            }
            last = error;
        }
        f64::INFINITY
    }

    /// Observations until the product of `1 - K` is one half: what the filter must do, whatever it is told.
    fn half_life_of_gains(&self) -> f64 {
        let mut kept = 1.0;
        for (n, e) in self.events.iter().enumerate() {
            let next = kept * (1.0 - e.gain);
            if next <= 0.5 {
                return n as f64 + libm::log(2.0 * kept) / libm::log(kept / next);
            }
            kept = next;
        }
        f64::INFINITY
    }
}

/// The weight of an observation: `K = w / (W + w)` solved for `w`.
fn weight_of(event: &FusionEvent) -> f64 {
    if event.gain < 1.0 { event.weight_before * event.gain / (1.0 - event.gain) } else { event.weight_after }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        _ => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

impl GhostGroup {
    fn of(cells: &[&Followed], rule: &TsdfRule, laps: usize) -> Self {
        let of = |f: &dyn Fn(&Followed) -> f64| median(cells.iter().map(|c| f(c)).collect());
        let full: Vec<f64> = cells
            .iter()
            .flat_map(|c| c.events.iter().filter(|e| e.observation >= 0.0).map(weight_of))
            .collect();
        let longest = cells.iter().map(|c| c.events.len()).max().unwrap_or(0);
        // Only as far as at least half of the cells were followed.
        let curve = (0..=longest).map_while(|n| {
            let errors: Vec<f64> = cells.iter().filter_map(|c| c.error(n)).collect();
            (2 * errors.len() >= cells.len() && !errors.is_empty()).then(|| [n as f64, median(errors)])
        });
        let full = median(full);
        Self {
            cells: cells.len(),
            halved: cells.iter().filter(|c| c.half_life().is_finite()).count(),
            half_life_measured: of(&Followed::half_life),
            // Cells that never saw a full observation are compared with unit weight.
            half_life_predicted: match cells.len() {
                0 => f64::NAN,
                _ => rule.half_life(if full.is_nan() { 1.0 } else { full }),
            },
            half_life_of_gains: of(&Followed::half_life_of_gains),
            weight: median(cells.iter().flat_map(|c| c.events.iter().map(weight_of)).collect()),
            observations_per_lap: of(&|c| c.events.len() as f64) / laps as f64,
            weight_at_move: of(&|c| c.weight_at_move),
            curve: curve.collect(),
        }
    }
}
