//! Random changes of random bricks, and rays by the boxes of all cells.

use crate::cell::{DistanceBrick, Planes, SignedDistance};
use crate::explore::GainSettings;
use crate::geom::vector::unit;
use crate::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use crate::store::Bricks;
use crate::sweep::clip;
use proptest::prelude::*;

/// A brick, and what is put into cells from one place to another: nothing, or a distance and a weight.
pub(super) type Edit = ([i32; 3], Vec<(usize, usize, Option<(f32, f32)>)>);

pub(super) fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let value = prop_oneof![
        Just((0.3, 1.0)),
        Just((0.3, 1.0)),
        Just((-0.1, 2.0)),
        Just((0.2, 0.3)),
        Just((0.0, 1.0))
    ];
    let run = (0..512usize, 1..300usize, prop::option::weighted(0.8, value));
    prop::collection::vec((prop::array::uniform3(-1..2i32), prop::collection::vec(run, 1..8)), 1..12)
}

pub(super) fn put<const D: usize>(store: &mut Bricks<SignedDistance, D>, (key, runs): &Edit) {
    let key = BlockKey(std::array::from_fn(|k| key[k]));
    let n = block_cells::<D>();
    let mut brick: DistanceBrick = store.brick(key).cloned().unwrap_or_else(|| Planes::unobserved(n));
    for (from, len, value) in runs {
        for i in *from..*from + len % n {
            brick.set(i % n, value.map(|(distance, weight)| SignedDistance { distance, weight }));
        }
    }
    store.insert(key, brick).unwrap();
}

/// All cells that a ray from a pose could meet.
pub(super) fn cells_in_range<const D: usize>(
    lattice: &Lattice<D>,
    pose: &Pose<D>,
    max_range: f64,
) -> Vec<[i32; D]> {
    let from = lattice.cell_of(pose.translation).unwrap();
    let reach = (max_range / lattice.resolution).ceil() as i32 + 1;
    let side = (2 * reach + 1) as usize;
    (0..side.pow(D as u32))
        .map(|i| std::array::from_fn(|a| from[a] + (i / side.pow(a as u32) % side) as i32 - reach))
        .collect()
}

/// The part of a ray in the box of a cell.
pub(super) struct Stretch<const D: usize> {
    pub(super) cell: [i32; D],
    pub(super) length: f64,
    /// Whether it is in the bounds, too.
    pub(super) counts: bool,
}

/// The part of a ray in each of the cells, nearest first, and where it leaves the bounds.
pub(super) fn stretches<const D: usize>(
    lattice: &Lattice<D>,
    cells: &[[i32; D]],
    pose: &Pose<D>,
    direction: [f64; D],
    settings: &GainSettings<D>,
) -> (Vec<Stretch<D>>, f64) {
    let (size, d) = (lattice.resolution, unit(pose.rotate(direction)).unwrap());
    let (enter, leave) = match &settings.bounds {
        Some(b) => clip(b, pose.translation, d, f64::INFINITY).unwrap(),
        None => (0.0, f64::INFINITY),
    };
    let end = settings.max_range.min(leave);
    let mut crossed: Vec<_> = cells
        .iter()
        .filter_map(|&cell| {
            let min: [f64; D] = std::array::from_fn(|a| lattice.center(cell)[a] - 0.5 * size);
            let (a, b) = clip(&Aabb::new(min, min.map(|v| v + size)), pose.translation, d, f64::INFINITY)?;
            let b = b.min(end);
            let counts = b - a.max(enter) > 1e-9 * size;
            (b - a > 1e-9 * size).then_some((a, Stretch { cell, length: b - a, counts }))
        })
        .collect();
    crossed.sort_by(|a, b| a.0.total_cmp(&b.0));
    (crossed.into_iter().map(|(_, stretch)| stretch).collect(), leave)
}
