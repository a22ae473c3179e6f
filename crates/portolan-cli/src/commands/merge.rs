//! `merge`: maps of sums into one, or out of one.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use portolan::cell::Sign;
use portolan_io::{
    Container, LedgerFile, Manifest, MapHeader, add_ledger_files, map_dimension, scans_of_sum, write_atomic,
};
use serde_json::{Map, Value, json};

use crate::arguments::bytes;
use crate::dimension::Dimension;
use crate::folder::Results;
use crate::json;
use crate::mapping::{
    ARTIFACTS, Artifacts, Derived, Settings, TOO_LARGE, Written, is_about_memory, peak_memory, title,
};
use crate::output::Output;
use crate::saved::{SavedMap, in_words_of_copies};
use crate::stop;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  portolan map LOG --resolution 0.05 --shard 1/2 --out part1\n  \
                  portolan map LOG --resolution 0.05 --shard 2/2 --out part2\n  \
                  portolan merge part1 part2 --out whole\n  portolan merge whole --without part2 --out rest")]
pub(crate) struct Args {
    /// Maps made with --ledger or --shard, or their folders
    #[arg(required = true, value_name = "MAP")]
    parts: Vec<PathBuf>,
    /// Take the scans of this map out; may be given several times
    #[arg(long, value_name = "MAP")]
    without: Vec<PathBuf>,
    /// Folder for the results; created if missing. A map that is there is not replaced without --overwrite
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the map in DIR, and what was written with it
    #[arg(long)]
    overwrite: bool,
    /// Write the map alone, without mesh, contour, distances and pictures
    #[arg(long)]
    map_only: bool,
    /// Memory for the maps, with suffix K, M or G
    #[arg(long, value_name = "BYTES", value_parser = bytes, default_value = "4G")]
    memory: u64,
    #[command(flatten)]
    output: Output,
}

/// Adds maps up.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let start = Instant::now();
    let mut results = Results::claim(&args.out, "merge", &ARTIFACTS)?;
    if !args.overwrite {
        results.refuse_to_replace()?;
    }
    let files: Vec<(PathBuf, Sign)> = args.files();
    let dimension = match map_dimension(&Container::open(&files[0].0)?)? {
        3 => Dimension::Three,
        _ => Dimension::Two,
    };
    let copies = match dimension {
        Dimension::Two => add::<2>(args, &files, dimension, &mut results)?,
        Dimension::Three => add::<3>(args, &files, dimension, &mut results)?,
    };
    results.publish()?;
    stop::leaves(format!(
        "{} is saved, the files around it are not whole",
        args.out.join("map.portolan").display()
    ));
    let added = start.elapsed().as_secs_f64();
    let derived = Derivatives::of(args, dimension)?;
    let mut written = derived.written;
    written.files.extend(["summary.json", Manifest::NAME]);
    written.notes.extend(copies);
    let header = derived.header;
    let document = json!({
        "program": concat!("portolan ", env!("CARGO_PKG_VERSION")),
        "merged": args.parts.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
        "without": args.without.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
        "logs": header.logs,
        "scans": header.scans,
        "settings": header.settings,
        "statistics": header.statistics,
        "bytes": derived.bytes,
        "peak_memory": peak_memory(),
        "warnings": written.notes,
        "files": written.files,
        "seconds": { "merge": added, "total": start.elapsed().as_secs_f64() },
    });
    write_atomic(args.out.join("summary.json"), |w| writeln!(w, "{document:#}"))?;
    results.complete(&written.files)?;
    let text = format!(
        "{} scans of {}, added up in {added:.2} s\n{}wrote {} to {}\n",
        header.scans,
        if header.logs.is_empty() { "no log".to_owned() } else { header.logs.join(", ") },
        written.notes.iter().map(|note| format!("warning: {note}\n")).collect::<String>(),
        written.files.join(", "),
        args.out.display(),
    );
    args.output.print(&document, text)
}

impl Args {
    /// What is added, then what is taken out.
    fn files(&self) -> Vec<(PathBuf, Sign)> {
        let file = |path: &PathBuf| if path.is_dir() { path.join("map.portolan") } else { path.clone() };
        let plus = self.parts.iter().map(|path| (file(path), Sign::Plus));
        plus.chain(self.without.iter().map(|path| (file(path), Sign::Minus))).collect()
    }
}

/// Writes the sum of the maps.
/// Returns what is to be said of its scans.
fn add<const D: usize>(
    args: &Args,
    files: &[(PathBuf, Sign)],
    dimension: Dimension,
    results: &mut Results,
) -> anyhow::Result<Option<String>> {
    let mut opened = Vec::new();
    for (path, sign) in files {
        let Some(file) = LedgerFile::<D>::open(path, args.memory)? else {
            bail!(
                "{}: a map of clamped cells, which do not add up; make it with `map --ledger` or --shard",
                path.display()
            );
        };
        opened.push((file, *sign));
    }
    let mut header = opened[0].0.header.clone();
    for ((part, sign), (path, _)) in opened.iter().zip(files).skip(1) {
        add_headers(&mut header, &part.header, path, *sign, dimension)?;
    }
    let scans = scans_of_sum(&opened)?;
    header.logs = scans.logs().map(str::to_owned).collect();
    header.scans = scans.len() as u64;
    add_ledger_files(&opened, &header, &results.map_file()?)?;
    Ok(in_words_of_copies(scans.copies()))
}

/// Settings must be the same, as far as they shape evidence; counts add up.
fn add_headers(
    sum: &mut MapHeader,
    part: &MapHeader,
    path: &Path,
    sign: Sign,
    dimension: Dimension,
) -> anyhow::Result<()> {
    let ours = Settings::of_saved(&sum.settings).resolved(dimension);
    ours.check_agree(&part.settings, &path.display().to_string())?;
    agree_on_the_rest(&mut sum.settings, &part.settings, path)?;
    if (sum.hold_out, sum.every) != (part.hold_out, part.every) {
        bail!("{}: other scans were left out than in the first map (--every, --hold-out)", path.display());
    }
    match sign {
        Sign::Minus => json::take_counts(&mut sum.statistics, &part.statistics),
        Sign::Plus => json::add_counts(&mut sum.statistics, &part.statistics),
    }
    Ok(())
}

/// What is said of how logs were read is left out of the sum where it differs; what is to be derived must be the same, or the sum
/// would depend on the order of its parts.
fn agree_on_the_rest(
    sum: &mut Map<String, Value>,
    part: &Map<String, Value>,
    path: &Path,
) -> anyhow::Result<()> {
    const OF_LOGS: [&str; 3] = ["no_return", "no_return_free", "shift"];
    for key in OF_LOGS {
        if sum.get(key) != part.get(key) {
            sum.remove(key);
        }
    }
    let keys = sum.keys().chain(part.keys()).filter(|key| !OF_LOGS.contains(&key.as_str()));
    match keys.into_iter().find(|key| sum.get(*key) != part.get(*key)) {
        Some(key) => {
            let [ours, theirs] = [sum, part].map(|s| s.get(key).unwrap_or(&Value::Null).clone());
            bail!("{}: {key} is {theirs} there and {ours} in the first map", path.display())
        }
        None => Ok(()),
    }
}

/// What follows from the sum.
struct Derivatives {
    header: MapHeader,
    bytes: BTreeMap<&'static str, usize>,
    written: Written,
}

impl Derivatives {
    /// Files beside the map, unless only the map is wanted, or it takes more memory than allowed.
    fn of(args: &Args, dimension: Dimension) -> anyhow::Result<Self> {
        let path = args.out.join("map.portolan");
        if args.map_only {
            return Self::of_map_alone(args, dimension);
        }
        let file = match SavedMap::read(&path, args.memory) {
            Ok(file) => file,
            Err(error) if is_about_memory(&error) => {
                let mut alone = Self::of_map_alone(args, dimension)?;
                alone.written.notes.push(TOO_LARGE.to_owned());
                return Ok(alone);
            }
            Err(error) => return Err(error),
        };
        let settings = Settings::of_saved(&file.header().settings).resolved(dimension);
        let memory = usize::try_from(args.memory).unwrap_or(usize::MAX);
        let derived = Derived::of(&file, &settings, memory);
        let header = file.header().clone();
        let title = title(&header.logs, settings.resolution(), header.scans);
        let (dense, camera) = (None, false);
        let artifacts = Artifacts {
            file: &file,
            derived: &derived,
            dense,
            edge: settings.resolution(),
            camera,
            movers: None,
            sigma: None,
            title,
        };
        let mut bytes = file.bytes();
        bytes.extend(derived.bytes());
        Ok(Self { header, bytes, written: artifacts.write(&args.out)? })
    }

    fn of_map_alone(args: &Args, dimension: Dimension) -> anyhow::Result<Self> {
        let path = args.out.join("map.portolan");
        let header = match dimension {
            Dimension::Two => LedgerFile::<2>::open(&path, args.memory)?.map(|file| file.header),
            Dimension::Three => LedgerFile::<3>::open(&path, args.memory)?.map(|file| file.header),
        };
        Ok(Self {
            header: header.unwrap_or_default(),
            bytes: BTreeMap::new(),
            written: Written::of_map_alone(),
        })
    }
}
