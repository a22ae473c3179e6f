//! Ambient occlusion and outlines, which make shapes readable without shadows.

use super::camera::Projection;
use super::parallel;
use super::raster::Visible;
use super::vector::{dot, sub};

/// Number of samples around a pixel.
const SAMPLES: usize = 14;
/// Distance within which surfaces occlude each other, as a share of the median depth.
const REACH: f32 = 0.045;
/// Largest distance in the picture (pixels).
const WIDEST: f32 = 48.0;
/// Half the side of the window over which noise is averaged (pixels).
const BLUR: i64 = 2;
/// Relative difference of nearness above which pixels belong to different surfaces.
const STEP: f32 = 0.03;

/// The nearest thing at every whole pixel.
pub(super) struct Surface {
    pub(super) width: usize,
    pub(super) height: usize,
    /// One over the depth; 0: nothing.
    pub(super) nearness: Vec<f32>,
    /// Toward the viewer, in the camera's axes.
    pub(super) normals: Vec<[f32; 3]>,
}

/// The light that reaches every pixel, 0 to 1 (screen-space ambient occlusion, after Filion & McNaughton 2008).
pub(super) fn openness(surface: &Surface, projection: &Projection) -> Vec<f32> {
    let reach = REACH * median_depth(&surface.nearness);
    let raw = by_rows(surface, |x, y| sample(surface, projection, x, y, reach));
    by_rows(surface, |x, y| {
        let own = surface.nearness[y * surface.width + x];
        let (mut sum, mut count) = (0.0, 0.0);
        for v in -BLUR..=BLUR {
            for u in -BLUR..=BLUR {
                let Some(at) = surface.index(x as i64 + u, y as i64 + v) else { continue };
                if (surface.nearness[at] - own).abs() <= STEP * own {
                    sum += raw[at];
                    count += 1.0;
                }
            }
        }
        if count > 0.0 { sum / count } else { 1.0 }
    })
}

impl Surface {
    fn index(&self, x: i64, y: i64) -> Option<usize> {
        let inside = x >= 0 && y >= 0 && x < self.width as i64 && y < self.height as i64;
        inside.then(|| y as usize * self.width + x as usize)
    }

    fn place(&self, projection: &Projection, x: usize, y: usize) -> Option<[f32; 3]> {
        let w = self.nearness[y * self.width + x];
        let pixel = [x as f32 + 0.5, y as f32 + 0.5];
        let ray = |k: usize| (pixel[k] - projection.middle[k]) / projection.focal;
        (w > 0.0).then(|| [ray(0) / w, ray(1) / w, 1.0 / w])
    }
}

fn by_rows(surface: &Surface, f: impl Fn(usize, usize) -> f32 + Send + Sync) -> Vec<f32> {
    let mut out = vec![1.0; surface.width * surface.height];
    parallel::chunks(&mut out, surface.width, |y, row| {
        row.iter_mut().enumerate().for_each(|(x, v)| *v = f(x, y));
    });
    out
}

fn median_depth(nearness: &[f32]) -> f32 {
    let mut some: Vec<f32> = nearness.iter().copied().step_by(37).filter(|w| *w > 0.0).collect();
    some.sort_by(f32::total_cmp);
    some.get(some.len() / 2).map_or(1.0, |w| 1.0 / w)
}

fn sample(surface: &Surface, projection: &Projection, x: usize, y: usize, reach: f32) -> f32 {
    let Some(p) = surface.place(projection, x, y) else { return 1.0 };
    let normal = surface.normals[y * surface.width + x];
    let radius = (reach * projection.focal / p[2]).clamp(3.0, WIDEST);
    // A different rotation for every pixel of a small tile turns bands into noise, which the blur removes.
    let turn = (52.982_918 * (0.067_110_56 * x as f32 + 0.005_837_15 * y as f32).fract()).fract();
    let mut dark = 0.0;
    for k in 0..SAMPLES {
        let share = ((k as f32 + 0.5) / SAMPLES as f32).sqrt();
        let (sin, cos) = (2.399_963 * k as f32 + std::f32::consts::TAU * turn).sin_cos();
        let (u, v) = (x as f32 + radius * share * cos, y as f32 + radius * share * sin);
        let Some(at) = surface.index(u.round() as i64, v.round() as i64) else { continue };
        let Some(q) = surface.place(projection, at % surface.width, at / surface.width) else { continue };
        let way = sub(q, p);
        let length_sq = dot(way, way);
        let rise = dot(normal, way) / length_sq.sqrt().max(1e-6) - 0.12;
        let near = 1.0 - length_sq / (reach * reach);
        if rise > 0.0 && near > 0.0 {
            dark += rise * near;
        }
    }
    (1.0 - 2.2 * dark / SAMPLES as f32).clamp(0.25, 1.0)
}

/// How strongly a pixel lies on the near side of an outline, 0 to 1: how much nearer it is than the line through its two
/// neighbors, which on a plane is 0.
pub(super) fn outline(visible: &Visible, x: usize, y: usize) -> f32 {
    let own = visible.nearness[y * visible.width + x];
    let at = |x: usize, y: usize| visible.nearness[y * visible.width + x];
    let bend = |before: f32, after: f32| (2.0 * own - before - after) / own;
    let mut most: f32 = 0.0;
    if x > 0 && x + 1 < visible.width {
        most = most.max(bend(at(x - 1, y), at(x + 1, y)));
    }
    if y > 0 && y + 1 < visible.height {
        most = most.max(bend(at(x, y - 1), at(x, y + 1)));
    }
    ((most - 0.02) / 0.1).clamp(0.0, 1.0)
}
