//! Maps as messages of ROS 2.

use portolan::cell::{LogOdds8, LogOddsValue, Planes};
use portolan::geom::{Grid, Pose};
use portolan::store::{Bricks, Store};
use portolan::surface::{MeshSettings, marching_cubes};
use portolan_io::{MapCell, MapFile, MapMessages, MapServerMap, write_map_mcap};

use super::{Args, contour_of, contour_of_map};
use crate::esdf::esdf_of_cells;
use crate::mapping::{cells_for_map_server, polylines};

/// Width of the lines of a contour, in cells.
const LINE: f64 = 0.25;

/// `false`: the map has no cells that an array can hold.
pub(super) fn of_map2(file: &MapFile<2>, args: &Args) -> anyhow::Result<bool> {
    let Some((grid, cells)) = cells_for_map_server(file) else { return Ok(false) };
    let lines = contour_of_map(file)?.map(|contour| polylines(&contour)).unwrap_or_default();
    write(&grid, 0.0, &cells, &lines, args)
}

/// A map_server map, which may be turned.
pub(super) fn of_server(map: &MapServerMap, args: &Args) -> anyhow::Result<bool> {
    let mut contour = contour_of(&esdf_of_cells(map.grid, &map.cells))?;
    let world_from_grid = map.world_from_grid();
    contour.vertices.iter_mut().for_each(|v| *v = world_from_grid.transform_point(*v));
    write(&map.grid, map.yaw, &map.cells, &polylines(&contour), args)
}

fn write(
    grid: &Grid<2>,
    yaw: f64,
    cells: &[MapCell],
    lines: &[portolan_io::Polyline],
    args: &Args,
) -> anyhow::Result<bool> {
    let [x, y] = grid.lattice.origin;
    let world_from_corner = Pose::<2>::new(x, y, yaw);
    let center = |i: usize| {
        let [cx, cy] = grid.lattice.center(grid.cell(i));
        // An upright grid stays as exact as it is.
        let [cx, cy] =
            if yaw == 0.0 { [cx, cy] } else { world_from_corner.transform_point([cx - x, cy - y]) };
        [cx, cy, 0.0]
    };
    let occupied: Vec<_> = (0..cells.len()).filter(|i| cells[*i] == MapCell::Occupied).map(center).collect();
    let map = MapMessages {
        cells: Some((grid, yaw, cells)),
        occupied: Some(&occupied),
        contour: Some((lines, LINE * grid.lattice.resolution)),
        mesh: None,
    };
    write_map_mcap(&args.out, &map)?;
    Ok(true)
}

/// `false`: the map has neither occupancy nor signed distances in bricks.
pub(super) fn of_map3(file: &MapFile<3>, args: &Args) -> anyhow::Result<bool> {
    let occupied = file.occupancy_bricks.as_ref().map(|map| occupied(&map.store));
    let colors = file.color_bricks.as_ref().map(|c| &c.store);
    let mesh = file.tsdf_bricks.as_ref().map(|map| marching_cubes(map, colors, &MeshSettings::default()));
    if occupied.is_none() && mesh.is_none() {
        return Ok(false);
    }
    let map = MapMessages { occupied: occupied.as_deref(), mesh: mesh.as_ref(), ..MapMessages::default() };
    write_map_mcap(&args.out, &map)?;
    Ok(true)
}

/// The centers of cells that are more likely occupied than not, brick by brick in ascending order.
fn occupied(store: &Bricks<LogOdds8, 3>) -> Vec<[f64; 3]> {
    let mut centers = Vec::new();
    for key in store.keys() {
        let Some(brick) = store.brick(key) else { continue };
        for i in 0..brick.len() {
            if brick.get(i).is_some_and(LogOdds8::is_occupied) {
                centers.push(store.lattice().center(key.cell(i)));
            }
        }
    }
    centers
}
