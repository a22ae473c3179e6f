//! Pictures for people, as `portolan map` leaves them in its folder.

use std::path::Path;

use portolan::Mapper;
use portolan::geom::Pose;
use portolan::surface::Mesh;
use portolan_io::MapFile;

use super::maps::in_file_2d;
use crate::mapping::{Derived, Settings, picture, preview, title};

/// The picture of a 2-D mapper as PNG bytes: cells, contour, obstacles and path; `None` where there is nothing to show.
///
/// # Errors
/// As [`save_2d`](super::save_2d).
pub fn picture_2d(mapper: Mapper<2>, rest: MapFile<2>) -> anyhow::Result<Option<Vec<u8>>> {
    let resolution = mapper.settings().resolution;
    let file = in_file_2d(mapper, rest, Path::new("picture"))?;
    let derived = Derived::of_2d(&file, &Settings::of_saved(&file.header.settings));
    Ok(picture::of_map(&file, &derived, &[], &title(&file.header.logs, resolution, file.header.scans)))
}

/// A mesh from sensible views as PNG bytes; `None`: it is empty. `poses` are those of sensors that look along z with y down
/// where `camera`, else along x with z up.
pub fn picture_of_mesh(mesh: &Mesh, poses: &[Pose<3>], camera: bool, title: &str) -> Option<Vec<u8>> {
    preview::of_mesh(mesh, poses, camera, None, None, title)
}
