//! Surfaces extracted from distance fields: contours, meshes, ray casting and comparison.

mod compare;
mod contour;
pub(crate) mod cubes;
mod measures;
mod mesh;
mod nearest;
mod polyline;
mod predict;
mod ray_cast;
mod ray_caster;
pub(crate) mod squares;

pub use compare::{
    CompareSettings, Reference, SurfaceComparison, SurfaceDistances, area_samples, compare_surfaces,
};
pub use contour::Contour;
pub use cubes::{
    IncrementalMesh, Inside, Isosurface, IsosurfaceSettings, MeshSettings, isosurface, marching_cubes,
};
pub use measures::{DoubledLength, ThinWalls, doubled_length, thin_walls};
pub use mesh::{EdgeCounts, Mesh};
pub use nearest::NearestSurface;
pub(crate) use nearest::point_triangle_sq;
pub use polyline::Polyline;
pub(crate) use predict::hit_rays;
pub use predict::{PredictionScore, RangeNoise, RangePredictions};
pub use ray_cast::{RayCast, RayCastSettings, RayTrace, cast_ray, trace_ray};
pub use ray_caster::RayCaster;
pub use squares::{Ambiguity, ContourSettings, level_set, marching_squares};
