//! The files that a mapping run in space leaves behind.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use portolan::cell::LogOddsRule;
use portolan::geom::Aabb;
use portolan_io::{IoError, MapFile, write_atomic, write_esdf, write_octomap_bt, write_octomap_ot};

use crate::stale::remove_stale;

use super::files::{dense_esdf, write_mesh};
use super::{Derived, preview};

/// Everything that is written.
pub(crate) struct Artefacts<'a> {
    pub(crate) file: &'a MapFile<3>,
    pub(crate) derived: &'a Derived,
    /// The box of the distance field that is asked for.
    pub(crate) dense: Option<Aabb<3>>,
    /// Whether the sensor is a camera, which looks along z.
    pub(crate) camera: bool,
    /// What the picture's title says.
    pub(crate) title: String,
}

/// What writing did.
#[derive(Default)]
pub(crate) struct Written {
    pub(crate) files: Vec<&'static str>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// What was not written, and why.
    pub(crate) notes: Vec<String>,
}

impl Artefacts<'_> {
    /// Writes all files but `map.portolan` and `summary.json`. What an earlier run left in the folder and this one does not make is removed:
    /// it would belong to another map.
    pub(crate) fn write(&self, folder: &Path) -> anyhow::Result<Written> {
        let mut written = Written { notes: self.derived.notes.clone(), ..Written::default() };
        let start = Instant::now();
        if let Some(mesh) = &self.derived.mesh {
            write_mesh(&folder.join("mesh.ply"), mesh)?;
            written.files.push("mesh.ply");
        }
        self.write_octree(folder, &mut written)?;
        self.write_esdf(folder, &mut written)?;
        // Saved before anything was derived from it.
        written.files.push("map.portolan");
        written.seconds.insert("write", start.elapsed().as_secs_f64());
        let start = Instant::now();
        let png = self
            .derived
            .mesh
            .as_ref()
            .and_then(|mesh| preview::of_mesh(mesh, &self.file.poses, self.camera, &self.title));
        if let Some(png) = png {
            write_atomic(folder.join("preview.png"), |w| w.write_all(&png))?;
            written.files.push("preview.png");
        }
        written.seconds.insert("preview", start.elapsed().as_secs_f64());
        remove_stale(folder, &written.files)?;
        Ok(written)
    }

    fn write_octree(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let (Some(tree), Some(map)) = (&self.derived.tree, &self.file.occupancy_bricks) else {
            return Ok(());
        };
        let rule = LogOddsRule::<i8>::new(&map.model)?;
        let bt = write_octomap_bt(folder.join("octree.bt"), tree);
        let ot = write_octomap_ot(folder.join("octree.ot"), tree, rule.quantum);
        for (name, result) in [("octree.bt", bt), ("octree.ot", ot)] {
            match result {
                Ok(()) => written.files.push(name),
                // The format's own limits: the map is whole without it.
                Err(error @ IoError::Unwritable { .. }) => written.notes.push(error.to_string()),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    fn write_esdf(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let Some(esdf) = &self.derived.esdf else { return Ok(()) };
        match dense_esdf(esdf, self.dense.as_ref()) {
            Ok(dense) => {
                let path = folder.join("esdf.bin");
                write_esdf(path, dense.grid(), dense.samples(), Some(&dense.status_bytes()))?;
                written.files.push("esdf.bin");
            }
            Err(why) => written.notes.push(format!("esdf.bin was not written: {why}")),
        }
        Ok(())
    }
}
