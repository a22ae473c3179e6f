//! `convert`: one format into another.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan::cell::{LogOdds8, LogOddsRule, LogOddsValue, OccupancyModel};
use portolan::field::{EsdfGrid, UnknownSpace};
use portolan::geom::Pose;
use portolan::map::OccupancyGrid;
use portolan::store::Dense;
use portolan::surface::{Contour, ContourSettings, MeshSettings, marching_cubes, marching_squares};
use portolan_io::{
    EsdfFile, MapCell, MapFile, MapHeader, MapServerMap, OctomapTree, Polyline, write_esdf, write_map_server,
    write_octomap_bt, write_octomap_ot,
};
use serde_json::json;

use self::arrays::ArrayArgs;
use self::costs::CostArgs;
use self::field::Field;
use crate::arguments::{Bounds, bounds, length, thin};
use crate::dimension::{Given, ONLY_3D};
use crate::error::bad_call;
use crate::esdf::{EsdfArg, esdf_of_cells, status_plane, tsdf_of_samples};
use crate::folder;
use crate::mapping::{Octree, cells_for_map_server, polylines, write_contour, write_mesh};
use crate::output::Output;
use crate::source::{Source, open};
use crate::unknown::{STAYS, UnknownCells};
use crate::up::{Up, up};

mod arrays;
mod costs;
mod field;
mod messages;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  portolan convert depot.yaml depot.esdf.bin\n  \
                  portolan convert intel intel.npz --layout casadi\n  \
                  portolan convert intel costs.yaml --inflate 0.55 --inscribed 0.22\n  \
                  portolan convert kitchen floor.yaml --z 0.1:1.2 --unknown optimistic\n  \
                  portolan convert intel intel.mcap")]
pub(crate) struct Args {
    #[command(flatten)]
    given: Given<()>,
    /// map.portolan or its folder, map_server yaml, esdf.bin, GeoJSON contour, or OctoMap .bt or .ot
    input: PathBuf,
    /// File to write: .portolan, .yaml (with its .pgm), .bin, .npz, .npy, .geojson, .svg, .bt, .ot, .ply, .glb, .obj, or
    /// .mcap (messages of ROS 2)
    out: PathBuf,
    /// Method of the distance field [default: as the map was made, else accurate]
    #[arg(long, value_enum)]
    esdf: Option<EsdfArg>,
    /// Largest distance of the distance field (meters) [default: as the map was made]
    #[arg(long, value_name = "M", value_parser = length, help_heading = ONLY_3D)]
    max_distance: Option<f64>,
    /// Share of the beams through a cell of a map.portolan that must end there to make it an obstacle where no surface is
    /// found; 0: only surfaces are [default: as the map was made]
    #[arg(long, value_name = "SHARE", value_parser = thin, allow_negative_numbers = true)]
    thin: Option<f64>,
    /// Write only this box of the distance field: x0,y0,x1,y1 in 2-D, x0,y0,z0,x1,y1,z1 in 3-D (meters)
    #[arg(long, value_name = "BOX", value_parser = bounds, allow_hyphen_values = true)]
    bounds: Option<Bounds>,
    /// Which way is up, where the map says it wrongly: an axis like +z or -y, or a direction x,y,z. --z is refused where it is
    /// not z
    #[arg(long, value_name = "AXIS|X,Y,Z", value_parser = up, allow_hyphen_values = true, requires = "z", help_heading = ONLY_3D)]
    up: Option<Up>,
    #[command(flatten)]
    arrays: ArrayArgs,
    #[command(flatten)]
    costs: CostArgs,
    #[command(flatten)]
    output: Output,
}

/// What can be written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Target {
    Portolan,
    MapServer,
    Esdf,
    Arrays,
    Contour,
    OctomapBt,
    OctomapOt,
    Mesh,
    Messages,
}

/// Converts the file.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let target = target(&args.out);
    let source = open(&args.input)?;
    folder::warn(&args.input, args.output)?;
    let Some(target) = target else { return Err(not_possible(args, &source)) };
    source.check::<Args>(&args.given)?;
    args.check(target, &source)?;
    let done = match &source {
        _ if args.takes_field(target, &source) => match Field::of(&source, target, args)? {
            Some(field) => write_field_as(&field, target, args)?,
            None => false,
        },
        Source::Map2(file) => convert_map2(file, target, args)?,
        Source::Map3(file) => convert_map3(file, target, args)?,
        Source::Server(map) => convert_server(map, target, args)?,
        Source::Esdf(EsdfFile::Two(field)) => {
            if target == Target::Esdf {
                write_whole(field, args)?
            } else {
                convert_esdf(field, target, args)?
            }
        }
        Source::Esdf(EsdfFile::Three(field)) if target == Target::Esdf => write_whole(field, args)?,
        Source::Contour(lines) => target == Target::Contour && write_contour(&args.out, lines)?,
        Source::Octomap(file) => convert_octomap(file, target, args)?,
        _ => false,
    };
    if !done {
        return Err(not_possible(args, &source));
    }
    folder::forget(&args.out)?;
    let document = json!({
        "input": args.input.display().to_string(),
        "kind": source.describe(),
        "out": args.out.display().to_string(),
        "unknown_as": args.unknown_as(target).map(|(word, _)| word),
        "warning": source.warning(),
    });
    let mut text = format!("{} -> {}\n", args.input.display(), args.out.display());
    if let Some((_, said)) = args.unknown_as(target) {
        text += &format!("{said}\n");
    }
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
        "npz" | "npy" => Some(Target::Arrays),
        "geojson" | "json" | "svg" => Some(Target::Contour),
        "bt" => Some(Target::OctomapBt),
        "ot" => Some(Target::OctomapOt),
        "ply" | "glb" | "obj" => Some(Target::Mesh),
        "mcap" => Some(Target::Messages),
        _ => None,
    }
}

/// The refusal, with what the input could become.
fn not_possible(args: &Args, source: &Source) -> anyhow::Error {
    let possible = match source {
        Source::Map2(_) => {
            ".yaml, .bin (esdf), .npz, .npy, .geojson, .svg, .mcap or .portolan, as far as its maps go"
        }
        Source::Server(_) => ".bin (esdf), .npz, .npy, .geojson, .svg, .mcap, .portolan or .yaml",
        Source::Esdf(EsdfFile::Two(_)) => ".yaml, .npz, .npy, .geojson, .svg or .bin",
        Source::Esdf(EsdfFile::Three(_)) => ".bin, .npz, .npy, or .yaml with --z",
        Source::Contour(_) => ".geojson or .svg",
        Source::Image(_) => "a map only together with its yaml file",
        Source::Octomap(_) => ".bt or .ot",
        Source::Map3(_) => {
            ".ply, .glb, .obj, .bt, .ot, .bin (esdf), .npz, .npy, .mcap, .yaml with --z, or .portolan, as far as its maps go"
        }
        Source::Log2(_) | Source::Log3(_) => "a map, by `portolan map`",
        Source::Mesh(_) => "nothing: a mesh is no map",
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

fn convert_map2(file: &MapFile<2>, target: Target, args: &Args) -> anyhow::Result<bool> {
    match target {
        Target::Portolan => file.write(&args.out)?,
        Target::MapServer => {
            let Some((grid, cells)) = cells_for_map_server(file) else { return Ok(false) };
            write_map_server(yaml(&args.out), &grid, &cells)?;
        }
        Target::Contour => {
            let Some(contour) = contour_of_map(file)? else { return Ok(false) };
            return write_lines(&contour, args);
        }
        Target::Messages => return messages::of_map2(file, args),
        _ => return Ok(false),
    }
    Ok(true)
}

/// The contour of a map: of its signed distances, else around its occupied cells. `None`: it has no cells that an array
/// can hold.
fn contour_of_map(file: &MapFile<2>) -> anyhow::Result<Option<Contour>> {
    if let Some(tsdf) = &file.tsdf {
        return Ok(Some(marching_squares(tsdf, &ContourSettings::of(tsdf))));
    }
    let Some((grid, cells)) = cells_for_map_server(file) else { return Ok(None) };
    Ok(Some(contour_of(&esdf_of_cells(grid, &cells))?))
}

/// `false`: the map lacks what the format needs, or the format is for 2-D.
fn convert_map3(file: &MapFile<3>, target: Target, args: &Args) -> anyhow::Result<bool> {
    match (target, &file.occupancy_bricks, &file.tsdf_bricks) {
        (Target::Portolan, ..) => file.write(&args.out)?,
        (Target::OctomapBt | Target::OctomapOt, Some(map), _) => {
            let Some(octree) = Octree::of(&map.store) else {
                bail!("{}: the map is too large for one tree", args.input.display());
            };
            if let Some(note) = octree.note().filter(|_| !args.output.quiet) {
                writeln!(io::stderr(), "portolan: warning: {}: {note}", args.out.display())?;
            }
            if target == Target::OctomapBt {
                write_octomap_bt(&args.out, &octree.tree)?;
            } else {
                write_octomap_ot(&args.out, &octree.tree, LogOddsRule::<i8>::new(&map.model)?.quantum)?;
            }
        }
        (Target::Mesh, _, Some(map)) => {
            let colors = file.color_bricks.as_ref().map(|c| &c.store);
            return write_mesh(&args.out, &marching_cubes(map, colors, &MeshSettings::default()));
        }
        (Target::Messages, ..) => return messages::of_map3(file, args),
        _ => return Ok(false),
    }
    Ok(true)
}

fn convert_server(map: &MapServerMap, target: Target, args: &Args) -> anyhow::Result<bool> {
    let turned = map.yaw != 0.0;
    if turned && !matches!(target, Target::Contour | Target::Messages) {
        bail!(
            "{}: the map is turned by yaw {} rad, which {} cannot hold; turn the image and set yaw to 0, or \
             convert it to .geojson or .mcap",
            args.input.display(),
            map.yaw,
            args.out.display()
        );
    }
    match target {
        Target::Portolan => as_map_file(map, args)?.write(&args.out)?,
        Target::MapServer => write_map_server(yaml(&args.out), &map.grid, &map.cells)?,
        Target::Contour => {
            let mut contour = contour_of(&esdf_of_cells(map.grid, &map.cells))?;
            let world_from_grid: Pose<2> = map.world_from_grid();
            if turned {
                contour.vertices.iter_mut().for_each(|v| *v = world_from_grid.transform_point(*v));
            }
            return write_lines(&contour, args);
        }
        Target::Messages => return messages::of_server(map, args),
        _ => return Ok(false),
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

fn convert_esdf(esdf: &EsdfGrid<2>, target: Target, args: &Args) -> anyhow::Result<bool> {
    match target {
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
        _ => return Ok(false),
    }
    Ok(true)
}

/// Writes a distance field as `esdf.bin`, arrays or a costmap.
fn write_field_as(field: &Field, target: Target, args: &Args) -> anyhow::Result<bool> {
    match (target, field) {
        (Target::Arrays, _) => args.arrays.write(field, &args.out)?,
        (Target::MapServer, _) => {
            let note = args.unknown_as(target).map_or("", |(_, said)| said);
            args.costs.write(field, args.arrays.unknown, note, &yaml(&args.out))?;
        }
        (_, Field::Two(field)) => write_dense(field, args)?,
        (_, Field::Three(field)) => write_dense(field, args)?,
    }
    Ok(true)
}

/// The same file: statuses only where it has them.
fn write_whole<const D: usize>(field: &EsdfGrid<D>, args: &Args) -> anyhow::Result<bool> {
    let status = field.has_status().then(|| field.status_bytes());
    write_esdf(&args.out, field.grid(), field.samples(), status.as_deref())?;
    Ok(true)
}

fn write_dense<const D: usize>(field: &EsdfGrid<D>, args: &Args) -> anyhow::Result<()> {
    // In 3-D the status has always been written.
    let status = if D == 3 { Some(field.status_bytes()) } else { status_plane(field) };
    Ok(write_esdf(&args.out, field.grid(), field.samples(), status.as_deref())?)
}

impl Args {
    /// Whether the target is made from a distance field, whatever the source.
    fn takes_field(&self, target: Target, source: &Source) -> bool {
        match target {
            Target::Arrays => true,
            Target::MapServer => self.costs.asked(),
            // A whole file stays as it is.
            Target::Esdf => self.bounds.is_some() || !matches!(source, Source::Esdf(_)),
            _ => false,
        }
    }

    /// What unknown space counts as in the file, in one word and in words for people; `None`: it says nothing of unknown
    /// space.
    fn unknown_as(&self, target: Target) -> Option<(&'static str, &'static str)> {
        let given = self.arrays.unknown;
        let layer = target == Target::MapServer && self.costs.is_layer();
        let (word, space) = (UnknownCells::word(given), UnknownCells::space(given));
        Some(match (target, space) {
            (Target::Arrays, Some(UnknownSpace::Pessimistic)) => (word, "unknown cells are obstacles"),
            (Target::Arrays, Some(UnknownSpace::Optimistic)) => (word, "unknown cells are free"),
            (Target::MapServer, Some(UnknownSpace::Pessimistic)) if layer => {
                (word, "columns with an unknown cell are unknown, but where there is an obstacle")
            }
            (Target::MapServer, Some(UnknownSpace::Optimistic)) if layer => {
                (word, "columns are free where what is known of them is free")
            }
            (Target::Arrays | Target::Esdf, _) => (STAYS, "unknown cells are unknown: NaN"),
            (Target::MapServer | Target::Messages | Target::OctomapBt | Target::OctomapOt, _) => {
                (STAYS, "unknown cells are unknown")
            }
            (Target::Portolan | Target::Contour | Target::Mesh, _) => return None,
        })
    }

    /// Refuses options that would change nothing.
    fn check(&self, target: Target, source: &Source) -> anyhow::Result<()> {
        let out = self.out.display();
        if self.arrays.asked() && target != Target::Arrays {
            return Err(bad_call(format!("options of arrays are only for .npz and .npy, not for {out}")));
        }
        if let (true, Source::Map3(file)) = (self.costs.is_layer(), source) {
            let up = self.up.or_else(|| Up::of_header(&file.header)).unwrap_or(Up::Z);
            up.check_slab(&self.input.display().to_string())?;
        }
        if self.costs.asked() && target != Target::MapServer {
            return Err(bad_call(format!("options of costmaps are only for .yaml, not for {out}")));
        }
        if target == Target::Esdf && self.arrays.unknown.is_some() {
            return Err(bad_call(format!(
                "--unknown is for arrays and layers: {out} holds unknown cells as NaN"
            )));
        }
        if !self.takes_field(target, source) {
            let given = [
                ("--esdf", self.esdf.is_some()),
                ("--max-distance", self.max_distance.is_some()),
                ("--thin", self.thin.is_some()),
                ("--bounds", self.bounds.is_some()),
                ("--unknown", self.arrays.unknown.is_some()),
            ];
            if let Some((option, _)) = given.iter().find(|(_, given)| *given) {
                return Err(bad_call(format!(
                    "{option} is only for distance fields; {out} is made without one"
                )));
            }
        }
        Ok(())
    }
}

fn write_lines(contour: &Contour, args: &Args) -> anyhow::Result<bool> {
    let lines: Vec<Polyline> = polylines(contour);
    write_contour(&args.out, &lines)
}

/// The zero level set of a distance field.
fn contour_of(esdf: &EsdfGrid<2>) -> anyhow::Result<Contour> {
    let tsdf = tsdf_of_samples(*esdf.grid(), esdf.samples())?;
    Ok(marching_squares(&tsdf, &ContourSettings::of(&tsdf)))
}

/// The cells as an occupancy grid whose cells are as sure as they can be.
fn as_map_file(map: &MapServerMap, args: &Args) -> anyhow::Result<MapFile<2>> {
    let model = OccupancyModel::default();
    let mut grid = OccupancyGrid::covering(&map.grid, model)?;
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
    let mut file = MapFile::<2>::default();
    file.header = MapHeader { logs: vec![name], ..MapHeader::default() };
    file.grid = Some(grid);
    Ok(file)
}
