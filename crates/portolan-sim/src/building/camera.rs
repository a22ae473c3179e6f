//! A depth camera with color.

use super::world::World3;
use crate::Random;
use portolan::geom::Pose;
use portolan::geom::vector::{along, norm, scale};
use portolan::scan::{Frame, Pinhole, RangeImage};

/// A depth camera; depth and color have the same viewpoint.
///
/// The noise of the depth is independent, normal and without bias, with a standard deviation of
/// `noise + noise_quadratic (z - 0.4 m)^2`. Directions, colors and poses are exact: no distortion, no mixed pixels at
/// edges, no shadow of a projector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthCamera {
    /// The projection.
    pub pinhole: Pinhole,
    /// Number of pixels in a row.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Least and greatest depth measured (meters).
    pub depth: [f64; 2],
    /// Standard deviation of a depth at 0.4 m (meters).
    pub noise: f64,
    /// Its increase with the squared distance (per meter).
    pub noise_quadratic: f64,
    /// Depths are rounded to multiples of this (meters); 0 for no rounding.
    pub step: f64,
    /// Share of pixels without a reading, at random.
    pub dropped_rate: f64,
}

impl Default for DepthCamera {
    /// 640 x 480 pixels, a focal length of 525 pixels, 0.3 m to 8 m, rounded to millimeters, one pixel in 200 lost; the noise
    /// of a Kinect: 1.2 mm at 0.4 m, 14 mm at 3 m (Nguyen, Izadi & Lovell 2012, doi:10.1109/3DIMPVT.2012.84).
    fn default() -> Self {
        Self {
            pinhole: Pinhole { fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 },
            columns: 640,
            rows: 480,
            depth: [0.3, 8.0],
            noise: 0.0012,
            noise_quadratic: 0.0019,
            step: 0.001,
            dropped_rate: 0.005,
        }
    }
}

impl DepthCamera {
    /// The camera with a share of the pixels along each side and the same field of view.
    pub fn scaled(self, share: f64) -> Self {
        let c = self.pinhole;
        let centre = |v: f64| (v + 0.5) * share - 0.5;
        let pinhole = Pinhole { fx: c.fx * share, fy: c.fy * share, cx: centre(c.cx), cy: centre(c.cy) };
        let pixels = |n: usize| ((n as f64 * share).round() as usize).max(1);
        Self { pinhole, columns: pixels(self.columns), rows: pixels(self.rows), ..self }
    }

    /// Standard deviation of a depth (meters).
    pub fn sigma(&self, depth: f64) -> f64 {
        self.noise + self.noise_quadratic * (depth - 0.4) * (depth - 0.4)
    }
}

/// The image of the camera from a pose (x right, y down, z forward). The noise depends on the stream `(seed, index)` alone.
pub fn camera_frame(
    world: &World3,
    world_from_camera: &Pose<3>,
    camera: &DepthCamera,
    (seed, index): (u64, u64),
) -> Frame {
    let mut random = Random::stream(seed ^ 0xCA3E_2A00, index);
    let c = &camera.pinhole;
    let (mut values, mut colors) = (Vec::new(), Vec::new());
    for row in 0..camera.rows {
        for column in 0..camera.columns {
            let (fate, noise) = (random.uniform(), random.normal());
            let ray = [(column as f64 - c.cx) / c.fx, (row as f64 - c.cy) / c.fy, 1.0];
            let per_depth = norm(ray);
            let direction = world_from_camera.rotate(scale(ray, 1.0 / per_depth));
            let hit = world.cast_ray(world_from_camera.translation, direction);
            let reading = hit.map_or(0.0, |hit| {
                let truth = hit.range / per_depth;
                let z = truth + camera.sigma(truth) * noise;
                let z = if camera.step > 0.0 { (z / camera.step).round() * camera.step } else { z };
                let [low, high] = camera.depth;
                if fate >= camera.dropped_rate && low <= z && z <= high { z } else { 0.0 }
            });
            values.push(reading as f32);
            colors.push(hit.map_or([0; 3], |hit| {
                world.color(hit.body, along(world_from_camera.translation, direction, hit.range))
            }));
        }
    }
    Frame::Image(RangeImage::from_depth(*c, camera.columns, camera.rows, values).with_colors(colors))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::building_world;
    use crate::building::walk::{BODY_FROM_CAMERA, body_pose};

    #[test]
    fn depths_are_those_of_the_surface_with_the_stated_noise() {
        let world = building_world(1).world;
        let camera = DepthCamera::default();
        let body = body_pose([3.1, 2.9, 1.4], [1.0, 0.0], -0.3, 0.2, 0.0);
        let pose = body * BODY_FROM_CAMERA;
        let Frame::Image(image) = camera_frame(&world, &pose, &camera, (1, 0)) else {
            panic!("a camera delivers images")
        };
        let mut errors = Vec::new();
        for (i, p) in image.points() {
            let z = f64::from(image.values[i]);
            assert!(((z * 1000.0).round() - z * 1000.0).abs() < 1e-3);
            let direction = pose.rotate(scale(p, 1.0 / norm(p)));
            let hit = world.cast_ray(pose.translation, direction).unwrap();
            let truth = z * hit.range / norm(p);
            errors.push((z - truth) / camera.sigma(truth));
            let q = along(pose.translation, direction, hit.range);
            assert!(world.signed_distance(q).abs() < 1e-9);
            assert_eq!(image.colors[i], world.color(hit.body, q));
        }
        let n = errors.len() as f64;
        assert!(n > 280_000.0, "{n}");
        let mean = errors.iter().sum::<f64>() / n;
        let spread = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        assert!(mean.abs() < 0.02 && (spread - 1.0).abs() < 0.03, "{mean} {spread}");
    }

    #[test]
    fn a_smaller_image_sees_the_same_field() {
        let whole = DepthCamera::default();
        let half = whole.scaled(0.5);
        assert_eq!((half.columns, half.rows), (320, 240));
        let edge = |c: &DepthCamera| (c.columns as f64 - 0.5 - c.pinhole.cx) / c.pinhole.fx;
        assert!((edge(&whole) - edge(&half)).abs() < 1e-12);
    }
}
