//! Binary PLY files of clouds.

use std::io::{self, Write};
use std::path::Path;

use crate::points::PointCloudFile;
use crate::{Result, write_atomic};

/// Writes a cloud as binary little-endian PLY: `x y z` (doubles where the cloud has an offset, else floats), and
/// `intensity`, `nx ny nz`, `red green blue` where it has them. Rows and columns are not written.
///
/// # Errors
/// [`crate::IoError::Unwritable`] where a list is neither empty nor as long as the points, else as [`write_atomic`].
pub fn write_ply_cloud(path: impl AsRef<Path>, cloud: &PointCloudFile) -> Result<()> {
    let path = path.as_ref();
    cloud.check_lists(path, &[])?;
    write_atomic(path, |w| write_to(w, cloud))
}

pub(super) fn write_to(w: &mut impl Write, cloud: &PointCloudFile) -> io::Result<()> {
    let fine = cloud.offset != [0.0; 3];
    let coordinate = if fine { "double" } else { "float" };
    writeln!(w, "ply\nformat binary_little_endian 1.0\nelement vertex {}", cloud.points.len())?;
    for axis in ["x", "y", "z"] {
        writeln!(w, "property {coordinate} {axis}")?;
    }
    for (lines, has) in [
        ("property float intensity\n", !cloud.intensity.is_empty()),
        ("property float nx\nproperty float ny\nproperty float nz\n", !cloud.normals.is_empty()),
        ("property uchar red\nproperty uchar green\nproperty uchar blue\n", !cloud.colors.is_empty()),
    ] {
        if has {
            w.write_all(lines.as_bytes())?;
        }
    }
    writeln!(w, "end_header")?;
    for i in 0..cloud.points.len() {
        if fine {
            cloud.position(i).iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
        } else {
            cloud.points[i].iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
        }
        if let Some(v) = cloud.intensity.get(i) {
            w.write_all(&v.to_le_bytes())?;
        }
        if let Some(normal) = cloud.normals.get(i) {
            normal.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
        }
        if let Some(color) = cloud.colors.get(i) {
            w.write_all(color)?;
        }
    }
    Ok(())
}
