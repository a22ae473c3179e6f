//! What is made of maps of space, as files.

use std::path::Path;

use portolan::field::{DenseEsdf, SparseEsdf};
use portolan::geom::Aabb;
use portolan::surface::Mesh;
use portolan_io::{write_glb, write_obj, write_ply_mesh};

/// A dense distance field is written up to this size.
const LARGEST_DENSE: usize = 256 << 20;
/// Bytes of a cell of it: distance and status.
const DENSE_CELL: usize = 5;

/// Writes a mesh as PLY, GLB or OBJ, by the name of the file. `false`: the name is of none of them.
pub(crate) fn write_mesh(path: &Path, mesh: &Mesh) -> anyhow::Result<bool> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("ply") => write_ply_mesh(path, mesh)?,
        Some("glb") => write_glb(path, mesh)?,
        Some("obj") => write_obj(path, mesh)?,
        _ => return Ok(false),
    }
    Ok(true)
}

/// The field, or the asked box of it, as arrays; else why there is none that `esdf.bin` should hold.
pub(crate) fn dense_esdf(esdf: &SparseEsdf<3>, bounds: Option<&Aabb<3>>) -> Result<DenseEsdf<3>, String> {
    let asked = bounds.map_or_else(|| esdf.grid(), |bounds| esdf.grid_within(bounds));
    let grid = asked.ok_or("nothing was observed there")?;
    let most = LARGEST_DENSE / DENSE_CELL;
    if grid.checked_len().is_none_or(|cells| cells > most) {
        let fitting = esdf.grid_of_at_most(most).map(|g| shown_box(&g.aabb())).unwrap_or_default();
        return Err(format!(
            "{} cells are more than 256 MiB; --dense {fitting} would fit",
            grid.shape.map(|n| n.to_string()).join(" x ")
        ));
    }
    Ok(esdf.dense(&grid))
}

/// A box as the command line takes it.
fn shown_box(bounds: &Aabb<3>) -> String {
    let numbers = bounds.min.iter().chain(&bounds.max);
    numbers.map(|v| ((v * 1000.0).round() / 1000.0).to_string()).collect::<Vec<_>>().join(",")
}
