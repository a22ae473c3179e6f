//! Surfaces and distance fields as files.

use std::path::Path;

use portolan::field::{Esdf, EsdfGrid};
use portolan::geom::{Aabb, Grid};
use portolan::surface::{Contour, Mesh};
use portolan_io::{Polyline, SvgStyle, write_geojson, write_glb, write_obj, write_ply_mesh, write_svg};

/// A dense distance field is written up to this size.
const LARGEST_DENSE: usize = 256 << 20;
/// Bytes of a cell of it: distance and status.
const DENSE_CELL: usize = 5;

/// The lines of a contour as files hold them: closed ones repeat their first point.
pub fn polylines(contour: &Contour) -> Vec<Polyline> {
    let closed = |line: portolan::surface::Polyline| {
        let mut points = line.vertices;
        if line.closed {
            points.extend(points.first().copied());
        }
        points
    };
    contour.polylines().into_iter().map(closed).collect()
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Writes lines as GeoJSON or SVG, by the extension of the file. `false`: it has another one.
pub(crate) fn write_contour(path: &Path, lines: &[Polyline]) -> anyhow::Result<bool> {
    match extension(path).as_str() {
        "geojson" | "json" => write_geojson(path, lines)?,
        "svg" => write_svg(path, lines, &SvgStyle::default())?,
        _ => return Ok(false),
    }
    Ok(true)
}

/// Writes a mesh as PLY, GLB or OBJ, by the extension of the file. `false`: it has another one.
pub(crate) fn write_mesh(path: &Path, mesh: &Mesh) -> anyhow::Result<bool> {
    match extension(path).as_str() {
        "ply" => write_ply_mesh(path, mesh)?,
        "glb" => write_glb(path, mesh)?,
        "obj" => write_obj(path, mesh)?,
        _ => return Ok(false),
    }
    Ok(true)
}

/// The field, or a box of it, as arrays; else why `esdf.bin` cannot hold it.
pub(crate) fn dense_esdf(esdf: &Esdf<3>, bounds: Option<&Aabb<3>>) -> Result<EsdfGrid<3>, String> {
    let wanted = bounds.map_or_else(|| esdf.grid(), |bounds| esdf.grid_within(bounds));
    let grid = wanted.ok_or("nothing was observed there")?;
    let most = (LARGEST_DENSE - 64) / DENSE_CELL;
    if grid.checked_len().is_none_or(|cells| cells > most) {
        let fitting = esdf.grid_of_at_most(most).map(|g| format!("; --dense {} would fit", shown_box(&g)));
        let shape = grid.shape.map(|n| n.to_string()).join(" x ");
        return Err(format!("{shape} cells are more than 256 MiB{}", fitting.unwrap_or_default()));
    }
    Ok(esdf.dense(&grid))
}

/// A box of cells as the command line takes it: a quarter of a cell inside of it, so that rounding adds no cell.
fn shown_box(grid: &Grid<3>) -> String {
    let r = grid.lattice.resolution;
    let digits = (2.0 - r.log10()).ceil().clamp(0.0, 9.0) as usize;
    let bounds = grid.aabb().grown(-0.25 * r);
    let numbers = bounds.min.iter().chain(&bounds.max);
    numbers.map(|v| format!("{v:.digits$}")).collect::<Vec<_>>().join(",")
}
