//! `query`: points in, answers out.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan::Answer;
use portolan::cell::SignedDistance;
use portolan::field::{Esdf, EsdfGrid, SurfaceNoise, UnknownSpace};
use portolan::geom::Pose;
use portolan::map;
use portolan::store::Store;
use portolan::uncertainty::SurfaceSigma;
use portolan_io::{
    AnswerRow, EsdfFile, HELD_BACK, Input, Manifest, MapFile, MapServerMap, OctomapTree, QueryPoints,
    SigmaColumns, certified_reach, write_answer, write_answer_header,
};
use serde_json::{Map, Value, json};

use crate::arguments::{length, sigmas, thin};
use crate::error::bad_call;
use crate::esdf::{
    EsdfArg, FieldHow, PointsAlone, SURFACE_ALONE, check_thin, esdf_2d, esdf_3d, esdf_of_cells,
    esdf_of_points, is_of_points, keeps_thin,
};
use crate::folder;
use crate::mapping::{SIGMA_FILE, Settings, read_sigma};
use crate::output::Output;
use crate::source::{Source, open};
use crate::unknown::UnknownArg;

#[derive(clap::Args)]
#[command(after_help = "Example:\n  echo 1.5,2.0 | portolan query intel --points -")]
/// Answers at points, as CSV: x,y[,z],status,occupancy,distance,lower,upper,gx,gy[,gz],unknown_as
///
/// A row is one statement about the nearest obstacle. What is known of obstacles (the surface that `map` writes, and cells
/// that stop beams without one, --thin) is `distance` away, certified to be no farther than `upper`. Nothing is nearer than
/// `lower`, which counts unknown space as `unknown_as` has it (--unknown). The distance lies within its bounds; inside of
/// obstacles all three are negative. `status` is known, unknown, saturated (obstacles are farther than `distance`, and
/// `upper` is empty) or outside. gx,gy[,gz] is the gradient of the distance. Only a map.portolan with signed distances has
/// bounds; of other files `distance` is interpolated. Lengths are in meters.
pub(crate) struct Args {
    /// A folder that `map` wrote, a map.portolan, an esdf.bin, a map_server yaml, or an OctoMap .bt or .ot
    map: PathBuf,
    /// CSV of x,y (2-D) or x,y,z (3-D) in meters; - reads standard input
    #[arg(long, value_name = "FILE")]
    points: PathBuf,
    /// Share of the beams through a cell that must end there to make it an obstacle where no surface is found; 0: only
    /// surfaces are [default: as the map was made]
    #[arg(long, value_name = "SHARE", value_parser = thin, allow_negative_numbers = true)]
    thin: Option<f64>,
    /// 3-D maps: largest distance to find (meters) [default: as the map was made]
    #[arg(long, value_name = "M", value_parser = length)]
    max_distance: Option<f64>,
    /// Method of the distances of a map.portolan; only accurate ones have bounds [default: accurate]
    #[arg(long, value_enum)]
    esdf: Option<EsdfArg>,
    /// What unknown space counts as: an obstacle (pessimistic) or free (optimistic) [default: pessimistic]
    #[arg(long, value_enum)]
    unknown: Option<UnknownArg>,
    /// Give the standard deviation of each distance as well, by sigma.json beside the map: how sure the surface is, as `map
    /// --ledger` found by the beginning and the end of the log. With K also the lower bound if every obstacle were nearer by K of
    /// its standard deviations (lower_at_K_sigma)
    #[arg(long, value_name = "K", value_parser = sigmas, num_args = 0..=1, require_equals = true)]
    sigma: Option<Option<f64>>,
    #[command(flatten)]
    output: Output,
}

impl Args {
    fn columns(&self) -> SigmaColumns {
        match self.sigma {
            None => SigmaColumns::No,
            Some(None) => SigmaColumns::Sigma,
            Some(Some(sigmas)) => SigmaColumns::LowerAt(sigmas),
        }
    }
}

/// Answers at all points.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let source = open(&args.map)?;
    folder::warn(&args.map, args.output)?;
    if args.esdf.is_some() && !matches!(source, Source::Map2(_) | Source::Map3(_)) {
        return Err(bad_call(format!("--esdf is only for a map.portolan; this is {}", source.describe())));
    }
    if args.unknown.is_some() && !matches!(source, Source::Map2(_) | Source::Map3(_)) {
        return Err(bad_call(format!("--unknown is only for a map.portolan; this is {}", source.describe())));
    }
    if args.thin.is_some() && !matches!(source, Source::Map2(_) | Source::Map3(_)) {
        return Err(bad_call(format!("--thin is only for a map.portolan; this is {}", source.describe())));
    }
    if args.max_distance.is_some() && !matches!(source, Source::Map3(_)) {
        return Err(bad_call(format!(
            "--max-distance is only for a 3-D map.portolan; this is {}",
            source.describe()
        )));
    }
    if args.sigma.is_some() && !matches!(source, Source::Map2(_) | Source::Map3(_)) {
        return Err(bad_call(format!("--sigma is only for a map.portolan; this is {}", source.describe())));
    }
    if matches!(args.sigma, Some(Some(_))) && args.esdf.unwrap_or_default() != EsdfArg::Accurate {
        return Err(bad_call("--sigma=K is about lower bounds, which only accurate distances have"));
    }
    check_thin(args.thin.is_some(), args.esdf.unwrap_or_default())?;
    if surface_alone(&source, args) && !args.output.quiet {
        writeln!(io::stderr(), "portolan: warning: {}: {SURFACE_ALONE}", args.map.display())?;
    }
    if let Some(warning) = source.warning().filter(|_| !args.output.quiet) {
        // Standard output is for the answers.
        writeln!(io::stderr(), "portolan: warning: {}: {warning}", args.map.display())?;
    }
    let field = Fields::of(source, args)?;
    let points = if args.points == Path::new("-") {
        QueryPoints::parse(Input::from_reader(io::stdin(), "standard input".as_ref())?)?
    } else {
        QueryPoints::read(&args.points)?
    };
    match (field, points) {
        (Fields::Two(field), QueryPoints::Two(points)) => write_answers(&field, &points, args),
        (Fields::Three(field), QueryPoints::Three(points)) => write_answers(&field, &points, args),
        (Fields::Two(_), _) => {
            bail!("{}: the points are x,y,z; the map is 2-D: give x,y", shown(args))
        }
        (Fields::Three(_), _) => {
            bail!("{}: the points are x,y; the map is 3-D: give x,y,z", shown(args))
        }
    }
}

/// Whether thin obstacles would count, and no map of the file knows them.
fn surface_alone(source: &Source, args: &Args) -> bool {
    let lacks = match source {
        Source::Map2(file) => file.tsdf.is_some() && !keeps_thin(file),
        Source::Map3(file) => file.tsdf_bricks.is_some() && !keeps_thin(file),
        _ => false,
    };
    lacks && args.esdf.unwrap_or_default() == EsdfArg::Accurate && args.thin != Some(0.0)
}

fn shown(args: &Args) -> String {
    args.points.display().to_string()
}

fn write_answers<const D: usize>(field: &Field<D>, points: &[[f64; D]], args: &Args) -> anyhow::Result<()> {
    let (rows, columns) = (points.iter().map(|&p| field.answer(p)), args.columns());
    let mut out = BufWriter::new(io::stdout().lock());
    if args.output.json {
        writeln!(out, "{:#}", json!({ "answers": rows.map(|r| row_json(&r, columns)).collect::<Vec<_>>() }))?;
    } else {
        write_answer_header::<D>(&mut out, columns)?;
        for row in rows {
            write_answer(&mut out, &row, columns)?;
        }
    }
    out.flush()?;
    Ok(())
}

fn row_json<const D: usize>(row: &AnswerRow<D>, columns: SigmaColumns) -> Value {
    let mut value = json!({
        "point": row.point.to_vec(),
        "status": row.status.word(),
        "occupancy": row.occupancy,
        "distance": row.distance,
        "lower": row.lower,
        "upper": row.upper,
        "gradient": row.gradient.map(|g| g.to_vec()),
        "unknown_as": row.unknown.map(UnknownSpace::word),
    });
    if columns != SigmaColumns::No {
        value["sigma"] = json!(row.sigma);
    }
    if let Some(name) = columns.lower_at() {
        value[name] = json!(row.lower_at);
    }
    value
}

/// A map of either dimension.
enum Fields {
    Two(Field<2>),
    Three(Field<3>),
}

/// Occupancy and distance of one map.
struct Field<const D: usize> {
    distance: Option<Distance<D>>,
    clearance: Option<Certified<D>>,
    occupancy: Occupancy<D>,
    /// For maps that are turned against the world.
    world_from_field: Pose<D>,
    sigma: Option<Sigma<D>>,
}

type Occupancy<const D: usize> = Box<dyn Fn([f64; D]) -> Answer<f64>>;
/// The standard deviation of a distance with this gradient.
type Sigma<const D: usize> = Box<dyn Fn([f64; D], f64, [f64; D]) -> Option<f64>>;
/// Distance and gradient.
type Distance<const D: usize> = Box<dyn Fn([f64; D]) -> Answer<(f64, [f64; D])>>;

/// Certified bounds of the distance.
struct Certified<const D: usize> {
    field: Esdf<D>,
    unknown: UnknownSpace,
    /// Bounds are given up to this distance (meters).
    limit: f64,
    /// Whether it is of points without rays.
    of_points: bool,
    /// What the surface is uncertain by, where that is asked for.
    noise: Option<SurfaceNoise<D>>,
}

/// What unknown space counts as.
fn space(args: &Args) -> UnknownSpace {
    UnknownArg::space(args.unknown)
}

/// What a field in bricks answers. Only the accurate method certifies.
fn sparse<const D: usize>(field: Esdf<D>, limit: f64, args: &Args) -> (Distance<D>, Option<Certified<D>>) {
    let certifies = args.esdf.unwrap_or_default() == EsdfArg::Accurate;
    let reach = certified_reach(&field);
    // Bricks are shared.
    let certified = certifies.then(|| Certified {
        field: field.clone(),
        unknown: space(args),
        limit: limit.min(reach),
        of_points: false,
        noise: None,
    });
    (Box::new(move |p| field.distance_and_gradient(p)), certified)
}

fn dense<const D: usize>(esdf: EsdfGrid<D>) -> Distance<D> {
    Box::new(move |p| esdf.distance_and_gradient(p))
}

impl Fields {
    fn of(source: Source, args: &Args) -> anyhow::Result<Self> {
        Ok(match source {
            Source::Map2(file) => Self::Two(of_map2(*file, args)?),
            Source::Esdf(EsdfFile::Two(field)) => Self::Two(of_esdf(field)),
            Source::Esdf(EsdfFile::Three(field)) => Self::Three(of_esdf(field)),
            Source::Server(map) => Self::Two(of_server(map)),
            Source::Map3(file) => Self::Three(of_map3(*file, args)?),
            Source::Octomap(file) => Self::Three(of_octomap(*file)),
            other => bail!(
                "{}: is {}; give a map.portolan or its folder, an esdf.bin, a map_server yaml, or an OctoMap .bt or .ot",
                args.map.display(),
                other.describe()
            ),
        })
    }
}

/// As the map was made, but for what was asked for.
fn how(args: &Args, saved: &Map<String, Value>) -> FieldHow {
    let saved = FieldHow::of(&Settings::of_saved(saved));
    FieldHow {
        method: args.esdf.unwrap_or_default(),
        // Only what is certified looks at unknown space.
        unknown: space(args) == UnknownSpace::Pessimistic
            && args.esdf.unwrap_or_default() == EsdfArg::Accurate,
        thin: args.thin.unwrap_or(saved.thin),
        max_distance: args.max_distance.unwrap_or(saved.max_distance),
    }
}

/// How sure the surface of a map is, where that was asked for.
fn sigma_of(lacks_distances: bool, args: &Args) -> anyhow::Result<Option<SurfaceSigma>> {
    if args.sigma.is_none() {
        return Ok(None);
    }
    if lacks_distances {
        bail!("{}: has no signed distances, whose standard deviation --sigma gives", args.map.display());
    }
    let folder =
        if args.map.is_dir() { args.map.as_path() } else { args.map.parent().unwrap_or(Path::new("")) };
    let file = folder.join(SIGMA_FILE);
    // One of another run, or a damaged one, says nothing about this map.
    folder::check_file(&file)?;
    if file.is_file() && Manifest::read(folder).is_some_and(|set| !set.files.contains_key(SIGMA_FILE)) {
        bail!("{}: was not written with the map beside it, and says nothing about it", file.display());
    }
    read_sigma(&file).map(Some)
}

/// The standard deviation of distances to the surface of a map.
fn sigma_on<const D: usize, S: Store<SignedDistance, D> + Clone + 'static>(
    map: &S,
    curve: SurfaceSigma,
) -> Sigma<D> {
    let map = map.clone();
    Box::new(move |p, distance, gradient| curve.of_distance(&map, p, distance, gradient))
}

/// What the obstacles of a field are uncertain by, where a number of standard deviations is asked for.
fn noise_of<const D: usize>(
    field: &Esdf<D>,
    map: &(impl Store<SignedDistance, D> + Sync),
    curve: Option<&SurfaceSigma>,
    args: &Args,
) -> Option<SurfaceNoise<D>> {
    Some(field.surface_noise(map, curve?, args.sigma??))
}

fn of_map2(file: MapFile<2>, args: &Args) -> anyhow::Result<Field<2>> {
    let curve = sigma_of(file.tsdf.is_none(), args)?;
    let of_tsdf = file.tsdf.as_ref().map(|t| {
        let field = esdf_2d(&file, t, &how(args, &file.header.settings))?.esdf;
        let noise = noise_of(&field, t.store(), curve.as_ref(), args);
        let (distance, clearance) = sparse(field, f64::INFINITY, args);
        let clearance = clearance.map(|c| Certified { noise, ..c });
        // A 2-D map is a box: what lies outside does not depend on where something was seen.
        let bounds = t.grid().aabb();
        let in_box: Distance<2> = Box::new(move |p| match distance(p) {
            _ if !bounds.contains(p) => Answer::Outside,
            Answer::Outside => Answer::Unknown,
            answer => answer,
        });
        anyhow::Ok((in_box, clearance))
    });
    let of_grid = || {
        let map = file.grid.as_ref()?;
        let occupied = |i: usize| map.store().at(i).map(|v| v.0 > 0);
        Some(EsdfGrid::from_mask(*map.store().grid(), occupied))
    };
    let (distance, clearance) = match of_tsdf.transpose()? {
        Some((distance, clearance)) => (Some(distance), clearance),
        None => (of_grid().map(dense), None),
    };
    let sigma = file.tsdf.as_ref().zip(curve).map(|(map, curve)| sigma_on(map.store(), curve));
    let occupancy: Occupancy<2> = match (file.grid, file.tree, file.tsdf) {
        (Some(map), ..) => Box::new(move |p| map.probability(p)),
        (_, Some(map), _) => Box::new(move |p| map.probability(p)),
        (.., Some(map)) => Box::new(move |p| map.occupancy(p).map_or(Answer::Unknown, Answer::Known)),
        _ => Box::new(|_| Answer::Outside),
    };
    Ok(Field { distance, clearance, occupancy, world_from_field: Pose::IDENTITY, sigma })
}

fn of_map3(file: MapFile<3>, args: &Args) -> anyhow::Result<Field<3>> {
    let curve = sigma_of(file.tsdf_bricks.is_none(), args)?;
    let mut how = how(args, &file.header.settings);
    let max_distance = how.max_distance;
    let field = file.tsdf_bricks.as_ref().map(|map| {
        if how.method == EsdfArg::Accurate {
            how.max_distance += HELD_BACK * map.store.lattice().resolution;
        }
        let field = esdf_3d(&file, map, &how)?.esdf;
        let noise = noise_of(&field, &map.store, curve.as_ref(), args);
        let (distance, clearance) = sparse(field, max_distance, args);
        anyhow::Ok((distance, clearance.map(|c| Certified { noise, ..c })))
    });
    let of_points = file.occupancy_bricks.as_ref().filter(|_| is_of_points(&file.header.settings));
    let field = match (field, of_points) {
        (None, Some(map)) => {
            how.max_distance += HELD_BACK * map.store.lattice().resolution;
            let (distance, certified) = sparse(esdf_of_points(map, &how, usize::MAX)?, max_distance, args);
            Some((distance, certified.map(|c| Certified { of_points: true, ..c })))
        }
        (field, _) => field.transpose()?,
    };
    let (distance, clearance) =
        field.map_or((None, None), |(distance, clearance)| (Some(distance), clearance));
    let sigma = file.tsdf_bricks.as_ref().zip(curve).map(|(map, curve)| sigma_on(&map.store, curve));
    let occupancy: Occupancy<3> = match (file.occupancy_bricks, file.tsdf_bricks) {
        (Some(map), _) => {
            let map = map::Occupancy::<3>::from_store(map.store, map.model)?;
            Box::new(move |p| map.probability(p))
        }
        (None, Some(map)) => Box::new(move |p| match map.store.lattice().cell_of(p) {
            None => Answer::Outside,
            Some(cell) => match map.store.cell(cell) {
                Some(c) => Answer::Known(if c.distance < 0.0 { 1.0 } else { 0.0 }),
                None => Answer::Unknown,
            },
        }),
        (None, None) => Box::new(|_| Answer::Outside),
    };
    Ok(Field { distance, clearance, occupancy, world_from_field: Pose::IDENTITY, sigma })
}

fn of_esdf<const D: usize>(esdf: EsdfGrid<D>) -> Field<D> {
    let occupancy: Occupancy<D> = Box::new(|_| Answer::Unknown);
    let (distance, world_from_field) = (Some(dense(esdf)), Pose::IDENTITY);
    Field { distance, clearance: None, occupancy, world_from_field, sigma: None }
}

fn of_server(map: MapServerMap) -> Field<2> {
    let world_from_field = map.world_from_grid();
    let distance = Some(dense(esdf_of_cells(map.grid, &map.cells)));
    let occupancy: Occupancy<2> = Box::new(move |p| match map.grid.index_of(p) {
        None => Answer::Outside,
        Some(i) if map.occupancy[i].is_nan() => Answer::Unknown,
        Some(i) => Answer::Known(f64::from(map.occupancy[i])),
    });
    Field { distance, clearance: None, occupancy, world_from_field, sigma: None }
}

/// Occupancy alone: a tree holds no distances.
fn of_octomap(file: OctomapTree) -> Field<3> {
    let tree = file.into_tree();
    let bounds = tree.grid().aabb();
    let occupancy: Occupancy<3> =
        Box::new(move |p| match tree.lattice().cell_of(p).filter(|_| bounds.contains(p)) {
            None => Answer::Outside,
            Some(cell) => tree.cell(cell).map_or(Answer::Unknown, |v| Answer::Known(logistic(v.0))),
        });
    Field { distance: None, clearance: None, occupancy, world_from_field: Pose::IDENTITY, sigma: None }
}

/// P(occupied) of log odds.
fn logistic(log_odds: f32) -> f64 {
    1.0 / (1.0 + (-f64::from(log_odds)).exp())
}

impl<const D: usize> Field<D> {
    fn answer(&self, point: [f64; D]) -> AnswerRow<D> {
        let p = self.world_from_field.inverse().transform_point(point);
        let occupancy = (self.occupancy)(p);
        let Some(distance) = &self.distance else {
            let nothing = if occupancy == Answer::Outside { Answer::Outside } else { Answer::Unknown };
            return AnswerRow::of(point, occupancy.known(), nothing);
        };
        let distance = distance(p).map(|(d, gradient)| (d, self.world_from_field.rotate(gradient)));
        let mut row = AnswerRow::of(point, occupancy.known(), distance);
        if let Some(certified) = &self.clearance {
            let (unknown, limit) = (certified.unknown, certified.limit);
            match certified.of_points {
                true => row.certify(&PointsAlone(&certified.field), p, unknown, limit),
                false => row.certify(&certified.field, p, unknown, limit),
            }
            if let Some(noise) = &certified.noise {
                row.less_noise(&certified.field, noise, p);
            }
        }
        if let (Some(sigma), Some((distance, gradient))) = (&self.sigma, distance.known()) {
            row.sigma = sigma(p, distance, gradient);
        }
        row
    }
}
