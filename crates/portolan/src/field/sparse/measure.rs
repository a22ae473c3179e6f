//! From the nearest crossing to the distance of a cell.

use super::crossings::{BrickCrossings, Crossings};
use super::feature::Feature;
use super::planes::Nearest;
use crate::geom::BlockKey;

/// Distance (cells) of each cell of a brick to the crossing that it found nearest; infinite where it found none.
pub(super) fn measure<const D: usize>(
    crossings: &impl Crossings<D>,
    key: BlockKey<D>,
    nearest: &Nearest,
    out: &mut [f32],
) {
    // Cells beside each other look at the same bricks.
    let mut last: Option<(BlockKey<D>, Option<&BrickCrossings<D>>)> = None;
    for (i, (to, &word)) in out.iter_mut().zip(&nearest.feature).enumerate() {
        *to = f32::INFINITY;
        let Some(feature) = Feature(word).known() else { continue };
        let (cell, offset, axis) = (key.cell(i), feature.offset::<D>(), feature.axis());
        let edge: [i32; D] = std::array::from_fn(|k| cell[k] + offset[k]);
        let of = BlockKey::of_cell(edge);
        let brick = match last {
            Some((key, brick)) if key == of => brick,
            _ => crossings.brick(of),
        };
        last = Some((of, brick));
        let Some(brick) = brick else { continue };
        let place = brick.place[axis][BlockKey::offset(edge)];
        let along = |k: usize| offset[k] as f32 + if k == axis { place } else { 0.0 };
        *to = (0..D).map(|k| along(k) * along(k)).sum::<f32>().sqrt();
    }
}
