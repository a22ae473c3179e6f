//! What is derived from the signed distances, kept up to date.

use super::Mapper;
use crate::field::{Esdf, EsdfSettings, ObstacleCells};
use crate::surface::{Contour, ContourSettings, IncrementalMesh, Mesh, MeshSettings, marching_squares};

/// What was asked for so far; it follows the map when it is asked for again.
#[derive(Debug, Default)]
pub(super) struct Derived<const D: usize> {
    esdf: Option<Esdf<D>>,
    /// Where something stops beams, as of the field.
    cells: ObstacleCells<D>,
    mesh: Option<Box<IncrementalMesh>>,
}

/// A snapshot's field shares its bricks with the original; its mesh is made again when it is asked for.
impl<const D: usize> Clone for Derived<D> {
    fn clone(&self) -> Self {
        Self { esdf: self.esdf.clone(), cells: self.cells.clone(), mesh: None }
    }
}

impl<const D: usize> Derived<D> {
    pub(super) fn memory_bytes(&self) -> usize {
        self.esdf.as_ref().map_or(0, Esdf::memory_bytes)
            + self.cells.memory_bytes()
            + self.mesh.as_ref().map_or(0, |mesh| mesh.memory_bytes())
    }
}

impl<const D: usize> Mapper<D> {
    /// Settings of the Euclidean distances that fit the map; `None` without signed distances. Distances to unknown space
    /// are among them: it is an obstacle, unless asked otherwise.
    pub fn esdf_settings(&self) -> Option<EsdfSettings> {
        let max_distance = self.settings().max_distance;
        self.tsdf().map(|tsdf| EsdfSettings { max_distance, unknown: true, ..EsdfSettings::of(tsdf) })
    }

    /// Euclidean distances to the nearest obstacle, as of the last scan; `None` without signed distances. Obstacles are the
    /// surface and what the other maps say stops beams ([`Mapper::obstacle_cells`]). The first call computes the whole
    /// field, later ones what changed. A clone of it is a snapshot.
    pub fn esdf(&mut self) -> Option<&Esdf<D>> {
        let settings = self.esdf_settings()?;
        let mut field = self.derived.esdf.take();
        self.follow_obstacle_cells();
        let (tsdf, cells) = (self.tsdf()?, &self.derived.cells);
        match &mut field {
            Some(field) => drop(field.update_with(tsdf.store(), cells)),
            None => field = Some(Esdf::with_obstacles(tsdf, cells, &settings)),
        }
        self.derived.esdf = field;
        self.derived.esdf.as_ref()
    }

    /// The cells where something stops beams, as of the last scan: by log odds above zero, or by the share of beams that end
    /// there. Empty without a map of either, and where [`MapperSettings::thin`](super::MapperSettings::thin) is 0.
    pub fn obstacle_cells(&mut self) -> &ObstacleCells<D> {
        self.follow_obstacle_cells();
        &self.derived.cells
    }

    fn follow_obstacle_cells(&mut self) {
        if self.settings().thin > 0.0 {
            let mut cells = std::mem::take(&mut self.derived.cells);
            if let Some(map) = self.occupancy() {
                cells.follow_occupancy(map.store());
            }
            if let Some(map) = self.attenuation() {
                cells.follow_attenuation(map.store(), self.settings().thin);
            }
            self.derived.cells = cells;
        }
    }
}

impl Mapper<2> {
    /// The surface as segments; empty without signed distances. O(cells).
    pub fn contour(&self) -> Contour {
        self.tsdf().map(|tsdf| marching_squares(tsdf, &ContourSettings::of(tsdf))).unwrap_or_default()
    }
}

impl Mapper<3> {
    /// The surface as triangles, brick by brick, as of the last scan; `None` without signed distances. The first call
    /// computes all of it, later ones what changed. [`IncrementalMesh::mesh`] puts the pieces together.
    pub fn pieces(&mut self) -> Option<&IncrementalMesh> {
        let mut mesh = self.derived.mesh.take();
        let tsdf = self.tsdf()?;
        let colors = tsdf.colors().filter(|store| !store.is_empty());
        mesh.get_or_insert_with(|| Box::new(IncrementalMesh::new(MeshSettings::of(tsdf))))
            .update(tsdf.store(), colors);
        self.derived.mesh = mesh;
        self.derived.mesh.as_deref()
    }

    /// The surface as triangles, as of the last scan; empty without signed distances.
    pub fn mesh(&mut self) -> Mesh {
        self.pieces().map(IncrementalMesh::mesh).unwrap_or_default()
    }
}
