//! Optimizes a g2o file from every start there is: `cargo run --release -p portolan-graph --example solve -- FILE`.

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, Write};
use std::time::Instant;

use portolan_graph::{AnyGraph, Chain, PoseGraph, Settings, read_g2o};

fn main() -> Result<(), Box<dyn Error>> {
    let settings = |tolerance| Settings { relative_tolerance: tolerance, ..Settings::default() };
    for path in std::env::args().skip(1) {
        let clock = Instant::now();
        let file = read_g2o(BufReader::new(File::open(&path)?), &path)?;
        writeln!(std::io::stdout(), "{path}: read in {:.1} ms", 1e3 * clock.elapsed().as_secs_f64())?;
        for tolerance in [Settings::default().relative_tolerance, 1e-12] {
            let settings = settings(tolerance);
            match &file.graph {
                AnyGraph::Se2(graph) => solve(graph, &settings)?,
                AnyGraph::Se3(graph) => solve(graph, &settings)?,
            }
        }
    }
    Ok(())
}

fn solve<const D: usize>(graph: &PoseGraph<D>, settings: &Settings) -> Result<(), Box<dyn Error>> {
    for start in ["given", "odometry", "shortest", "chordal"] {
        let mut graph = graph.clone();
        let clock = Instant::now();
        match start {
            "odometry" => graph.start_from_tree(Chain::Odometry),
            "shortest" => graph.start_from_tree(Chain::Shortest),
            "chordal" => graph.start_from_chordal()?,
            _ => {}
        }
        let started = clock.elapsed().as_secs_f64();
        let report = graph.optimize(settings)?;
        writeln!(
            std::io::stdout(),
            "  {start:9} {:14.6} -> {:14.9}  {:3} iterations, {:?}, start {:.1} ms, all {:.1} ms, {} factor blocks",
            report.chi_square[0],
            graph.chi_square(),
            report.iterations,
            report.stop,
            1e3 * started,
            1e3 * clock.elapsed().as_secs_f64(),
            report.factor_blocks,
        )?;
    }
    Ok(())
}
