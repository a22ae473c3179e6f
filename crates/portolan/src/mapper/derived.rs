//! What is derived from the signed distances, kept up to date.

use super::Mapper;
use crate::field::{Esdf, EsdfSettings};
use crate::surface::{Contour, ContourSettings, IncrementalMesh, Mesh, MeshSettings, marching_squares};

/// What was asked for so far; it follows the map when it is asked for again.
#[derive(Debug, Default)]
pub(super) struct Derived<const D: usize> {
    esdf: Option<Esdf<D>>,
    mesh: Option<Box<IncrementalMesh>>,
}

/// A snapshot's field shares its bricks with the original; its mesh is made again when it is asked for.
impl<const D: usize> Clone for Derived<D> {
    fn clone(&self) -> Self {
        Self { esdf: self.esdf.clone(), mesh: None }
    }
}

impl<const D: usize> Derived<D> {
    pub(super) fn memory_bytes(&self) -> usize {
        self.esdf.as_ref().map_or(0, Esdf::memory_bytes)
            + self.mesh.as_ref().map_or(0, |mesh| mesh.memory_bytes())
    }
}

impl<const D: usize> Mapper<D> {
    /// Settings of the Euclidean distances that fit the map; `None` without signed distances.
    pub fn esdf_settings(&self) -> Option<EsdfSettings> {
        let max_distance = self.settings().max_distance;
        self.tsdf().map(|tsdf| EsdfSettings { max_distance, ..EsdfSettings::of(tsdf) })
    }

    /// Euclidean distances to the surface, as of the last scan; `None` without signed distances. The first call computes
    /// the whole field, later ones what changed. A clone of it is a snapshot.
    pub fn esdf(&mut self) -> Option<&Esdf<D>> {
        let settings = self.esdf_settings()?;
        let mut field = self.derived.esdf.take();
        let tsdf = self.tsdf()?;
        match &mut field {
            Some(field) => {
                field.update(tsdf.store());
            }
            None => field = Some(Esdf::of(tsdf, &settings)),
        }
        self.derived.esdf = field;
        self.derived.esdf.as_ref()
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
