//! How large a map in bricks is.

use portolan::cell::Cell;
use portolan::geom::{Aabb, BLOCK_EDGE};
use portolan::store::{Bricks, Store};

/// The box of all bricks (metres).
pub(crate) fn brick_extent<C: Cell>(store: &Bricks<C, 3>) -> Aabb<3> {
    let mut extent = Aabb::EMPTY;
    for (key, _) in store.bricks_by_age() {
        let first = key.first_cell();
        extent.include(store.lattice().corner(first));
        extent.include(store.lattice().corner(first.map(|c| c + BLOCK_EDGE as i32)));
    }
    extent
}
