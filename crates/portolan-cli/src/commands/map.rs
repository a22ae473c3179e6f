//! `map`: fuse a log into maps.

mod common;
mod plane;
mod space;

use std::path::PathBuf;

use portolan::geom::Aabb;
use portolan::scan::Body;
use portolan::sweep::WeightModel;

use crate::arguments::{Bounds, ForgettingArgs, body, bounds, box3, bytes, length, share};
use crate::error::bad_call;
use crate::esdf::EsdfArg;
use crate::log::{LimitArgs, LogArgs};
use crate::mapping::MapKind;
use crate::output::Output;

/// Sweeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SweepArg {
    /// Planar: distances at cell centres, with the range interpolated between beams
    CellCentre,
    /// Planar: the textbook's march along beams
    March,
    /// In space: projective where a scan has rows and columns, exact rays otherwise
    Auto,
    /// In space: every ray exactly
    Exact,
    /// In space: cells against the range image
    Projective,
}

/// Weights of beams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum WeightsArg {
    /// Every beam 1
    Constant,
    /// One over the range squared
    Range,
    /// Cosine of the incidence angle
    Incidence,
    /// Both
    RangeIncidence,
}

impl WeightsArg {
    fn model(self) -> WeightModel {
        match self {
            Self::Constant => WeightModel::Constant,
            Self::Range => WeightModel::InverseSquare,
            Self::Incidence => WeightModel::CosIncidence,
            Self::RangeIncidence => WeightModel::InverseSquareCosIncidence,
        }
    }
}

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  portolan map intel-corrected.log.gz --resolution 0.05 --out intel\n  \
                  portolan map rgbd_redkitchen --resolution 0.02 --out kitchen")]
pub(crate) struct Args {
    /// Log of range scans with poses; its kind is recognised
    log: PathBuf,
    /// Folder for the results; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Edge of a cell (metres); with --append the map's
    #[arg(long, value_name = "R", value_parser = length, allow_negative_numbers = true)]
    #[arg(required_unless_present = "append")]
    resolution: Option<f64>,
    /// Distances are kept within this of a surface (metres); default three cells
    #[arg(long, value_name = "T", value_parser = length, allow_negative_numbers = true)]
    truncation: Option<f64>,
    #[command(flatten)]
    forgetting: ForgettingArgs,
    /// How much each beam is trusted; default constant
    #[arg(long, value_enum)]
    weights: Option<WeightsArg>,
    /// How scans become evidence; default cell-centre, in space auto
    #[arg(long, value_enum)]
    sweep: Option<SweepArg>,
    /// Maps to make, separated by commas; esdf, contour and mesh need tsdf, which is then made too
    /// [default: grid,tree,tsdf,esdf,contour; in space: tree,tsdf,esdf,mesh]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    maps: Option<Vec<MapKind>>,
    #[command(flatten)]
    source: LogArgs,
    #[command(flatten)]
    limits: LimitArgs,
    /// Do not fuse the free space in front of surfaces into the distances: faster, but free is then unknown
    #[arg(long)]
    no_carve: bool,
    /// Weight of free space against that of a surface, above 0 and at most 1; with less, thin things survive and
    /// what has gone fades more slowly; default 0.3 (the chapter's is 1)
    #[arg(long, value_name = "W", value_parser = share, allow_negative_numbers = true, conflicts_with = "no_carve")]
    carve_weight: Option<f32>,
    /// Map this box only: x0,y0,x1,y1, in space x0,y0,z0,x1,y1,z1 (metres)
    #[arg(long, value_name = "BOX", value_parser = bounds, allow_hyphen_values = true)]
    bounds: Option<Bounds>,
    /// Readings inside of this part of the sensor's frame are of the robot itself: a box x0,y0,z0,x1,y1,z1 or a ball
    /// x,y,z,radius (metres); may be given several times
    #[arg(long, value_name = "BOX|SPHERE", value_parser = body, allow_hyphen_values = true)]
    self_filter: Vec<Body>,
    /// How the esdf is made: distances to the extracted surface, from the chapter's seeds, or between cells [default:
    /// accurate]
    #[arg(long, value_enum)]
    esdf: Option<EsdfArg>,
    /// In space: distances of the esdf are kept up to here (metres); default 1
    #[arg(long, value_name = "M", value_parser = length)]
    max_distance: Option<f64>,
    /// In space: write this box of the esdf into esdf.bin, where the whole would be larger than 256 MiB
    #[arg(long, value_name = "BOX", value_parser = box3, allow_hyphen_values = true)]
    dense: Option<Aabb<3>>,
    /// In space: do not fuse colour
    #[arg(long)]
    no_color: bool,
    /// Use every N-th scan of the log only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    every: Option<u64>,
    /// Leave every N-th scan out of fusion, for `eval --scans`
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..), allow_negative_numbers = true)]
    hold_out: Option<u64>,
    /// Go on with the map in DIR; settings not given are the map's, but for --bounds, which are those of this run
    #[arg(long)]
    append: bool,
    /// Threads; default: one per core. The result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), allow_negative_numbers = true)]
    threads: Option<u16>,
    /// Memory that may be used, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "4G")]
    memory: u64,
    #[command(flatten)]
    output: Output,
}

/// Fuses the log.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if args.source.is_space(&args.log)? { space::run(args) } else { plane::run(args) }
}

impl Args {
    fn map_path(&self) -> PathBuf {
        self.out.join("map.portolan")
    }

    /// A file in place of the folder is found out before the work, not after it.
    fn check_out(&self) -> anyhow::Result<()> {
        if self.out.exists() && !self.out.is_dir() {
            anyhow::bail!("{}: is a file, not a folder; name a folder for the results", self.out.display());
        }
        if let (Ok(out), Ok(log)) = (self.out.canonicalize(), self.log.canonicalize())
            && out == log
        {
            return Err(bad_call("--out is the log's own folder; name another one"));
        }
        Ok(())
    }
}
