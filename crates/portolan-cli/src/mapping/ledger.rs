//! Maps of sums: scans into them, and the maps that other commands read out of them.

use anyhow::{anyhow, bail};
use portolan::cell::DistanceSum;
use portolan::geom::vector::{distance, scale};
use portolan::geom::{Grid, Pose};
use portolan::ledger::LedgerError;
use portolan::map::MapError;
use portolan::mapper::{Fused, Mapper};
use portolan::scan::{BeamCounts, RangeLimits, ScanStats};
use portolan::store::Bricks;
use portolan::{Ledger, MapperSettings};
use portolan_io::scan_log::ScanLog;
use portolan_io::{LaserLog, MapFile};
use std::path::Path;
use std::time::Instant;

use super::agreement::Agreement;
use super::aside::Aside;
use super::extent::Extent;
use super::fuse::{Frames, FusionReport};
use super::mapper::{Limits, OccupancyKinds, store_2d, store_3d};
use super::movers::{Judge, Looking, look_2d};
use super::sigma::Calibration;
use super::{MapKind, Settings, recipe};
use crate::arguments::Shift;
use crate::log::Log;
use crate::progress::Progress;
use crate::saved::SavedMap;
use crate::stop;

/// Scans that go into a ledger.
pub(crate) enum LedgerRun<'a> {
    Two { log: &'a LaserLog, limits: RangeLimits, judge: Option<Box<Judge<2>>>, part: Part<'a, 2> },
    Three { frames: Frames<'a>, part: Part<'a, 3> },
}

/// What a run has of either dimension.
pub(crate) struct Part<'a, const D: usize> {
    /// The name under which the ledger keeps the scans.
    name: String,
    indices: &'a [usize],
    ledger: Box<Ledger<D>>,
    file: Box<MapFile<D>>,
    /// What did not fit into memory.
    aside: Aside,
    /// Distances of the first two fifths of the scans, and of the first three, once they are fused.
    parts: Vec<Bricks<DistanceSum, D>>,
    /// So many scans were added.
    added: usize,
    /// After so many scans a part is complete; `None`: parts are of no use.
    ends: Option<[usize; 2]>,
}

impl<'a> LedgerRun<'a> {
    /// Prepares to fuse these scans of a log into a new ledger, or into that of a file.
    pub(crate) fn new(
        log: &'a Log,
        indices: &'a [usize],
        settings: &Settings,
        before: Option<SavedMap>,
        limits: &Limits,
    ) -> anyhow::Result<Self> {
        let out = Path::new(limits.map).parent().unwrap_or(Path::new("."));
        Ok(match log {
            Log::Two(laser) => {
                let file = before.and_then(SavedMap::in_2d).unwrap_or_default();
                // The first scan of the log, fused or not: parts of a log have one lattice.
                let first =
                    if laser.len() == 0 { [0.0; 2] } else { laser.raw(0).world_from_laser.translation };
                let bounds = settings.bounds.map(|bounds| bounds.in_2d("the log")).transpose()?;
                let how = recipe::mapper_settings(settings, None, bounds, limits.memory);
                let part = Part::new(log.name(), indices, file, how, first, out)?;
                Self::Two { log: laser, limits: settings.limits().limits(laser), judge: None, part }
            }
            Log::Three(scans) => {
                let file = before.and_then(SavedMap::in_3d).unwrap_or_default();
                let origin = match settings.shift {
                    Some(Shift::At(origin)) => Some(origin),
                    Some(Shift::Auto) | None => None,
                };
                let bounds = settings.bounds.map(|bounds| bounds.in_3d("the log")).transpose()?;
                let how = recipe::mapper_settings(settings, origin, bounds, limits.memory);
                let part = Part::new(log.name(), indices, file, how, scans.pose(0).translation, out)?;
                Self::Three { frames: Frames::new(scans, indices, settings)?, part }
            }
        })
    }

    /// Number of scans.
    pub(crate) fn scans(&self) -> usize {
        match self {
            Self::Two { part, .. } => part.indices.len(),
            Self::Three { part, .. } => part.indices.len(),
        }
    }

    /// Adds all scans.
    pub(crate) fn fuse(&mut self, threads: usize, progress: &Progress) -> FusionReport {
        match self {
            Self::Two { log, limits, judge, part } => {
                let mut report = FusionReport::default();
                let start = Instant::now();
                let clock = || start.elapsed().as_secs_f64();
                for &i in part.indices {
                    if stop::asked().is_some() {
                        break;
                    }
                    let (pose, mut scan) = (&log.raw(i).world_from_laser, log.scan(i, limits));
                    if let Some(judge) = judge {
                        scan = judge.without_movers(i, pose, scan, &mut BeamCounts::default());
                    }
                    let added = part.add(i, pose, &scan, &clock);
                    if !report.note::<2>(added, &part.name, i) {
                        break;
                    }
                    progress.add(1);
                    progress.holding(|| part.ledger.memory_bytes());
                }
                report.movers = judge.as_ref().map(|judge| judge.found());
                report.sigma = Some(part.calibration());
                report
            }
            Self::Three { frames, part } => {
                let report = super::fuse::fuse_3d(part, frames, &mut Vec::new(), threads, progress);
                FusionReport { sigma: Some(part.calibration()), ..report }
            }
        }
    }

    /// Looks for what moved, so that it is left out of all scans from now on. The sums have the memory that is left.
    pub(crate) fn look(&mut self, how: &Looking) -> anyhow::Result<()> {
        match self {
            Self::Two { log, limits, judge, part } => {
                let scans = how.indices.iter().map(|&i| (log.raw(i).world_from_laser, log.scan(i, limits)));
                let judge = judge.insert(Box::new(look_2d(scans, how)?));
                part.ledger.set_memory(how.memory.saturating_sub(judge.memory_bytes()));
            }
            Self::Three { frames, part } => {
                let bytes = frames.look(how)?;
                part.ledger.set_memory(how.memory.saturating_sub(bytes));
            }
        }
        Ok(())
    }

    /// Moves the scans that are elsewhere in `moved`, the same log with other poses, by more than `tolerance` (meters).
    /// Returns how many moved; what the report counts is what that added, less what it took away.
    pub(crate) fn repose(
        &mut self,
        moved: &Log,
        settings: &Settings,
        tolerance: f64,
        progress: &Progress,
    ) -> anyhow::Result<Reposed> {
        match (self, moved) {
            (Self::Two { log, limits, part, .. }, Log::Two(moved)) => {
                check_same_length(log.len(), moved.len(), &part.name)?;
                let read =
                    |i: usize| (log.scan(i, limits), moved.raw(i).world_from_laser, moved.scan(i, limits));
                part.repose(
                    log.len(),
                    tolerance,
                    progress,
                    |i| Ok(moved.raw(i).world_from_laser),
                    |i| Ok(read(i)),
                )
            }
            (Self::Three { frames, part }, Log::Three(moved)) => {
                check_same_length(frames.log.len(), moved.len(), &part.name)?;
                let after = Frames::new(moved, &[], settings)?;
                let read = |i: usize| {
                    let before = frames.frame(i)?.0;
                    Ok((before, *moved.pose(i), after.frame(i)?.0))
                };
                part.repose(moved.len(), tolerance, progress, |i| Ok(*moved.pose(i)), read)
            }
            _ => bail!("the log with the new poses is of another dimension"),
        }
    }

    /// The ledger as a file, with the maps that follow from it, and the box that they cover. Where it did not fit into memory,
    /// what is to be added up in the end.
    pub(crate) fn finish(self, settings: &Settings) -> anyhow::Result<(SavedMap, Extent, Option<Aside>)> {
        match self {
            Self::Two { mut part, .. } => {
                if part.is_aside()? {
                    return Ok((SavedMap::Two(part.file), Extent::OnDisk, Some(part.aside)));
                }
                let (file, extent) = in_file_2d(*part.ledger, part.file, settings)?;
                Ok((file, extent, None))
            }
            Self::Three { mut part, .. } => {
                if part.is_aside()? {
                    return Ok((SavedMap::Three(part.file), Extent::OnDisk, Some(part.aside)));
                }
                let (file, extent) = in_file_3d(*part.ledger, part.file)?;
                Ok((file, extent, None))
            }
        }
    }
}

/// Scans that were moved.
#[derive(Default)]
pub(crate) struct Reposed {
    pub(crate) moved: u64,
    /// Scans of the log that are in the map.
    pub(crate) held: u64,
    /// What taking them away and adding them did.
    pub(crate) taken: ScanStats,
    pub(crate) added: ScanStats,
}

fn check_same_length(ours: usize, theirs: usize, log: &str) -> anyhow::Result<()> {
    if ours != theirs {
        bail!(
            "{log}: {ours} scans have poses, and {theirs} with the new ones; give new poses for the same scans"
        );
    }
    Ok(())
}

impl<'a, const D: usize> Part<'a, D> {
    fn new(
        name: String,
        indices: &'a [usize],
        mut file: Box<MapFile<D>>,
        how: MapperSettings<D>,
        first: [f64; D],
        out: &Path,
    ) -> anyhow::Result<Self> {
        // Only in a map of this log alone is the end all that was not there before.
        let ends = file.ledger.is_none().then(|| [2, 3].map(|fifths| fifths * indices.len() / 5));
        let ledger = match file.ledger.take() {
            Some(mut ledger) => {
                check_as_asked(&ledger, &how)?;
                ledger.set_memory(how.memory);
                ledger
            }
            None => {
                let origin = Some(how.origin_near(first));
                Ledger::new(MapperSettings { origin, ..how })?
            }
        };
        let (ledger, aside) = (Box::new(ledger), Aside::new(out));
        Ok(Self { name, indices, ledger, file, aside, parts: Vec::new(), added: 0, ends })
    }

    /// Counts a scan, and keeps the distances where a part of the log ends: they share their bricks with the whole until that
    /// changes them. Only where there may be memory for all three.
    fn count_scan(&mut self) {
        self.added += 1;
        if self.ends.is_some_and(|ends| ends.contains(&self.added))
            && self.aside.is_unused()
            && self.ledger.memory_bytes() < self.ledger.settings().memory / 3
        {
            self.parts.extend(self.ledger.distance_sums().cloned());
        }
    }

    /// How sure the surface is.
    ///
    /// # Errors
    /// Why that is not known.
    fn calibration(&self) -> Result<Calibration, String> {
        let why = match (self.ledger.distance_sums(), &self.parts[..]) {
            (Some(whole), [first, until]) if self.aside.is_unused() => {
                return Calibration::of([first, until, whole], self.ledger.settings().truncation());
            }
            (None, _) => "there are no signed distances",
            _ => match self.ends {
                None => "it takes the beginning and the end of one log, mapped at once",
                Some([first, until]) if first == 0 || first == until => {
                    "so few scans are the log of one visit"
                }
                Some([_, until]) if self.added < until => "not all of the log was fused",
                Some(_) => "--memory leaves no room for the parts of the log",
            },
        };
        Err(why.to_owned())
    }

    /// Adds a scan; where there is no room for it, what is there is put aside first.
    fn add(
        &mut self,
        index: usize,
        pose: &Pose<D>,
        scan: &(impl portolan::map::ScanKind<D> + Sync),
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, LedgerError> {
        if self.aside.holds(&self.name, index as u64) {
            return Err(LedgerError::Twice { log: self.name.clone(), index: index as u64 });
        }
        let added = self.ledger.add_timed(&self.name, index as u64, pose, scan, clock);
        if added.is_ok() {
            self.count_scan();
        }
        match added {
            Err(LedgerError::Map(MapError::Full(_))) if !self.ledger.scans().is_empty() => {
                if let Err(error) = self.put_aside() {
                    self.aside.fail(error);
                    return added;
                }
                self.ledger.add_timed(&self.name, index as u64, pose, scan, clock)
            }
            _ => added,
        }
    }

    /// Writes the ledger into a file and begins another one. Parts of the log are of no use from then on.
    fn put_aside(&mut self) -> anyhow::Result<()> {
        self.parts.clear();
        let empty = Ledger::new(*self.ledger.settings())?;
        let full = std::mem::replace(&mut *self.ledger, empty);
        self.aside.put(full)
    }

    /// Whether something was put aside; what is left then is, too.
    fn is_aside(&mut self) -> anyhow::Result<bool> {
        if self.aside.is_empty()? {
            return Ok(false);
        }
        if !self.ledger.scans().is_empty() {
            self.put_aside()?;
        }
        Ok(true)
    }

    fn repose<S: portolan::map::ScanKind<D> + Sync>(
        &mut self,
        scans: usize,
        tolerance: f64,
        progress: &Progress,
        pose: impl Fn(usize) -> anyhow::Result<Pose<D>>,
        read: impl Fn(usize) -> anyhow::Result<(S, Pose<D>, S)>,
    ) -> anyhow::Result<Reposed> {
        let mut done = Reposed::default();
        for i in 0..scans {
            let Some(record) = self.ledger.scans().get(&self.name, i as u64).copied() else { continue };
            done.held += 1;
            if displacement(&record.world_from_sensor, &pose(i)?) > tolerance {
                let (before, pose, after) = read(i)?;
                let [taken, added] = self.ledger.replace(&self.name, i as u64, &before, &pose, &after).map_err(
                    |error| match error {
                        LedgerError::OtherReadings { .. } => anyhow!(
                            "{error}: give the log with the poses that it was mapped with, as then, and the new ones \
                             with --repose"
                        ),
                        other => other.into(),
                    },
                )?;
                done.moved += 1;
                done.taken += taken;
                done.added += added;
            }
            progress.add(1);
        }
        if done.held == 0 {
            bail!("{}: no scan of this log is in the map; logs are known by their file names", self.name);
        }
        Ok(done)
    }
}

/// Refuses to go on with a ledger of another box or other maps than are asked for: it cannot get them any more.
fn check_as_asked<const D: usize>(ledger: &Ledger<D>, how: &MapperSettings<D>) -> anyhow::Result<()> {
    let held = ledger.settings();
    if how.bounds.is_some_and(|bounds| held.bounds != Some(bounds)) {
        bail!(
            "--bounds: the map has others, or none, and keeps them; leave it out, or write to another folder"
        );
    }
    if how.origin.is_some_and(|origin| held.origin != Some(origin)) {
        bail!("--shift: the cells of the map begin elsewhere; leave it out, or write to another folder");
    }
    let missing = [
        (how.occupancy.is_some() && held.occupancy.is_none(), "occupancy (grid, tree)"),
        (how.distances && !held.distances, "tsdf"),
        (how.attenuation.is_some() && held.attenuation.is_none(), "attenuation"),
    ];
    match missing.iter().find(|(missing, _)| *missing) {
        Some((_, map)) => {
            bail!("--maps: the map holds no {map}; leave it out of --maps, or write to another folder")
        }
        None => Ok(()),
    }
}

/// How far the sensor, or what it sees 10 m away, is between two poses (meters).
fn displacement<const D: usize>(a: &Pose<D>, b: &Pose<D>) -> f64 {
    const REACH: f64 = 10.0;
    let mut most = distance(a.translation, b.translation);
    for k in 0..D {
        let axis = scale(std::array::from_fn(|j| f64::from(j == k)), REACH);
        for end in [axis, scale(axis, -1.0)] {
            most = most.max(distance(a.transform_point(end), b.transform_point(end)));
        }
    }
    most
}

impl super::fuse::TakesFrames for Part<'_, 3> {
    fn take(
        &mut self,
        index: usize,
        pose: &Pose<3>,
        frame: &portolan::scan::Frame,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, LedgerError> {
        self.add(index, pose, frame, clock)
    }

    fn is_free(&self, p: [f64; 3]) -> Option<bool> {
        Agreement::is_free(self.ledger.signed_distance(p), self.ledger.probability(p))
    }

    fn resolution(&self) -> f64 {
        self.ledger.settings().resolution
    }

    fn memory_bytes(&self) -> usize {
        self.ledger.memory_bytes()
    }
}

/// Puts a ledger into a file, with the maps that follow from it.
pub(crate) fn in_file_2d(
    ledger: Ledger<2>,
    mut file: Box<MapFile<2>>,
    settings: &Settings,
) -> anyhow::Result<(SavedMap, Extent)> {
    describe(&ledger, &mut file);
    let mapper = mapper_of(&ledger)?;
    if ledger.scans().is_empty() {
        let grid = Grid::new([0.0; 2], ledger.settings().resolution, [0; 2]);
        file.ledger = Some(ledger);
        return Ok((SavedMap::Two(file), Extent::Two(grid)));
    }
    let grid = crate::library::grid(&mapper, "the map")?;
    let wants = |kind| settings.wants(kind);
    let kinds = OccupancyKinds { grid: wants(MapKind::Grid), tree: wants(MapKind::Tree) };
    store_2d(mapper, kinds, &grid, &mut file)?;
    file.ledger = Some(ledger);
    Ok((SavedMap::Two(file), Extent::Two(grid)))
}

/// [`in_file_2d`] in 3-D.
pub(crate) fn in_file_3d(ledger: Ledger<3>, mut file: Box<MapFile<3>>) -> anyhow::Result<(SavedMap, Extent)> {
    describe(&ledger, &mut file);
    let mapper = mapper_of(&ledger)?;
    store_3d(mapper, &mut file);
    file.ledger = Some(ledger);
    let extent = Extent::of_bricks(&file);
    Ok((SavedMap::Three(file), extent))
}

fn mapper_of<const D: usize>(ledger: &Ledger<D>) -> anyhow::Result<Mapper<D>> {
    // Of cells with a byte or eight each beside sums of four or more: what the sums had room for, these have.
    let mut unlimited = ledger.clone();
    unlimited.set_memory(usize::MAX);
    Ok(unlimited.mapper()?)
}

/// What the header says of a ledger: the same for any way in which it came about.
fn describe<const D: usize>(ledger: &Ledger<D>, file: &mut MapFile<D>) {
    file.header.logs = ledger.scans().logs().map(str::to_owned).collect();
    file.header.scans = ledger.scans().len() as u64;
    file.poses = ledger.scans().iter().map(|(_, _, record)| record.world_from_sensor).collect();
}

/// The frames of a log.
impl<'a> Frames<'a> {
    pub(crate) fn new(log: &'a ScanLog, indices: &'a [usize], settings: &Settings) -> anyhow::Result<Self> {
        let filter = settings.shape.range.filter(settings.shape.self_filter.clone())?;
        Ok(Self { log, indices, filter, points_only: settings.shape.points_only, judge: None })
    }
}
