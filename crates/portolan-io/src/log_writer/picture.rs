//! Depth and color as PNG, and rotations as quaternions.

use std::io::Write;
use std::path::Path;

use png::{BitDepth, ColorType, Encoder};
use portolan::geom::Pose;
use portolan::scan::RangeImage;

use crate::{Result, write_atomic};

/// A 16-bit gray picture of so many units per meter; 0 for pixels without a surface, and for values beyond 16 bits.
pub(super) fn depth_png(path: &Path, image: &RangeImage, units_per_metre: f64) -> Result<()> {
    let units = |v: &f32| {
        let units = (f64::from(*v) * units_per_metre).round();
        // 65535 means "no reading" to many readers.
        if 0.0 < units && units < 65535.0 { units as u16 } else { 0 }
    };
    let bytes: Vec<u8> = image.values.iter().flat_map(|v| units(v).to_be_bytes()).collect();
    png(path, image, ColorType::Grayscale, BitDepth::Sixteen, &bytes)
}

/// An 8-bit RGB picture.
pub(super) fn color_png(path: &Path, image: &RangeImage) -> Result<()> {
    png(path, image, ColorType::Rgb, BitDepth::Eight, image.colors.as_flattened())
}

fn png(path: &Path, image: &RangeImage, color: ColorType, depth: BitDepth, bytes: &[u8]) -> Result<()> {
    write_atomic(path, |out| {
        let mut encoder = Encoder::new(out.by_ref(), image.columns as u32, image.rows as u32);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().map_err(std::io::Error::other)?;
        writer.write_image_data(bytes).map_err(std::io::Error::other)?;
        writer.finish().map_err(std::io::Error::other)
    })
}

/// The unit quaternion x, y, z, w of a rotation, w not negative, from its largest component (Shepperd 1978).
pub(super) fn quaternion(pose: &Pose<3>) -> [f64; 4] {
    let m = &pose.rotation;
    let trace = m[0][0] + m[1][1] + m[2][2];
    let k = (0..3).fold(0, |best, k| if m[k][k] > m[best][best] { k } else { best });
    let mut q = [0.0; 4];
    if trace >= m[k][k] {
        let s = 2.0 * (1.0 + trace).max(0.0).sqrt();
        q = [(m[2][1] - m[1][2]) / s, (m[0][2] - m[2][0]) / s, (m[1][0] - m[0][1]) / s, 0.25 * s];
    } else {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let s = 2.0 * (1.0 + 2.0 * m[k][k] - trace).max(0.0).sqrt();
        q[k] = 0.25 * s;
        q[i] = (m[i][k] + m[k][i]) / s;
        q[j] = (m[j][k] + m[k][j]) / s;
        q[3] = (m[j][i] - m[i][j]) / s;
    }
    if q[3] < 0.0 { q.map(|v| -v) } else { q }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_come_back() {
        let mut worst: f64 = 0.0;
        let halves = [-1.0, -0.5, -1e-9, 0.0, 0.3, 1.0];
        for (x, y, z, w) in halves.into_iter().flat_map(|x| {
            halves
                .into_iter()
                .flat_map(move |y| halves.into_iter().flat_map(move |z| halves.map(|w| (x, y, z, w))))
        }) {
            let Some(pose) = Pose::from_quaternion([0.0; 3], [x, y, z, w]) else { continue };
            let back = Pose::from_quaternion([0.0; 3], quaternion(&pose)).unwrap();
            for (a, b) in pose.rotation.iter().flatten().zip(back.rotation.iter().flatten()) {
                worst = worst.max((a - b).abs());
            }
        }
        assert!(worst < 1e-12, "{worst}");
    }
}
