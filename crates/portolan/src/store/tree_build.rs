//! Blocks into subtrees and back.

use super::arena::{Arena, NONE, Record, children};
use crate::cell::LogOddsValue;

/// Where child `c` of a node of height `height` starts in a block laid out x fastest.
#[inline(always)]
fn child_offset<const D: usize>(c: usize, height: u32) -> usize {
    let mut offset = 0;
    for k in 0..D {
        offset += ((c >> k) & 1) << (height - 1 + 3 * k as u32);
    }
    offset
}

/// The value of an inner node: the largest of its children's; unobserved only if all are.
pub(super) fn value_above<V: LogOddsValue>(record: &Record<V>, children: usize) -> V {
    let mut above = V::UNOBSERVED;
    for &v in &record.values[..children] {
        if above.is_unobserved() || v > above {
            above = if v.is_unobserved() { above } else { v };
        }
    }
    above
}

/// Writes the cells below `record` (of height `height`) into `block`, from `offset`.
pub(super) fn expand<V: LogOddsValue, const D: usize>(
    arena: &Arena<V, D>,
    record: u32,
    block: &mut [V],
    offset: usize,
    height: u32,
) {
    for c in 0..children::<D>() {
        let at = offset + child_offset::<D>(c, height);
        if arena.mask(record) >> c & 1 != 0 {
            expand(arena, arena.child(record, c), block, at, height - 1);
        } else {
            fill::<V, D>(block, at, height - 1, arena.values(record)[c]);
        }
    }
}

fn fill<V: LogOddsValue, const D: usize>(block: &mut [V], offset: usize, height: u32, value: V) {
    let edge = 1usize << height;
    for row in 0..edge.pow(D as u32 - 1) {
        let start = offset
            + match D {
                2 => row << 3,
                _ => ((row & (edge - 1)) << 3) + ((row >> height) << 6),
            };
        block[start..start + edge].fill(value);
    }
}

/// The smallest subtree of the cells of `block` from `offset`, `2^height` along each edge: a value where all
/// are equal, else a record, whose children stand in the arena already.
pub(super) fn subtree<V: LogOddsValue, const D: usize>(
    arena: &mut Arena<V, D>,
    block: &[V],
    offset: usize,
    height: u32,
) -> Result<V, Record<V>> {
    let mut record = Record { values: [V::UNOBSERVED; 8], first_child: NONE, mask: 0 };
    if height == 1 {
        for c in 0..children::<D>() {
            record.values[c] = block[offset + child_offset::<D>(c, 1)];
        }
    } else {
        let mut inner = [record; 8];
        let mut n = 0;
        for c in 0..children::<D>() {
            match subtree(arena, block, offset + child_offset::<D>(c, height), height - 1) {
                Ok(value) => record.values[c] = value,
                Err(below) => {
                    record.values[c] = value_above(&below, children::<D>());
                    record.mask |= 1 << c;
                    inner[n] = below;
                    n += 1;
                }
            }
        }
        if n > 0 {
            record.first_child = arena.allocate(n);
            for (k, below) in inner[..n].iter().enumerate() {
                arena.write(record.first_child + k as u32, below);
            }
        }
    }
    let first = record.values[0];
    let uniform = record.mask == 0 && record.values[..children::<D>()].iter().all(|v| v.same(first));
    if uniform { Ok(first) } else { Err(record) }
}
