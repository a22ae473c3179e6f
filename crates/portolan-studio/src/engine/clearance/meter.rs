//! The ‖∇d‖ meter: a distance field has gradients of length one, whatever else it is.

use portolan::geom::vector::norm;
use serde::Serialize;

use super::ask::Which;
use super::fields::Fields;

/// Width of a bin (per meter of distance: none).
const BIN: f64 = 0.05;
/// Bins; the last holds everything beyond.
const BINS: usize = 31;
/// Corners that are looked at, at most: every second, third ... row and column where there are more.
const MOST: usize = 1 << 20;

/// How long gradients are, at the corners between four known cells: there the interpolant leans to no side.
#[derive(Debug, Serialize)]
pub(super) struct Meter {
    /// Corners.
    pub(super) corners: usize,
    /// Width of a bin.
    pub(super) bin: f64,
    pub(super) truncated: Norms,
    pub(super) euclidean: Norms,
}

/// Of one field.
#[derive(Debug, Serialize)]
pub(super) struct Norms {
    /// `null` where there is no corner.
    pub(super) median: Option<f64>,
    /// Corners by the length of their gradient.
    pub(super) counts: Vec<u32>,
}

/// Looks at both fields at the same corners.
pub(super) fn meter(fields: &Fields) -> Meter {
    let grid = fields.grid();
    let [width, height] = grid.shape;
    let step = ((width * height).div_ceil(MOST) as f64).sqrt().ceil().max(1.0) as usize;
    let rows = (1..height).step_by(step);
    let corners = rows.flat_map(|y| (1..width).step_by(step).map(move |x| [x as i32, y as i32]));
    let points: Vec<[f64; 2]> = corners.map(|c| grid.lattice.corner(c)).collect();
    let kept = fields.gradients(Which::Truncated, &points);
    let exact = fields.gradients(Which::Euclidean, &points);
    let both = kept.into_iter().zip(exact).filter_map(|(a, b)| Some((norm(a?), norm(b?))));
    let (truncated, euclidean): (Vec<f64>, Vec<f64>) = both.unzip();
    Meter {
        corners: truncated.len(),
        bin: BIN,
        truncated: Norms::of(truncated),
        euclidean: Norms::of(euclidean),
    }
}

impl Norms {
    fn of(mut lengths: Vec<f64>) -> Self {
        let mut counts = vec![0; BINS];
        for length in &lengths {
            counts[((length / BIN) as usize).min(BINS - 1)] += 1;
        }
        lengths.sort_unstable_by(f64::total_cmp);
        Self { median: lengths.get(lengths.len() / 2).copied(), counts }
    }
}
