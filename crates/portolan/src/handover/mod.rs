//! Distance fields as arrays in the layouts of planners, optimizers and costmaps.
//!
//! A field here is an array of samples at the cell centers of a grid: meters, positive in free space, x fastest, NaN where
//! unknown ([`crate::field::EsdfGrid`]). Consumers differ in each of these, and most of them have
//! no value for unknown: the caller first decides what unknown cells become ([`Filled`]), then the layout.
//!
//! | consumer | array | sign | position of samples | beyond the array | here |
//! |---|---|---|---|---|---|
//! | GPMP2 `SignedDistanceField`, `PlanarSDF` | a matrix per z, row = y, column = x, `f64` | + outside | at `origin + index * cell`: the origin is the *centre* of cell 0 | throws; its factors treat that as no cost (optimistic) | [`Gpmp2Field`] |
//! | CasADi, acados `interpolant` | vectors of knots, values with the first axis fastest (Fortran) | any, here + outside | at the knots: the centers | extrapolates the last cells | [`KnotGrid`] |
//! | cuRobo 0.8 `VoxelGrid` | x slowest (C), `f16` | + outside | at centres, the box `n * voxel` long about its pose | `max_dist`: free (optimistic) | [`CuroboGrid`] |
//! | cuRobo up to 0.7 | x slowest (C), `f16` or `f32` | **+ inside** | at the ends too: the box is `(n - 1) * voxel` long | free (optimistic) | [`CuroboGrid`] |
//! | numpy, C or Fortran | any | + outside | at centers | | [`c_order`] |
//! | Nav2 costmap | a byte, row = y, column = x | cost, not distance | at centers | | [`Inflation`] |
//!
//! A costmap has a value for unknown, 255; for the others see [`Filled`].
//!
//! ```
//! use portolan::field::UnknownSpace;
//! use portolan::geom::Grid;
//! use portolan::handover::{Filled, Gpmp2Field};
//!
//! let grid = Grid::new([10.0, 20.0], 0.5, [3, 2]);
//! let distances = [0.1, 0.6, 1.1, 0.2, 0.7, f32::NAN];
//! let filled = Filled::new(&grid, &distances, UnknownSpace::Pessimistic, 2.0)?;
//! let field = Gpmp2Field::of(&filled);
//! assert_eq!(field.origin, [10.25, 20.25]); // PlanarSDF(origin, 0.5, data)
//! assert_eq!((field.rows, field.columns), (2, 3));
//! assert_eq!(field.at(1, 0, 0), f64::from(0.2_f32)); // row 1: the second y
//! assert!(field.at(1, 2, 0) < 0.0); // never seen: an obstacle
//! # Ok::<(), portolan::handover::HandoverError>(())
//! ```

mod fill;
mod half;
mod inflation;
mod layout;
mod reach;
mod slice;

pub use fill::{Filled, HandoverError};
pub use half::{f16_from_f32, f32_from_f16};
pub use inflation::{Inflation, cost};
pub use layout::{CuroboGrid, CuroboVersion, Gpmp2Field, KnotGrid, c_order};
pub use slice::lowest_between;
