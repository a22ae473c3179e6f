//! Small logs for tests: a camera that turns about its axis and moves towards a wall.

use std::fs;
use std::path::Path;

use portolan::geom::Pose;
use portolan::geom::vector::distance;
use portolan::scan::{Frame, RangeImage};

use super::{ScanLog, ScanLogOptions};
use crate::poses3::PoseConvention;

/// z of the wall (meters).
pub(super) const WALL: f64 = 3.0;

/// Columns and rows of the pictures.
pub(super) const SIZE: [usize; 2] = [8, 6];

/// The camera of the pictures, as `fx fy cx cy`.
pub(super) const SMALL_CAMERA: [f64; 4] = [10.0, 12.0, 3.5, 2.5];

/// A picture of one color, `[201, 40, 90]`, 8 x 8 pixels, as JPEG.
pub(super) const RED_JPEG: &str = "ffd8ffe000104a46494600010100000100010000ffdb0043000201010101010201010102020202020403020202020504 \
    040304060506060605060606070908060709070606080b08090a0a0a0a0a06080b0c0b0a0c090a0a0affdb0043010202 \
    02020202050303050a0706070a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a \
    0a0a0a0a0a0a0a0a0a0a0a0a0a0affc00011080008000803011100021101031101ffc400140001000000000000000000 \
    00000000000008ffc40014100100000000000000000000000000000000ffc40015010101000000000000000000000000 \
    00000409ffc40014110100000000000000000000000000000000ffda000c03010002110311003f003b8ea60fffd9";

/// The same in gray 94.
pub(super) const GREY_JPEG: &str = "ffd8ffe000104a46494600010100000100010000ffdb0043000201010101010201010102020202020403020202020504 \
    040304060506060605060606070908060709070606080b08090a0a0a0a0a06080b0c0b0a0c090a0a0affc0000b080008 \
    000801011100ffc40014000100000000000000000000000000000008ffc4001410010000000000000000000000000000 \
    0000ffda0008010100003f003bbfffd9";

/// The bytes of hexadecimal digits.
pub(super) fn bytes_of(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.chars().filter_map(|c| c.to_digit(16).map(|d| d as u8)).collect();
    digits.chunks_exact(2).map(|pair| 16 * pair[0] + pair[1]).collect()
}

fn half_turn(i: usize) -> (f64, f64) {
    (0.05 * i as f64 + 0.2).sin_cos()
}

/// The pose of the camera at picture `i`.
pub(super) fn camera_pose(i: usize) -> Pose<3> {
    let (sin, cos) = half_turn(i);
    Pose::<3>::from_quaternion([0.1 * i as f64, -0.2, 0.25 * i as f64], [0.0, 0.0, sin, cos]).unwrap()
}

/// The pose as `tx ty tz qx qy qz qw`.
pub(super) fn quaternion_text(i: usize) -> String {
    let ([x, y, z], (sin, cos)) = (camera_pose(i).translation, half_turn(i));
    format!("{x} {y} {z} 0 0 {sin:.9} {cos:.9}")
}

/// The pose as four lines of four numbers.
pub(super) fn matrix_text(pose: &Pose<3>) -> String {
    let row = |k: usize| {
        let [a, b, c] = pose.rotation[k];
        format!("{a:.9} {b:.9} {c:.9} {}\n", pose.translation[k])
    };
    format!("{}{}{}0 0 0 1\n", row(0), row(1), row(2))
}

/// A 16-bit gray PNG.
pub(super) fn gray_png([w, h]: [usize; 2], values: &[u16]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    png_of([w, h], png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes)
}

/// Any PNG.
pub(crate) fn png_of(size: [usize; 2], color: png::ColorType, depth: png::BitDepth, bytes: &[u8]) -> Vec<u8> {
    let mut all = Vec::new();
    let mut encoder = png::Encoder::new(&mut all, size[0] as u32, size[1] as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
    all
}

/// Writes picture `i` of the wall. The first two pixels are no readings.
pub(super) fn write_depth(path: &Path, i: usize, units_per_metre: f64) {
    let depth = ((WALL - 0.25 * i as f64) * units_per_metre).round() as u16;
    let mut values = vec![depth; SIZE[0] * SIZE[1]];
    (values[0], values[1]) = (0, u16::MAX);
    write(path, gray_png(SIZE, &values));
}

/// Writes a color picture of the size of the depth images.
pub(super) fn write_color(path: &Path, rgb: [u8; 3]) {
    let bytes = rgb.repeat(SIZE[0] * SIZE[1]);
    write(path, png_of(SIZE, png::ColorType::Rgb, png::BitDepth::Eight, &bytes));
}

/// Writes a file and the folders above it.
pub(super) fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

/// Median distance from every `step`-th point to the nearest of the others, by looking at all of them.
pub(super) fn median_distance(from: &[[f64; 3]], to: &[[f64; 3]], step: usize) -> f64 {
    let square = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>();
    let nearest = |p: &[f64; 3]| to.iter().map(|q| square(*p, *q)).fold(f64::INFINITY, f64::min);
    let mut all: Vec<f64> = from.iter().step_by(step).map(|p| nearest(p).sqrt()).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Options with a convention of poses.
pub(super) fn with_convention(convention: PoseConvention) -> ScanLogOptions {
    ScanLogOptions { pose_convention: Some(convention), ..ScanLogOptions::default() }
}

/// The depth image of scan `i`.
pub(super) fn image(log: &ScanLog, i: usize) -> RangeImage {
    match log.frame(i).unwrap() {
        Frame::Image(image) => image,
        Frame::Points(_) => panic!("a depth camera gives images"),
    }
}

/// Scan `k` of the log is picture `i`: its pose is, and its points lie in the wall (to half a unit and a f32's rounding).
pub(super) fn assert_is_picture(log: &ScanLog, k: usize, i: usize) {
    let (pose, expected) = (log.pose(k), camera_pose(i));
    for p in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]] {
        assert!(distance(pose.transform_point(p), expected.transform_point(p)) < 1e-6, "scan {k}: {pose:?}");
    }
    let image = image(log, k);
    assert_eq!([image.columns, image.rows], SIZE);
    assert_eq!(&image.values[..2], [0.0; 2], "0 and 65535 are no readings");
    assert_eq!(image.hits(), SIZE[0] * SIZE[1] - 2);
    for (_, p) in image.points() {
        assert!((pose.transform_point(p)[2] - WALL).abs() < 1e-3, "scan {k}");
    }
}
