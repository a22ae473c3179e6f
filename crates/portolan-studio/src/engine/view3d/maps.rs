//! The 3-D maps of a tab, and mesh and field that follow them.

use std::sync::Arc;

use portolan::Mapper;
use portolan::field::{Esdf, EsdfSettings};
use portolan::geom::vector::sub;
use portolan::geom::{BlockKey, Pose};
use portolan::map::{MapError, Occupancy, Tsdf3};
use portolan::mapper::MapperMaps;
use portolan::scan::{Frame, ScanStats};
use portolan::surface::{IncrementalMesh, Mesh, MeshSettings};

use super::history::Watched;
use super::mesh_buffers::{Delta, MeshBuffers};
use super::settings::Settings;
use super::source::Source;
use crate::engine::{Clock, Refusal};

/// Points of the last frame that are shown.
const POINTS: usize = 6000;

/// Seconds that the last answer's frames took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seconds {
    /// Reading, or simulating.
    pub(super) frames: f64,
    /// Fusing distances and colors.
    pub(super) tsdf: f64,
    /// Fusing occupancy.
    pub(super) occupancy: f64,
    /// Meshing what has changed.
    pub(super) mesh: f64,
}

/// Maps, mesh, and the page's copy of it.
pub(super) struct Maps {
    /// Frames that are fused.
    pub(super) at: usize,
    /// Distances and, if they are wanted, occupancy.
    mapper: Mapper<3>,
    pub(super) esdf: Option<Esdf<3>>,
    /// The map's epoch when the Euclidean field was made.
    measured: u64,
    pub(super) mesh: IncrementalMesh,
    pub(super) buffers: MeshBuffers,
    pub(super) watched: Option<Watched>,
    /// The page counts places from its lower corner.
    pub(super) first: BlockKey<3>,
    /// The same in the world (meters).
    pub(super) origin: [f64; 3],
    /// Of the frame that was fused last.
    pub(super) stats: ScanStats,
    pub(super) last: Option<(Pose<3>, Arc<Frame>)>,
    pub(super) seconds: Seconds,
    /// Frames that were left out, and why the first was.
    pub(super) left_out: (usize, Option<String>),
    /// Why nothing more is fused.
    pub(super) full: Option<String>,
}

impl Maps {
    /// Maps of nothing, or the map that stands for frames.
    pub(super) fn new(source: &Source, settings: &Settings) -> Result<Self, Refusal> {
        let start = source.pose(0).map_or([0.0; 3], |pose| pose.translation);
        let mut mapper = Mapper::with(settings.mapper(source.has_color())?);
        if let Some(map) = source.map() {
            let maps = MapperMaps { tsdf: Some(map.clone()), ..Default::default() };
            mapper = Mapper::of_maps(*mapper.settings(), maps).map_err(Refusal::new)?;
        }
        mapper.prepare(start).map_err(Refusal::new)?;
        let Some(tsdf) = mapper.tsdf() else { return Err(Refusal::new("there are no distances")) };
        let near = match source.map() {
            Some(map) => map.store().bricks_by_age().next().map_or(BlockKey([0; 3]), |(key, _)| key),
            None => BlockKey::of_cell(tsdf.lattice().cell_of(start).unwrap_or([0; 3])),
        };
        Ok(Self {
            at: 0,
            origin: tsdf.lattice().corner(near.first_cell()),
            first: near,
            mesh: IncrementalMesh::new(MeshSettings::of(tsdf)),
            buffers: MeshBuffers::nothing(source.up()),
            mapper,
            esdf: None,
            measured: 0,
            watched: None,
            stats: ScanStats::default(),
            last: None,
            seconds: Seconds::default(),
            left_out: (0, None),
            full: None,
        })
    }

    /// Fuses the frame after those that are fused; the maps may take `memory` bytes.
    pub(super) fn fuse_one(&mut self, source: &mut Source, memory: usize, clock: &Clock) {
        let (read, seconds) = clock.time(|| source.frame(self.at));
        self.seconds.frames += seconds;
        let fused = read.map_err(|refusal| refusal.to_string()).and_then(|(pose, frame)| {
            self.integrate(&pose, &frame, memory, clock).map_err(|error| {
                if matches!(error, MapError::Full(_)) {
                    self.full = Some(format!("{error}; choose larger cells"));
                }
                error.to_string()
            })?;
            self.last = Some((pose, frame));
            Ok(())
        });
        if self.full.is_some() {
            return;
        }
        if let Err(why) = fused {
            self.left_out.0 += 1;
            self.left_out.1.get_or_insert(why);
        }
        self.at += 1;
    }

    fn integrate(
        &mut self,
        pose: &Pose<3>,
        frame: &Frame,
        memory: usize,
        clock: &Clock,
    ) -> Result<(), MapError> {
        self.mapper.set_memory(memory);
        let fused = self.mapper.integrate_timed(pose, frame, &|| clock.now())?;
        self.seconds.occupancy += fused.seconds[0];
        self.seconds.tsdf += fused.seconds[1];
        self.stats = fused.stats();
        if let (Some(watched), Some(tsdf)) = (&mut self.watched, self.mapper.tsdf()) {
            watched.observe(self.at, tsdf.events());
        }
        Ok(())
    }

    /// What the page lacks of the mesh, each vertex with the byte that `shade` gives it.
    pub(super) fn next(
        &mut self,
        clock: &Clock,
        mut shade: impl FnMut(&Mesh, &Tsdf3, &mut Vec<u8>),
    ) -> Delta {
        let tsdf = self.mapper.tsdf().expect("the mapper made distances");
        self.buffers.next(&self.mesh, self.first, clock, |piece, out| shade(piece, tsdf, out))
    }

    /// The signed distances.
    pub(super) fn tsdf(&self) -> &Tsdf3 {
        self.mapper.tsdf().expect("the mapper made distances")
    }

    /// The occupancy beside them, if it is wanted.
    pub(super) fn occupancy(&self) -> Option<&Occupancy<3>> {
        self.mapper.occupancy()
    }

    /// Meshes again what has changed.
    pub(super) fn follow(&mut self, clock: &Clock) -> Result<(), Refusal> {
        let Some(tsdf) = self.mapper.tsdf() else { return Ok(()) };
        let colors = tsdf.colors().filter(|store| !store.is_empty());
        let (changed, seconds) = clock.time(|| self.mesh.update(tsdf.store(), colors));
        self.seconds.mesh += seconds;
        if changed.is_empty() {
            return Ok(());
        }
        self.buffers.change(&changed, &self.mesh)
    }

    /// The Euclidean field of the map as it is now. Gives the seconds that it took.
    ///
    /// # Errors
    /// Where it would need more than `memory` bytes beside what is held.
    pub(super) fn measure(&mut self, memory: usize, clock: &Clock) -> Result<f64, Refusal> {
        // The field, and as much again while it is made.
        let needed = 2 * self.tsdf().store().len() * 512 * size_of::<f32>();
        if self.esdf.is_none() && needed > memory {
            return Err(Refusal::new(format!(
                "the Euclidean field needs {} MiB more than this tab may have; choose larger cells",
                (needed - memory).div_ceil(1 << 20)
            )));
        }
        let cells = self.mapper.obstacle_cells().clone();
        let Some(tsdf) = self.mapper.tsdf() else { return Ok(0.0) };
        let store = tsdf.store();
        let ((), seconds) = clock.time(|| match &mut self.esdf {
            Some(esdf) => {
                esdf.update_with(store, &cells);
            }
            None => self.esdf = Some(Esdf::with_obstacles(tsdf, &cells, &EsdfSettings::default())),
        });
        self.measured = store.epoch();
        Ok(seconds)
    }

    /// The Euclidean field, where it is that of the map as it is now.
    pub(super) fn esdf_now(&self) -> Option<&Esdf<3>> {
        self.esdf.as_ref().filter(|_| self.measured == self.tsdf().store().epoch())
    }

    /// Watches a cell, and what was found of it so far.
    pub(super) fn watch(&mut self, watched: Option<Watched>) {
        if let Some(tsdf) = self.mapper.tsdf_mut() {
            tsdf.watch(watched.iter().map(|w| w.cell));
        }
        self.watched = watched;
    }

    /// Some points of the last frame (meters from the origin).
    pub(super) fn points(&self) -> Vec<f32> {
        let Some((pose, frame)) = &self.last else { return Vec::new() };
        let place = |p: [f64; 3]| sub(pose.transform_point(p), self.origin).map(|v| v as f32);
        let step = frame.hits().div_ceil(POINTS).max(1);
        match &**frame {
            Frame::Image(image) => image.points().step_by(step).flat_map(|(_, p)| place(p)).collect(),
            Frame::Points(scan) => {
                scan.points.iter().step_by(step).flat_map(|p| place(p.map(f64::from))).collect()
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.mapper.memory_bytes()
            + self.esdf.as_ref().map_or(0, Esdf::memory_bytes)
            + self.mesh.memory_bytes()
            + self.buffers.memory_bytes()
    }
}
