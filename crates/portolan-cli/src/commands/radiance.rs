//! `portolan radiance`: fits a radiance field on a line, shows what it became and why.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::ValueEnum;
use portolan_chapter::radiance::{Channels, Experiment, NAMED_SEEDS, Optimizer, PARKED, Settings};
use portolan_chapter::radiance_report::{Comparison, Seed};
use portolan_io::write_atomic;

/// The differentiable renderer on a line, as in the textbook's last section.
///
/// Ten rays in a corridor of 80 bins, three of them held out, are fitted through the renderer by gradient
/// descent. Writes density, transmittance, rays, residuals and the bias of depth as PNG, and all numbers as
/// radiance.json.
#[derive(Debug, clap::Args)]
#[command(after_help = help())]
pub(crate) struct Args {
    /// Folder to write into; made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seed of noise and start: a number, or the name of one that is worth seeing.
    #[arg(long, default_value = PARKED.name, value_parser = parse_seed)]
    seed: Seed,
    /// What is measured along a ray; several, separated by commas, are compared.
    #[arg(long, value_delimiter = ',', default_value = "depth,depth-reflectance,depth-reflectance-spread")]
    channels: Vec<ChannelsArg>,
    /// Steps of the optimiser; the named seeds are for the default.
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    steps: u32,
    /// How steps are made.
    #[arg(long, value_enum, default_value_t = OptimizerArg::GradientDescent)]
    optimizer: OptimizerArg,
    /// Write one JSON document to stdout and nothing else.
    #[arg(long)]
    json: bool,
    /// Write no text to stdout.
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum ChannelsArg {
    /// Depth alone.
    Depth,
    /// Depth and reflectance.
    DepthReflectance,
    /// Depth, reflectance, and how far the return is spread along the ray.
    DepthReflectanceSpread,
}

impl From<ChannelsArg> for Channels {
    fn from(arg: ChannelsArg) -> Self {
        match arg {
            ChannelsArg::Depth => Self::Depth,
            ChannelsArg::DepthReflectance => Self::DepthReflectance,
            ChannelsArg::DepthReflectanceSpread => Self::DepthReflectanceSpread,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OptimizerArg {
    /// Plain gradient descent.
    GradientDescent,
    /// Adam: finds its way more often, for the wrong reasons as well as the right ones.
    Adam,
}

/// Runs the command.
///
/// # Errors
/// When the folder cannot be written.
#[allow(clippy::print_stdout, reason = "the command line is where portolan speaks")]
pub(crate) fn run(args: &Args) -> Result<()> {
    let optimizer = match args.optimizer {
        OptimizerArg::GradientDescent => Settings::default().optimizer,
        OptimizerArg::Adam => Optimizer::adam(0.02),
    };
    let experiment = Experiment {
        steps: args.steps as usize,
        settings: Settings { optimizer, ..Settings::default() },
        ..Experiment::default()
    };
    let start = Instant::now();
    let mut clock = || start.elapsed().as_secs_f64();
    let comparison = Comparison::new(experiment, args.seed, &chosen(&args.channels), &mut clock)?;

    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}: choose another --out", args.out.display()))?;
    let files = comparison.files()?;
    for (name, bytes) in &files {
        write_atomic(args.out.join(name), |w| w.write_all(bytes))?;
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    if args.json {
        println!("{}", serde_json::to_string_pretty(&comparison.summary(&args.out, &names))?);
    } else if !args.quiet {
        print!("{}", comparison.text());
        println!("\nwrote {} to {}", names.join(", "), args.out.display());
    }
    Ok(())
}

/// Each set of channels once, in the order given.
fn chosen(args: &[ChannelsArg]) -> Vec<Channels> {
    let mut channels: Vec<Channels> = Vec::new();
    for arg in args {
        if !channels.contains(&(*arg).into()) {
            channels.push((*arg).into());
        }
    }
    channels
}

fn parse_seed(text: &str) -> Result<Seed, String> {
    if let Some(named) = NAMED_SEEDS.iter().find(|named| named.name == text) {
        return Ok(Seed { value: named.seed, named: Some(*named) });
    }
    let names: Vec<&str> = NAMED_SEEDS.iter().map(|named| named.name).collect();
    let value = text.parse().map_err(|_| format!("not a number, nor one of {}", names.join(", ")))?;
    Ok(Seed::of(value))
}

fn help() -> String {
    let mut text = "Named seeds:\n".to_owned();
    for named in NAMED_SEEDS {
        text += &format!("  {:15} {}\n", named.name, named.shows);
    }
    text + "\nExample:\n  portolan radiance --out out/radiance --seed parked --channels depth,depth-reflectance"
}
