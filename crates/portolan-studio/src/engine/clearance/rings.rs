//! Rings of equal distance.

use portolan::surface::{Ambiguity, level_set};
use serde_json::json;

use super::ask::Which;
use super::fields::Fields;
use crate::engine::fusion::frame::Lines;
use crate::engine::{Refusal, Reply};

/// Levels, at most.
const MOST_LEVELS: f64 = 200.0;
/// Cells that are looked at for all levels together, at most.
const MOST_CELLS: f64 = 4e8;

/// Rings at all multiples of `spacing` but zero, which is the contour. Where that would be more of them than anyone can
/// see, the spacing is doubled until it is not; the answer has the spacing that was used.
pub(super) fn rings(fields: &Fields, which: Which, spacing: f64) -> Result<Reply, Refusal> {
    if !(0.01..=100.0).contains(&spacing) {
        return Err(Refusal::new(format!("rings are from 0.01 to 100 m apart, not {spacing}")));
    }
    let samples = fields.samples(which);
    let known = || (0..samples.len()).filter(|&i| fields.is_known(which, i)).map(|i| samples[i]);
    let (low, high) = known().fold((0.0f64, 0.0f64), |(l, h), d| (l.min(d.into()), h.max(d.into())));
    let most = MOST_LEVELS.min(MOST_CELLS / samples.len().max(1) as f64).max(1.0);
    let mut spacing = spacing;
    while (high - low) / spacing > most {
        spacing *= 2.0;
    }
    let (first, last) = ((low / spacing).ceil() as i32, (high / spacing).floor() as i32);
    let (mut all, mut levels) = (Vec::new(), Vec::new());
    let mut shifted = vec![0.0f32; samples.len()];
    for level in (first..=last).filter(|&k| k != 0).map(|k| f64::from(k) * spacing) {
        for (to, &d) in shifted.iter_mut().zip(samples) {
            *to = (f64::from(d) - level) as f32;
        }
        // Next to where a field is a constant no ring is drawn: it would follow that border, not a distance.
        let ring = level_set(fields.grid(), &shifted, |i| fields.is_known(which, i), Ambiguity::Decide);
        let lines = ring.polylines();
        levels.extend(std::iter::repeat_n(level as f32, lines.len()));
        all.extend(lines);
    }
    let lines = Lines::of(&all);
    Ok(Reply::of(json!({ "spacing": spacing, "largest": high }))?
        .with("points", lines.points)
        .with("starts", lines.starts)
        .with("levels", levels))
}
