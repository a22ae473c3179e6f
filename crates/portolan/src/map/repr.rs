//! The chapter's thesis as an interface: a map is what it can answer cheaply.

use super::Tsdf;
use crate::field::{Esdf, EsdfGrid, EsdfSettings};
use crate::geom::Pose;
use crate::scan::{Scan, ScanStats};

/// Which questions a representation answers at all, within its documented cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abilities {
    /// Is this point occupied?
    pub occupancy: bool,
    /// How far to the nearest surface?
    pub distance: bool,
}

/// The thin view in which the gallery compares representations.
///
/// The two negatives are not mixed: what a representation *cannot* answer, [`MapRepr::abilities`] says; `None`
/// means that it does not *know*.
pub trait MapRepr<const D: usize> {
    /// Folds one scan in, with a known pose.
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> ScanStats;

    /// P(occupied) at a point (world, metres). `None`: never observed, which is not 0.5.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64>;

    /// Signed distance to the nearest surface (metres), positive in free space, without a search. `None`: not
    /// known there.
    fn distance(&self, p_world: [f64; D]) -> Option<f64>;

    /// Bytes held: measured, not estimated.
    fn memory_bytes(&self) -> usize;

    /// What it can answer at all.
    fn abilities(&self) -> Abilities;
}

/// A read-only field that is rebuilt from a TSDF: an ESDF, a contour.
pub trait DerivedField<const D: usize> {
    /// How the field is made.
    type Settings;

    /// Makes the field.
    fn derive(tsdf: &Tsdf<D>, settings: &Self::Settings) -> Self;

    /// P(occupied), if the field can tell.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64>;

    /// Signed distance (metres), if the field can tell.
    fn distance(&self, p_world: [f64; D]) -> Option<f64>;

    /// Bytes of the field alone.
    fn memory_bytes(&self) -> usize;

    /// What it can answer at all.
    fn abilities() -> Abilities;
}

/// A derived field with the TSDF that it is made from: scans go into the TSDF, [`Derived::rebuild`] makes the
/// field anew. Between the two the field answers as of the last rebuild.
#[derive(Clone, Debug)]
pub struct Derived<F: DerivedField<D>, const D: usize> {
    tsdf: Tsdf<D>,
    settings: F::Settings,
    field: F,
}

impl<F: DerivedField<D>, const D: usize> Derived<F, D> {
    /// Derives the field of a TSDF.
    pub fn new(tsdf: Tsdf<D>, settings: F::Settings) -> Self {
        let field = F::derive(&tsdf, &settings);
        Self { tsdf, settings, field }
    }

    /// Makes the field anew from all scans so far.
    pub fn rebuild(&mut self) {
        self.field = F::derive(&self.tsdf, &self.settings);
    }

    /// The field as of the last rebuild.
    pub fn field(&self) -> &F {
        &self.field
    }

    /// The map that it is made from.
    pub fn tsdf(&self) -> &Tsdf<D> {
        &self.tsdf
    }
}

impl<F: DerivedField<D>, const D: usize> MapRepr<D> for Derived<F, D> {
    fn integrate_scan(&mut self, world_from_sensor: &Pose<D>, scan: &Scan<D>) -> ScanStats {
        self.tsdf.integrate_scan(world_from_sensor, scan)
    }

    fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        self.field.occupancy(p_world)
    }

    fn distance(&self, p_world: [f64; D]) -> Option<f64> {
        self.field.distance(p_world)
    }

    /// The field's own bytes; the TSDF below it comes on top.
    fn memory_bytes(&self) -> usize {
        self.field.memory_bytes()
    }

    fn abilities(&self) -> Abilities {
        F::abilities()
    }
}

impl<const D: usize> DerivedField<D> for EsdfGrid<D> {
    type Settings = EsdfSettings;

    fn derive(tsdf: &Tsdf<D>, settings: &EsdfSettings) -> Self {
        Esdf::of(tsdf, settings).dense(tsdf.grid())
    }

    /// The sign of the distance.
    fn occupancy(&self, p_world: [f64; D]) -> Option<f64> {
        let v = *self.samples().get(self.grid().index_of(p_world)?)?;
        (!v.is_nan()).then_some(if v < 0.0 { 1.0 } else { 0.0 })
    }

    fn distance(&self, p_world: [f64; D]) -> Option<f64> {
        Self::distance(self, p_world).known()
    }

    fn memory_bytes(&self) -> usize {
        Self::memory_bytes(self)
    }

    fn abilities() -> Abilities {
        Abilities { occupancy: true, distance: true }
    }
}
