//! Pixels that a box may fall on.

use super::projector::{Kind, Projector};

/// Pixels, the border counted, both ends included. A window may pass the seam of a closed image: its last column is then
/// counted on past the border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub columns: [usize; 2],
    pub rows: [usize; 2],
}

impl Projector {
    /// Smallest and largest value that a pixel would have whose surface were in the box of [`Projector::window`]; `ranges`:
    /// how near and far the box is.
    #[inline]
    pub(super) fn depth(&self, center: [f64; 3], half: [f64; 3], ranges: impl Fn() -> [f64; 2]) -> [f64; 2] {
        match &self.kind {
            Kind::Pinhole(_) => [center[2] - half[2], center[2] + half[2]],
            Kind::Spherical(_) => ranges(),
            Kind::Parallel { top, .. } => [top - center[2] - half[2], top - center[2] + half[2]],
        }
    }

    /// Where a box can fall: `center` and half edges `half` along the sensor's axes hold it. `None`: not into the image.
    pub(super) fn window(&self, center: [f64; 3], half: [f64; 3]) -> Option<Window> {
        let [u, v] = match &self.kind {
            Kind::Pinhole(c) => {
                let (front, back) = (center[2] - half[2], center[2] + half[2]);
                if back <= 0.0 {
                    return None;
                }
                let (per_front, per_back) = (1.0 / front, 1.0 / back);
                let side = |k: usize, focal: f64, principal: f64| {
                    if front <= 1e-9 {
                        return [f64::NEG_INFINITY, f64::INFINITY];
                    }
                    let (low, high) = (center[k] - half[k], center[k] + half[k]);
                    let low = low * if low < 0.0 { per_front } else { per_back };
                    let high = high * if high < 0.0 { per_back } else { per_front };
                    let (a, b) = (focal * low + (principal + 1.0), focal * high + (principal + 1.0));
                    [a.min(b), a.max(b)]
                };
                [side(0, c.fx, c.cx), side(1, c.fy, c.cy)]
            }
            Kind::Spherical(rings) => rings.window(center, half),
            Kind::Parallel { rays, .. } => [0, 1].map(|k| {
                let at = |x: f64| (x - rays.first[k]) / rays.step[k] + 1.0;
                let (a, b) = (at(center[k] - half[k]), at(center[k] + half[k]));
                [a.min(b), a.max(b)]
            }),
        };
        /// Rounding of the lanes (pixels).
        const SLACK: f64 = 0.02;
        let rows = clamped(v[0] - SLACK, v[1] + SLACK, self.rows)?;
        let columns = if self.is_closed() {
            let (turn, slack) = (self.columns as f64, SLACK + self.misfit().abs());
            if u[1] - u[0] + 2.0 * slack >= turn - 2.0 {
                [0, self.columns + 1]
            } else {
                let turns = ((u[0] - slack - 1.0) / turn).floor() * turn;
                let first = (u[0] - slack - turns).floor().max(0.0);
                [first as usize, (u[1] + slack - turns).floor() as usize + 1]
            }
        } else {
            clamped(u[0] - SLACK, u[1] + SLACK, self.columns)?
        };
        Some(Window { columns, rows })
    }
}

/// Pixels around `low..=high`, on an axis of `n` pixels and a border of one; `None` where no pixel is near.
fn clamped(low: f64, high: f64, n: usize) -> Option<[usize; 2]> {
    let last = n as f64 + 1.0;
    // What is not negative is rounded down by truncation; `floor` is a call on baseline x86-64.
    (high >= 0.5 && low <= last - 0.5)
        .then(|| [low.clamp(0.0, last) as usize, (high.clamp(0.0, last) as usize + 1).min(n + 1)])
}
