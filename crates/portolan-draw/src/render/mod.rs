//! Pictures of triangle meshes: a software rasterizer with soft light.
//!
//! The steps of [`render_mesh`]: project and cut triangles (`camera`, `clip`), sort them into bands of rows and fill
//! those (`raster`), darken what lies in corners and draw creases (`occlusion`), light what is seen (`shade`).

mod camera;
mod clip;
mod mesh;
mod occlusion;
mod parallel;
mod preview;
mod raster;
mod scene;
mod shade;
#[cfg(test)]
mod testing;
mod vector;

pub use camera::Camera;
pub use mesh::MeshView;
pub use preview::{Preview, preview};
pub use scene::Sensor;
pub use shade::render_mesh;
