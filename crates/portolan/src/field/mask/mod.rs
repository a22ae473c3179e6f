//! The exact distance transform of a mask: how far every cell is from the nearest cell that is set, and which one that
//! is.
//!
//! A separable transform *(Saito & Toriwaki 1994)*, in whole numbers where all axes have one spacing. Along x the mask is scanned. Along the other axes
//! lines lie side by side in a panel, and every row of a panel looks for its minimum outwards, until no lane can find
//! less. Where that takes many steps, as in the middle of an empty hall, rows in between look only between what their
//! neighbours found: minima of parabolas of one width are ordered as the rows are *(the total monotonicity of Aggarwal
//! et al. 1987)*. Arrays of labels go the same way; where their lines end is told to every pass (`ends`).

mod cell;
mod ends;
mod number;
mod panel;
mod passes;
mod scan;
mod search;
mod transform;

pub use cell::{Label, MaskCell};
pub use transform::{MaskError, MaskTransform};
