//! Surfaces extracted from distance fields, and the questions they answer.

mod contour;
mod cubes;
mod measures;
mod mesh;
mod polyline;
mod ray_cast;
mod squares;

pub use contour::Contour;
pub use cubes::{IncrementalMesh, MeshSettings, isosurface, marching_cubes};
pub use measures::{DoubledLength, ThinWalls, doubled_length, thin_walls};
pub use mesh::{EdgeCounts, Mesh};
pub use polyline::Polyline;
pub use ray_cast::{RayCast, RayCastSettings, cast_ray};
pub use squares::{Ambiguity, ContourSettings, level_set, marching_squares};
