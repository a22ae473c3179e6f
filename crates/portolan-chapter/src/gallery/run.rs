//! Builds every representation from one log and measures it.

use super::against_truth::hold_against_truth;
use super::asker::{Asker, candidates, observed_free};
use super::build::build;
use super::foretold::foretold;
use super::measured::{Gallery, GallerySettings};
use super::probes::{Clock, points};
use super::row::Workload;
use portolan::geom::Pose;
use portolan::map::MapError;
use portolan::scan::Scan;
use portolan_sim::Truth;

/// Runs the whole comparison. Scans are fused one after the other on the calling thread.
///
/// # Errors
/// Where the settings are not possible.
pub fn run(
    log: &[(Pose<2>, Scan<2>)],
    settings: &GallerySettings,
    truth: Option<&dyn Truth<2>>,
    clock: &mut Clock<'_>,
) -> Result<Gallery, MapError> {
    let grid = settings.grid;
    let mut gallery = build(log, settings, clock)?;
    if let Some(foretold) = foretold(log, settings)? {
        // The first rows are those of the maps that foretell.
        gallery.rows.iter_mut().zip(foretold).for_each(|(row, told)| row.foretold = Some(told));
    }
    let everywhere = points(&grid.aabb(), settings.probes);
    let min_weight = settings.esdf.min_weight.unwrap_or(gallery.tsdf.min_weight());
    let free = observed_free(&gallery.tsdf, candidates(&grid), min_weight, truth);
    hold_against_truth(&mut gallery, &Asker { truth, free, everywhere: &everywhere, grid });
    for workload in Workload::ALL {
        gallery.measure(workload, settings.probes, clock);
    }
    Ok(gallery)
}
