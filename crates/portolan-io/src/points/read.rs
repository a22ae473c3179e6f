//! Any file of points; its first bytes and its name decide the format.

use std::io::BufRead;
use std::path::Path;

use super::posed::joined;
use super::{PointCloudFile, PosedCloud};
use crate::bytes::{Compression, Input, open};
use crate::e57_file::{self, E57File};
use crate::ptx::{self, Wanted};
use crate::{IoError, Result, kitti_bin, las_file, pcd, ply, xyz};

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
    /// LAS, LAZ and COPC: surveys, which do not say where they were seen from.
    Las,
    /// E57: scans of a scanner with their poses; [`read_points`] joins them.
    E57,
    /// PTX: likewise.
    Ptx,
}

/// The format of a file of points: PCD, PLY, LAS and E57 by their first bytes, the others by the name (`.bin`, `.ptx`;
/// `.xyz`, `.txt`, `.csv`, `.pts`, `.asc`, `.dat`, `.xyzn`, `.xyzrgb`; a further `.gz` or `.bz2` is passed over). `None`: any
/// other file.
pub fn point_format(path: impl AsRef<Path>, head: &[u8]) -> Option<PointFormat> {
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
        return Some(PointFormat::Ply);
    }
    if head.starts_with(las_file::MAGIC) {
        return Some(PointFormat::Las);
    }
    if head.starts_with(e57_file::MAGIC) {
        return Some(PointFormat::E57);
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
        "las" | "laz" => Some(PointFormat::Las),
        "e57" => Some(PointFormat::E57),
        "ptx" => Some(PointFormat::Ptx),
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
        Some(PointFormat::Las) => las_file::parse(input),
        Some(PointFormat::E57) => {
            let mut file = E57File::parse(input)?;
            let scans: Vec<_> = (0..file.len()).map(|i| file.scan(i, usize::MAX)).collect::<Result<_>>()?;
            in_one(scans, &path)
        }
        Some(PointFormat::Ptx) => in_one(ptx::parse(input, Wanted::All)?, &path),
        None => {
            let value = crate::error::shown(&head[..head.len().min(16)]);
            let advice = "give a PCD, PLY, LAS, LAZ, E57, PTX, KITTI .bin or .xyz file";
            Err(IoError::binary(&path, 0, "the start of the file", value, advice))
        }
    }
}

/// Scans in the frame of their file, as one cloud.
fn in_one(scans: Vec<PosedCloud>, path: &Path) -> Result<PointCloudFile> {
    let mut clouds = Vec::new();
    for (i, scan) in scans.into_iter().enumerate() {
        clouds.push(scan.in_file().ok_or_else(|| {
            let advice = "its rotation is none, or a number is not finite: export the file again";
            IoError::layout(path, format!("the pose of scan {i}"), "no pose", advice)
        })?);
    }
    Ok(joined(clouds))
}

/// Whether a file of this format holds scans with poses.
pub(crate) fn has_poses(format: PointFormat) -> bool {
    matches!(format, PointFormat::E57 | PointFormat::Ptx)
}

/// The scans of a file with poses, each with its first `most` points; of other formats their one cloud.
pub(crate) fn posed_clouds(path: &Path, format: PointFormat, most: usize) -> Result<Vec<PosedCloud>> {
    match format {
        PointFormat::E57 => {
            let mut file = E57File::open(path)?;
            (0..file.len()).map(|i| file.scan(i, most)).collect()
        }
        PointFormat::Ptx => ptx::parse(open(path)?, Wanted::First(most)),
        _ => {
            let cloud = read_points_as(path, Some(format))?;
            let (file_from_scan, origin, name) = (None, None, None);
            Ok(vec![PosedCloud { cloud, file_from_scan, origin, name }])
        }
    }
}

/// Scan `i` of a file with poses.
pub(crate) fn scan_of(path: &Path, format: PointFormat, i: usize) -> Result<PosedCloud> {
    let found = match format {
        PointFormat::E57 => {
            let mut file = E57File::open(path)?;
            if i < file.len() { Some(file.scan(i, usize::MAX)?) } else { None }
        }
        _ => ptx::parse(open(path)?, Wanted::Scan(i))?.into_iter().nth(i),
    };
    found.ok_or_else(|| {
        let advice = "the file has changed while it was read; start again";
        IoError::layout(path, format!("scan {i}"), "missing", advice)
    })
}

/// The scans of any file of points: of E57 and PTX as many as it has, each with its pose; else one.
///
/// # Errors
/// As [`read_points`].
pub fn read_posed_clouds(path: impl AsRef<Path>) -> Result<Vec<PosedCloud>> {
    let path = path.as_ref();
    let mut input = open(path)?;
    let head = input.fill_buf().map(<[u8]>::to_vec).unwrap_or_default();
    match point_format(path, &head) {
        Some(format) if has_poses(format) => posed_clouds(path, format, usize::MAX),
        format => {
            let cloud = parse_as(input, format)?;
            Ok(vec![PosedCloud { cloud, file_from_scan: None, origin: None, name: None }])
        }
    }
}
