//! The representations, and when they are built anew.

use portolan::field::EsdfSettings;
use portolan::surface::ContourSettings;
use portolan_chapter::gallery::{GallerySettings, run, tree_crossovers_at};
use portolan_sim::{Truth, World};
use serde_json::json;

use super::ask::Ask;
use super::built::Built;
use super::{answers, picture, report};
use crate::engine::fusion::Fusion;
use crate::engine::{Clock, Limits, Refusal, Reply};

/// Points that direct answers are timed and compared at when the view is opened: few, so that it opens quickly.
const FIRST_PROBES: usize = 10_000;
/// Points that a workload can be run with.
const PROBES: std::ops::RangeInclusive<usize> = 100..=300_000;
/// Bytes of a cell in all maps together, with what deriving and sending them takes on top.
const BYTES_PER_CELL: f64 = 200.0;
/// Bytes of a beam in the cloud and its tree, while they are built.
const BYTES_PER_BEAM: f64 = 120.0;
/// Edges of the leaves that trees are fused with to follow the formula (meters).
const LEAVES: [f64; 6] = [0.10, 0.075, 0.05, 0.0375, 0.025, 0.0175];
/// Bytes that a tree may take for a cell of the dense array that it is held against.
const BYTES_PER_LEAF_CELL: f64 = 16.0;
/// Scans that these trees are fused of, at most; of a longer log every n-th.
const MOST_SCANS: usize = 1000;

/// The view of all representations.
pub(in crate::engine) struct Gallery {
    limits: Limits,
    clock: Clock,
    built: Option<Built>,
}

impl Gallery {
    pub(in crate::engine) fn new(limits: Limits, clock: &Clock) -> Self {
        Self { limits, clock: clock.clone(), built: None }
    }

    /// Answers.
    pub(in crate::engine) fn ask(&mut self, ask: Ask, fusion: &mut Fusion) -> Result<Reply, Refusal> {
        let clock = self.clock.clone();
        match ask {
            Ask::Open { have } => {
                let built = self.built(fusion)?;
                match have == Some(built.revision) {
                    true => Reply::of(json!({ "revision": built.revision, "costs": report::costs(built) })),
                    false => picture::everything(built),
                }
            }
            Ask::Run { workload, probes } => {
                if !PROBES.contains(&probes) {
                    let (low, high) = (PROBES.start(), PROBES.end());
                    return Err(Refusal::new(format!(
                        "probes must be from {low} to {high}, and are {probes}"
                    )));
                }
                let built = self.built(fusion)?;
                let measure = || built.measured.measure(workload, probes, &mut || clock.now());
                let ((), seconds) = clock.time(measure);
                Reply::of(
                    json!({ "revision": built.revision, "seconds": seconds, "costs": report::costs(built) }),
                )
            }
            Ask::Answers { at } => match at.iter().all(|v| v.is_finite()) {
                true => Reply::of(answers::at(self.built(fusion)?, at)),
                false => Err(Refusal::new("a place has two finite coordinates")),
            },
            Ask::Trees {} => self.trees(fusion),
        }
    }

    /// What there is of the map of fusion as it is now.
    fn built(&mut self, fusion: &mut Fusion) -> Result<&mut Built, Refusal> {
        fusion.finish_if_new()?;
        if self.built.as_ref().is_none_or(|built| built.revision != fusion.revision()) {
            self.built = None;
            self.built = Some(self.make(fusion)?);
        }
        self.built.as_mut().ok_or_else(|| Refusal::new("there is no gallery"))
    }

    fn make(&self, fusion: &mut Fusion) -> Result<Built, Refusal> {
        let tsdf = fusion.tsdf()?;
        let (grid, esdf, contour) = (*tsdf.grid(), EsdfSettings::of(tsdf), ContourSettings::of(tsdf));
        let lap = fusion.scans();
        let log = lap.first(fusion.at());
        let beams: usize = log.iter().map(|(_, scan)| scan.len()).sum();
        self.check_memory(grid.shape, beams, fusion)?;
        if log.iter().all(|(_, scan)| scan.counts().hit == 0) {
            return Err(Refusal::new("no beam of these scans hit anything: there is nothing to compare"));
        }
        let truth = lap.world(fusion.at());
        let settings = GallerySettings {
            tsdf: fusion.settings().config()?,
            contour,
            esdf,
            ..GallerySettings::new(grid, FIRST_PROBES, truth.map(World::wall_length))
        };
        let clock = self.clock.clone();
        let known = truth.map(|world| world as &dyn Truth<2>);
        let (measured, seconds) = clock.time(|| run(log, &settings, known, &mut || clock.now()));
        let measured = measured.map_err(Refusal::new)?;
        let of = json!({
            "log": lap.name(), "scans": fusion.at(), "lap": lap.lap_length(), "beams": beams, "settings": fusion.settings(),
            "probes": FIRST_PROBES, "moved": lap.last_move(fusion.at()).is_some(),
        });
        let truth = truth.cloned();
        Ok(Built { revision: fusion.revision(), settings, measured, of, seconds, truth, trees: None })
    }

    /// Refuses what would take more than the tab may have, before any of it is built.
    fn check_memory(&self, shape: [usize; 2], beams: usize, fusion: &Fusion) -> Result<(), Refusal> {
        let cells: f64 = shape.iter().map(|&n| n as f64).product();
        let needed = BYTES_PER_CELL * cells + BYTES_PER_BEAM * beams as f64;
        let left = self.limits.memory.saturating_sub(fusion.memory_bytes());
        if needed <= left as f64 {
            return Ok(());
        }
        let [needed, left] = [needed, left as f64].map(|bytes| bytes / f64::from(1 << 20));
        Err(Refusal::new(format!(
            "all representations together need about {needed:.0} MiB of {left:.0} MiB that are left to this tab; \
             choose larger cells in Fusion"
        )))
    }

    /// Trees of other leaves; once for a map, since nothing of them is a matter of time.
    fn trees(&mut self, fusion: &mut Fusion) -> Result<Reply, Refusal> {
        let limit = self.limits.memory.saturating_sub(fusion.memory_bytes()) as f64;
        let built = self.built(fusion)?;
        let log = fusion.scans().first(fusion.at());
        let every = log.len().div_ceil(MOST_SCANS).max(1);
        if built.trees.is_none() {
            let bounds = built.settings.grid.aabb();
            let cells = |r: f64| bounds.extent().iter().map(|metres| (metres / r).ceil()).product::<f64>();
            let fit: Vec<f64> =
                LEAVES.into_iter().filter(|&r| BYTES_PER_LEAF_CELL * cells(r) <= limit).collect();
            let few: Vec<_> = log.iter().step_by(every).cloned().collect();
            let surface = report::surface_length(built);
            let trees = tree_crossovers_at(&few, built.settings.model, &bounds, surface, &fit);
            built.trees = Some(trees.map_err(Refusal::new)?);
        }
        Reply::of(json!({ "revision": built.revision, "every": every, "sizes": built.trees }))
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        self.built.as_ref().map_or(0, |built| built.measured.memory_bytes())
    }

    /// Gives everything up.
    pub(in crate::engine) fn forget(&mut self) {
        self.built = None;
    }
}
