//! Binary PCD files.

use std::io::{self, Write};
use std::path::Path;

use crate::points::{PointCloudFile, Viewpoint};
use crate::{IoError, Result, write_atomic};

/// Writes a binary PCD file (version 0.7) with the fields that the cloud has; coordinates are doubles where it has an
/// offset, else floats. Times are written as `timestamp` (doubles, seconds). An organized cloud gets its pixels without a
/// reading back as NaN.
///
/// # Errors
/// [`IoError::Unwritable`] where a list is neither empty nor as long as the points, or where rows and columns do not hold
/// the points, else as [`write_atomic`].
pub fn write_pcd(path: impl AsRef<Path>, cloud: &PointCloudFile) -> Result<()> {
    let path = path.as_ref();
    let n = cloud.points.len();
    let lists = [("times", cloud.times.len()), ("rings", cloud.rings.len())];
    cloud.check_lists(path, &lists)?;
    if let Some(grid) = &cloud.grid {
        let size = grid.columns.saturating_mul(grid.rows);
        let ascending = grid.pixels.windows(2).all(|w| w[0] < w[1]);
        if grid.pixels.len() != n || !ascending || grid.pixels.last().is_some_and(|p| *p as usize >= size) {
            let value = format!("{} x {} for {n} points", grid.columns, grid.rows);
            return Err(IoError::unwritable(
                path,
                "the size of the cloud",
                value,
                "give one pixel per point, in ascending order, within columns x rows",
            ));
        }
    }
    write_atomic(path, |w| write_to(w, cloud))
}

fn write_to(w: &mut impl Write, cloud: &PointCloudFile) -> io::Result<()> {
    let fine = cloud.offset != [0.0; 3];
    let mut fields = Vec::new();
    for (names, field, has) in [
        (&["x", "y", "z"][..], (if fine { 8 } else { 4 }, 'F'), true),
        (&["intensity"], (4, 'F'), !cloud.intensity.is_empty()),
        (&["rgb"], (4, 'F'), !cloud.colors.is_empty()),
        (&["normal_x", "normal_y", "normal_z"], (4, 'F'), !cloud.normals.is_empty()),
        (&["ring"], (2, 'U'), !cloud.rings.is_empty()),
        (&["timestamp"], (8, 'F'), !cloud.times.is_empty()),
    ] {
        fields.extend(names.iter().filter(|_| has).map(|name| (*name, field)));
    }
    let names: Vec<_> = fields.iter().map(|f| f.0.to_owned()).collect();
    let sizes: Vec<_> = fields.iter().map(|f| f.1.0.to_string()).collect();
    let kinds: Vec<_> = fields.iter().map(|f| f.1.1.to_string()).collect();
    let (width, height) = match &cloud.grid {
        Some(grid) => (grid.columns, grid.rows),
        None => (cloud.points.len(), 1),
    };
    let Viewpoint { position: [x, y, z], quaternion: [qx, qy, qz, qw] } =
        cloud.viewpoint.unwrap_or(Viewpoint::NONE);
    writeln!(w, "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7")?;
    writeln!(w, "FIELDS {}", names.join(" "))?;
    writeln!(w, "SIZE {}", sizes.join(" "))?;
    writeln!(w, "TYPE {}", kinds.join(" "))?;
    writeln!(w, "COUNT {}", vec!["1"; fields.len()].join(" "))?;
    writeln!(w, "WIDTH {width}\nHEIGHT {height}")?;
    writeln!(w, "VIEWPOINT {x} {y} {z} {qw} {qx} {qy} {qz}")?;
    writeln!(w, "POINTS {}\nDATA binary", width * height)?;

    let stride: usize = fields.iter().map(|f| f.1.0).sum();
    let empty = empty_pixel(fine, stride);
    let mut next_pixel = 0;
    for i in 0..cloud.points.len() {
        if let Some(grid) = &cloud.grid {
            for _ in next_pixel..grid.pixels[i] {
                w.write_all(&empty)?;
            }
            next_pixel = grid.pixels[i] + 1;
        }
        write_point(w, cloud, i, fine)?;
    }
    if cloud.grid.is_some() {
        for _ in next_pixel as usize..width * height {
            w.write_all(&empty)?;
        }
    }
    Ok(())
}

/// A pixel without a reading: NaN coordinates, the rest zero.
fn empty_pixel(fine: bool, stride: usize) -> Vec<u8> {
    let mut bytes = if fine { f64::NAN.to_le_bytes().repeat(3) } else { f32::NAN.to_le_bytes().repeat(3) };
    bytes.resize(stride, 0);
    bytes
}

fn write_point(w: &mut impl Write, cloud: &PointCloudFile, i: usize, fine: bool) -> io::Result<()> {
    if fine {
        cloud.position(i).iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
    } else {
        cloud.points[i].iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
    }
    if let Some(v) = cloud.intensity.get(i) {
        w.write_all(&v.to_le_bytes())?;
    }
    if let Some([r, g, b]) = cloud.colors.get(i) {
        w.write_all(&[*b, *g, *r, 0])?;
    }
    if let Some(normal) = cloud.normals.get(i) {
        normal.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
    }
    if let Some(v) = cloud.rings.get(i) {
        w.write_all(&v.to_le_bytes())?;
    }
    if let Some(v) = cloud.times.get(i) {
        w.write_all(&(cloud.start_time + f64::from(*v)).to_le_bytes())?;
    }
    Ok(())
}
