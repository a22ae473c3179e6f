//! Exact rays through bricks: every cell that a beam passes is missed, the cell in which it ends is hit.

use super::masks::BrickMasks;
use crate::geom::vector::{distance, scale, sub};
use crate::geom::{BlockKey, Lattice, RayWalk};

/// A cell's place in its brick as three numbers of four bits; the fourth bit of each changes when a step leaves.
type Packed = u32;
const FENCE: Packed = 0x888;

/// Marks the cells of the ray from `origin` to `end` (world) as missed, without the one that holds `end`; returns that
/// one. `None` where one of the two has no cell index: nothing is marked.
///
/// The cells are those of [`RayWalk`] up to the first that holds `end` or that the ray leaves beyond it, bit for bit.
#[inline]
pub(crate) fn trace(
    masks: &mut BrickMasks,
    lattice: &Lattice<3>,
    origin: [f64; 3],
    end: [f64; 3],
) -> Option<[i32; 3]> {
    let end_cell = lattice.cell_of(end)?;
    let length = distance(end, origin);
    if length > 0.0 {
        let direction = scale(sub(end, origin), 1.0 / length);
        walk(masks, RayWalk::new(lattice, origin, direction)?, end_cell, length);
    }
    Some(end_cell)
}

/// Marks from the start of the walk up to, not including, `end`, or up to arc length `length`.
#[inline]
pub(crate) fn walk(masks: &mut BrickMasks, walk: RayWalk<3>, end: [i32; 3], length: f64) {
    let (start, step, t_next, delta) = walk.into_parts();
    // The walk only ever goes one way along an axis: it stands in `end` after that many steps or never.
    let mut remaining: u64 = (0..3).map(|k| u64::from(start[k].abs_diff(end[k]))).sum();
    if remaining == 0 {
        return;
    }
    let [mut tx, mut ty, mut tz] = t_next;
    let mut key = BlockKey::of_cell(start);
    // Going down, the fence bit is set and falls with the step from 0; going up it rises with the step from 7.
    let fence = (0..3).fold(0, |f, k| if step[k] < 0 { f | 8 << (4 * k) } else { f });
    let move_by = [0, 1, 2].map(|k| (step[k] << (4 * k)) as Packed);
    let mut at: Packed = (0..3).fold(fence, |p, k| p | ((start[k] & 7) as Packed) << (4 * k));
    loop {
        let slot = masks.slot(key);
        let miss = &mut masks.bits_mut(slot).miss;
        loop {
            miss[(at >> 8 & 7) as usize] |= 1 << (at & 7 | at >> 1 & 0x38);
            // As in `RayWalk::advance`: the smallest, on a tie the first axis.
            let x = (tx <= ty) & (tx <= tz);
            let y = !(tx <= ty) & (ty <= tz);
            let exit = if x {
                tx
            } else if y {
                ty
            } else {
                tz
            };
            if exit >= length {
                return;
            }
            at = at.wrapping_add(if x {
                move_by[0]
            } else if y {
                move_by[1]
            } else {
                move_by[2]
            });
            // Adding zero instead of branching: the same number.
            tx += if x { delta[0] } else { 0.0 };
            ty += if y { delta[1] } else { 0.0 };
            tz += if x | y { 0.0 } else { delta[2] };
            remaining -= 1;
            if remaining == 0 {
                let here: [i32; 3] = std::array::from_fn(|k| at as i32 >> (4 * k) & 7);
                let crossed = (at ^ fence) & FENCE;
                let brick = stepped(key, crossed, step);
                if (0..3).all(|k| (brick.0[k] << 3) + here[k] == end[k]) {
                    return;
                }
                remaining = u64::MAX;
            }
            if (at ^ fence) & FENCE != 0 {
                break;
            }
        }
        key = stepped(key, (at ^ fence) & FENCE, step);
        at = at & 0x777 | fence;
    }
}

/// The brick after a step that crossed the faces whose fence bits are set.
#[inline(always)]
fn stepped(key: BlockKey<3>, crossed: Packed, step: [i32; 3]) -> BlockKey<3> {
    BlockKey(std::array::from_fn(|k| key.0[k] + if crossed >> (4 * k) & 8 != 0 { step[k] } else { 0 }))
}
