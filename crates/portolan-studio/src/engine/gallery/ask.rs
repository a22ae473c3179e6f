//! What the gallery can be asked.

use portolan_chapter::gallery::Workload;
use serde::Deserialize;

/// A question. The representations are of the scans that the view of fusion holds.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(in crate::engine) enum Ask {
    /// All representations, built and measured where that was not done yet.
    Open {
        /// The number of what the page shows already: that is not sent again.
        have: Option<u64>,
    },
    /// Measures one workload now.
    Run {
        /// Which.
        workload: Workload,
        /// Points to ask at, 100 to 300,000; searches get a fiftieth.
        probes: usize,
    },
    /// What every representation answers there.
    Answers {
        /// World (meters).
        at: [f64; 2],
    },
    /// Fuses trees over leaves of other sizes: the formula's line and what is measured.
    Trees {},
}
