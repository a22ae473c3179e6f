//! Maps of space into other formats.

use anyhow::bail;
use portolan::cell::LogOddsRule;
use portolan::store::Tree;
use portolan::surface::marching_cubes;
use portolan_io::{MapFile, write_octomap_bt, write_octomap_ot};

use super::{Args, Target};
use crate::space::{mesh_settings, write_mesh};

/// `false`: the map does not hold what the format needs, or the format is one of the plane.
pub(super) fn convert(file: &MapFile<3>, target: Target, args: &Args) -> anyhow::Result<bool> {
    match (target, &file.occupancy_bricks, &file.tsdf_bricks) {
        (Target::Portolan, ..) => file.write(&args.out)?,
        (Target::OctomapBt | Target::OctomapOt, Some(map), _) => {
            let Some(tree) = Tree::from_bricks(&map.store) else {
                bail!("{}: the map is too large for one tree", args.input.display());
            };
            if target == Target::OctomapBt {
                write_octomap_bt(&args.out, &tree)?;
            } else {
                write_octomap_ot(&args.out, &tree, LogOddsRule::<i8>::new(&map.model)?.quantum)?;
            }
        }
        (Target::Mesh, _, Some(map)) => {
            let colors = file.color_bricks.as_ref().map(|c| &c.store);
            return write_mesh(&args.out, &marching_cubes(&map.store, colors, &mesh_settings(map.weights)));
        }
        _ => return Ok(false),
    }
    Ok(true)
}
