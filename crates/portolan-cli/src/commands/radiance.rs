//! `portolan radiance`: fits a radiance field on a line, shows what it became and why.

mod document;
mod pictures;
mod text;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::ValueEnum;
use portolan::radiance::{
    Channels, Experiment, NAMED_SEEDS, NamedSeed, Optimizer, Outcome, PARKED, Settings, Terms,
};

/// Surfaces nearer than this do not count as empty space, m.
const MARGIN: f64 = 0.3;
/// Steps into the second channel after which its terms are shown.
const BEGUN: usize = 500;

/// The differentiable renderer on a line, as in the last section of the chapter.
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

/// A seed and, where it has one, its name.
#[derive(Clone, Copy, Debug)]
struct Seed {
    value: u64,
    named: Option<NamedSeed>,
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

/// One fit, and how long it took.
struct Run {
    channels: Channels,
    outcome: Outcome,
    elapsed: Duration,
}

/// Why depth alone keeps the density that it parked, and what the second channel does about it.
struct Explanation {
    /// The bin with most density in empty space under depth alone.
    bin: usize,
    /// Its gradient where depth alone ended.
    stuck: Vec<Terms>,
    /// Its gradient a little later, with reflectance in the likelihood.
    begun: Vec<Terms>,
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
    let mut runs = Vec::new();
    for channels in chosen(&args.channels) {
        let begin = Instant::now();
        let outcome = experiment.run(args.seed.value, channels)?;
        runs.push(Run { channels, outcome, elapsed: begin.elapsed() });
    }
    let explanation = explain(&experiment, args.seed.value, &runs)?;

    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}: choose another --out", args.out.display()))?;
    let files = [
        ("density.png", pictures::density(&experiment, args.seed, &runs)),
        ("transmittance.png", pictures::transmittance(&experiment, args.seed, &runs)),
        ("rays.png", pictures::rays(&experiment, args.seed, &runs)),
        ("residuals.png", pictures::residuals(&experiment, args.seed, &runs)),
        ("bias.png", pictures::bias(&experiment)),
        ("radiance.json", document::full(&experiment, args.seed, &runs, explanation.as_ref())?),
    ];
    for (name, bytes) in &files {
        write(&args.out.join(name), bytes)?;
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    if args.json {
        let summary =
            document::summary(&experiment, args.seed, &runs, explanation.as_ref(), &args.out, &names);
        println!("{}", serde_json::to_string_pretty(&summary)?);
    } else if !args.quiet {
        print!("{}", text::report(&experiment, args.seed, &runs, explanation.as_ref()));
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

/// The terms of the worst bin of the fit by depth alone; `None` when that was not run.
fn explain(experiment: &Experiment, seed: u64, runs: &[Run]) -> Result<Option<Explanation>> {
    let Some(stuck) = runs.iter().find(|run| run.channels == Channels::Depth) else { return Ok(None) };
    let Some(bin) = stuck.outcome.worst_bin(&experiment.scene, MARGIN) else { return Ok(None) };
    let start = stuck.outcome.fit.line().clone();
    let begun = Experiment { steps: BEGUN, ..experiment.clone() };
    let begun = begun.run_from(start, seed, Channels::DepthReflectance)?;
    let explanation =
        Explanation { bin, stuck: stuck.outcome.fit.explain(bin), begun: begun.fit.explain(bin) };
    Ok(Some(explanation))
}

/// Writes a file under a temporary name and renames it, so that there is never half of one.
fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".portolan.tmp");
    let temporary = PathBuf::from(temporary);
    let failed = || format!("cannot write {}: choose another --out", path.display());
    fs::write(&temporary, bytes).with_context(failed)?;
    fs::rename(&temporary, path).with_context(failed)
}

fn parse_seed(text: &str) -> Result<Seed, String> {
    if let Some(named) = NAMED_SEEDS.iter().find(|named| named.name == text) {
        return Ok(Seed { value: named.seed, named: Some(*named) });
    }
    let names: Vec<&str> = NAMED_SEEDS.iter().map(|named| named.name).collect();
    let value = text.parse().map_err(|_| format!("not a number, nor one of {}", names.join(", ")))?;
    Ok(Seed { value, named: NAMED_SEEDS.iter().find(|named| named.seed == value).copied() })
}

fn help() -> String {
    let mut text = "Named seeds:\n".to_owned();
    for named in NAMED_SEEDS {
        text += &format!("  {:15} {}\n", named.name, named.shows);
    }
    text + "\nExample:\n  portolan radiance --out out/radiance --seed parked --channels depth,depth-reflectance"
}

/// Name of a set of channels, as on the command line.
fn name(channels: Channels) -> &'static str {
    match channels {
        Channels::Depth => "depth",
        Channels::DepthReflectance => "depth-reflectance",
        Channels::DepthReflectanceSpread => "depth-reflectance-spread",
    }
}

/// The same in words.
fn title(channels: Channels) -> &'static str {
    match channels {
        Channels::Depth => "depth alone",
        Channels::DepthReflectance => "depth and reflectance",
        Channels::DepthReflectanceSpread => "depth, reflectance and spread",
    }
}
