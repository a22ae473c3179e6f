//! Velodyne scans of the KITTI data sets: four little-endian `f32` per point, `x y z reflectance`.

use std::io::{self, Write};
use std::path::Path;

use crate::bytes::{Compression, Endian, Input, Scalar, open};
use crate::points::{CloudBuilder, PointCloudFile, most_bytes};
use crate::{IoError, Result, write_atomic};

/// Bytes of a point.
const STRIDE: usize = 16;

/// Reads a scan (meters, the lidar's frame: x forward, y left, z up).
///
/// # Errors
/// [`IoError::Binary`] where the length is not a multiple of 16 bytes.
pub fn read_kitti_bin(path: impl AsRef<Path>) -> Result<PointCloudFile> {
    parse(open(path)?)
}

pub(crate) fn parse(mut input: Input) -> Result<PointCloudFile> {
    let bytes = input.read_all(most_bytes(&input))?;
    let points = bytes.chunks_exact(STRIDE);
    if !points.remainder().is_empty() {
        let at = (bytes.len() - points.remainder().len()) as u64;
        let value = format!("{} bytes", points.remainder().len());
        let advice =
            "a scan has 16 bytes per point (x y z reflectance as f32): the file is cut off, or not a scan";
        return Err(IoError::binary(input.path(), at, "the last point", value, advice));
    }
    let mut builder = CloudBuilder::new(false);
    for (i, point) in points.enumerate() {
        let value = |k: usize| Scalar::F32.read(&point[4 * k..], Endian::Little);
        if builder.push(i, [value(0), value(1), value(2)]) {
            builder.cloud.intensity.push(value(3) as f32);
        }
    }
    Ok(builder.finish())
}

/// Whether a file, which has no magic, may be a scan: by its length, and by its first numbers, which are meters.
pub(crate) fn may_be_scan(path: &Path) -> bool {
    let packed = open(path).is_ok_and(|input| input.compression() != Compression::Plain);
    // What is packed has another length: its reader finds out.
    let whole =
        std::fs::metadata(path).is_ok_and(|m| m.len() > 0 && (packed || m.len() % STRIDE as u64 == 0));
    let head = || open(path).and_then(|mut input| input.read_up_to(4096)).unwrap_or_default();
    whole && {
        let head = head();
        let mut values = head.chunks_exact(4).map(|b| Scalar::F32.read(b, Endian::Little).abs());
        values.clone().any(|v| v > 1e-3) && values.all(|v| v == 0.0 || (1e-12..1e4).contains(&v))
    }
}

/// Writes a scan; points without an intensity get 0. The offset is added, in `f32`.
///
/// # Errors
/// As [`write_atomic`].
pub fn write_kitti_bin(path: impl AsRef<Path>, cloud: &PointCloudFile) -> Result<()> {
    write_atomic(path, |w| write_to(w, cloud))
}

fn write_to(w: &mut impl Write, cloud: &PointCloudFile) -> io::Result<()> {
    for i in 0..cloud.points.len() {
        let [x, y, z] = cloud.position(i).map(|v| v as f32);
        for v in [x, y, z, cloud.intensity.get(i).copied().unwrap_or(0.0)] {
            w.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{no_panic, says};

    fn read(bytes: Vec<u8>) -> Result<PointCloudFile> {
        parse(Input::from_reader(io::Cursor::new(bytes), "0.bin".as_ref())?)
    }

    #[test]
    fn the_layout_is_four_floats_and_no_bytes_make_it_panic() {
        let mut bytes = Vec::new();
        for v in [1.0f32, -2.0, 0.5, 0.25, f32::NAN, 0.0, 0.0, 0.0] {
            bytes.extend(v.to_le_bytes());
        }
        let cloud = read(bytes.clone()).unwrap();
        assert_eq!((cloud.points.clone(), cloud.intensity.clone()), (vec![[1.0, -2.0, 0.5]], vec![0.25]));
        assert_eq!(cloud.refused.not_finite, 1);
        let mut written = Vec::new();
        write_to(&mut written, &cloud).unwrap();
        assert_eq!(written, bytes[..16]);
        says(read(bytes[..20].to_vec()), "0.bin: byte 16: the last point is 4 bytes; a scan has 16");
        no_panic([7; 64], 3, 500, read);
    }
}
