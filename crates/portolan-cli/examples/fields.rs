//! Distance transforms and queries, timed on raw arrays: prints one JSON line. `bench/distance_transform.py` and `bench/queries.py` set it
//! beside other libraries.
//!
//! ```text
//! fields mask MASK.u8 --shape 128 512 512 --within 20 --out SQUARED.f32
//! fields query FIELD.f32 --shape 128 128 128 --resolution 0.05 --points POINTS.f64 --cubic --out VALUES.f64
//! ```
//!
//! Arrays are little-endian, x fastest. Only the library's own calls are inside the clock.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::{Parser, Subcommand};
use portolan::Status;
use portolan::field::{EsdfGrid, FieldSlots, Interpolation, MaskTransform};
use portolan::geom::Grid;
use serde_json::{Value, json};

/// Distance transforms and queries, timed on raw arrays: prints one JSON line.
#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    what: What,
    #[arg(long, global = true, default_value_t = 3)]
    repeats: usize,
    #[arg(long, global = true, default_value_t = 1)]
    threads: usize,
    /// Where the last result goes, raw
    #[arg(long, global = true)]
    out: Option<PathBuf>,
}

#[derive(Subcommand)]
enum What {
    /// Squared distances to the cells of a mask that are not 0
    Mask {
        file: PathBuf,
        #[arg(long, num_args = 1..=3, required = true)]
        shape: Vec<usize>,
        /// Only distances up to so many cells
        #[arg(long, default_value_t = f64::INFINITY)]
        within: f64,
        /// The nearest cells, too
        #[arg(long)]
        nearest: bool,
    },
    /// Values and gradients of a field at points
    Query {
        file: PathBuf,
        #[arg(long, num_args = 3, required = true)]
        shape: Vec<usize>,
        #[arg(long, default_value_t = 1.0)]
        resolution: f64,
        /// x y z of each, f64, from the corner of the first cell
        #[arg(long)]
        points: PathBuf,
        #[arg(long)]
        cubic: bool,
    },
}

/// Seconds of each repeat, items, the result's bytes.
type Timed = (Vec<f64>, usize, Vec<u8>, Value);

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    ensure!(args.repeats > 0, "at least one repeat");
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global()?;
    let (seconds, per, bytes, more) = match &args.what {
        What::Mask { file, shape, within, nearest } => {
            let mask = read(file)?;
            match shape[..] {
                [x] => transform([x], &mask, *within, *nearest, args.repeats)?,
                [x, y] => transform([x, y], &mask, *within, *nearest, args.repeats)?,
                [x, y, z] => transform([x, y, z], &mask, *within, *nearest, args.repeats)?,
                _ => anyhow::bail!("a shape has one to three axes"),
            }
        }
        What::Query { file, shape, resolution, points, cubic } => {
            let samples = read(file)?.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
            let points: Vec<f64> =
                read(points)?.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
            let grid = Grid::new([0.0; 3], *resolution, [shape[0], shape[1], shape[2]]);
            let esdf = EsdfGrid::from_samples(grid, samples)?;
            let interpolation = if *cubic { Interpolation::Cubic } else { Interpolation::Linear };
            query(&esdf, points.as_chunks().0, interpolation, args.repeats)
        }
    };
    if let Some(path) = &args.out {
        std::fs::write(path, bytes).with_context(|| path.display().to_string())?;
    }
    writeln!(std::io::stdout(), "{}", json!({ "seconds": seconds, "per": per, "more": more }))?;
    Ok(())
}

fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(path).with_context(|| path.display().to_string())
}

fn transform<const D: usize>(
    shape: [usize; D],
    mask: &[u8],
    within: f64,
    nearest: bool,
    repeats: usize,
) -> anyhow::Result<Timed> {
    let transform = MaskTransform::new(shape)?.within(within)?;
    let (mut seconds, mut squared) = (Vec::new(), Vec::new());
    for _ in 0..repeats {
        drop(std::mem::take(&mut squared)); // the last run's memory is not this one's
        let start = Instant::now();
        squared = if nearest { transform.nearest(mask)?.0 } else { transform.squared_distances(mask)? };
        seconds.push(start.elapsed().as_secs_f64());
    }
    Ok((seconds, mask.len(), squared.iter().flat_map(|v| v.to_le_bytes()).collect(), Value::Null))
}

fn query(esdf: &EsdfGrid<3>, points: &[[f64; 3]], interpolation: Interpolation, repeats: usize) -> Timed {
    let mut distance = vec![0.0; points.len()];
    let mut gradient = vec![[0.0; 3]; points.len()];
    let mut status = vec![Status::default(); points.len()];
    let mut seconds = Vec::new();
    for _ in 0..repeats {
        let slots = FieldSlots { distance: &mut distance, gradient: &mut gradient, status: &mut status };
        let start = Instant::now();
        esdf.distances_and_gradients(points, interpolation, slots);
        seconds.push(start.elapsed().as_secs_f64());
    }
    let known = status.iter().filter(|s| **s == Status::Known).count();
    let bytes = distance.iter().flat_map(|v| v.to_le_bytes()).collect();
    (seconds, points.len(), bytes, json!({ "known": known }))
}
