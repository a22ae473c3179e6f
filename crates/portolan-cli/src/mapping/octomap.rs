//! Occupancy in OctoMap's place: its files hold 65,536 cells about zero along each axis, and no origin.

use portolan::cell::LogOdds8;
use portolan::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice};
use portolan::store::{Bricks, Store, Tree};

/// Cells on either side of zero.
const HALF: f64 = 32768.0;

/// An octree, and where its zero lies in the coordinates of the map.
pub(crate) struct Octree {
    pub(crate) tree: Tree<LogOdds8, 3>,
    /// Meters; zero wherever OctoMap's range holds the map as it is.
    pub(crate) shift: [f64; 3],
}

impl Octree {
    /// Of an occupancy map; `None`: it spans more cells than a tree has. A map outside of OctoMap's range is moved by its own
    /// origin, or where that is not enough by the middle of what it holds, in whole bricks.
    pub(crate) fn of(store: &Bricks<LogOdds8, 3>) -> Option<Self> {
        let Lattice { origin, resolution, .. } = *store.lattice();
        let extent = keys(store);
        let fits = |from: [f64; 3]| {
            extent.is_empty()
                || (0..3).all(|k| {
                    let edge = BLOCK_EDGE as f64;
                    from[k] + edge * extent.min[k] >= -HALF && from[k] + edge * (extent.max[k] + 1.0) <= HALF
                })
        };
        let first = origin.map(|v| v / resolution);
        let middle = if fits(first) {
            return Some(Self { tree: Tree::from_bricks(store)?, shift: [0.0; 3] });
        } else if fits([0.0; 3]) {
            [0; 3]
        } else {
            [0, 1, 2].map(|k| (0.5 * (extent.min[k] + extent.max[k])).round() as i32)
        };
        let mut moved = Bricks::new(Lattice::new([0.0; 3], resolution));
        for (key, brick) in store.bricks_by_age() {
            // Bricks are shared, and there is no limit.
            let key = BlockKey(std::array::from_fn(|k| key.0[k] - middle[k]));
            moved.insert(key, brick.clone()).ok()?;
        }
        let corner = BlockKey(middle).first_cell();
        Some(Self { tree: Tree::from_bricks(&moved)?, shift: store.lattice().corner(corner) })
    }

    /// What is to be said of files whose coordinates are not the map's.
    pub(crate) fn note(&self) -> Option<String> {
        (self.shift != [0.0; 3]).then(|| {
            let [x, y, z] = self.shift;
            format!(
                "OctoMap's files hold 65,536 cells about zero and no origin: the coordinates in them are those of the map less \
                 {x},{y},{z}"
            )
        })
    }
}

/// The box of the keys of all bricks.
fn keys(store: &Bricks<LogOdds8, 3>) -> Aabb<3> {
    let mut extent = Aabb::EMPTY;
    store.bricks_by_age().for_each(|(key, _)| extent.include(key.0.map(f64::from)));
    extent
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::cell::{Cell, LogOddsValue, Planes};
    use portolan::geom::block_cells;

    fn store_at(origin: [f64; 3], cell: [i32; 3]) -> Bricks<LogOdds8, 3> {
        let mut store = Bricks::new(Lattice::new(origin, 0.5));
        let mut brick = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<3>());
        brick.set(BlockKey::offset(cell), Some(LogOdds8(40)));
        store.insert(BlockKey::of_cell(cell), brick).unwrap();
        store
    }

    #[test]
    fn what_is_far_is_moved_and_says_where() {
        let cell = [3, 300, -9];
        for (origin, place) in [
            ([0.0; 3], cell),
            ([500_000.0, 4_000_000.0, 0.0], cell),
            // Too far from the lattice's own origin, too.
            ([0.0; 3], [1_000_003, 8_000_300, -9]),
        ] {
            let store = store_at(origin, place);
            let octree = Octree::of(&store).unwrap();
            assert_eq!(octree.note().is_some(), origin[0] > 0.0 || place[0] > 9);
            let (low, _) = octree.tree.extent().unwrap();
            let at = octree.tree.lattice().corner(low);
            let want = store.lattice().corner(place);
            for k in 0..3 {
                assert!(at[k].abs() < 0.5 * HALF, "{at:?}");
                assert!(
                    (at[k] + octree.shift[k] - want[k]).abs() < 1e-6,
                    "{at:?} {:?} {want:?}",
                    octree.shift
                );
            }
            let mut occupied = 0;
            octree.tree.for_each_leaf(|leaf| occupied += usize::from(leaf.value.is_occupied()));
            assert_eq!(occupied, 1);
        }
    }
}
