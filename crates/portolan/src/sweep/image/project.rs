//! Points to places between pixels, 64 at a time: what distances are interpolated at.

use super::lanes::{Gradients, LANES, Lanes, Projected, Steps};
use super::projector::{Kind, Projector};

/// The truncation is measured across surfaces, up to this cosine of the incidence (66 degrees).
pub(super) const LEAST_COSINE: f32 = 0.4;

impl Projector {
    /// Projects points of the sensor's frame. What falls outside lands on the border.
    #[inline(always)]
    pub(super) fn project(&self, p: &[Lanes; 3]) -> Projected {
        let mut out =
            Projected { u: [0.0; LANES], v: [0.0; LANES], length: [0.0; LANES], scale: [1.0; LANES] };
        match &self.kind {
            Kind::Pinhole(c) => {
                let [fx, fy] = [c.fx as f32, c.fy as f32];
                let [cx, cy] = [(c.cx + 1.0) as f32, (c.cy + 1.0) as f32];
                for l in 0..LANES {
                    let (x, y, z) = (p[0][l], p[1][l], p[2][l]);
                    let inverse = 1.0 / z;
                    out.u[l] = if z > 0.0 { fx * x * inverse + cx } else { 0.0 };
                    out.v[l] = fy * y * inverse + cy;
                    out.length[l] = (x * x + y * y + z * z).sqrt();
                    out.scale[l] = out.length[l] * inverse;
                }
            }
            Kind::Spherical(rings) => rings.project(p, &mut out),
            Kind::Parallel { rays, top } => {
                let origin = [0, 1].map(|k| (1.0 - rays.first[k] / rays.step[k]) as f32);
                let per_metre = rays.step.map(|s| (1.0 / s) as f32);
                for l in 0..LANES {
                    out.u[l] = p[0][l] * per_metre[0] + origin[0];
                    out.v[l] = p[1][l] * per_metre[1] + origin[1];
                    out.length[l] = *top as f32 - p[2][l];
                }
            }
        }
        let seam = if self.is_closed() { 1.0 } else { 0.75 };
        let (right, bottom) = (self.columns as f32 + seam, self.rows as f32 + 0.75);
        for l in 0..LANES {
            // NaN becomes 0, which is the border.
            out.u[l] = out.u[l].max(0.0).min(right);
            out.v[l] = out.v[l].max(0.0).min(bottom);
        }
        out
    }

    /// Cosines of the incidence of 64 rays on the surface between pixels, not below [`LEAST_COSINE`]; `row` counts the border.
    #[inline(always)]
    pub(super) fn cosines(&self, on: &Gradients, seen: &Projected, row: &[u32; LANES]) -> Lanes {
        let mut cosine = [1.0; LANES];
        match &self.kind {
            // On a plane n.p = D with p = z (x, y, 1) it is 1 / z that is linear: nx = fx d(1/z)/du, and so on, in units of D.
            Kind::Pinhole(c) => {
                let [fx, fy] = [c.fx as f32, c.fy as f32];
                let [cx, cy] = [(c.cx + 1.0) as f32, (c.cy + 1.0) as f32];
                for l in 0..LANES {
                    let (nx, ny) = (fx * on.right[l], fy * on.below[l]);
                    // (Of the pixel to which the place was clamped, which is where the surface is.)
                    let nz = on.value[l] - on.right[l] * (seen.u[l] - cx) - on.below[l] * (seen.v[l] - cy);
                    cosine[l] = on.value[l] / (seen.scale[l] * (nx * nx + ny * ny + nz * nz).sqrt());
                }
            }
            // d(1/r) / (1/r) = - dr / r, and dr over r times the angle is the tangent.
            Kind::Spherical(_) => {
                let openings = &self.openings[..];
                for l in 0..LANES {
                    let row = ((row[l].max(1) - 1) & 0x3fff_ffff) as usize;
                    let row = row.min(openings.len() - 1);
                    let a = if row < openings.len() { openings[row][0] } else { 1.0 };
                    let b = if row < openings.len() { openings[row][1] } else { 1.0 };
                    let (x, y) = (on.right[l] / (a * on.value[l]), on.below[l] / (b * on.value[l]));
                    cosine[l] = 1.0 / (1.0 + x * x + y * y).sqrt();
                }
            }
            Kind::Parallel { .. } => {
                let [a, b] = self.openings(0);
                let (a, b) = (1.0 / a, 1.0 / b);
                for l in 0..LANES {
                    let (x, y) = (on.right[l] * a, on.below[l] * b);
                    cosine[l] = 1.0 / (1.0 + x * x + y * y).sqrt();
                }
            }
        }
        // Where nothing is known it is NaN, which `max` takes out and `clamp` would not.
        cosine.map(|c| 1.0f32.min(c.max(LEAST_COSINE)))
    }

    /// Distances between points and the rays of pixels near them (meters).
    #[inline(always)]
    pub(super) fn aside(&self, steps: &Steps, projected: &Projected) -> Lanes {
        let mut aside = [0.0; LANES];
        // Checked without a way out of the loops: so the loads are gathers.
        let openings = &self.openings[..];
        if matches!(self.kind, Kind::Spherical(_)) {
            for l in 0..LANES {
                let row = (steps.row[l] & 0x3fff_ffff) as usize;
                let row = row.min(openings.len() - 1);
                let a = if row < openings.len() { openings[row][0] } else { 0.0 };
                let b = if row < openings.len() { openings[row][1] } else { 0.0 };
                aside[l] = across(steps.right[l] * a, steps.below[l] * b) * projected.length[l];
            }
            return aside;
        }
        let [a, b] = self.openings(0);
        let parallel = self.is_parallel();
        for l in 0..LANES {
            let depth = if parallel { 1.0 } else { projected.length[l] / projected.scale[l] };
            aside[l] = across(steps.right[l] * a, steps.below[l] * b) * depth;
        }
        aside
    }
}

#[inline(always)]
fn across(a: f32, b: f32) -> f32 {
    (a * a + b * b).sqrt()
}
