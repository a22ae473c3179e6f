//! The files that a mapping run in space leaves behind.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use anyhow::bail;
use portolan::cell::LogOddsRule;
use portolan_io::{IoError, SpaceMapFile, write_octomap_bt, write_octomap_ot};

use super::Derived;

/// A dense distance field is written up to this size (bytes of distances and states).
pub(crate) const LARGEST_DENSE: u64 = 256 << 20;

/// Everything that is written.
pub(crate) struct Artefacts<'a> {
    pub(crate) file: &'a SpaceMapFile,
    pub(crate) derived: &'a Derived,
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
}
