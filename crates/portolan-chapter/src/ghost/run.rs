//! The ghost of the chair: how long a map believes in what is no longer there, and what forgetting costs.
//!
//! The lap is driven until every cell of the chair's place that can saturate has done so; then the chair is moved and
//! the laps go on. Of each cell the error against the new truth is followed from re-observation to
//! re-observation. By the theory it halves every `ln 2 / ln(1 + w / W_max)` of them.

use super::settings::{GhostSettings, chair, lap_config, map_config};
use super::{GhostGroup, GhostWatch, StaticNoise, static_noise};
use portolan::cell::SignedDistance;
use portolan::geom::{Aabb, Grid};
use portolan::map::{MapError, Tsdf2};
use portolan_sim::{CHAIR_MOVE, World, apartment, lap};
use serde::Serialize;

/// The whole experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Ghost {
    /// One run for each clamp, in the order asked for.
    pub per_w_max: Vec<GhostRun>,
}

/// What one map remembered.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GhostRun {
    /// The clamp.
    pub w_max: f32,
    /// Laps driven before the chair moved.
    pub laps_before: usize,
    /// Laps after which every cell of the chair's place was saturated; `None`: some were not after the last one.
    pub laps_until_saturated: Option<usize>,
    /// Laps driven afterwards.
    pub laps_after: usize,
    /// All cells of the abandoned place that were seen again: how long the map believes in the chair.
    pub left: GhostGroup,
    /// Those of them that were saturated when the chair moved, and only ever seen as free from then on. Their half-life
    /// is the filter's gain in other words: a check of the program, not a measurement of the theory.
    pub saturated: GhostGroup,
    /// Those that had not reached `W_max`: their gain is higher than the clamp's, and they forget faster.
    pub unclamped: GhostGroup,
    /// Cells, here and at the chair's new place, of which at least one re-observation lay behind a surface, where the
    /// weight tapers to 0: they learn slower than from beams of full weight, and what they observe is a
    /// distance along a beam, not the truth.
    pub tapered: GhostGroup,
    /// What this clamp costs where nothing moves, if it was asked for.
    pub static_noise: Option<StaticNoise>,
}

struct Run {
    w_max: f32,
    tsdf: Tsdf2,
    saturated_after: Option<usize>,
    laps_before: usize,
    laps_after: usize,
    watch: Option<GhostWatch>,
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
            tsdf: Tsdf2::covering(&grid, map_config(settings, w_max))?,
            saturated_after: None,
            laps_before: 0,
            laps_after: 0,
            watch: None,
            done: false,
        });
    }

    for k in 0..settings.max_laps_before {
        let scans = lap(&before, &lap_config(settings, k));
        for run in runs.iter_mut().filter(|r| r.saturated_after.is_none()) {
            for (pose, scan) in &scans {
                run.tsdf.integrate(pose, scan)?;
            }
            run.laps_before = k + 1;
            let all = old_place(&run.tsdf, places[0]);
            let full = |c: &[i32; 2]| state(&run.tsdf, *c).is_some_and(|s| s.weight >= run.w_max);
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
            run.drive(&scans, settings)?;
        }
    }
    let mut per_w_max: Vec<_> = runs.into_iter().map(Run::tell).collect();
    if settings.noise_laps > 1 {
        let noise = static_noise(settings, settings.noise_laps / 2, settings.noise_laps)?;
        per_w_max.iter_mut().zip(noise).for_each(|(run, noise)| run.static_noise = Some(noise));
    }
    Ok(Ghost { per_w_max })
}

/// Cells of the chair's place: center in the chair or within a cell of it, estimated as behind or near its surface.
pub(crate) fn old_place(tsdf: &Tsdf2, place: Aabb<2>) -> Vec<[i32; 2]> {
    let near = place.grown(tsdf.grid().lattice.resolution);
    let limit = (0.5 * tsdf.config().truncation) as f32;
    cells_in(tsdf, near).filter(|&c| state(tsdf, c).is_some_and(|s| s.distance < limit)).collect()
}

pub(crate) fn cells_in(tsdf: &Tsdf2, place: Aabb<2>) -> impl Iterator<Item = [i32; 2]> + '_ {
    let grid = tsdf.grid();
    (0..grid.len()).map(|i| grid.cell(i)).filter(move |&c| place.contains(grid.lattice.center(c)))
}

/// What the map holds of a cell.
pub(crate) fn state(tsdf: &Tsdf2, cell: [i32; 2]) -> Option<SignedDistance> {
    tsdf.store().at(tsdf.grid().index(cell)?)
}

impl Run {
    /// Chooses the cells and watches them from now on.
    fn follow(&mut self, after: &World, places: [Aabb<2>; 2]) {
        let watch = GhostWatch::new(&self.tsdf, after, places);
        self.tsdf.watch(watch.cells());
        self.watch = Some(watch);
    }

    /// One more lap; done when all measured cells were seen often enough.
    fn drive(
        &mut self,
        scans: &[(portolan::geom::Pose<2>, portolan::scan::Scan<2>)],
        settings: &GhostSettings,
    ) -> Result<(), MapError> {
        let Some(watch) = &mut self.watch else { return Ok(()) };
        for (pose, scan) in scans {
            self.tsdf.integrate(pose, scan)?;
            watch.observe(self.tsdf.events());
        }
        self.laps_after += 1;
        self.done = watch.is_measured(self.tsdf.rule(), settings.half_lives);
        Ok(())
    }

    fn tell(self) -> GhostRun {
        let (rule, laps) = (self.tsdf.rule(), self.laps_after as f64);
        let of_watch = |w: &GhostWatch| (w.left(rule, laps), w.groups(rule, laps));
        let (left, [saturated, unclamped, tapered]) = self.watch.as_ref().map(of_watch).unwrap_or_default();
        GhostRun {
            w_max: self.w_max,
            laps_before: self.laps_before,
            laps_until_saturated: self.saturated_after,
            laps_after: self.laps_after,
            left,
            saturated,
            unclamped,
            tapered,
            static_noise: None,
        }
    }
}
