//! The camera of a rendered picture.

use super::vector::{cross, dot, sub, unit_or};

/// A perspective camera with clipping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position (coordinates of the mesh, meters).
    pub eye: [f32; 3],
    /// The point at the center of the picture.
    pub target: [f32; 3],
    /// The direction that points up in the picture, as far as possible; height is measured along it.
    pub up: [f32; 3],
    /// Angle between the upper and the lower edge of the picture (radians).
    pub field_of_view: f32,
    /// Near plane (meters, along the view).
    pub near: f32,
    /// Height along `up` above which surfaces are cut away, such as ceilings (meters).
    pub cut: Option<f32>,
    /// Whether triangles are culled from behind, to look into rooms from outside.
    pub cull_back: bool,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, z up, with a field of view of 50 degrees.
    pub fn new(eye: [f32; 3], target: [f32; 3]) -> Self {
        Self {
            eye,
            target,
            up: [0.0, 0.0, 1.0],
            field_of_view: 50f32.to_radians(),
            near: 0.05,
            cut: None,
            cull_back: false,
        }
    }

    /// Unit vectors to the right, down and forward.
    pub(super) fn axes(&self) -> [[f32; 3]; 3] {
        let forward = unit_or(sub(self.target, self.eye), [1.0, 0.0, 0.0]);
        // Something at right angles to the view, if `up` is not.
        let aside = if forward[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
        let spare = unit_or(cross(forward, aside), [0.0, 1.0, 0.0]);
        let right = unit_or(cross(forward, self.up), spare);
        [right, cross(forward, right), forward]
    }

    /// Unit vector upward.
    pub(super) fn upwards(&self) -> [f32; 3] {
        unit_or(self.up, [0.0, 0.0, 1.0])
    }
}

/// The projection of a camera: from coordinates of the mesh to pixels.
#[derive(Clone, Copy)]
pub(super) struct Projection {
    pub(super) axes: [[f32; 3]; 3],
    pub(super) eye: [f32; 3],
    /// Pixels per unit of x / z.
    pub(super) focal: f32,
    /// The middle of the picture (pixels).
    pub(super) middle: [f32; 2],
    pub(super) near: f32,
}

impl Projection {
    pub(super) fn new(camera: &Camera, width: usize, height: usize) -> Self {
        let half = 0.5 * camera.field_of_view.clamp(0.01, 3.0);
        Self {
            axes: camera.axes(),
            eye: camera.eye,
            focal: 0.5 * height as f32 / half.tan(),
            middle: [0.5 * width as f32, 0.5 * height as f32],
            near: camera.near.max(1e-4),
        }
    }

    /// In the camera's axes (right, down, forward).
    #[inline(always)]
    pub(super) fn view(&self, p: [f32; 3]) -> [f32; 3] {
        let p = sub(p, self.eye);
        self.axes.map(|axis| dot(axis, p))
    }

    /// Pixels, for what lies in front of the camera.
    #[inline(always)]
    pub(super) fn pixel(&self, [x, y, z]: [f32; 3]) -> [f32; 2] {
        [self.middle[0] + self.focal * x / z, self.middle[1] + self.focal * y / z]
    }

    /// The direction of a pixel, with 1 forward, in the mesh's axes.
    #[inline(always)]
    pub(super) fn ray(&self, pixel: [f32; 2]) -> [f32; 3] {
        let (x, y) = ((pixel[0] - self.middle[0]) / self.focal, (pixel[1] - self.middle[1]) / self.focal);
        std::array::from_fn(|k| x * self.axes[0][k] + y * self.axes[1][k] + self.axes[2][k])
    }
}
