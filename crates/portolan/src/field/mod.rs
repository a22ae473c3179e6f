//! Read-only fields that answer in constant time.

mod clearance;
mod distance_transform;
mod elements;
mod envelope;
mod esdf;
mod mask;
mod smooth;
mod sparse;
mod surface_noise;

pub use clearance::{Clearance, ClearanceField, UnknownSpace};
pub use distance_transform::squared_distance_transform;
pub use esdf::{Esdf, EsdfError, EsdfSettings, esdf_from_tsdf};
pub use mask::{MaskCell, MaskError, MaskTransform};
pub use smooth::{FieldSlots, Interpolation, Smooth, Status};
pub use sparse::{DenseEsdf, EsdfMethod, EsdfUpdate, SparseEsdf, SparseEsdfSettings};
pub use surface_noise::SurfaceNoise;

/// A Euclidean signed distance field of the plane.
pub type Esdf2 = Esdf<2>;
/// A Euclidean signed distance field of space.
pub type Esdf3 = Esdf<3>;
