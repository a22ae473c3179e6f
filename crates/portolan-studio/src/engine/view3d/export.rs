//! Files of a 3-D map, in memory: the same bytes that the command line writes.

use portolan::field::Esdf;
use portolan::store::Tree;
use portolan_io::{esdf_to_bytes, glb_to_bytes, octomap_bt_to_bytes, ply_mesh_to_bytes};

use super::ask::ExportFile;
use super::maps::Maps;
use crate::engine::exports::file as answer;
use crate::engine::{Refusal, Reply};

/// A dense field is sent up to this size, as the command line writes it.
const LARGEST_DENSE: usize = 256 << 20;
/// Bytes of a cell of it: distance and status.
const DENSE_CELL: usize = 5;

/// The file; the Euclidean field was made before.
pub(super) fn file(maps: &Maps, file: ExportFile) -> Result<Reply, Refusal> {
    match file {
        ExportFile::Ply => answer("mesh.ply", ply_mesh_to_bytes(&maps.mesh.mesh()).map_err(Refusal::new)?),
        ExportFile::Glb => answer("mesh.glb", glb_to_bytes(&maps.mesh.mesh()).map_err(Refusal::new)?),
        ExportFile::Esdf => {
            let esdf = maps.esdf.as_ref().ok_or_else(|| Refusal::new("the field was not made"))?;
            dense(esdf)
        }
        ExportFile::Octree => {
            let map = maps.occupancy().ok_or_else(|| {
                Refusal::new(
                    "this map holds distances only; switch on occupancy in the settings for an octree",
                )
            })?;
            let tree = Tree::from_bricks(map.store())
                .ok_or_else(|| Refusal::new("an octree spans 2^28 cells at most, and the map is larger"))?;
            answer("octree.bt", octomap_bt_to_bytes(&tree).map_err(Refusal::new)?)
        }
    }
}

fn dense(esdf: &Esdf<3>) -> Result<Reply, Refusal> {
    let grid = esdf.grid().ok_or_else(|| Refusal::new("nothing was observed yet"))?;
    let most = (LARGEST_DENSE - 64) / DENSE_CELL;
    if grid.checked_len().is_none_or(|cells| cells > most) {
        let shape = grid.shape.map(|n| n.to_string()).join(" x ");
        return Err(Refusal::new(format!(
            "{shape} cells are more than 256 MiB; choose larger cells, or let `portolan map --dense` write a part"
        )));
    }
    let dense = esdf.dense(&grid);
    answer(
        "esdf.bin",
        esdf_to_bytes(dense.grid(), dense.samples(), Some(&dense.status_bytes())).map_err(Refusal::new)?,
    )
}
