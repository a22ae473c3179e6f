//! A layer of cells of a field, as an image.

use portolan::field::Esdf;
use portolan::geom::{Aabb, BLOCK_EDGE, BlockKey, Lattice};
use portolan::map::{Occupancy, Tsdf3};
use portolan::store::Store;

use super::ask::{Field, Slice};
use crate::engine::Refusal;

/// Cells along a side of the image; of larger layers every so many cells are shown.
const LONGEST: usize = 1536;

/// The cells of all bricks but stray ones: the first, and the one behind the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) first: [i32; 3],
    pub(super) end: [i32; 3],
}

impl Extent {
    /// `None` where nothing was observed. What lies further from all but a hundredth of the bricks on each side than half of
    /// their extent is left out: a beam through a window shall not make all else a dot. O(bricks).
    pub(super) fn of(tsdf: &Tsdf3) -> Option<Self> {
        let last = tsdf.store().len().checked_sub(1)?;
        let side = |k: usize| {
            let mut all: Vec<i32> = tsdf.store().bricks_by_age().map(|(key, _)| key.0[k]).collect();
            let (low, high) = (*all.iter().min()?, *all.iter().max()?);
            let stray = last / 100;
            let usual_low = *all.select_nth_unstable(stray).1;
            let usual_high = *all.select_nth_unstable(last - stray).1;
            let more = 2 + (usual_high - usual_low) / 2;
            Some((low.max(usual_low - more), high.min(usual_high + more)))
        };
        let [x, y, z] = [side(0)?, side(1)?, side(2)?];
        Some(Self {
            first: BlockKey([x.0, y.0, z.0]).first_cell(),
            end: BlockKey([x.1, y.1, z.1]).first_cell().map(|c| c + BLOCK_EDGE as i32),
        })
    }

    /// In the world (meters).
    pub(super) fn aabb(&self, lattice: &Lattice<3>) -> Aabb<3> {
        lattice.aabb(self.first, self.end)
    }
}

/// The values of a layer.
pub(super) struct Layer {
    /// The layer's index along its axis.
    pub(super) cell: i32,
    /// Its middle on the axis (world, meters).
    pub(super) at: f64,
    /// Values to the right, and up.
    pub(super) shape: [usize; 2],
    /// Cells from one value to the next.
    pub(super) step: usize,
    /// The lower corner of the first cell (world, meters).
    pub(super) corner: [f64; 3],
    /// First to the right, then up; NaN where nothing is known.
    pub(super) values: Vec<f32>,
}

/// The axes of an image across an axis.
pub(super) const AXES: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

/// The layer's index; the place is kept within the map.
pub(super) fn layer_index(
    slice: &Slice,
    at_world: f64,
    extent: &Extent,
    lattice: &Lattice<3>,
) -> Result<i32, Refusal> {
    if slice.axis > 2 {
        return Err(Refusal::new(format!("axes are 0, 1 and 2; there is no axis {}", slice.axis)));
    }
    if !at_world.is_finite() {
        return Err(Refusal::new("a slice must lie at a finite place"));
    }
    let k = slice.axis;
    let cells = ((at_world - lattice.origin[k]) / lattice.resolution).floor();
    Ok(cells.clamp(f64::from(extent.first[k]), f64::from(extent.end[k] - 1)) as i32)
}

/// The value of a field at a cell; NaN: unknown.
pub(super) fn value_of<'a>(
    field: Field,
    tsdf: &'a Tsdf3,
    occupancy: Option<&'a Occupancy<3>>,
    esdf: Option<&'a Esdf<3>>,
) -> impl Fn([i32; 3]) -> f32 + 'a {
    move |cell| {
        let value = match field {
            Field::Tsdf => tsdf.store().cell(cell).map(|c| c.distance),
            Field::Esdf => esdf.and_then(|esdf| esdf.cell(cell).value()),
            Field::Occupancy => occupancy
                .and_then(|map| map.probability(map.store().lattice().center(cell)).known())
                .map(|p| p as f32),
        };
        value.unwrap_or(f32::NAN)
    }
}

/// Cuts.
pub(super) fn layer(
    axis: usize,
    cell: i32,
    extent: &Extent,
    lattice: &Lattice<3>,
    value: impl Fn([i32; 3]) -> f32,
) -> Layer {
    let axes = AXES[axis];
    let cells = axes.map(|k| (extent.end[k] - extent.first[k]) as usize);
    let step = cells.map(|n| n.div_ceil(LONGEST)).into_iter().max().unwrap_or(1).max(1);
    let shape = cells.map(|n| n.div_ceil(step));
    let mut values = Vec::with_capacity(shape[0] * shape[1]);
    let mut at = extent.first;
    at[axis] = cell;
    for v in 0..shape[1] {
        at[axes[1]] = extent.first[axes[1]] + (v * step) as i32;
        for u in 0..shape[0] {
            at[axes[0]] = extent.first[axes[0]] + (u * step) as i32;
            values.push(value(at));
        }
    }
    let mut first = extent.first;
    first[axis] = cell;
    Layer { cell, at: lattice.center(first)[axis], shape, step, corner: lattice.corner(first), values }
}
