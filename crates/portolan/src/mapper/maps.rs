//! The maps of a mapper, and one scan into all of them.

use super::MapperSettings;
use super::derived::Derived;
use crate::geom::{Aabb, Lattice, Pose};
use crate::map::{Attenuation, MapError, Occupancy, ScanKind, Tsdf};
use crate::parallel;
use crate::scan::ScanStats;
use crate::store::Store;
use std::sync::atomic::{AtomicUsize, Ordering};

/// An occupancy map, signed distances and hits per meter of the same scans, and what is derived from them.
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
    maps: MapperMaps<D>,
    /// Whether the maps are there: the first scan says where their lattice begins.
    made: bool,
    stats: ScanStats,
    pub(super) derived: Derived<D>,
}

/// The maps of a mapper; `None`: no such map.
#[derive(Clone, Debug, Default)]
pub struct MapperMaps<const D: usize> {
    /// Log odds of being occupied.
    pub occupancy: Option<Occupancy<D>>,
    /// Signed distances.
    pub tsdf: Option<Tsdf<D>>,
    /// Hits per meter.
    pub attenuation: Option<Attenuation<D>>,
}

impl<const D: usize> MapperMaps<D> {
    /// Bytes of each map, in the order of the fields.
    fn bytes(&self) -> [usize; 3] {
        [
            self.occupancy.as_ref().map_or(0, Occupancy::<D>::memory_bytes),
            self.tsdf.as_ref().map_or(0, Tsdf::memory_bytes),
            self.attenuation.as_ref().map_or(0, Attenuation::<D>::memory_bytes),
        ]
    }

    fn set_limits(&mut self, [a, b, c]: [usize; 3]) {
        self.occupancy.iter_mut().for_each(|map| map.set_limit(a));
        self.tsdf.iter_mut().for_each(|map| map.set_limit(b));
        self.attenuation.iter_mut().for_each(|map| map.set_limit(c));
    }

    fn set_bounds(&mut self, bounds: Option<Aabb<D>>) {
        self.occupancy.iter_mut().for_each(|map| map.set_bounds(bounds));
        self.tsdf.iter_mut().for_each(|map| map.set_bounds(bounds));
        self.attenuation.iter_mut().for_each(|map| map.set_bounds(bounds));
    }
}

/// What a scan did to each map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fused {
    /// To the occupancy map, if there is one.
    pub occupancy: Option<ScanStats>,
    /// To the signed distances, if there are any.
    pub distances: Option<ScanStats>,
    /// To the hits per meter, if there are any.
    pub attenuation: Option<ScanStats>,
    /// Seconds that each of the three took, by the caller's clock.
    pub seconds: [f64; 3],
}

impl Fused {
    fn of([occupancy, distances, attenuation]: [Option<Timed>; 3]) -> Result<Self, MapError> {
        let seconds = [&occupancy, &distances, &attenuation];
        let seconds = seconds.map(|timed| timed.as_ref().map_or(0.0, |timed| timed.1));
        let stats = |timed: Option<Timed>| timed.map(|timed| timed.0).transpose();
        Ok(Self {
            occupancy: stats(occupancy)?,
            distances: stats(distances)?,
            attenuation: stats(attenuation)?,
            seconds,
        })
    }

    /// Of the signed distances, else of another map; what became of the beams is the same in all.
    pub fn stats(&self) -> ScanStats {
        self.distances.or(self.occupancy).or(self.attenuation).unwrap_or_default()
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
        let (maps, stats, derived) = Default::default();
        Self { settings, maps, made: false, stats, derived }
    }

    /// A mapper that goes on with these maps; missing ones are not made. The maps keep their lattices and filters: resolution,
    /// truncation, weights and clamp of the signed distances are theirs, whatever `settings` say.
    ///
    /// # Errors
    /// Where a setting is not possible.
    pub fn of_maps(settings: MapperSettings<D>, maps: MapperMaps<D>) -> Result<Self, MapError> {
        settings.check()?;
        let MapperMaps { occupancy, tsdf, attenuation } = maps;
        let lattices = [
            occupancy.as_ref().map(|map| *map.store().lattice()),
            tsdf.as_ref().map(|map| *map.lattice()),
            attenuation.as_ref().map(|map| *map.store().lattice()),
        ];
        let mut given = lattices.iter().flatten();
        if let Some(first) = given.next()
            && given.any(|other| other != first)
        {
            return Err(MapError::Lattices);
        }
        let of_occupancy = occupancy.as_ref().map(|map| map.store().lattice().resolution);
        let resolution = attenuation.as_ref().map(|map| map.store().lattice().resolution).or(of_occupancy);
        let settings = MapperSettings { resolution: resolution.unwrap_or(settings.resolution), ..settings };
        let settings = tsdf.as_ref().map_or(settings, |map| settings.with_filter(map.config()));
        let mut mapper = Self::with(settings);
        let occupancy = occupancy.map(|map| map.with_sweep(settings.occupancy_sweep()));
        let attenuation = attenuation.map(|map| map.with_sweep(settings.occupancy_sweep()));
        let tsdf = tsdf.map(|map| {
            let config = settings.tsdf(map.lattice().origin);
            let (distances, colors) = map.into_stores();
            Tsdf::from_stores(distances, colors, config)
        });
        mapper.maps = MapperMaps { occupancy, tsdf: tsdf.transpose()?, attenuation };
        mapper.made = true;
        mapper.maps.set_bounds(settings.bounds);
        Ok(mapper)
    }

    /// Fuses one scan, taken at a known pose, into the maps. All hold the same bytes for any number of threads.
    ///
    /// # Errors
    /// Where a setting is not possible; else as [`Tsdf::integrate`], [`Occupancy::integrate`] and
    /// [`Attenuation::integrate`]. Where one map is full, the others may hold the scan.
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
        if self.made {
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
        let attenuation = settings.attenuation.map(|rule| {
            Attenuation::<D>::new(lattice, rule).map(|map| map.with_sweep(settings.occupancy_sweep()))
        });
        self.maps = MapperMaps {
            occupancy: occupancy.transpose()?,
            tsdf: tsdf.transpose()?,
            attenuation: attenuation.transpose()?,
        };
        self.made = true;
        self.maps.set_bounds(self.settings.bounds);
        Ok(())
    }

    /// Fuses scans in their order, as [`Mapper::integrate`] does one by one: the same bytes. In 2-D, where a scan is planned
    /// on one thread, each map goes through all of them on a thread of its own. `clock` as for [`Mapper::integrate_timed`].
    ///
    /// A result a scan. A map that is full ends the list, with that error; the others may hold a few scans more.
    pub fn integrate_all(
        &mut self,
        scans: &[(Pose<D>, impl ScanKind<D> + Sync)],
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Vec<Result<Fused, MapError>> {
        let memory = self.settings.memory;
        let first = scans.iter().find(|(pose, _)| pose.is_rigid());
        let ready = first.map_or(Ok(()), |(pose, _)| self.prepare(pose.translation));
        let (true, Ok(())) = (D == 2 && self.made, ready) else {
            let mut full = false;
            let mut one = |(pose, scan): &(Pose<D>, _)| {
                let fused = self.integrate_timed(pose, scan, clock);
                let ended = std::mem::replace(&mut full, matches!(fused, Err(MapError::Full(_))));
                (!ended).then_some(fused)
            };
            return scans.iter().map_while(&mut one).collect();
        };
        let held = self.maps.bytes();
        // Each may use a part of what is left.
        let count = held.len() - self.missing();
        let part = memory.saturating_sub(held.iter().sum()) / count.max(1);
        self.maps.set_limits(held.map(|bytes| bytes.saturating_add(part)));
        let full = AtomicUsize::new(usize::MAX);
        let MapperMaps { occupancy, tsdf, attenuation } = &mut self.maps;
        let (distances, (occupancy, attenuation)) = parallel::join(
            || fuse_all(tsdf, scans, clock, &full, |map, pose, scan| map.integrate(pose, scan)),
            || {
                parallel::join(
                    || fuse_all(occupancy, scans, clock, &full, |map, pose, scan| map.integrate(pose, scan)),
                    || {
                        fuse_all(attenuation, scans, clock, &full, |map, pose, scan| {
                            map.integrate(pose, scan)
                        })
                    },
                )
            },
        );
        let all = occupancy.into_iter().zip(distances).zip(attenuation);
        let fused: Vec<_> = all.map(|((a, b), c)| Fused::of([a, b, c])).collect();
        fused.iter().flatten().for_each(|fused| self.stats += fused.stats());
        fused
    }

    /// Number of maps that there are not.
    fn missing(&self) -> usize {
        let maps = &self.maps;
        [maps.occupancy.is_none(), maps.tsdf.is_none(), maps.attenuation.is_none()]
            .map(usize::from)
            .iter()
            .sum()
    }

    fn fuse(
        &mut self,
        pose: &Pose<D>,
        scan: &impl ScanKind<D>,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Result<Fused, MapError> {
        let memory = self.settings.memory;
        // Each map may use what the others leave, as they are when it comes to its turn.
        let left = |maps: &MapperMaps<D>| {
            let held = maps.bytes();
            held.map(|own| memory.saturating_sub(held.iter().sum::<usize>() - own))
        };
        self.maps.set_limits(left(&self.maps));
        let occupancy = self.maps.occupancy.as_mut().map(|map| timed(clock, || map.integrate(pose, scan)));
        self.maps.set_limits(left(&self.maps));
        let distances = self.maps.tsdf.as_mut().map(|map| timed(clock, || map.integrate(pose, scan)));
        self.maps.set_limits(left(&self.maps));
        let attenuation =
            self.maps.attenuation.as_mut().map(|map| timed(clock, || map.integrate(pose, scan)));
        Fused::of([occupancy, distances, attenuation])
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

    /// Hits per meter; `None` where there are none, or before the first scan.
    pub fn attenuation(&self) -> Option<&Attenuation<D>> {
        self.maps.attenuation.as_ref()
    }

    /// The maps themselves.
    pub fn into_maps(self) -> MapperMaps<D> {
        self.maps
    }

    /// Allows no more than `bytes` for all maps from now on.
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
        self.maps.bytes().iter().sum::<usize>() + self.derived.memory_bytes()
    }
}

/// What a map said to a scan, and the seconds that it took.
type Timed = (Result<ScanStats, MapError>, f64);

/// All scans into one map, up to the one that it, or another one, had no room for: `None` for each where there is no map.
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

/// What work gives, and the seconds that it took by the caller's clock.
pub(crate) fn timed<T>(clock: &(dyn Fn() -> f64 + Sync), work: impl FnOnce() -> T) -> (T, f64) {
    let start = clock();
    let result = work();
    (result, clock() - start)
}
