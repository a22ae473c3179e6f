//! One workload, timed: prints one JSON line. `bench/compare.py` sets it beside portolan's peers.
//!
//! ```text
//! cargo run --release -p portolan-cli --example workload -- occupancy --data DIR --resolution 0.1
//! ```
//!
//! Only the library's own calls are inside the clock; reading and decoding files is not.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use clap::{Parser, ValueEnum};
use portolan::cell::OccupancyModel;
use portolan::geom::{Lattice, Pose};
use portolan::map::{Occupancy, Tsdf3, TsdfConfig};
use portolan::scan::Frame;
use portolan::surface::{IsosurfaceSettings, isosurface};
use portolan::sweep::OccupancySweep;
use portolan_io::scan_log::{ScanLog, ScanLogOptions};
use serde_json::{Value, json};

/// What is timed.
#[derive(Clone, Copy, ValueEnum)]
enum Workload {
    /// Lidar scans into occupancy
    Occupancy,
    /// Lidar scans into signed distances
    LidarTsdf,
    /// Depth images into signed distances
    DepthTsdf,
    /// The zero level of a volume
    Surface,
    /// Occupancy at random points
    Query,
}

#[derive(Clone, Copy, ValueEnum)]
enum Sweep {
    Auto,
    Exact,
}

/// One workload, timed: prints one JSON line.
#[derive(Parser)]
struct Args {
    workload: Workload,
    /// Folder with lidar_building/, rgbd_building/ and grids/
    #[arg(long)]
    data: PathBuf,
    #[arg(long, default_value_t = 0.1)]
    resolution: f64,
    #[arg(long, value_enum, default_value = "auto")]
    sweep: Sweep,
    /// Fuse free space, too
    #[arg(long)]
    carve: bool,
    #[arg(long, default_value_t = 20)]
    scans: usize,
    #[arg(long, default_value_t = 3)]
    repeats: usize,
    #[arg(long, default_value_t = 1)]
    threads: usize,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global()?;
    let (seconds, per, more) = match args.workload {
        Workload::Occupancy => occupancy(&args)?,
        Workload::LidarTsdf => tsdf(&args, "lidar_building")?,
        Workload::DepthTsdf => tsdf(&args, "rgbd_building")?,
        Workload::Surface => surface(&args)?,
        Workload::Query => query(&args)?,
    };
    let mut line = json!({ "seconds": seconds, "per": per, "peak": peak_memory() });
    if let (Value::Object(line), Value::Object(more)) = (&mut line, more) {
        line.extend(more);
    }
    writeln!(std::io::stdout(), "{line}")?;
    Ok(())
}

type Timed = (Vec<f64>, usize, Value);

fn frames(args: &Args, folder: &str) -> anyhow::Result<Vec<(Pose<3>, Frame)>> {
    let options = ScanLogOptions { color: false, ..Default::default() };
    let log = ScanLog::open(&args.data.join(folder), &options)?;
    (0..log.len().min(args.scans)).map(|i| Ok((*log.pose(i), log.frame(i)?))).collect()
}

/// Seconds of each repeat, and the last result.
fn timed<T>(repeats: usize, mut run: impl FnMut() -> anyhow::Result<T>) -> anyhow::Result<(Vec<f64>, T)> {
    ensure!(repeats > 0, "at least one repeat");
    let mut seconds = Vec::new();
    let mut last = None;
    for _ in 0..repeats {
        drop(last.take()); // the last run's memory is not this one's
        let start = Instant::now();
        last = Some(run()?);
        seconds.push(start.elapsed().as_secs_f64());
    }
    Ok((seconds, last.context("a repeat")?))
}

fn fused(args: &Args, frames: &[(Pose<3>, Frame)]) -> anyhow::Result<Occupancy<3>> {
    let sweep = match args.sweep {
        Sweep::Auto => OccupancySweep::Auto,
        Sweep::Exact => OccupancySweep::Exact,
    };
    let lattice = Lattice::new([0.0; 3], args.resolution);
    let mut map = Occupancy::<3>::new(lattice, OccupancyModel::default())?.with_sweep(sweep);
    for (pose, frame) in frames {
        map.integrate(pose, frame)?;
    }
    Ok(map)
}

fn occupancy(args: &Args) -> anyhow::Result<Timed> {
    let frames = frames(args, "lidar_building")?;
    let (seconds, map) = timed(args.repeats, || fused(args, &frames))?;
    let more =
        json!({ "bricks": map.store().len(), "cells": map.observed_cells(), "bytes": map.memory_bytes() });
    Ok((seconds, frames.len(), more))
}

fn tsdf(args: &Args, folder: &str) -> anyhow::Result<Timed> {
    let frames = frames(args, folder)?;
    let config = TsdfConfig {
        resolution: args.resolution,
        // As the peers are set: four cells for depth images, three for lidars.
        truncation: if folder.starts_with("rgbd") { 4.0 } else { 3.0 } * args.resolution,
        carve: args.carve,
        color: false,
        ..TsdfConfig::default()
    };
    let (seconds, map) = timed(args.repeats, || {
        let mut map = Tsdf3::new(config)?;
        for (pose, frame) in &frames {
            map.integrate(pose, frame)?;
        }
        Ok(map)
    })?;
    let more =
        json!({ "bricks": map.store().len(), "cells": map.observed_cells(0.0), "bytes": map.memory_bytes() });
    Ok((seconds, frames.len(), more))
}

fn surface(args: &Args) -> anyhow::Result<Timed> {
    let (samples, shape) = read_npy(&args.data.join("grids/w4_gyroid_256_f32.npy"))?;
    let settings = IsosurfaceSettings { normals: false, ..IsosurfaceSettings::default() };
    let (seconds, mesh) = timed(args.repeats, || Ok(isosurface(&samples, shape, &settings).mesh))?;
    Ok((seconds, 1, json!({ "vertices": mesh.vertices.len(), "triangles": mesh.triangles.len() })))
}

fn query(args: &Args) -> anyhow::Result<Timed> {
    let map = fused(args, &frames(args, "lidar_building")?)?;
    let path = args.data.join("grids/w5_queries_1e6x3.f32");
    let numbers = floats(&std::fs::read(&path).with_context(|| path.display().to_string())?);
    let points: Vec<[f64; 3]> =
        numbers.chunks_exact(3).map(|p| [p[0].into(), p[1].into(), p[2].into()]).collect();
    let (seconds, known) =
        timed(args.repeats, || Ok(points.iter().filter(|&&p| map.probability(p).known().is_some()).count()))?;
    Ok((seconds, points.len(), json!({ "known": known })))
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// Samples and shape of a cube of `f32` in numpy's format, the last axis the fastest: as x, y, z here.
fn read_npy(path: &Path) -> anyhow::Result<(Vec<f32>, [usize; 3])> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    ensure!(bytes.starts_with(b"\x93NUMPY") && bytes.len() > 10, "{}: no npy file", path.display());
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let samples = floats(bytes.get(header..).unwrap_or_default());
    let edge = (samples.len() as f64).cbrt().round() as usize;
    if edge.pow(3) != samples.len() {
        bail!("{}: {} samples are no cube", path.display(), samples.len());
    }
    Ok((samples, [edge; 3]))
}

fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
