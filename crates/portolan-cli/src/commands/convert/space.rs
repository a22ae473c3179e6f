//! Maps of space into other formats.

use anyhow::bail;
use portolan::cell::LogOddsRule;
use portolan::field::SparseEsdf;
use portolan::store::Tree;
use portolan::surface::marching_cubes;
use portolan_io::{SpaceMapFile, write_esdf, write_octomap_bt, write_octomap_ot};
use serde_json::Value;

use super::{Args, Target};
use crate::space::{dense_esdf, esdf_settings, mesh_settings, write_mesh};

/// `false`: the map does not hold what the format needs, or the format is one of the plane.
pub(super) fn convert(file: &SpaceMapFile, target: Target, args: &Args) -> anyhow::Result<bool> {
    match (target, &file.occupancy, &file.tsdf) {
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
            let colors = file.colors.as_ref().map(|c| &c.store);
            return write_mesh(&args.out, &marching_cubes(&map.store, colors, &mesh_settings(map.weights)));
        }
        (Target::Esdf, _, Some(map)) => {
            let max_distance = file.header.settings.get("max_distance").and_then(Value::as_f64);
            let max_distance = max_distance.filter(|d| *d > 0.0).unwrap_or(1.0);
            let how = esdf_settings(map.weights, map.carve_weight, max_distance);
            let dense = match dense_esdf(&SparseEsdf::of(&map.store, &how), None) {
                Ok(dense) => dense,
                Err(why) => bail!("{}: {why} (an option of `map`)", args.input.display()),
            };
            write_esdf(&args.out, &dense.grid, &dense.distances, Some(&dense.status))?;
        }
        _ => return Ok(false),
    }
    Ok(true)
}
