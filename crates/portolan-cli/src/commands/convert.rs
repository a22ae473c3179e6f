//! `convert`: one format into another.

use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan::cell::{DistancePlanes, LogOdds8, LogOddsValue, OccupancyModel};
use portolan::field::{Esdf, EsdfSettings, esdf_from_tsdf};
use portolan::geom::{Grid, Pose};
use portolan::map::{OccupancyGrid, Tsdf, TsdfConfig};
use portolan::store::Dense;
use portolan::surface::{Contour, ContourSettings, marching_squares};
use portolan_io::{
    EsdfFile, MapCell, MapFile, MapHeader, MapServerMap, OctomapTree, Polyline, write_esdf, write_map_server,
};
use serde_json::json;

use super::query::esdf_of_server;
use crate::mapping::{cells_for_map_server, polylines, write_contour};
use crate::output::Output;
use crate::source::{Source, open};

mod space;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  portolan convert depot.yaml depot.esdf.bin\n  portolan convert intel intel.yaml"
)]
pub(crate) struct Args {
    /// map.portolan or its folder, map_server yaml, esdf.bin, GeoJSON contour, or OctoMap .bt or .ot
    input: PathBuf,
    /// File to write: .portolan, .yaml (with its .pgm), .bin, .geojson, .svg, .bt, .ot, .ply, .glb or .obj
    out: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// What can be written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Target {
    Portolan,
    MapServer,
    Esdf,
    Contour,
    OctomapBt,
    OctomapOt,
    Mesh,
}

/// Converts the file.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let target = target(&args.out);
    let source = open(&args.input)?;
    let Some(target) = target else { return Err(not_possible(args, &source)) };
    let done = match &source {
        Source::Map(file) => convert_map(file, target, args)?,
        Source::Server(map) => convert_server(map, target, args)?,
        Source::Esdf(EsdfFile::Two(field)) => {
            if target == Target::Esdf {
                field.write(&args.out)?; // the same file, its status plane included
                true
            } else {
                let mut samples = field.distances.clone();
                let status = field.status.iter().flatten();
                samples
                    .iter_mut()
                    .zip(status)
                    .filter(|(_, s)| **s == portolan_io::EsdfBin::<2>::UNKNOWN)
                    .for_each(|(d, _)| *d = f32::NAN);
                convert_esdf(&Esdf::from_samples(field.grid, samples)?, target, args)?
            }
        }
        Source::Esdf(EsdfFile::Three(field)) if target == Target::Esdf => {
            field.write(&args.out)?;
            true
        }
        Source::Contour(lines) => target == Target::Contour && write_contour(&args.out, lines)?,
        Source::Octomap(file) => convert_octomap(file, target, args)?,
        Source::SpaceMap(file) => space::convert(file, target, args)?,
        _ => false,
    };
    if !done {
        return Err(not_possible(args, &source));
    }
    let document = json!({
        "input": args.input.display().to_string(),
        "kind": source.describe(),
        "out": args.out.display().to_string(),
        "warning": source.warning(),
    });
    let mut text = format!("{} -> {}\n", args.input.display(), args.out.display());
    if let Some(warning) = source.warning() {
        text += &format!("warning: {warning}\n");
    }
    args.output.print(&document, text)
}

fn target(out: &Path) -> Option<Target> {
    match out.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "portolan" => Some(Target::Portolan),
        "yaml" | "yml" | "pgm" => Some(Target::MapServer),
        "bin" => Some(Target::Esdf),
        "geojson" | "json" | "svg" => Some(Target::Contour),
        "bt" => Some(Target::OctomapBt),
        "ot" => Some(Target::OctomapOt),
        "ply" | "glb" | "obj" => Some(Target::Mesh),
        _ => None,
    }
}

/// Says what the input could be turned into.
fn not_possible(args: &Args, source: &Source) -> anyhow::Error {
    let possible = match source {
        Source::Map(_) => ".yaml, .bin (esdf), .geojson, .svg or .portolan, as far as its maps go",
        Source::Server(_) => ".bin (esdf), .geojson, .svg, .portolan or .yaml",
        Source::Esdf(EsdfFile::Two(_)) => ".yaml, .geojson, .svg or .bin",
        Source::Esdf(EsdfFile::Three(_)) => ".bin: it is in space",
        Source::Contour(_) => ".geojson or .svg",
        Source::Image(_) => "nothing without its yaml file",
        Source::Octomap(_) => ".bt or .ot",
        Source::SpaceMap(_) => ".ply, .glb, .obj, .bt, .ot, .bin (esdf) or .portolan, as far as its maps go",
        Source::Log(_) | Source::SpaceLog(_) => "nothing here: `portolan map` makes maps of logs",
    };
    let (input, out) = (args.input.display(), args.out.display());
    anyhow::anyhow!("{input}: {} cannot become {out}; it can become {possible}", source.describe())
}

/// The yaml file of a pair whose either name may be given.
fn yaml(out: &Path) -> PathBuf {
    if out.extension().is_some_and(|e| e.eq_ignore_ascii_case("pgm")) {
        out.with_extension("yaml")
    } else {
        out.to_owned()
    }
}

fn convert_map(file: &MapFile, target: Target, args: &Args) -> anyhow::Result<bool> {
    match (target, &file.tsdf) {
        (Target::Portolan, _) => file.write(&args.out)?,
        (Target::MapServer, _) => {
            let Some((grid, cells)) = cells_for_map_server(file) else { return Ok(false) };
            write_map_server(yaml(&args.out), &grid, &cells)?;
        }
        (Target::Esdf, Some(tsdf)) => {
            let EsdfSettings { min_weight, band_cells } = EsdfSettings::of(tsdf);
            write_field(&esdf_from_tsdf(tsdf, min_weight, band_cells), args)?;
        }
        (Target::Contour, Some(tsdf)) => {
            return write_lines(&marching_squares(tsdf, &ContourSettings::of(tsdf)), args);
        }
        (Target::OctomapBt | Target::OctomapOt | Target::Mesh, _) => return Ok(false),
        (Target::Esdf | Target::Contour, None) => {
            let Some((grid, cells)) = cells_for_map_server(file) else { return Ok(false) };
            return convert_esdf(&esdf_of_cells(grid, &cells), target, args);
        }
    }
    Ok(true)
}

fn convert_server(map: &MapServerMap, target: Target, args: &Args) -> anyhow::Result<bool> {
    let turned = map.yaw != 0.0;
    if turned && target != Target::Contour {
        bail!(
            "{}: the map is turned by yaw {} rad, which {} cannot hold; turn the image and set yaw to 0, or \
             convert it to .geojson",
            args.input.display(),
            map.yaw,
            args.out.display()
        );
    }
    match target {
        Target::Portolan => as_map_file(map, args)?.write(&args.out)?,
        Target::MapServer => write_map_server(yaml(&args.out), &map.grid, &map.cells)?,
        Target::Esdf => write_field(&esdf_of_server(map), args)?,
        Target::Contour => {
            let mut contour = contour_of(&esdf_of_server(map))?;
            let world_from_grid: Pose<2> = map.world_from_grid();
            if turned {
                contour.vertices.iter_mut().for_each(|v| *v = world_from_grid.transform_point(*v));
            }
            return write_lines(&contour, args);
        }
        Target::OctomapBt | Target::OctomapOt | Target::Mesh => return Ok(false),
    }
    Ok(true)
}

/// Back to its own format: the same bytes.
fn convert_octomap(file: &OctomapTree, target: Target, args: &Args) -> anyhow::Result<bool> {
    match target {
        Target::OctomapBt => file.write_bt(&args.out)?,
        Target::OctomapOt => file.write_ot(&args.out)?,
        _ => return Ok(false),
    }
    Ok(true)
}

fn convert_esdf(esdf: &Esdf<2>, target: Target, args: &Args) -> anyhow::Result<bool> {
    match target {
        Target::Portolan | Target::OctomapBt | Target::OctomapOt | Target::Mesh => return Ok(false),
        Target::Esdf => write_field(esdf, args)?,
        Target::MapServer => {
            let cell = |d: &f32| match d {
                d if d.is_nan() => MapCell::Unknown,
                d if *d < 0.0 => MapCell::Occupied,
                _ => MapCell::Free,
            };
            let cells: Vec<_> = esdf.samples().iter().map(cell).collect();
            write_map_server(yaml(&args.out), esdf.grid(), &cells)?;
        }
        Target::Contour => return write_lines(&contour_of(esdf)?, args),
    }
    Ok(true)
}

fn esdf_of_cells(grid: Grid<2>, cells: &[MapCell]) -> Esdf<2> {
    Esdf::from_mask(grid, |i| match cells[i] {
        MapCell::Occupied => Some(true),
        MapCell::Free => Some(false),
        MapCell::Unknown => None,
    })
}

fn write_field(esdf: &Esdf<2>, args: &Args) -> anyhow::Result<()> {
    Ok(write_esdf(&args.out, esdf.grid(), esdf.samples(), None)?)
}

fn write_lines(contour: &Contour, args: &Args) -> anyhow::Result<bool> {
    let lines: Vec<Polyline> = polylines(contour);
    write_contour(&args.out, &lines)
}

/// The zero level set of a distance field.
fn contour_of(esdf: &Esdf<2>) -> anyhow::Result<Contour> {
    let known = |d: &f32| if d.is_nan() { (0.0, 0.0) } else { (*d, 1.0) };
    let (distances, weights) = esdf.samples().iter().map(known).unzip();
    let planes = DistancePlanes::from_parts(distances, weights);
    let store = planes.and_then(|p| Dense::from_planes(*esdf.grid(), p));
    let Some(store) = store else { bail!("the distance field has values that are not finite") };
    let tsdf = Tsdf::from_store(store, TsdfConfig::default())?;
    Ok(marching_squares(&tsdf, &ContourSettings::of(&tsdf)))
}

/// The cells as an occupancy grid whose cells are as sure as they can be.
fn as_map_file(map: &MapServerMap, args: &Args) -> anyhow::Result<MapFile> {
    let model = OccupancyModel::default();
    let mut grid = OccupancyGrid::new(map.grid, model)?;
    let (free, occupied) = (grid.rule().min, grid.rule().max);
    let cells = map.cells.iter().map(|c| match c {
        MapCell::Free => LogOdds8(free),
        MapCell::Occupied => LogOdds8(occupied),
        MapCell::Unknown => LogOdds8::UNOBSERVED,
    });
    if let Some(store) = Dense::from_planes(map.grid, cells.collect()) {
        grid = OccupancyGrid::from_store(store, model)?;
    }
    let name = args.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut file = MapFile::default();
    file.header = MapHeader { logs: vec![name], ..MapHeader::default() };
    file.grid = Some(grid);
    Ok(file)
}
