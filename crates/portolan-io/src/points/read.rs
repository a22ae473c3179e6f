//! Any file of points; its first bytes and its name decide the format.

use std::io::BufRead;
use std::path::Path;

use super::PointCloudFile;
use crate::bytes::{Compression, Input, open};
use crate::{IoError, Result, kitti_bin, pcd, ply, xyz};

/// The most bytes of a file that is read as a whole: what few bytes unpack to is kept within the memory of a small machine.
pub(crate) fn most_bytes(input: &Input) -> u64 {
    match input.compression() {
        Compression::Plain => 1 << 34,
        _ => 1 << 30,
    }
}

/// The formats of single clouds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointFormat {
    /// [`crate::read_pcd`]
    Pcd,
    /// [`crate::read_ply_cloud`]
    Ply,
    /// [`crate::read_kitti_bin`]
    KittiBin,
    /// [`crate::read_xyz`]
    Xyz,
}

/// The format of a file of points: PCD and PLY by their first bytes, the others by the name (`.bin`;
/// `.xyz`, `.txt`, `.csv`, `.pts`, `.asc`, `.dat`, `.xyzn`, `.xyzrgb`; a further `.gz` or `.bz2` is passed over). `None`: any
/// other file.
pub fn point_format(path: impl AsRef<Path>, head: &[u8]) -> Option<PointFormat> {
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
        return Some(PointFormat::Ply);
    }
    let start = head.iter().take_while(|b| **b != b'\n').count();
    let first_line = String::from_utf8_lossy(&head[..start]);
    if first_line.starts_with("VERSION ") || (first_line.starts_with('#') && first_line.contains(".PCD")) {
        return Some(PointFormat::Pcd);
    }
    let name = path.as_ref().file_name()?.to_string_lossy().to_ascii_lowercase();
    let name = [".gz", ".bz2"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
    match name.rsplit_once('.')?.1 {
        "pcd" => Some(PointFormat::Pcd),
        "ply" => Some(PointFormat::Ply),
        "bin" => Some(PointFormat::KittiBin),
        "xyz" | "xyzi" | "xyzn" | "xyzrgb" | "txt" | "csv" | "pts" | "asc" | "dat" => Some(PointFormat::Xyz),
        _ => None,
    }
}

/// Reads a file of points in any of the formats of [`PointFormat`], plain or packed by gzip or bzip2.
///
/// # Errors
/// Those of the format's reader; [`IoError::Binary`] for any other file.
pub fn read_points(path: impl AsRef<Path>) -> Result<PointCloudFile> {
    parse_points(open(path)?)
}

/// [`read_points`] from any input.
///
/// # Errors
/// As [`read_points`].
pub fn parse_points(input: Input) -> Result<PointCloudFile> {
    parse_as(input, None)
}

/// [`read_points`] in a format that is known.
pub(crate) fn read_points_as(path: &Path, format: Option<PointFormat>) -> Result<PointCloudFile> {
    parse_as(open(path)?, format)
}

fn parse_as(mut input: Input, format: Option<PointFormat>) -> Result<PointCloudFile> {
    let path = input.path().to_owned();
    // A failure to read will come again, with its place.
    let head = input.fill_buf().map(<[u8]>::to_vec).unwrap_or_default();
    match format.or_else(|| point_format(&path, &head)) {
        Some(PointFormat::Pcd) => pcd::parse(input),
        Some(PointFormat::Ply) => ply::parse(input),
        Some(PointFormat::KittiBin) => kitti_bin::parse(input),
        Some(PointFormat::Xyz) => xyz::parse(input),
        None => {
            let value = crate::error::shown(&head[..head.len().min(16)]);
            let advice = "give a PCD, PLY, KITTI .bin or .xyz file";
            Err(IoError::binary(&path, 0, "the start of the file", value, advice))
        }
    }
}
