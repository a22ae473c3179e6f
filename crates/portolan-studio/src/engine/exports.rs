//! Files made in memory, for the page to save: the same bytes that the command line writes.

use portolan::field::{Esdf, EsdfSettings, ObstacleCells};
use portolan::geom::vector::norm;
use portolan::map::Tsdf2;
use portolan::surface::{ContourSettings, Polyline, marching_squares};
use portolan_io::{MapFile, MapHeader, esdf_to_bytes, geojson_to_bytes};
use serde_json::{Map, Value, json};

use super::fusion::Beside;
use super::{Refusal, Reply};

/// A file under a name.
pub(super) fn file(name: &str, bytes: Vec<u8>) -> Result<Reply, Refusal> {
    Ok(Reply::of(json!({ "name": name, "bytes": bytes.len() }))?.with("file", bytes))
}

/// The Euclidean field of a map, as `query` and `map` make it: accurate, over the whole map, around the surface and where
/// something stops beams.
pub(super) fn field(tsdf: &Tsdf2, cells: &ObstacleCells<2>, unknown: bool) -> Esdf<2> {
    let grid = tsdf.grid();
    Esdf::with_obstacles(
        tsdf,
        cells,
        &EsdfSettings {
            max_distance: norm(grid.aabb().extent()).max(grid.lattice.resolution),
            unknown,
            ..EsdfSettings::default()
        },
    )
}

/// `esdf.bin`
pub(super) fn esdf(tsdf: &Tsdf2, cells: &ObstacleCells<2>) -> Result<Reply, Refusal> {
    let dense = field(tsdf, cells, false).dense(tsdf.grid());
    let status = dense.is_saturated().then(|| dense.status_bytes());
    let bytes = esdf_to_bytes(dense.grid(), dense.samples(), status.as_deref());
    file("esdf.bin", bytes.map_err(Refusal::new)?)
}

/// `contour.geojson`
pub(super) fn contour(tsdf: &Tsdf2) -> Result<Reply, Refusal> {
    let lines = marching_squares(tsdf, &ContourSettings::of(tsdf)).polylines();
    let closed = |line: Polyline| {
        let again = line.vertices.first().copied().filter(|_| line.closed);
        line.vertices.into_iter().chain(again).collect()
    };
    let lines: Vec<Vec<[f64; 2]>> = lines.into_iter().map(closed).collect();
    file("contour.geojson", geojson_to_bytes(&lines).map_err(Refusal::new)?)
}

/// `map.portolan`
pub(super) fn map(
    tsdf: &Tsdf2,
    beside: &Beside,
    log: &str,
    scans: usize,
    settings: &Value,
) -> Result<Reply, Refusal> {
    let settings: Map<String, Value> = settings.as_object().cloned().unwrap_or_default();
    let header = MapHeader { logs: vec![log.into()], scans: scans as u64, settings, ..MapHeader::default() };
    let mut content = MapFile::<2>::default();
    (content.header, content.tsdf) = (header, Some(tsdf.clone()));
    beside.store(&mut content)?;
    file("map.portolan", content.to_bytes().map_err(Refusal::new)?)
}
