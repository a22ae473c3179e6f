//! Dense files of 2-D maps.

use portolan::cell::{Cell, LogOdds8, LogOddsValue};
use portolan::geom::{BLOCK_EDGE, Grid};
use portolan::map::Quadtree;
use portolan::store::{Bricks, Store};
use portolan_io::{MapCell, MapFile};

/// More likely occupied than this is occupied, less likely than the second is free.
const OCCUPIED: f64 = 0.65;
const FREE: f64 = 0.25;

/// A tree may span more than any array can hold: dense files of it stop here.
const MOST_CELLS: usize = 1 << 28;

/// The box of the observed leaves of a tree: the root may be much larger than what was seen.
pub(crate) fn seen_by_tree(map: &Quadtree) -> Option<Grid<2>> {
    let mut low = [i32::MAX; 2];
    let mut high = [i32::MIN; 2];
    map.store().for_each_leaf(|leaf| {
        for k in 0..2 {
            low[k] = low[k].min(leaf.cell[k]);
            high[k] = high[k].max(leaf.cell[k] + (1 << leaf.height));
        }
    });
    let lattice = map.store().grid().lattice;
    let shape = [0, 1].map(|k| high[k].saturating_sub(low[k]).max(0) as usize);
    (low[0] < high[0]).then(|| Grid::new(lattice.corner(low), lattice.resolution, shape))
}

/// The cells of a map_server map: from the occupancy grid, else from the signs of the distances, else from the tree.
/// `None`: the file holds no map, or a tree that spans too much for an array.
pub(crate) fn cells_for_map_server(file: &MapFile<2>) -> Option<(Grid<2>, Vec<MapCell>)> {
    let decide = |p: Option<f64>| match p {
        Some(p) if p > OCCUPIED => MapCell::Occupied,
        Some(p) if p < FREE => MapCell::Free,
        _ => MapCell::Unknown,
    };
    if let Some(map) = &file.grid {
        // 256 values: a table instead of an exponential per cell.
        let table: Vec<MapCell> = (i8::MIN..=i8::MAX)
            .map(|v| {
                let value = LogOdds8(v);
                decide((!value.is_unobserved()).then(|| value.probability(map.rule())))
            })
            .collect();
        let cells = map.store().planes().iter().map(|v| table[(i16::from(v.0) + 128) as usize]).collect();
        return Some((*map.store().grid(), cells));
    }
    if let Some(map) = &file.tsdf {
        let grid = *map.grid();
        let cell = |i: usize| map.store().at(i).map(|c| if c.distance < 0.0 { 1.0 } else { 0.0 });
        return Some((grid, (0..grid.len()).map(|i| decide(cell(i))).collect()));
    }
    let map = file.tree.as_ref()?;
    let grid = seen_by_tree(map).filter(|grid| grid.len() <= MOST_CELLS)?;
    let cells = (0..grid.len()).map(|i| decide(map.probability(grid.lattice.center(grid.cell(i))).known()));
    Some((grid, cells.collect()))
}

/// The grid of a saved map.
pub(crate) fn grid_of(file: &MapFile<2>) -> Option<Grid<2>> {
    let dense = file.tsdf.as_ref().map(|m| *m.grid());
    dense
        .or_else(|| file.grid.as_ref().map(|m| *m.store().grid()))
        .or_else(|| file.tree.as_ref().and_then(seen_by_tree))
        .or_else(|| file.attenuation.as_ref().and_then(|m| seen_by_bricks(&m.store)))
}

/// The grid of all bricks of a store; `None`: there are none.
fn seen_by_bricks<C: Cell>(store: &Bricks<C, 2>) -> Option<Grid<2>> {
    let keys = store.keys();
    let first = [0, 1].map(|k| keys.iter().map(|key| key.first_cell()[k]).min());
    let last = [0, 1].map(|k| keys.iter().map(|key| key.first_cell()[k]).max());
    let ([Some(x), Some(y)], [Some(right), Some(top)]) = (first, last) else { return None };
    let shape = [right - x, top - y].map(|cells| cells as usize + BLOCK_EDGE);
    Some(Grid::new(store.lattice().corner([x, y]), store.lattice().resolution, shape))
}
