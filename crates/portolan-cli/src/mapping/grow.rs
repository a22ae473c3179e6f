//! Maps that were saved, in a larger grid.

use anyhow::{anyhow, bail};
use portolan::cell::{LogOdds8, LogOddsValue};
use portolan::geom::Grid;
use portolan::map::{OccupancyGrid, Quadtree, Tsdf};
use portolan::store::{Tree, TreeRecords};

use super::Maps2;

/// The same cells in `grid`, which holds the maps' own.
pub(crate) fn grown(maps: Maps2, grid: &Grid<2>) -> anyhow::Result<Maps2> {
    let lost = || anyhow!("the saved map does not fit the lattice of the new grid; write to another folder");
    let grow_grid = |map: OccupancyGrid<2>| {
        let store = map.store().regridded(*grid).ok_or_else(lost)?;
        anyhow::Ok(OccupancyGrid::from_store(store, *map.model())?)
    };
    let grow_tsdf = |map: Tsdf2| {
        let store = map.store().regridded(*grid).ok_or_else(lost)?;
        anyhow::Ok(Tsdf::from_store(store, *map.config())?)
    };
    Ok(Maps2 {
        grid: maps.grid.map(grow_grid).transpose()?,
        tree: maps.tree.map(|tree| grown_tree(tree, grid)).transpose()?,
        tsdf: maps.tsdf.map(grow_tsdf).transpose()?,
        ..maps
    })
}

/// The tree under a root that covers `grid`: above the old root new ones are put, each twice as large and
/// reaching further to where the grid reaches further.
fn grown_tree(map: Quadtree, grid: &Grid<2>) -> anyhow::Result<Quadtree> {
    let r = grid.lattice.resolution;
    let root = map.store().grid();
    let mut depth = map.tree().depth();
    let mut first = root.lattice.origin.map(|v| (v / r).round() as i64);
    let wanted = grid.lattice.origin.map(|v| (v / r).round() as i64);
    let end: [i64; 2] = std::array::from_fn(|k| wanted[k] + grid.shape[k] as i64);
    let mut records = map.tree().records();
    let mut origin = root.lattice.origin;
    while (0..2).any(|k| wanted[k] < first[k] || end[k] > first[k] + (1 << depth)) {
        let mut child = 0;
        for k in 0..2 {
            if wanted[k] < first[k] {
                first[k] -= 1 << depth;
                origin[k] = first[k] as f64 * r;
                child |= 1 << k;
            }
        }
        records = below_new_root(&records, child);
        depth += 1;
        if depth > 28 {
            bail!(
                "the saved tree and the new scans are too far apart for one tree of {r} m cells (2^28 along each axis); \
                 write to another folder, or give --bounds"
            );
        }
    }
    let tree = Tree::from_records(origin, r, depth, &records)?;
    Ok(Quadtree::from_tree(tree, *map.model())?)
}

/// The records of a tree whose root has the old tree as one child, and nothing in the others.
fn below_new_root(old: &TreeRecords<LogOdds8>, child: usize) -> TreeRecords<LogOdds8> {
    let leaf = old.masks.is_empty();
    if leaf && old.root_value.is_unobserved() {
        return old.clone();
    }
    let mut values = vec![LogOdds8::UNOBSERVED; 4];
    values[child] = old.root_value;
    values.extend(&old.values);
    let mut masks = vec![if leaf { 0 } else { 1 << child }];
    masks.extend(&old.masks);
    TreeRecords { root_value: old.root_value, values, masks }
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::cell::OccupancyModel;
    use portolan::geom::Pose;
    use portolan::scan::{RangeLimits, Scan};
    use portolan::store::Store;

    #[test]
    fn a_grown_tree_answers_the_same() {
        let model = OccupancyModel::default();
        let small = Grid::new([-1.0, -1.0], 0.1, [20, 20]);
        let mut tree = Quadtree::covering(&small, model).unwrap();
        let empty = tree.clone();
        let bearings: Vec<f64> = (0..90).map(|i| f64::from(i) * 0.0698).collect();
        let scan = Scan::from_laser(&bearings, &vec![0.8; 90], &RangeLimits::default());
        tree.integrate(&Pose::<2>::IDENTITY, &scan);
        for (origin, shape) in
            [([-30.0, -2.0], [400, 30]), ([-1.0, -1.0], [500, 20]), ([-1.0, -9.0], [20, 900])]
        {
            let large = Grid::new(origin, 0.1, shape);
            let grown = grown_tree(tree.clone(), &large).unwrap();
            grown.tree().check_invariants();
            for i in 0..small.len() {
                let p = small.lattice.center(small.cell(i));
                assert_eq!(grown.probability(p), tree.probability(p));
            }
            let mut leaves = 0;
            grown.store().for_each_leaf(|_| leaves += 1);
            let mut before = 0;
            tree.store().for_each_leaf(|_| before += 1);
            assert_eq!(leaves, before);
            let root = grown.store().grid().aabb().grown(1e-9);
            assert!(root.contains(large.aabb().min) && root.contains(large.aabb().max));
            assert!(grown_tree(empty.clone(), &large).unwrap().store().cell([0, 0]).is_none());
        }
    }
}
