//! The maps of a mapper, and one scan into all of them.

use super::MapperSettings;
use super::derived::Derived;
use crate::geom::{Lattice, Pose};
use crate::map::{MapError, Occupancy, ScanKind, Tsdf};
use crate::parallel;
use crate::scan::ScanStats;
use crate::store::Store;
use std::sync::atomic::{AtomicUsize, Ordering};

/// An occupancy map and signed distances of the same scans, and what is derived from them.
///
/// ```
/// use portolan::{Mapper, geom::Pose, scan::{RangeLimits, Scan}};
///
/// // A laser in the middle of a room of 4 m x 4 m, 360 beams.
/// let bearings: Vec<f64> = (0..360).map(|d| f64::from(d - 180).to_radians()).collect();
/// let ranges: Vec<f64> = bearings.iter().map(|b| 2.0 / b.cos().abs().max(b.sin().abs())).collect();
/// let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
///
/// let mut mapper = Mapper::<2>::new(0.05);
/// mapper.integrate(&Pose::<2>::IDENTITY, &scan)?;
/// assert!((mapper.contour().length() - 16.0).abs() < 0.2);
/// let esdf = mapper.esdf().expect("distances are made by default");
/// let (clearance, away) = esdf.distance_and_gradient([1.5, 0.02]).known().expect("seen by the laser");
/// assert!((clearance - 0.5).abs() < 0.05 && away[0] < -0.9);
/// assert!(mapper.occupancy().unwrap().probability([1.0, 0.0]).known() < Some(0.5));
/// # Ok::<(), portolan::map::MapError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mapper<const D: usize> {
    settings: MapperSettings<D>,
    maps: Maps<D>,
    stats: ScanStats,
    pub(super) derived: Derived<D>,
}

/// The maps; none before the first scan has said where the lattice begins.
#[derive(Clone, Debug, Default)]
struct Maps<const D: usize> {
    occupancy: Option<Occupancy<D>>,
    tsdf: Option<Tsdf<D>>,
    made: bool,
}

/// What a scan did to each map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fused {
    /// To the occupancy map, if there is one.
    pub occupancy: Option<ScanStats>,
    /// To the signed distances, if there are any.
    pub distances: Option<ScanStats>,
    /// Seconds that each of the two took, by the caller's clock.
    pub seconds: [f64; 2],
}

impl Fused {
    fn of(occupancy: Option<Timed>, distances: Option<Timed>) -> Result<Self, MapError> {
        let seconds = [&occupancy, &distances].map(|timed| timed.as_ref().map_or(0.0, |timed| timed.1));
        let occupancy = occupancy.map(|timed| timed.0).transpose()?;
        Ok(Self { occupancy, distances: distances.map(|timed| timed.0).transpose()?, seconds })
    }

    /// Of the map that comes last; what became of the beams is the same in both.
    pub fn stats(&self) -> ScanStats {
        self.distances.or(self.occupancy).unwrap_or_default()
    }
}

impl<const D: usize> Mapper<D> {
    /// A mapper with cells of this edge (meters) and [the usual settings](MapperSettings::new). Maps are made when the
    /// first scan comes.
    pub fn new(resolution: f64) -> Self {
        Self::with(MapperSettings::new(resolution))
    }

    /// A mapper with these settings.
    pub fn with(settings: MapperSettings<D>) -> Self {
        Self { settings, maps: Maps::default(), stats: ScanStats::default(), derived: Derived::default() }
    }

    /// A mapper that goes on with these maps; missing ones are not made. The maps keep their lattices and filters: resolution,
    /// truncation, weights and clamp of the signed distances are theirs, whatever `settings` say.
    ///
    /// # Errors
    /// Where a setting is not possible.
    pub fn of_maps(
        settings: MapperSettings<D>,
        occupancy: Option<Occupancy<D>>,
        tsdf: Option<Tsdf<D>>,
    ) -> Result<Self, MapError> {
        settings.check()?;
        let resolution = occupancy.as_ref().map(|map| map.store().lattice().resolution);
        let settings = MapperSettings { resolution: resolution.unwrap_or(settings.resolution), ..settings };
        let settings = tsdf.as_ref().map_or(settings, |map| settings.with_filter(map.config()));
        let mut mapper = Self::with(settings);
        let occupancy = occupancy.map(|map| map.with_sweep(settings.occupancy_sweep()));
        let tsdf = tsdf.map(|map| {
            let config = settings.tsdf(map.lattice().origin);
            let (distances, colors) = map.into_stores();
            Tsdf::from_stores(distances, colors, config)
        });
        mapper.maps = Maps { occupancy, tsdf: tsdf.transpose()?, made: true };
        mapper.bound();
        Ok(mapper)
    }

    /// Fuses one scan, taken at a known pose, into the maps. Both hold the same bytes for any number of threads.
    ///
    /// # Errors
    /// Where a setting is not possible; else as [`Tsdf::integrate`] and [`Occupancy::integrate`]. Where one map is full, the
    /// other may hold the scan.
    pub fn integrate(
        &mut self,
        world_from_sensor: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
    ) -> Result<ScanStats, MapError> {
        self.integrate_timed(world_from_sensor, scan, &|| 0.0).map(|fused| fused.stats())
    }

    /// [`Mapper::integrate`], with what the scan did to each map and how long it took by `clock` (seconds).
    ///
    /// # Errors
    /// As [`Mapper::integrate`].
    pub fn integrate_timed(
        &mut self,
        world_from_sensor: &Pose<D>,
        scan: &(impl ScanKind<D> + Sync),
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, MapError> {
        if !world_from_sensor.is_rigid() {
            let refused = ScanStats::refused_pose();
            self.stats += refused;
            return Ok(Fused { distances: Some(refused), ..Default::default() });
        }
        self.prepare(world_from_sensor.translation)?;
        let fused = self.fuse(world_from_sensor, scan, clock)?;
        self.stats += fused.stats();
        Ok(fused)
    }

    /// Makes the maps that are asked for, on a lattice that fits a sensor at `first`, if there are none yet.
    ///
    /// # Errors
    /// Where a setting is not possible.
    pub fn prepare(&mut self, first: [f64; D]) -> Result<(), MapError> {
        if self.maps.made {
            return Ok(());
        }
        let settings = &self.settings;
        settings.check()?;
        let origin = settings.origin_near(first);
        let lattice = Lattice::new(origin, settings.resolution);
        let occupancy = settings.occupancy.map(|model| {
            Occupancy::<D>::new(lattice, model).map(|map| map.with_sweep(settings.occupancy_sweep()))
        });
        let tsdf = settings.distances.then(|| Tsdf::<D>::new(settings.tsdf(origin)));
        self.maps = Maps { occupancy: occupancy.transpose()?, tsdf: tsdf.transpose()?, made: true };
        self.bound();
        Ok(())
    }

    fn bound(&mut self) {
        let bounds = self.settings.bounds;
        self.maps.occupancy.iter_mut().for_each(|map| map.set_bounds(bounds));
        self.maps.tsdf.iter_mut().for_each(|map| map.set_bounds(bounds));
    }

    /// Fuses scans in their order, as [`Mapper::integrate`] does one by one: the same bytes. In 2-D, where a scan is planned
    /// on one thread, each map goes through all of them on a thread of its own. `clock` as for [`Mapper::integrate_timed`].
    ///
    /// A result a scan. A map that is full ends the list, with that error; the other map may hold a few scans more.
    pub fn integrate_all(
        &mut self,
        scans: &[(Pose<D>, impl ScanKind<D> + Sync)],
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Vec<Result<Fused, MapError>> {
        let memory = self.settings.memory;
        let first = scans.iter().find(|(pose, _)| pose.is_rigid());
        let ready = first.map_or(Ok(()), |(pose, _)| self.prepare(pose.translation));
        let (true, Ok(())) = (D == 2 && self.maps.made, ready) else {
            let mut full = false;
            let mut one = |(pose, scan): &(Pose<D>, _)| {
                let fused = self.integrate_timed(pose, scan, clock);
                let ended = std::mem::replace(&mut full, matches!(fused, Err(MapError::Full(_))));
                (!ended).then_some(fused)
            };
            return scans.iter().map_while(&mut one).collect();
        };
        let Maps { occupancy, tsdf, .. } = &mut self.maps;
        let [a, b] = bytes(occupancy, tsdf);
        // Each may use half of what is left.
        let half = memory.saturating_sub(a + b) / 2;
        occupancy.iter_mut().for_each(|map| map.set_limit(a.saturating_add(half)));
        tsdf.iter_mut().for_each(|map| map.set_limit(b.saturating_add(half)));
        let full = AtomicUsize::new(usize::MAX);
        let (occupancy, distances) = parallel::join(
            || fuse_all(occupancy, scans, clock, &full, |map, pose, scan| map.integrate(pose, scan)),
            || fuse_all(tsdf, scans, clock, &full, |map, pose, scan| map.integrate(pose, scan)),
        );
        let fused: Vec<_> = occupancy.into_iter().zip(distances).map(|(a, b)| Fused::of(a, b)).collect();
        fused.iter().flatten().for_each(|fused| self.stats += fused.stats());
        fused
    }

    fn fuse(
        &mut self,
        pose: &Pose<D>,
        scan: &impl ScanKind<D>,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, MapError> {
        let memory = self.settings.memory;
        let Maps { occupancy, tsdf, .. } = &mut self.maps;
        let [_, b] = bytes(occupancy, tsdf);
        let of_occupancy = occupancy.as_mut().map(|map| {
            map.set_limit(memory.saturating_sub(b));
            timed(clock, || map.integrate(pose, scan))
        });
        let [a, _] = bytes(occupancy, tsdf);
        let of_distances = tsdf.as_mut().map(|map| {
            map.set_limit(memory.saturating_sub(a));
            timed(clock, || map.integrate(pose, scan))
        });
        Fused::of(of_occupancy, of_distances)
    }

    /// The occupancy map; `None` where there is none, or before the first scan.
    pub fn occupancy(&self) -> Option<&Occupancy<D>> {
        self.maps.occupancy.as_ref()
    }

    /// The signed distances; `None` where there are none, or before the first scan.
    pub fn tsdf(&self) -> Option<&Tsdf<D>> {
        self.maps.tsdf.as_ref()
    }

    /// The signed distances, for watching cells.
    pub fn tsdf_mut(&mut self) -> Option<&mut Tsdf<D>> {
        self.maps.tsdf.as_mut()
    }

    /// The maps themselves: occupancy, signed distances.
    pub fn into_maps(self) -> (Option<Occupancy<D>>, Option<Tsdf<D>>) {
        (self.maps.occupancy, self.maps.tsdf)
    }

    /// Allows no more than `bytes` for both maps from now on.
    pub fn set_memory(&mut self, bytes: usize) {
        self.settings.memory = bytes;
    }

    /// What all scans did so far.
    pub fn stats(&self) -> &ScanStats {
        &self.stats
    }

    /// The settings.
    pub fn settings(&self) -> &MapperSettings<D> {
        &self.settings
    }

    /// Bytes of the maps and of what is derived from them: measured, not estimated.
    pub fn memory_bytes(&self) -> usize {
        self.occupancy().map_or(0, Occupancy::<D>::memory_bytes)
            + self.tsdf().map_or(0, Tsdf::memory_bytes)
            + self.derived.memory_bytes()
    }
}

/// What a map said to a scan, and the seconds that it took.
type Timed = (Result<ScanStats, MapError>, f64);

/// Bytes of the two maps.
fn bytes<const D: usize>(occupancy: &Option<Occupancy<D>>, tsdf: &Option<Tsdf<D>>) -> [usize; 2] {
    [occupancy.as_ref().map_or(0, Occupancy::<D>::memory_bytes), tsdf.as_ref().map_or(0, Tsdf::memory_bytes)]
}

/// All scans into one map, up to the one that it, or the other one, had no room for: `None` for each where there is no map.
fn fuse_all<M, S, const D: usize>(
    map: &mut Option<M>,
    scans: &[(Pose<D>, S)],
    clock: &(dyn Fn() -> f64 + Sync),
    full: &AtomicUsize,
    integrate: impl Fn(&mut M, &Pose<D>, &S) -> Result<ScanStats, MapError>,
) -> Vec<Option<Timed>> {
    let Some(map) = map else { return scans.iter().map(|_| None).collect() };
    let mut done = Vec::with_capacity(scans.len());
    for (i, (pose, scan)) in scans.iter().enumerate() {
        if i > full.load(Ordering::Relaxed) {
            break;
        }
        let timed = timed(clock, || integrate(map, pose, scan));
        if let Err(MapError::Full(_)) = timed.0 {
            full.fetch_min(i, Ordering::Relaxed);
        }
        done.push(Some(timed));
    }
    done
}

fn timed<T>(clock: &(dyn Fn() -> f64 + Sync), work: impl FnOnce() -> T) -> (T, f64) {
    let start = clock();
    let result = work();
    (result, clock() - start)
}
