//! The projection of a range image, made ready for many points.

use super::rings::Rings;
use crate::scan::{Orthographic, Pinhole, Projection, RangeImage};

/// A pinhole, a turning lidar or parallel rays, with the size of their image: where points of the sensor's frame fall.
///
/// | for | question | in |
/// |---|---|---|
/// | distances | places of 64 points, as exact as `f32` is, to interpolate between pixels | `project.rs` |
/// | misses | pixels of 64 points in 1/64 of a pixel, without the second arc tangent | `pixels.rs` |
/// | distances | pixels that a box may fall on | `window.rs` |
/// | misses | pixels that eight balls may fall on | `balls.rs` |
#[derive(Clone, Debug)]
pub(super) struct Projector {
    pub columns: usize,
    pub rows: usize,
    pub kind: Kind,
    /// See [`Projector::openings`], for each row.
    pub openings: Vec<[f32; 2]>,
    projection: Projection,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    Pinhole(Pinhole),
    Spherical(Box<Rings>),
    Parallel { rays: Orthographic, top: f64 },
}

impl Projector {
    /// The projector of an image that fits together ([`RangeImage::check`]). O(rows).
    pub(super) fn of(image: &RangeImage) -> Self {
        let (columns, rows) = (image.columns, image.rows);
        let kind = match &image.projection {
            Projection::Pinhole(camera) => Kind::Pinhole(*camera),
            Projection::Spherical(s) => {
                Kind::Spherical(Box::new(Rings::new(s, columns, image.is_full_turn())))
            }
            Projection::Orthographic { rays, top } => Kind::Parallel { rays: *rays, top: *top },
        };
        let mut projector =
            Self { columns, rows, kind, openings: Vec::new(), projection: image.projection.clone() };
        let turning = matches!(projector.kind, Kind::Spherical(_));
        let opening = |row: usize| projector.opening(if turning { row } else { 0 }).map(|o| o as f32);
        projector.openings = (0..rows).map(opening).collect();
        projector
    }

    /// Whether it is that of an image: most sensors look the same way all day.
    pub(super) fn is_of(&self, image: &RangeImage) -> bool {
        (self.columns, self.rows) == (image.columns, image.rows) && self.projection == image.projection
    }

    /// Whether column 0 is a neighbor of the last one: see [`RangeImage::is_full_turn`].
    #[inline(always)]
    pub(super) fn is_closed(&self) -> bool {
        matches!(&self.kind, Kind::Spherical(rings) if rings.closed)
    }

    /// Columns of a full turn, to the nearest whole one; `None` where the sensor does not turn.
    pub(super) fn columns_of_turn(&self) -> Option<usize> {
        match &self.kind {
            Kind::Spherical(rings) => Some(rings.period.round() as usize),
            _ => None,
        }
    }

    /// By how much the columns of a closed image miss a full turn: less than half a column.
    pub(super) fn misfit(&self) -> f64 {
        match &self.kind {
            Kind::Spherical(rings) if rings.closed => rings.period - self.columns as f64,
            _ => 0.0,
        }
    }

    /// Whether all rays are parallel.
    #[inline(always)]
    pub(super) fn is_parallel(&self) -> bool {
        matches!(self.kind, Kind::Parallel { .. })
    }

    /// How far neighboring rays are apart: columns, and row `row` from the next; radians, meters where rays are parallel.
    #[inline(always)]
    pub(super) fn openings(&self, row: usize) -> [f32; 2] {
        self.openings[row.min(self.rows - 1)]
    }

    fn opening(&self, row: usize) -> [f64; 2] {
        match &self.kind {
            Kind::Pinhole(c) => [c.fx, c.fy].map(|f| 1.0 / f.abs()),
            Kind::Parallel { rays, .. } => rays.step.map(f64::abs),
            Kind::Spherical(rings) => rings.opening(row),
        }
    }

    /// Length of a pixel's ray per unit of its value.
    pub(super) fn stretch(&self, column: usize, row: usize) -> f64 {
        let Kind::Pinhole(c) = &self.kind else { return 1.0 };
        let x = (column as f64 + 1.0 - (c.cx + 1.0)) / c.fx;
        let y = (row as f64 + 1.0 - (c.cy + 1.0)) / c.fy;
        (1.0 + x * x + y * y).sqrt()
    }

    /// A box that holds everything with values up to `depth`, in the sensor's frame; where rays are parallel from `front`
    /// meters before the plane that values are measured from.
    pub(super) fn reach(&self, depth: f64, front: f64) -> ([f64; 3], [f64; 3]) {
        let (w, h) = (self.columns as f64, self.rows as f64);
        match &self.kind {
            Kind::Pinhole(c) => {
                let side = |focal: f64, principal: f64, at: f64| (at - (principal + 1.0)) / focal * depth;
                let x = [side(c.fx, c.cx, 0.0), side(c.fx, c.cx, w + 1.0)];
                let y = [side(c.fy, c.cy, 0.0), side(c.fy, c.cy, h + 1.0)];
                let low = |s: [f64; 2]| s[0].min(s[1]).min(0.0);
                let high = |s: [f64; 2]| s[0].max(s[1]).max(0.0);
                ([low(x), low(y), 0.0], [high(x), high(y), depth])
            }
            Kind::Spherical(_) => ([-depth; 3], [depth; 3]),
            Kind::Parallel { rays, top } => {
                let ends =
                    |k: usize, n: f64| [rays.first[k] - rays.step[k], rays.first[k] + rays.step[k] * n];
                let (x, y) = (ends(0, w), ends(1, h));
                ([x[0].min(x[1]), y[0].min(y[1]), top - depth], [x[0].max(x[1]), y[0].max(y[1]), top + front])
            }
        }
    }
}
