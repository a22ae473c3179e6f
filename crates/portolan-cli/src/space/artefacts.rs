//! The files that a mapping run in space leaves behind.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use anyhow::bail;
use portolan::cell::LogOddsRule;
use portolan::geom::Aabb;
use portolan_io::{IoError, SpaceMapFile, write_esdf, write_octomap_bt, write_octomap_ot};

use super::Derived;

/// A dense distance field is written up to this size.
const LARGEST_DENSE: usize = 256 << 20;
/// Bytes of a cell of it: distance and status.
const DENSE_CELL: usize = 5;

/// Everything that is written.
pub(crate) struct Artefacts<'a> {
    pub(crate) file: &'a SpaceMapFile,
    pub(crate) derived: &'a Derived,
    /// The box of the distance field that is asked for.
    pub(crate) dense: Option<Aabb<3>>,
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

/// Files of the folder that belong to a map and would be wrong beside another one.
const NAMES: [&str; 7] =
    ["map.portolan", "mesh.ply", "octree.bt", "octree.ot", "esdf.bin", "preview.png", "summary.json"];

impl Artefacts<'_> {
    /// Writes all files but `summary.json`. What an earlier run left in the folder and this one does not make is removed:
    /// it would belong to another map.
    pub(crate) fn write(&self, folder: &Path) -> anyhow::Result<Written> {
        let mut written = Written::default();
        let start = Instant::now();
        self.write_octree(folder, &mut written)?;
        self.write_esdf(folder, &mut written)?;
        self.file.write(folder.join("map.portolan"))?;
        written.files.push("map.portolan");
        written.seconds.insert("write", start.elapsed().as_secs_f64());
        for stale in NAMES.iter().filter(|n| !written.files.contains(n) && **n != "summary.json") {
            match std::fs::remove_file(folder.join(stale)) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    bail!(
                        "{}: cannot remove what an earlier run left: {e}; remove it",
                        folder.join(stale).display()
                    )
                }
                _ => {}
            }
        }
        Ok(written)
    }

    fn write_octree(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let (Some(tree), Some(map)) = (&self.derived.tree, &self.file.occupancy) else { return Ok(()) };
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
        let asked = match &self.dense {
            Some(bounds) => esdf.grid_within(bounds),
            None => esdf.grid(),
        };
        let Some(grid) = asked else {
            written.notes.push("esdf.bin was not written: nothing was observed there".to_owned());
            return Ok(());
        };
        let most = LARGEST_DENSE / DENSE_CELL;
        if grid.checked_len().is_none_or(|cells| cells > most) {
            let fitting = esdf.grid_of_at_most(most).map(|g| shown_box(&g.aabb())).unwrap_or_default();
            written.notes.push(format!(
                "esdf.bin was not written: {} cells are more than 256 MiB; --dense {fitting} would fit",
                grid.shape.map(|n| n.to_string()).join(" x ")
            ));
            return Ok(());
        }
        let dense = esdf.dense(&grid);
        write_esdf(folder.join("esdf.bin"), &dense.grid, &dense.distances, Some(&dense.status))?;
        written.files.push("esdf.bin");
        Ok(())
    }
}

/// A box as the command line takes it.
fn shown_box(bounds: &Aabb<3>) -> String {
    let numbers = bounds.min.iter().chain(&bounds.max);
    numbers.map(|v| ((v * 1000.0).round() / 1000.0).to_string()).collect::<Vec<_>>().join(",")
}
