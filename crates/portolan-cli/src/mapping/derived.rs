//! What is derived from the maps when all scans are fused.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::bail;
use portolan::field::{Esdf, EsdfGrid, PointKind};
use portolan::map::Tsdf2;
use portolan::store::Store;
use portolan::surface::{Contour, ContourSettings, DoubledLength, Mesh, MeshSettings, ThinWalls};
use portolan::surface::{doubled_length, marching_cubes, marching_squares, thin_walls};
use portolan_io::{MapFile, TsdfBricks};

use super::{MapKind, Octree, Settings};
use crate::arguments::shown_bytes;
use crate::esdf::{Field, FieldHow, esdf_2d, esdf_3d, esdf_of_points};
use crate::saved::SavedMap;

/// Contours nearer to each other than this and facing the same way are one wall seen twice (meters).
const DOUBLED_REACH: f64 = 0.15;

/// What is to be said of a map of points without rays.
const NO_RAYS: &str = "no mesh, tsdf or attenuation were made: points without rays do not say which side of them is free, and all \
     space between them is unknown";

/// Surfaces, distance field and octree, as far as they are wanted and there is a map to derive them from.
#[derive(Default)]
pub(crate) struct Derived {
    pub(crate) contour: Option<ContourChecked>,
    pub(crate) mesh: Option<Mesh>,
    pub(crate) octree: Option<Octree>,
    pub(crate) esdf: Option<DistanceField>,
    /// Of what the field is around: cells that log odds alone, counts alone, and both call occupied.
    pub(crate) agreement: Option<[usize; 3]>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// What was not made, and why.
    pub(crate) notes: Vec<String>,
}

/// A contour and what it shows of the poses and walls.
pub(crate) struct ContourChecked {
    pub(crate) contour: Contour,
    pub(crate) doubled: DoubledLength,
    pub(crate) thin: ThinWalls,
}

/// The distance field of a map.
pub(crate) enum DistanceField {
    /// 2-D: its cells, and where obstacles are that are no surface.
    Two { cells: EsdfGrid<2>, points: Vec<([f64; 2], PointKind)> },
    /// 3-D.
    Three(Esdf<3>),
}

impl Derived {
    /// `memory`: what maps and fields may take together (bytes).
    pub(crate) fn of(file: &SavedMap, settings: &Settings, memory: usize) -> Self {
        match file {
            SavedMap::Two(file) => Self::of_2d(file, settings),
            SavedMap::Three(file) => Self::of_3d(file, settings, memory),
        }
    }

    pub(crate) fn of_2d(file: &MapFile<2>, settings: &Settings) -> Self {
        let mut derived = Self::default();
        let Some(tsdf) = &file.tsdf else { return derived };
        if settings.wants(MapKind::Contour) {
            let contour = derived.timed("contour", |_| marching_squares(tsdf, &ContourSettings::of(tsdf)));
            derived.contour = Some(derived.timed("contour_checks", |_| ContourChecked::of(contour, tsdf)));
        }
        if settings.wants(MapKind::Esdf) {
            let made = derived.timed("esdf", |_| esdf_2d(file, tsdf, &FieldHow::of(settings)));
            derived.hold_field(made.map(|f| (DistanceField::two(tsdf, &f.esdf), f.agreement)));
        }
        derived
    }

    fn of_3d(file: &MapFile<3>, settings: &Settings, memory: usize) -> Self {
        let mut derived = Self::default();
        if let Some(map) = &file.occupancy_bricks {
            derived.octree = derived.timed("octree", |_| Octree::of(&map.store));
            if derived.octree.is_none() {
                derived.notes.push("the octree was not made: the map spans more than 2^28 cells".to_owned());
            }
        }
        if settings.shape.points_only {
            derived.of_points(file, settings, memory);
            return derived;
        }
        let Some(tsdf) = &file.tsdf_bricks else { return derived };
        if settings.wants(MapKind::Mesh) {
            let colors = file.color_bricks.as_ref().map(|c| &c.store).filter(|store| !store.is_empty());
            let how = MeshSettings::default();
            derived.mesh = Some(derived.timed("mesh", |_| marching_cubes(tsdf, colors, &how)));
        }
        if settings.wants(MapKind::Esdf) {
            let held = tsdf.store.memory_bytes()
                + file.occupancy_bricks.as_ref().map_or(0, |o| o.store.memory_bytes());
            let made = derived.timed("esdf", |_| field_3d(file, tsdf, settings, memory.saturating_sub(held)));
            derived.hold_field(made.map(|f| (DistanceField::Three(f.esdf), f.agreement)));
        }
        derived
    }

    /// What points without rays give: distances to the cells that hold them.
    fn of_points(&mut self, file: &MapFile<3>, settings: &Settings, memory: usize) {
        self.notes.push(NO_RAYS.to_owned());
        let Some(map) = file.occupancy_bricks.as_ref().filter(|_| settings.wants(MapKind::Esdf)) else {
            return;
        };
        let left = memory.saturating_sub(map.store.memory_bytes());
        // The cells, and as much again while the field is made.
        let made = self.timed("esdf", |_| esdf_of_points(map, &FieldHow::of(settings), left / 2));
        self.hold_field(made.map(|esdf| (DistanceField::Three(esdf), None)));
    }

    /// The field, or a note why there is none.
    fn hold_field(&mut self, made: anyhow::Result<(DistanceField, Option<[usize; 3]>)>) {
        match made {
            Ok((field, agreement)) => (self.esdf, self.agreement) = (Some(field), agreement),
            Err(why) => self.notes.push(format!("the esdf was not made: {why}")),
        }
    }

    fn timed<T>(&mut self, name: &'static str, work: impl FnOnce(&mut Self) -> T) -> T {
        let start = Instant::now();
        let result = work(self);
        self.seconds.insert(name, start.elapsed().as_secs_f64());
        result
    }

    /// Bytes of each derived field, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let contour = self.contour.iter().map(|c| ("contour", c.contour.memory_bytes()));
        let mesh = self.mesh.iter().map(|m| ("mesh", m.memory_bytes()));
        let octree = self.octree.iter().map(|t| ("octree", t.tree.memory_bytes()));
        let esdf = self.esdf.iter().map(|e| ("esdf", e.memory_bytes()));
        contour.chain(mesh).chain(octree).chain(esdf).collect()
    }
}

/// The field of a 3-D map, where `memory` allows it.
fn field_3d(
    file: &MapFile<3>,
    tsdf: &TsdfBricks<3>,
    settings: &Settings,
    memory: usize,
) -> anyhow::Result<Field<3>> {
    // The field, and as much again while it is made.
    let needed = 2 * tsdf.store.len() * 512 * size_of::<f32>();
    if needed > memory {
        bail!("it needs {} more than --memory leaves", shown_bytes(needed as f64));
    }
    esdf_3d(file, tsdf, &FieldHow::of(settings))
}

/// The obstacles of a field that are no surface.
fn centers<const D: usize>(field: &Esdf<D>) -> Vec<([f64; D], PointKind)> {
    field.point_obstacles().map(|(cell, kind)| (field.lattice().center(cell), kind)).collect()
}

impl ContourChecked {
    fn of(contour: Contour, tsdf: &Tsdf2) -> Self {
        let doubled = doubled_length(&contour, DOUBLED_REACH);
        let thin = thin_walls(tsdf, &contour);
        Self { contour, doubled, thin }
    }
}

impl DistanceField {
    fn two(tsdf: &Tsdf2, field: &Esdf<2>) -> Self {
        Self::Two { cells: field.dense(tsdf.grid()), points: centers(field) }
    }

    /// Centers and kinds of the obstacles that are no surface: rows of a table.
    pub(crate) fn points(&self) -> Vec<(Vec<f64>, PointKind)> {
        match self {
            Self::Two { points, .. } => {
                points.iter().map(|(center, kind)| (center.to_vec(), *kind)).collect()
            }
            Self::Three(esdf) => {
                centers(esdf).into_iter().map(|(center, kind)| (center.to_vec(), kind)).collect()
            }
        }
    }

    fn memory_bytes(&self) -> usize {
        match self {
            Self::Two { cells, .. } => cells.memory_bytes(),
            Self::Three(esdf) => esdf.memory_bytes(),
        }
    }
}
