//! How sure a surface is, by the beginning and the end of a log that are mapped as the map was.

use std::path::Path;

use anyhow::{anyhow, bail};
use portolan_io::MapHeader;
use serde_json::json;

use super::{Args, Part};
use crate::dimension::Dimension;
use crate::log::{self, Log, Selection, Wanted};
use crate::mapping::{LedgerRun, Limits, Looking, MapKind, Run, Settings};
use crate::progress::Progress;

/// Maps the distances of a log as sums, with the settings of a map, and tells how sure its surface is. Nothing is written.
pub(super) fn part(
    args: &Args,
    path: &Path,
    header: &MapHeader,
    dimension: Dimension,
) -> anyhow::Result<Part> {
    let mut settings = Settings::of_saved(&header.settings);
    settings.maps = vec![MapKind::Tsdf];
    settings.shape.ledger = true;
    let range = &mut settings.shape.range;
    range.min_range = args.limits.range.min_range.or(range.min_range);
    range.max_range = args.limits.range.max_range.or(range.max_range);
    let no_return = &mut settings.no_return.no_return;
    *no_return = args.limits.no_return.no_return.or(*no_return);
    let settings = settings.resolved(dimension);
    let deskew = settings.shape.deskew;
    let log = match dimension {
        Dimension::Two => Log::Two(Box::new(log::read_2d(path, &args.source, deskew)?)),
        Dimension::Three => {
            let wanted = Wanted { color: false, deskew, points_only: false };
            Log::Three(Box::new(log::read_3d(path, &args.source, wanted)?))
        }
    };
    let name = path.display().to_string();
    let (all, _) = Selection { every: args.every.or(header.every), hold_out: None }.split(log.len());
    // What one map of the log takes, three times over at most: nothing is put aside on the disk here.
    let limits = Limits { memory: usize::MAX, log: &name, map: &name };
    let mut run = Run::Sums(Box::new(LedgerRun::new(&log, &all, &settings, None, &limits)?));
    if let Some(pose_sigma) = settings.shape.movers {
        let progress = Progress::new(all.len(), "looking for what moved", args.output);
        run.look(&Looking { pose_sigma, indices: &all, memory: usize::MAX, progress: &progress })?;
    }
    let progress = Progress::new(run.scans(), "fusing", args.output);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let report = run.fuse(threads, &progress);
    drop(progress);
    if let Some(why) = report.full.or(report.contradiction) {
        bail!("{name}: {why}");
    }
    let calibration = match report.sigma {
        Some(Ok(calibration)) => calibration,
        Some(Err(why)) => return Err(anyhow!("{name}: how sure the surface is cannot be told: {why}")),
        None => bail!("{name}: no sums were made"),
    };
    let mut value = calibration.to_json();
    value["log"] = json!(name);
    value["scans"] = json!(report.stats.scans);
    let text = format!(
        "{}; the fit is to half of the bricks, the table of the other half:\n{}",
        calibration.in_words(),
        calibration.table()
    );
    Ok(Part { key: "sigma", value, text })
}
