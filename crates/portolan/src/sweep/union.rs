//! Blocks of two plans together.

use crate::geom::BlockKey;

/// Visits the blocks of two ascending lists, ascending, each once, with its place in either list.
pub(super) fn union<const D: usize>(
    a: &[BlockKey<D>],
    b: &[BlockKey<D>],
    mut visit: impl FnMut(BlockKey<D>, [Option<u32>; 2]),
) {
    let (mut i, mut j) = (0, 0);
    loop {
        let key = match (a.get(i), b.get(j)) {
            (Some(a), Some(b)) => *a.min(b),
            (Some(key), None) | (None, Some(key)) => *key,
            (None, None) => return,
        };
        let (in_a, in_b) = (a.get(i) == Some(&key), b.get(j) == Some(&key));
        visit(key, [in_a.then_some(i as u32), in_b.then_some(j as u32)]);
        i += usize::from(in_a);
        j += usize::from(in_b);
    }
}
