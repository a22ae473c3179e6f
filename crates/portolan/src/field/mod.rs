//! Distance fields: how far the nearest surface is, and which way is away from it.
//!
//! | question | field |
//! |---|---|
//! | how far, for certain, with a gradient; kept up to date with its map | [`Esdf`], in bricks |
//! | the same as one array, for files and programs that want one | [`EsdfGrid`], by [`Esdf::dense`] |
//! | what the textbook makes of a dense map | [`esdf_from_tsdf`] |
//! | how far every cell of a mask is from one that is set, and from which; of labels, from another label | [`MaskTransform`] |
//!
//! Three distance transforms stand side by side, because none can do the work of another. The passes over bricks
//! ([`Esdf`]) are bounded by a largest distance, so that they fill only bricks near the surface. The transform of samples
//! ([`squared_distance_transform`]) takes any real heights and has no bound, in `f64`: the textbook's numbers come from
//! it, and bounded passes in `f32` would change them. The transform of masks ([`MaskTransform`]) is in whole numbers
//! where axes have one spacing and the diagonal is below 46 340 cells, which is exact and several times as fast, else in
//! `f32`; it finds the nearest cell too, and takes labels, but no heights.

mod clearance;
mod esdf;
mod grid;
mod mask;
mod on_nodes;
mod smooth;

pub use clearance::{Clearance, ClearanceField, UnknownSpace};
pub use esdf::{
    Esdf, EsdfMethod, EsdfSettings, EsdfUpdate, LEAST_HITS, LessNoise, ObstacleCells, PointKind, SurfaceNoise,
};
pub use grid::{EsdfError, EsdfGrid, esdf_from_tsdf, squared_distance_transform};
pub use mask::{Label, MaskCell, MaskError, MaskTransform};
pub use smooth::{FieldSlots, Interpolation, Smooth};
