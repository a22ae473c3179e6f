//! What is measured of one representation.

use super::Foretold;
use portolan_sim::ErrorSummary;
use serde::{Deserialize, Serialize};

/// Time of one operation (seconds) and how it is done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// Seconds an operation.
    pub seconds: f64,
    /// How, where it is no direct answer: "ring search", "brute force".
    pub by: Option<&'static str>,
}

impl Cost {
    pub(super) fn direct(seconds: f64) -> Option<Self> {
        Some(Self { seconds, by: None })
    }

    pub(super) fn by(seconds: f64, by: &'static str) -> Option<Self> {
        Some(Self { seconds, by: Some(by) })
    }
}

/// One representation of the gallery; `None` where it cannot answer, or, for errors, without a truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// What it is.
    pub name: String,
    /// Bytes, measured.
    pub memory_bytes: usize,
    /// The bytes come on top of the TSDF that it is derived from.
    pub derived: bool,
    /// Fusing one scan; for derived fields a full rebuild.
    pub update: Option<Cost>,
    /// "Is this point occupied?"
    pub occupancy: Option<Cost>,
    /// "How far to the nearest surface?"
    pub distance: Option<Cost>,
    /// "Give me the boundary as polylines."
    pub surface: Option<Cost>,
    /// Share of wrong answers to the first question, among those given more than half a cell from a true
    /// surface.
    pub occupancy_wrong: Option<f64>,
    /// Error of the second answer against the true distance (meters), at observed free points.
    pub distance_error: Option<ErrorSummary>,
    /// Distance of the extracted surface from the true one (meters).
    pub surface_error: Option<ErrorSummary>,
    /// How well ranges of scans that were held out are foretold; `None` also where there were too few scans to hold any out.
    pub foretold: Option<Foretold>,
    /// A number worth telling: nodes, segments, points.
    pub note: String,
}

/// The three questions.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Workload {
    /// Occupancy probes.
    Occupancy,
    /// Distance probes.
    Distance,
    /// Surface extraction.
    Surface,
}

impl Workload {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Occupancy, Self::Distance, Self::Surface];

    /// A name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Occupancy => "occupancy",
            Self::Distance => "distance",
            Self::Surface => "surface",
        }
    }

    /// The cost of this workload in a row.
    pub fn cost(self, row: &Row) -> Option<Cost> {
        match self {
            Self::Occupancy => row.occupancy,
            Self::Distance => row.distance,
            Self::Surface => row.surface,
        }
    }

    pub(super) fn cost_mut(self, row: &mut Row) -> &mut Option<Cost> {
        match self {
            Self::Occupancy => &mut row.occupancy,
            Self::Distance => &mut row.distance,
            Self::Surface => &mut row.surface,
        }
    }
}

/// Costs within this factor of the best are called level: they change places between runs.
pub const LEVEL: f64 = 1.3;

/// The cheapest representation for a workload.
#[derive(Clone, Debug, PartialEq)]
pub struct Winner {
    /// The workload.
    pub workload: Workload,
    /// Index of the row.
    pub row: usize,
    /// All rows whose cost is within [`LEVEL`] times the cheapest one's, that one first, then in the order of their cost.
    pub level: Vec<usize>,
    /// How many times dearer the first row is that is not level; `None` where the winner costs nothing or all are level.
    pub ahead: Option<f64>,
}

/// Who wins each workload, and the rows that are not even level with a winner.
pub(super) fn winners(rows: &[Row]) -> (Vec<Winner>, Vec<usize>) {
    let winners: Vec<Winner> = Workload::ALL
        .into_iter()
        .filter_map(|workload| {
            let mut costs: Vec<(usize, f64)> =
                rows.iter().enumerate().filter_map(|(i, r)| Some((i, workload.cost(r)?.seconds))).collect();
            costs.sort_by(|a, b| a.1.total_cmp(&b.1));
            let (row, best) = *costs.first()?;
            let (level, behind) = costs.split_at(costs.partition_point(|c| c.1 <= LEVEL * best));
            let ahead = behind.first().filter(|_| best > 0.0).map(|next| next.1 / best);
            Some(Winner { workload, row, level: level.iter().map(|c| c.0).collect(), ahead })
        })
        .collect();
    let never = (0..rows.len()).filter(|i| winners.iter().all(|w| !w.level.contains(i))).collect();
    (winners, never)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(occupancy: f64, surface: Option<f64>) -> Row {
        let surface = surface.and_then(Cost::direct);
        Row { occupancy: Cost::direct(occupancy), surface, ..Default::default() }
    }

    #[test]
    fn costs_within_what_runs_differ_by_are_level() {
        let rows = [row(1.2e-9, None), row(5e-9, Some(2.0)), row(1e-9, Some(0.0)), row(1.31e-9, Some(1.0))];
        let (winners, never) = winners(&rows);
        assert_eq!((winners[0].row, &winners[0].level[..]), (2, &[2, 0][..]));
        assert!((winners[0].ahead.unwrap() - 1.31).abs() < 1e-12);
        assert_eq!((winners[1].workload, winners[1].row), (Workload::Surface, 2));
        assert_eq!((&winners[1].level[..], winners[1].ahead), (&[2][..], None));
        assert_eq!((winners.len(), never), (2, vec![1, 3]));
    }
}
