//! One scan into a ledger, out of it, or elsewhere.

use super::sum_map::SumMap;
use super::{Ledger, LedgerError, LedgerScans, ScanRecord};
use crate::cell::{ColorRule, LogOdds8, Sign};
use crate::geom::{Lattice, Pose};
use crate::map::{Attenuation, MapError, Occupancy, ScanKind, Tsdf};
use crate::mapper::{Fused, MapperSettings, timed};
use crate::parallel;
use crate::scan::ScanStats;
use crate::store::{Bricks, SumStore};

/// Coordinates beyond so many cells from the origin need an origin of their own.
const FAR_CELLS: f64 = 1e6;

impl<const D: usize> Ledger<D> {
    /// A ledger of the maps that the settings ask for, without scans. Its cells begin at the settings' origin, zero unless they
    /// give one. Clamp and half-lives are left aside: sums do not forget by themselves.
    ///
    /// # Errors
    /// Where a setting is not possible.
    pub fn new(settings: MapperSettings<D>) -> Result<Self, LedgerError> {
        settings.check()?;
        let color = settings.color && settings.distances;
        let settings = MapperSettings { w_max: f32::INFINITY, color, ..settings };
        let origin = settings.origin.unwrap_or([0.0; D]);
        let lattice = Lattice::new(origin, settings.resolution);
        let config = settings.tsdf(origin);
        let occupancy = settings.occupancy.map(|model| {
            let rule = <LogOdds8 as crate::cell::LogOddsValue>::rule(&model).map_err(MapError::from)?;
            let map = Occupancy::from_store(SumStore::new(Bricks::new(lattice), rule), model)?;
            Ok::<_, MapError>(map.with_sweep(settings.occupancy_sweep()))
        });
        let tsdf = settings.distances.then(|| {
            let rule = ColorRule { w_max: config.color_w_max };
            let colors = settings.color.then(|| SumStore::new(Bricks::new(lattice), rule));
            Tsdf::from_stores(SumStore::new(Bricks::new(lattice), config.rule()?), colors, config)
        });
        let attenuation = settings.attenuation.map(|_| {
            let map = Attenuation::from_store(
                SumStore::new(Bricks::new(lattice), Default::default()),
                Default::default(),
            )?;
            Ok::<_, MapError>(map.with_sweep(settings.occupancy_sweep()))
        });
        let mut ledger = Self {
            occupancy: occupancy.transpose()?,
            tsdf: tsdf.transpose()?,
            attenuation: attenuation.transpose()?,
            scans: LedgerScans::default(),
            settings,
        };
        ledger.occupancy.iter_mut().for_each(|map| map.keep_within(settings.bounds));
        ledger.tsdf.iter_mut().for_each(|map| map.keep_within(settings.bounds));
        ledger.attenuation.iter_mut().for_each(|map| map.keep_within(settings.bounds));
        Ok(ledger)
    }

    /// Adds a scan, taken at a known pose, under the name of its log and its number in it.
    ///
    /// # Errors
    /// [`LedgerError`]: where the scan is there already, or another one of this name, its pose has no cell, or there is no
    /// room for all of it. The ledger is then as before.
    pub fn add(
        &mut self,
        log: &str,
        index: u64,
        world_from_sensor: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
    ) -> Result<ScanStats, LedgerError> {
        self.add_timed(log, index, world_from_sensor, scan, &|| 0.0).map(|fused| fused.stats())
    }

    /// [`Ledger::add`], with what the scan did to each map and how long it took by `clock` (seconds).
    ///
    /// # Errors
    /// As [`Ledger::add`].
    pub fn add_timed(
        &mut self,
        log: &str,
        index: u64,
        world_from_sensor: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, LedgerError> {
        let fingerprint = self.fingerprint(scan);
        if self.scans.get(log, index).is_some() {
            self.scans.held(log, index, fingerprint)?;
            return Err(LedgerError::Twice { log: log.to_owned(), index });
        }
        let lattice = Lattice::new(self.settings.origin.unwrap_or([0.0; D]), self.settings.resolution);
        if !world_from_sensor.is_rigid() || lattice.cell_of(world_from_sensor.translation).is_none() {
            return Err(LedgerError::Pose { log: log.to_owned(), index });
        }
        let meters = world_from_sensor.translation.iter().fold(0.0, |far: f64, v| far.max(v.abs()));
        if self.settings.origin.is_none() && meters / self.settings.resolution > FAR_CELLS {
            return Err(LedgerError::Far { meters });
        }
        let fused = self.fuse(world_from_sensor, scan, Sign::Plus, clock)?;
        let record = ScanRecord { world_from_sensor: *world_from_sensor, fingerprint };
        self.scans.insert(log, index, record);
        Ok(fused)
    }

    /// Takes a scan away: the ledger is as if it had never been added. Returns what adding it had returned.
    ///
    /// # Errors
    /// [`LedgerError`]: where the scan is not there, or was another one. The ledger is then as before.
    pub fn subtract(
        &mut self,
        log: &str,
        index: u64,
        scan: &(impl ScanKind<D> + Sync),
    ) -> Result<ScanStats, LedgerError> {
        let record = self.scans.held(log, index, self.fingerprint(scan))?;
        let fused = self.fuse(&record.world_from_sensor, scan, Sign::Minus, &|| 0.0)?;
        self.scans.remove(log, index);
        Ok(fused.stats())
    }

    /// Moves a scan to another pose: the ledger is as if it had been added there. Returns what taking it away and adding it
    /// returned.
    ///
    /// # Errors
    /// As [`Ledger::replace`].
    pub fn repose(
        &mut self,
        log: &str,
        index: u64,
        world_from_sensor: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
    ) -> Result<[ScanStats; 2], LedgerError> {
        self.replace(log, index, scan, world_from_sensor, scan)
    }

    /// Puts other readings at another pose in the place of a scan: those of a sensor that moved while it scanned depend on its
    /// poses. Returns what taking it away and adding it returned.
    ///
    /// # Errors
    /// [`LedgerError`]: where the scan is not there, was another one, or cannot be at the new pose. The ledger is then as
    /// before.
    pub fn replace(
        &mut self,
        log: &str,
        index: u64,
        before: &(impl ScanKind<D> + Sync),
        world_from_sensor: &Pose<D>,
        after: &(impl ScanKind<D> + Sync),
    ) -> Result<[ScanStats; 2], LedgerError> {
        let record = self.scans.held(log, index, self.fingerprint(before))?;
        let taken = self.subtract(log, index, before)?;
        match self.add(log, index, world_from_sensor, after) {
            Ok(added) => Ok([taken, added]),
            Err(error) => {
                let memory = std::mem::replace(&mut self.settings.memory, usize::MAX);
                let back = self.add(log, index, &record.world_from_sensor, before);
                self.settings.memory = memory;
                back.and(Err(error))
            }
        }
    }

    /// What tells the scan's readings from others, as far as the maps read them.
    fn fingerprint(&self, scan: &impl ScanKind<D>) -> u64 {
        if self.settings.color { scan.fingerprint_with_colors() } else { scan.fingerprint() }
    }

    /// Adds a scan to the maps, or takes it from them: from all or from none. In 2-D, where a scan is planned on one thread,
    /// each map has a thread of its own.
    fn fuse(
        &mut self,
        pose: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
        sign: Sign,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, LedgerError> {
        self.share_memory();
        let (distances, (occupancy, attenuation)) = if D == 2 {
            let Self { occupancy, tsdf, attenuation, .. } = self;
            parallel::join(
                || fuse_one(tsdf, pose, scan, sign, clock),
                || {
                    parallel::join(
                        || fuse_one(occupancy, pose, scan, sign, clock),
                        || fuse_one(attenuation, pose, scan, sign, clock),
                    )
                },
            )
        } else {
            let distances = fuse_one(&mut self.tsdf, pose, scan, sign, clock);
            self.share_memory();
            let occupancy = fuse_one(&mut self.occupancy, pose, scan, sign, clock);
            self.share_memory();
            (distances, (occupancy, fuse_one(&mut self.attenuation, pose, scan, sign, clock)))
        };
        let done = [&occupancy, &distances, &attenuation].map(|fused| matches!(fused, Ok(Some(_))));
        let seconds = [&occupancy, &distances, &attenuation].map(|fused| match fused {
            Ok(Some((_, seconds))) => *seconds,
            _ => 0.0,
        });
        let stats = |fused: One| fused.map(|one| one.map(|(stats, _)| stats));
        match (stats(occupancy), stats(distances), stats(attenuation)) {
            (Ok(occupancy), Ok(distances), Ok(attenuation)) => {
                Ok(Fused { occupancy, distances, attenuation, seconds })
            }
            (Err(error), ..) | (_, Err(error), _) | (.., Err(error)) => {
                self.undo(pose, scan, sign, done)?;
                Err(error)
            }
        }
    }

    /// Undoes what those maps did that took a scan which another one refused.
    fn undo(
        &mut self,
        pose: &Pose<D>,
        scan: &impl ScanKind<D>,
        sign: Sign,
        done: [bool; 3],
    ) -> Result<(), LedgerError> {
        self.set_limits([usize::MAX; 3]);
        let (back, nothing) = (sign.opposite(), &|| 0.0);
        if done[0] {
            fuse_one(&mut self.occupancy, pose, scan, back, nothing)?;
        }
        if done[1] {
            fuse_one(&mut self.tsdf, pose, scan, back, nothing)?;
        }
        if done[2] {
            fuse_one(&mut self.attenuation, pose, scan, back, nothing)?;
        }
        Ok(())
    }

    /// Each map may use all that is left, where one comes after the other, else a part of it.
    fn share_memory(&mut self) {
        let (held, memory) = (self.bytes(), self.settings.memory);
        let maps = [self.occupancy.is_some(), self.tsdf.is_some(), self.attenuation.is_some()];
        let at_once = if D == 2 { maps.iter().filter(|there| **there).count().max(1) } else { 1 };
        let part = memory.saturating_sub(held.iter().sum()) / at_once;
        self.set_limits(if memory == usize::MAX { [memory; 3] } else { held.map(|own| own + part) });
    }

    fn set_limits(&mut self, [a, b, c]: [usize; 3]) {
        self.occupancy.iter_mut().for_each(|map| map.limit(a));
        self.tsdf.iter_mut().for_each(|map| map.limit(b));
        self.attenuation.iter_mut().for_each(|map| map.limit(c));
    }

    /// Bytes of occupancy, distances, hits per meter.
    fn bytes(&self) -> [usize; 3] {
        [
            self.occupancy.as_ref().map_or(0, SumMap::bytes),
            self.tsdf.as_ref().map_or(0, SumMap::bytes),
            self.attenuation.as_ref().map_or(0, SumMap::bytes),
        ]
    }

    /// Bytes of the sums and of what finds them: measured, not estimated. Without the list of scans.
    pub fn memory_bytes(&self) -> usize {
        self.bytes().iter().sum()
    }

    /// Allows no more than `bytes` for all sums from now on.
    pub fn set_memory(&mut self, bytes: usize) {
        self.settings.memory = bytes;
    }

    /// The settings.
    pub fn settings(&self) -> &MapperSettings<D> {
        &self.settings
    }

    /// The scans that are in it.
    pub fn scans(&self) -> &LedgerScans<D> {
        &self.scans
    }
}

/// What a map did with a scan, and the seconds that it took; `None`: there is no such map.
type One = Result<Option<(ScanStats, f64)>, LedgerError>;

fn fuse_one<M: SumMap<D>, const D: usize>(
    map: &mut Option<M>,
    pose: &Pose<D>,
    scan: &impl ScanKind<D>,
    sign: Sign,
    clock: &(dyn Fn() -> f64 + Sync),
) -> One {
    let Some(map) = map else { return Ok(None) };
    let (stats, seconds) = timed(clock, || map.fuse(pose, scan, sign));
    Ok(Some((stats?, seconds)))
}
