//! Rows and columns for points that came without them.

use super::angles::atan2;
use super::bridges::Holds;
use super::rings::{columns, rings};
use super::{RangeImage, Spherical, WhyRays};
use crate::parallel;
use std::f64::consts::TAU;

/// Fewer points than this have no rows and columns.
const FEWEST_POINTS: usize = 512;
/// Share of the points that need a pixel of their own: the nearest of several points in a pixel wins, the others are lost.
const FEWEST_KEPT: f64 = 0.8;
/// Share of the neighbors of pixels, bridges counted, that must have a value too: an image full of holes shows less surface
/// than its points.
const FEWEST_NEIGHBORS: f64 = 0.8;
/// The same where points are so dense that rays alone show their surface: closer than [`DENSE`] cells.
const FEWEST_NEIGHBORS_OF_DENSE: f64 = 0.95;
const DENSE: f64 = 0.8;
/// Share of the pixels with a value that need a reading of their own; the others are bridges.
const FEWEST_OWN: f64 = 0.2;

/// Where the rows and columns of a turning lidar look, found in the points of one scan and good for all scans of the
/// same sensor.
///
/// Lidar logs mostly keep points without rows and columns. What sees space between rays through a range image needs them back.
/// Rings are found as clusters of elevations, columns from the steps of azimuth along rings.
///
/// A layout is only good for points that it keeps: four fifths have a pixel of their own, and four fifths of the pixels beside one
/// with a value, in rows and in columns, have a value too, where gaps of a few pixels within a surface are bridged. Points of
/// other origins (grids, clouds of several scans, meshes, blurred rings) fail, and are better followed ray by ray.
#[derive(Clone, Debug, PartialEq)]
pub struct SphericalLayout {
    spherical: Spherical,
    columns: usize,
    /// Row by elevation: a table over `[low, low + len / scale]`; `NO_ROW` where no row is near.
    row_of: Vec<u16>,
    low: f32,
    scale: f32,
}

const NO_ROW: u16 = u16::MAX;
/// More than any image has: rows and columns are at most 2^14 and 2^15.
const NO_PIXEL: u32 = u32::MAX;

impl SphericalLayout {
    /// The layout of a scan of points about `origin`, both in one frame whose z is the sensor's axis of rotation. `None`
    /// where the points are no such scan: too few, without rings, or not good for it. O(n log n); once a log.
    pub fn of(points: &[[f32; 3]], origin: [f64; 3]) -> Option<Self> {
        Self::found(points, origin).ok()
    }

    /// The same, or why there is none.
    pub(super) fn found(points: &[[f32; 3]], origin: [f64; 3]) -> Result<Self, WhyRays> {
        if points.len() < FEWEST_POINTS {
            return Err(WhyRays::NoRows);
        }
        let polar = Polar::of(points, origin);
        if polar.ranges.iter().any(|r| !r.is_finite()) {
            return Err(WhyRays::NoRows);
        }
        let layout = Self::of_rings(&polar).ok_or(WhyRays::NoRows)?;
        layout.good_image(points, origin, 0.0)?;
        Ok(layout)
    }

    /// The image of points that the layout is good for in cells of this edge (meters), else why it is not. O(points + pixels).
    pub(super) fn good_image(
        &self,
        points: &[[f32; 3]],
        origin: [f64; 3],
        cell: f64,
    ) -> Result<RangeImage, WhyRays> {
        let image = self.image(points, origin);
        if (image.hits() as f64) < FEWEST_KEPT * points.len() as f64 {
            return Err(WhyRays::SharedPixels);
        }
        let holds = Holds::of(&image, &self.spherical);
        let dense = holds.spacing < DENSE * cell;
        let fewest = if dense { FEWEST_NEIGHBORS_OF_DENSE } else { FEWEST_NEIGHBORS };
        let whole = holds.across.min(holds.down) >= fewest && holds.own >= FEWEST_OWN;
        if whole { Ok(image) } else { Err(WhyRays::Gaps) }
    }

    /// The layout of rows at `elevations` (radians, strictly descending) and `columns` for a full turn from `first_azimuth`
    /// on. `None` where there are no or too many of either, or elevations do not descend.
    pub fn from_parts(elevations: Vec<f32>, columns: usize, first_azimuth: f64) -> Option<Self> {
        let descending = elevations.windows(2).all(|w| w[0] > w[1]);
        let sane = elevations.iter().all(|e| e.abs() < 1.6) && first_azimuth.is_finite();
        let fits = (2..=16_384).contains(&elevations.len()) && (4..=32_768).contains(&columns);
        if !(descending && sane && fits) {
            return None;
        }
        // A point belongs to the nearest row, to an end row only within half of the distance to the row beside it.
        let n = elevations.len();
        let finest = elevations.windows(2).map(|w| w[0] - w[1]).fold(f32::INFINITY, f32::min);
        let high = elevations[0] + 0.5 * (elevations[0] - elevations[1]);
        let low = elevations[n - 1] - 0.5 * (elevations[n - 2] - elevations[n - 1]);
        let bins = (((high - low) / finest * 32.0).ceil() as usize).clamp(64, 1 << 20);
        let scale = bins as f32 / (high - low);
        let mut row = n - 1;
        let row_of = (0..bins)
            .map(|b| {
                let e = low + (b as f32 + 0.5) / scale;
                while row > 0 && (elevations[row - 1] - e).abs() < (elevations[row] - e).abs() {
                    row -= 1;
                }
                row as u16
            })
            .collect();
        let spherical = Spherical { elevations, first_azimuth, azimuth_step: TAU / columns as f64 };
        Some(Self { spherical, columns, row_of, low, scale })
    }

    fn of_rings(polar: &Polar) -> Option<Self> {
        let elevations = rings(&polar.elevations)?;
        let rows = Self::from_parts(elevations.clone(), 4, 0.0)?;
        let ring_of: Vec<u32> = polar.elevations.iter().map(|&e| u32::from(rows.row(e))).collect();
        let (columns, first) = columns(&polar.azimuths, &ring_of)?;
        Self::from_parts(elevations, columns, first)
    }

    #[inline(always)]
    fn row(&self, elevation: f32) -> u16 {
        // A negative number becomes the first entry, which is why what lies below is sorted out first.
        let at = (elevation - self.low) * self.scale;
        if at >= 0.0 { self.row_of.get(at as usize).copied().unwrap_or(NO_ROW) } else { NO_ROW }
    }

    #[inline(always)]
    fn pixel(&self, polar: &Polar, i: usize) -> Option<usize> {
        let row = self.row(polar.elevations[i]);
        let turn = self.columns as f32 / TAU as f32;
        let column = (polar.azimuths[i] - self.spherical.first_azimuth as f32) * turn + 0.5;
        let n = self.columns as i32;
        // The azimuth and the first one both lie within a turn of zero: two turns up is enough.
        let mut column = (column + 2.0 * n as f32) as i32 - n;
        column -= if column >= n { n } else { 0 };
        column += if column < 0 { n } else { 0 };
        (row != NO_ROW && (0..n).contains(&column)).then(|| usize::from(row) * self.columns + column as usize)
    }

    /// The range image of a scan about `origin` (its pixels look from there, in the axes of the points' frame). The nearest
    /// of several points in a pixel wins; pixels without one are 0: nothing is known. Points above the first and below
    /// the last row have no pixel. O(n).
    pub fn image(&self, points: &[[f32; 3]], origin: [f64; 3]) -> RangeImage {
        const TOGETHER: usize = 4096;
        let chunks: Vec<_> = points.chunks(TOGETHER).collect();
        let parts = parallel::map(&chunks, 1, |points| {
            let polar = Polar::of(points, origin);
            let pixels: Vec<u32> =
                (0..points.len()).map(|i| self.pixel(&polar, i).map_or(NO_PIXEL, |p| p as u32)).collect();
            (pixels, polar.ranges)
        });
        let mut values = vec![0.0f32; self.columns * self.spherical.elevations.len()];
        for (pixel, range) in parts.into_iter().flat_map(|(pixels, ranges)| pixels.into_iter().zip(ranges)) {
            if let Some(value) = values.get_mut(pixel as usize) {
                *value = if *value == 0.0 || range < *value { range } else { *value };
            }
        }
        RangeImage::from_ranges(self.spherical.clone(), self.columns, values)
    }

    /// Rows and the first column.
    pub fn spherical(&self) -> &Spherical {
        &self.spherical
    }

    /// Number of columns of a full turn.
    pub fn columns(&self) -> usize {
        self.columns
    }
}

/// Angles and ranges of points, each in a plane of its own.
struct Polar {
    azimuths: Vec<f32>,
    elevations: Vec<f32>,
    ranges: Vec<f32>,
}

impl Polar {
    fn of(points: &[[f32; 3]], origin: [f64; 3]) -> Self {
        let o = origin.map(|v| v as f32);
        let n = points.len();
        let mut polar = Self { azimuths: vec![0.0; n], elevations: vec![0.0; n], ranges: vec![0.0; n] };
        let out = polar.azimuths.iter_mut().zip(&mut polar.elevations).zip(&mut polar.ranges);
        for (p, ((azimuth, elevation), range)) in points.iter().zip(out) {
            let (x, y, z) = (p[0] - o[0], p[1] - o[1], p[2] - o[2]);
            let across = x * x + y * y;
            *azimuth = atan2(y, x);
            *elevation = atan2(z, across.sqrt());
            *range = (across + z * z).sqrt();
        }
        polar
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room with a pillar, seen by `rings` rings of `columns` beams; some beams without an echo.
    fn scan(rings: usize, columns: usize, scatter: f64, origin: [f64; 3]) -> Vec<[f32; 3]> {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut points = Vec::new();
        for row in 0..rings {
            for column in 0..columns {
                let e = 0.39 - 0.78 * row as f64 / (rings - 1) as f64 + scatter * random();
                let a = -TAU * column as f64 / columns as f64 + scatter * random();
                let d = [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
                let wall = (0..3).map(|k| [5.0, 4.0, 1.4][k] / d[k].abs()).fold(f64::INFINITY, f64::min);
                let pillar = if (a + 1.0).abs() < 0.1 { 2.0 } else { f64::INFINITY };
                if (row + column) % 11 != 0 {
                    points.push(std::array::from_fn(|k| (origin[k] + wall.min(pillar) * d[k]) as f32));
                }
            }
        }
        points
    }

    #[test]
    fn exact_rings_give_every_beam_its_pixel() {
        let origin = [0.3, -0.2, 1.0];
        let points = scan(64, 1024, 0.0, origin);
        let layout = SphericalLayout::of(&points, origin).unwrap();
        assert_eq!((layout.spherical().elevations.len(), layout.columns()), (64, 1024));
        let image = layout.image(&points, origin);
        assert_eq!(image.hits(), points.len());
        for (_, p) in image.points() {
            let near =
                points.iter().any(|q| (0..3).all(|k| (f64::from(q[k]) - origin[k] - p[k]).abs() < 2e-5));
            assert!(near || p[0] > 0.0, "{p:?} is no point of the scan");
        }
    }

    #[test]
    fn blurred_rings_keep_most_points_or_are_no_rings() {
        let points = scan(64, 1024, 0.001, [0.0; 3]);
        let layout = SphericalLayout::of(&points, [0.0; 3]).unwrap();
        assert_eq!(layout.spherical().elevations.len(), 64);
        let image = layout.image(&points, [0.0; 3]);
        assert!(image.hits() as f64 > 0.95 * points.len() as f64, "{}", image.hits());
        // Most pixels know something.
        assert!(image.hits() as f64 > 0.7 * image.values.len() as f64);
        // An image of these keeps a third of the points.
        assert_eq!(SphericalLayout::of(&scan(64, 1024, 0.02, [0.0; 3]), [0.0; 3]), None);
    }

    /// Points of a wall, a few on each line of sight at best: an image of them has a pixel for each point and holes between.
    #[test]
    fn grids_of_points_are_no_scan() {
        for (edge, x) in [(0.05, 2.03), (0.02, 2.07), (0.1, 5.03), (0.05, 4.07)] {
            let wall =
                |i: usize| [x, (i % 101) as f32 * edge - 50.0 * edge, (i / 101) as f32 * edge - 20.0 * edge];
            let points: Vec<_> = (0..101 * 41).map(wall).collect();
            assert_eq!(SphericalLayout::of(&points, [0.0; 3]), None, "{edge} {x}");
            let few: Vec<_> = (0..101 * 41).filter(|i| i % 3 != 0).map(wall).collect();
            assert_eq!(SphericalLayout::of(&few, [0.0; 3]), None, "{edge} {x}");
        }
    }

    #[test]
    fn a_scan_that_was_thinned_out_is_still_one() {
        let mut seed = 7u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let whole = scan(64, 1024, 0.0, [0.0; 3]);
        for (share, is_scan) in [(0.9, true), (0.7, true), (0.5, true), (0.03, false)] {
            let points: Vec<_> = whole.iter().copied().filter(|_| random() < share).collect();
            assert_eq!(SphericalLayout::of(&points, [0.0; 3]).is_some(), is_scan, "{share}");
        }
    }

    #[test]
    fn what_is_no_scan_is_none() {
        let mut cloud = scan(64, 256, 0.0, [0.0; 3]);
        assert!(SphericalLayout::of(&cloud[..100], [0.0; 3]).is_none());
        // Two rooms, one behind the other: half of all points are hidden.
        let behind: Vec<_> = cloud.iter().map(|p| p.map(|v| 2.0 * v)).collect();
        cloud.extend(behind);
        assert!(SphericalLayout::of(&cloud, [0.0; 3]).is_none());
        assert!(SphericalLayout::of(&vec![[1.0, 0.0, 0.0]; 1000], [0.0; 3]).is_none());
        assert!(SphericalLayout::of(&vec![[f32::NAN; 3]; 1000], [0.0; 3]).is_none());
        assert!(SphericalLayout::from_parts(vec![0.0, 0.1], 100, 0.0).is_none());
    }
}
