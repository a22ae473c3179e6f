//! The distance field of anything that has one, as arrays.

use anyhow::bail;
use portolan::field::{EsdfGrid, UnknownSpace};
use portolan::geom::{Aabb, Grid};
use portolan_io::EsdfFile;
use serde_json::{Map, Value};

use super::{Args, Target};
use crate::esdf::{FieldHow, check_thin, esdf_2d, esdf_3d, esdf_of_cells, esdf_of_points, is_of_points};
use crate::mapping::{Settings, cells_for_map_server, dense_esdf};
use crate::source::Source;
use crate::unknown::UnknownCells;

/// A field of either dimension.
pub(super) enum Field {
    Two(EsdfGrid<2>),
    Three(EsdfGrid<3>),
}

impl Field {
    /// The field of a source, or the box of it that is wanted; `None`: the source has no distances.
    pub(super) fn of(source: &Source, target: Target, args: &Args) -> anyhow::Result<Option<Self>> {
        Ok(Some(match source {
            Source::Map2(file) => match &file.tsdf {
                Some(tsdf) => {
                    let field = esdf_2d(file, tsdf, &how(args, &file.header.settings)?)?.esdf;
                    Self::Two(in_2d(field.dense(tsdf.grid()), args)?)
                }
                None => {
                    let Some((grid, cells)) = cells_for_map_server(file) else { return Ok(None) };
                    Self::Two(in_2d(esdf_of_cells(grid, &cells), args)?)
                }
            },
            Source::Server(map) => {
                if map.yaw != 0.0 {
                    bail!(
                        "{}: the map is turned by yaw {} rad, which {} cannot hold; turn the image and set yaw to 0",
                        args.input.display(),
                        map.yaw,
                        args.out.display()
                    );
                }
                Self::Two(in_2d(esdf_of_cells(map.grid, &map.cells), args)?)
            }
            Source::Esdf(EsdfFile::Two(field)) => Self::Two(in_2d(field.clone(), args)?),
            Source::Esdf(EsdfFile::Three(field)) => {
                let dense = field.clone();
                Self::Three(match bounds_3d(args)? {
                    Some(bounds) => cropped(dense, &bounds, args)?,
                    None => dense,
                })
            }
            Source::Map3(file) => {
                let how = how(args, &file.header.settings)?;
                let field = match (&file.tsdf_bricks, &file.occupancy_bricks) {
                    (Some(map), _) => esdf_3d(file, map, &how)?.esdf,
                    (None, Some(map)) if is_of_points(&file.header.settings) => {
                        // Files that hold distances alone say nothing of free space.
                        let filled = UnknownCells::space(args.arrays.unknown);
                        if target != Target::Esdf && filled == Some(UnknownSpace::Pessimistic) {
                            bail!(
                                "{}: the map is of points without rays, and nothing is known to be free: with unknown \
                                 space as an obstacle (the default) all of it is one; give --unknown optimistic",
                                args.input.display()
                            );
                        }
                        esdf_of_points(map, &how, usize::MAX)?
                    }
                    _ => return Ok(None),
                };
                match dense_esdf(&field, bounds_3d(args)?.as_ref()) {
                    Ok(dense) => Self::Three(dense),
                    Err(why) => {
                        bail!("{}: {}", args.input.display(), why.replace("--dense", "--bounds"))
                    }
                }
            }
            _ => return Ok(None),
        }))
    }
}

/// As the map was made, but for what was asked for.
fn how(args: &Args, saved: &Map<String, Value>) -> anyhow::Result<FieldHow> {
    let saved = FieldHow::of(&Settings::of_saved(saved));
    let method = args.esdf.unwrap_or(saved.method);
    check_thin(args.thin.is_some(), method)?;
    let (thin, max_distance) =
        (args.thin.unwrap_or(saved.thin), args.max_distance.unwrap_or(saved.max_distance));
    Ok(FieldHow { method, thin, max_distance, ..saved })
}

fn in_2d(dense: EsdfGrid<2>, args: &Args) -> anyhow::Result<EsdfGrid<2>> {
    match args.bounds {
        None => Ok(dense),
        Some(bounds) => cropped(dense, &bounds.in_2d("the map")?, args),
    }
}

fn bounds_3d(args: &Args) -> anyhow::Result<Option<Aabb<3>>> {
    args.bounds.map(|bounds| bounds.in_3d("the map")).transpose()
}

/// The cells that a box touches, not those that only begin where it ends.
fn cropped<const D: usize>(dense: EsdfGrid<D>, bounds: &Aabb<D>, args: &Args) -> anyhow::Result<EsdfGrid<D>> {
    let Grid { lattice, shape } = *dense.grid();
    let cells = |v: f64, k: usize| (v - lattice.origin[k]) / lattice.resolution;
    // A millionth of a cell: a box of multiples of the resolution shall not gain a cell by rounding.
    let first: [usize; D] = std::array::from_fn(|k| {
        (cells(bounds.min[k], k) + 1e-6).floor().clamp(0.0, shape[k] as f64) as usize
    });
    let end: [usize; D] =
        std::array::from_fn(|k| (cells(bounds.max[k], k) - 1e-6).ceil().clamp(0.0, shape[k] as f64) as usize);
    if (0..D).any(|k| first[k] >= end[k]) {
        bail!("{}: no cell of the map lies in --bounds", args.input.display());
    }
    let grid = Grid::new(
        lattice.corner(first.map(|v| v as i32)),
        lattice.resolution,
        std::array::from_fn(|k| end[k] - first[k]),
    );
    let strides = dense.grid().strides();
    let from = |i: usize| {
        let cell = grid.cell(i);
        (0..D).map(|k| (first[k] + cell[k] as usize) * strides[k]).sum::<usize>()
    };
    let (distances, status) =
        (0..grid.len()).map(from).map(|i| (dense.samples()[i], dense.status(i))).unzip();
    Ok(EsdfGrid::with_status(grid, distances, status)?)
}
