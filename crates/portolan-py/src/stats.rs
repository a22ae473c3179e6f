//! What a scan did, as a dictionary.

use portolan::scan::ScanStats;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Counts of scans, beams by kind, refused readings and cell observations.
pub(crate) fn counts<'py>(py: Python<'py>, stats: &ScanStats) -> PyResult<Bound<'py, PyDict>> {
    let (beams, refused) = (stats.beams, stats.refused.total());
    let counts = PyDict::new(py);
    for (name, count) in [
        ("scans", stats.scans),
        ("hits", beams.hit),
        ("max_range", beams.max_range),
        ("no_return", beams.no_return),
        ("dropped", beams.dropped),
        ("self_hits", beams.self_hit),
        ("movers", beams.mover),
        ("refused_readings", refused),
        ("refused_poses", stats.refused_poses),
        ("hits_outside", stats.hits_outside),
        ("cells", stats.cells),
    ] {
        counts.set_item(name, count)?;
    }
    Ok(counts)
}
