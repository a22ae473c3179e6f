//! A camera as it is: a pinhole behind a lens that bends rays, and a color camera beside the depth camera.

use portolan::geom::Pose;
use portolan::scan::Pinhole;

use super::{CameraFrom, Distortion};

/// A pinhole and the lens before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lens {
    pub(super) pinhole: Pinhole,
    pub(super) distortion: Distortion,
    /// Rays further from the axis than this are not shown: the square of their radius at depth 1.
    limit_sq: f64,
}

/// A color camera that is not the depth camera.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorCamera {
    /// Its numbers (pixels).
    pub pinhole: Pinhole,
    /// Its lens.
    pub distortion: Distortion,
    /// Where it is: `color_from_depth`.
    pub color_from_depth: Pose<3>,
    /// Where its numbers come from.
    pub from: CameraFrom,
}

impl Lens {
    pub(super) fn new(pinhole: Pinhole, distortion: Distortion) -> Self {
        Self { pinhole, distortion, limit_sq: distortion.largest_radius_sq() }
    }

    /// The same camera, whose pictures were made so many times as large in x and in y. Pixels have their centers at whole numbers,
    /// so that it is their corners, half a pixel aside, that are scaled.
    pub(super) fn scaled(self, [x, y]: [f64; 2]) -> Self {
        Self { pinhole: scaled(self.pinhole, [x, y]), ..self }
    }

    /// The place of a point in the picture (pixels); `None` behind the camera and where the lens shows nothing.
    pub(super) fn place(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        if !(z > 0.0) {
            return None;
        }
        let ray = [x / z, y / z];
        if ray[0] * ray[0] + ray[1] * ray[1] > self.limit_sq {
            return None;
        }
        let [x, y] = self.distortion.bend(ray);
        let p = &self.pinhole;
        Some([p.fx * x + p.cx, p.fy * y + p.cy])
    }

    /// The pixel of a picture of this size that is nearest to where a point is shown.
    #[inline]
    pub(super) fn pixel(&self, point: [f64; 3], [columns, rows]: [usize; 2]) -> Option<usize> {
        let [u, v] = self.place(point)?.map(f64::round);
        // False for NaN, too.
        let inside = u >= 0.0 && v >= 0.0 && u < columns as f64 && v < rows as f64;
        inside.then(|| v as usize * columns + u as usize)
    }

    /// For every pixel of a picture of this size without distortion, of the same pinhole, the nearest pixel of the distorted
    /// picture; `None` where that shows nothing. `None` altogether where the lens does not distort.
    ///
    /// What is lost: half a pixel of a ray's direction at most; what the lens sees beyond the edge of the pinhole's picture; and
    /// pixels that others are taken for where the lens shrinks.
    pub(crate) fn sources(&self, size: [usize; 2]) -> Option<Vec<Option<u32>>> {
        if self.distortion == Distortion::None {
            return None;
        }
        let p = &self.pinhole;
        let [columns, rows] = size;
        let pixels = (0..rows).flat_map(|row| (0..columns).map(move |column| (column as f64, row as f64)));
        let source = |(u, v): (f64, f64)| {
            self.pixel([(u - p.cx) / p.fx, (v - p.cy) / p.fy, 1.0], size).map(|at| at as u32)
        };
        Some(pixels.map(source).collect())
    }
}

/// The camera of pictures that were made so many times as large.
pub(super) fn scaled(p: Pinhole, [x, y]: [f64; 2]) -> Pinhole {
    Pinhole { fx: x * p.fx, fy: y * p.fy, cx: x * (p.cx + 0.5) - 0.5, cy: y * (p.cy + 0.5) - 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Pinhole = Pinhole { fx: 40.0, fy: 40.0, cx: 31.5, cy: 23.5 };

    #[test]
    fn a_scaled_camera_shows_the_same_place() {
        let whole = Lens::new(CAMERA, Distortion::None);
        let half = whole.scaled([0.5, 0.5]);
        let [u, v] = whole.place([0.3, -0.2, 2.0]).unwrap();
        let [a, b] = half.place([0.3, -0.2, 2.0]).unwrap();
        // Corners of pixels: (u + 0.5) / 64 of the width in both.
        assert!(
            ((u + 0.5) / 64.0 - (a + 0.5) / 32.0).abs() < 1e-12
                && ((v + 0.5) / 48.0 - (b + 0.5) / 24.0).abs() < 1e-12
        );
        assert_eq!(half.pinhole.cx, 15.5);
        assert_eq!(whole.place([0.0, 0.0, -1.0]), None);
    }

    #[test]
    fn every_pixel_of_the_undistorted_picture_knows_its_source() {
        let size = [64, 48];
        assert_eq!(Lens::new(CAMERA, Distortion::None).sources(size), None);
        let barrel = Distortion::of_model("plumb_bob", &[-0.3, 0.05, 0.002, -0.001]).unwrap();
        let lens = Lens::new(CAMERA, barrel);
        let sources = lens.sources(size).unwrap();
        for (i, source) in sources.iter().enumerate() {
            // The inverse, which is worked out in another way, comes back to within half a pixel.
            let Some(source) = source.map(|s| s as usize) else { continue };
            let shown = [((source % 64) as f64 - 31.5) / 40.0, ((source / 64) as f64 - 23.5) / 40.0];
            let [x, y] = barrel.undistort(shown).unwrap();
            let (u, v) = (40.0 * x + 31.5, 40.0 * y + 23.5);
            let off = (u - (i % 64) as f64).abs().max((v - (i / 64) as f64).abs());
            // (Where the lens shrinks to two fifths.)
            assert!(off < 2.0, "{i}: {off}");
        }
        assert!(sources.iter().filter(|s| s.is_some()).count() > 64 * 48 * 9 / 10);
        // A pincushion shows less than the pinhole would.
        let pincushion = Distortion::of_model("plumb_bob", &[0.3, 0.0, 0.0, 0.0]).unwrap();
        assert_eq!(Lens::new(CAMERA, pincushion).sources(size).unwrap()[0], None);
    }
}
