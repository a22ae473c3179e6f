//! Range scans whose rows and columns are only nearly regular, seen along parallel rays.

use super::{Orthographic, Projection, RangeImage};

/// An edge of the surface may be so many times as long as the distance between pixels; a longer one spans a jump between
/// two surfaces. Four times is a surface seen at 14 degrees.
const LONGEST_EDGE: f64 = 4.0;
/// The image may have so many times as many pixels as the scan has.
const MOST_PIXELS: usize = 4;

/// No point at this pixel.
const NONE: u32 = u32::MAX;

/// The image of a range scan along parallel rays that look down -z.
///
/// `points` are in the scan's frame (meters), `pixels[i] = row * columns + column` is where point `i` was seen; columns run
/// along x and rows along y, both roughly. Scanners of triangulation do not look along exactly parallel rays: a Cyberware
/// moves every other row by half a pixel in x, and its camera sees y in perspective. So the points are joined to a surface of
/// triangles between neighboring pixels, and the surface is sampled at the middle of every pixel of a regular image
/// *(Curless & Levoy 1996, section 3)*.
///
/// What it costs: heights are interpolated linearly between points (for a surface of radius `R` and points `h` apart an
/// error of up to `h^2 / 8R`, 0.01 mm for 0.7 mm on 5 mm); readings without a neighbor, and the last half pixel at the rim of
/// a surface, are lost. Points on a regular grid come out as they are. The first surface from above counts.
///
/// `None` where columns do not run along x and rows along y, or where points lie too far from any regular grid. O(pixels).
pub fn orthographic_image(
    points: &[[f32; 3]],
    pixels: &[u32],
    columns: usize,
    rows: usize,
) -> Option<RangeImage> {
    let scan = Grid::of(points, pixels, columns, rows)?;
    let step = scan.step()?;
    let (first, shape) = scan.extent(step)?;
    let mut image = Raster { first, step, shape, heights: vec![f64::NEG_INFINITY; shape[0] * shape[1]] };
    let longest = LONGEST_EDGE * step[0].abs().max(step[1].abs());
    scan.triangles(|corners| {
        let edge = |a: [f64; 3], b: [f64; 3]| crate::geom::vector::distance(a, b);
        let [a, b, c] = corners;
        if edge(a, b) <= longest && edge(b, c) <= longest && edge(c, a) <= longest {
            image.draw(corners);
        }
    });
    // The rays begin just above the highest point: what lies above the scan stays unknown.
    let top = points.iter().map(|p| f64::from(p[2])).fold(f64::NEG_INFINITY, f64::max) + longest;
    let value = |z: &f64| if z.is_finite() { (top - z) as f32 } else { 0.0 };
    let projection = Projection::Orthographic { rays: Orthographic { first, step }, top };
    let values: Vec<f32> = image.heights.iter().map(value).collect();
    Some(RangeImage::new(projection, shape[0], shape[1], values))
}

/// The points of a scan by pixel.
struct Grid<'a> {
    points: &'a [[f32; 3]],
    index: Vec<u32>,
    columns: usize,
    rows: usize,
}

impl<'a> Grid<'a> {
    fn of(points: &'a [[f32; 3]], pixels: &[u32], columns: usize, rows: usize) -> Option<Self> {
        let size = columns.checked_mul(rows)?;
        if pixels.len() != points.len() || points.len() >= NONE as usize || size < points.len() {
            return None;
        }
        let mut index = vec![NONE; size];
        for (i, &pixel) in pixels.iter().enumerate() {
            *index.get_mut(pixel as usize)? = i as u32;
        }
        let finite = points.iter().flatten().all(|v| v.is_finite());
        finite.then_some(Self { points, index, columns, rows })
    }

    /// The point at a pixel.
    fn at(&self, column: usize, row: usize) -> Option<[f64; 3]> {
        let i = self.index[row * self.columns + column];
        (i != NONE).then(|| self.points[i as usize].map(f64::from))
    }

    /// Median distance between neighbors: along x in a row, along y in a column.
    fn step(&self) -> Option<[f64; 2]> {
        let mut along = [Vec::new(), Vec::new()];
        let mut across = [Vec::new(), Vec::new()];
        for row in 0..self.rows {
            for column in 0..self.columns {
                let Some(p) = self.at(column, row) else { continue };
                let right = if column + 1 < self.columns { self.at(column + 1, row) } else { None };
                let below = if row + 1 < self.rows { self.at(column, row + 1) } else { None };
                for (k, q) in [right, below].into_iter().enumerate() {
                    if let Some(q) = q {
                        along[k].push(q[k] - p[k]);
                        across[k].push(q[1 - k] - p[1 - k]);
                    }
                }
            }
        }
        let [mut x, mut y] = along;
        let [mut y_in_rows, mut x_in_columns] = across;
        let step = [median(&mut x)?, median(&mut y)?];
        let tilt = [median(&mut y_in_rows)?, median(&mut x_in_columns)?];
        // The median of an interlaced scan's x within a column is one of two values: half a pixel there, or back.
        let straight = tilt[0].abs() < 0.25 * step[0].abs() && tilt[1].abs() <= 0.75 * step[1].abs();
        straight.then_some(step)
    }

    /// The middle of the first pixel and the columns and rows of an image that holds all points. Its pixels lie on the
    /// scan's, as far as those are regular.
    fn extent(&self, step: [f64; 2]) -> Option<([f64; 2], [usize; 2])> {
        let (mut first, mut shape) = ([0.0; 2], [0; 2]);
        for k in 0..2 {
            let (mut phase, mut low, mut high) = (Vec::new(), f64::INFINITY, f64::NEG_INFINITY);
            for row in 0..self.rows {
                for column in 0..self.columns {
                    let Some(p) = self.at(column, row) else { continue };
                    phase.push(p[k] - [column, row][k] as f64 * step[k]);
                }
            }
            let zero = median(&mut phase)?;
            for p in self.points {
                let place = (f64::from(p[k]) - zero) / step[k];
                (low, high) = (low.min(place), high.max(place));
            }
            let (from, to) = (low.round(), high.round());
            let size = to - from + 1.0;
            if !(size >= 2.0 && size <= (MOST_PIXELS * self.columns.max(self.rows)) as f64) {
                return None;
            }
            first[k] = zero + from * step[k];
            shape[k] = size as usize;
        }
        (shape[0] * shape[1] <= MOST_PIXELS * self.index.len()).then_some((first, shape))
    }

    /// The triangles between neighboring pixels: two of four points, split along the shorter diagonal, or one of three.
    /// All wind the same way.
    fn triangles(&self, mut each: impl FnMut([[f64; 3]; 3])) {
        for row in 0..self.rows.saturating_sub(1) {
            for column in 0..self.columns.saturating_sub(1) {
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(c, r)| self.at(column + c, row + r));
                match corners {
                    [Some(a), Some(b), Some(c), Some(d)] => {
                        let distance = crate::geom::vector::distance::<3>;
                        if distance(a, c) <= distance(b, d) {
                            each([a, b, c]);
                            each([a, c, d]);
                        } else {
                            each([a, b, d]);
                            each([b, c, d]);
                        }
                    }
                    [None, Some(b), Some(c), Some(d)] => each([b, c, d]),
                    [Some(a), None, Some(c), Some(d)] => each([a, c, d]),
                    [Some(a), Some(b), None, Some(d)] => each([a, b, d]),
                    [Some(a), Some(b), Some(c), None] => each([a, b, c]),
                    _ => {}
                }
            }
        }
    }
}

/// Heights at the middles of pixels.
struct Raster {
    first: [f64; 2],
    step: [f64; 2],
    shape: [usize; 2],
    heights: Vec<f64>,
}

impl Raster {
    /// Draws a triangle, where it is higher than what is there. One that winds the other way is the back of a surface.
    fn draw(&mut self, corners: [[f64; 3]; 3]) {
        // In units of pixels, where a triangle of neighbors that was not turned over has a positive area.
        let place = |p: [f64; 3]| [0, 1].map(|k| (p[k] - self.first[k]) / self.step[k]);
        let [a, b, c] = corners.map(place);
        let cross = |o: [f64; 2], p: [f64; 2], q: [f64; 2]| {
            (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])
        };
        let area = cross(a, b, c);
        if !(area > 1e-9) {
            return;
        }
        let range = |k: usize| {
            let low = a[k].min(b[k]).min(c[k]) - EDGE;
            let high = a[k].max(b[k]).max(c[k]) + EDGE;
            low.ceil().max(0.0) as usize..((high.floor() + 1.0).max(0.0) as usize).min(self.shape[k])
        };
        for row in range(1) {
            for column in range(0) {
                let p = [column as f64, row as f64];
                let weights = [cross(b, c, p), cross(c, a, p), cross(a, b, p)].map(|w| w / area);
                if weights.iter().all(|w| *w >= -EDGE) {
                    let z = (0..3).map(|k| weights[k] * corners[k][2]).sum();
                    let height = &mut self.heights[row * self.shape[0] + column];
                    *height = height.max(z);
                }
            }
        }
    }
}

/// What rounding may put outside of a triangle (pixels): coordinates are text of six digits or `f32`.
const EDGE: f64 = 1e-3;

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn height(x: f64, y: f64) -> f64 {
        0.05 * (8.0 * x).sin() * (6.0 * y).cos()
    }

    /// A wavy surface of 40 x 30 points, moved sideways by `shift(column, row)` pixels.
    fn wave(shift: impl Fn(usize, usize) -> [f64; 2]) -> (Vec<[f32; 3]>, Vec<u32>) {
        let (mut points, mut pixels) = (Vec::new(), Vec::new());
        for row in 0..30 {
            for column in 0..40 {
                if (column + 7 * row) % 31 == 0 {
                    continue;
                }
                let [u, v] = shift(column, row);
                let (x, y) = (0.01 * (column as f64 + u), -0.02 * (row as f64 + v));
                points.push([x, y, height(x, y)].map(|v| v as f32));
                pixels.push(row as u32 * 40 + column as u32);
            }
        }
        (points, pixels)
    }

    #[test]
    fn points_on_a_grid_come_out_as_they_are() {
        let (points, pixels) = wave(|_, _| [0.0, 0.0]);
        let image = orthographic_image(&points, &pixels, 40, 30).unwrap();
        assert_eq!((image.columns, image.rows), (40, 30));
        let all: std::collections::HashMap<usize, [f64; 3]> = image.points().collect();
        for (p, pixel) in points.iter().zip(&pixels) {
            let q = all[&(*pixel as usize)];
            assert!((0..3).all(|k| (q[k] - f64::from(p[k])).abs() < 1e-6), "{q:?} {p:?}");
        }
        // Holes of one pixel are closed by no triangle of three points.
        let inner = |i: &usize| (1..39).contains(&(i % 40)) && (1..29).contains(&(i / 40));
        let closed = all.keys().filter(|i| inner(i) && !pixels.contains(&(**i as u32))).count();
        assert_eq!(closed, 0);
    }

    #[test]
    fn crooked_rows_are_sampled_again() {
        // Every other row is half a pixel off, and y creeps.
        let crooked = |_: usize, row: usize| {
            [if row.is_multiple_of(2) { 0.25 } else { -0.25 }, 0.004 * (row * row) as f64]
        };
        let (points, pixels) = wave(crooked);
        let image = orthographic_image(&points, &pixels, 40, 30).unwrap();
        let mut worst: f64 = 0.0;
        for (_, [x, y, z]) in image.points() {
            worst = worst.max((z - height(x, y)).abs());
        }
        // Linear interpolation over h = 0.025: second derivatives are up to 3.2, so up to h^2 / 8 * (3.2 + 1.8 + 2 * 2.4).
        assert!(worst < 8e-4, "{worst}");
        assert!(image.hits() > points.len() * 8 / 10, "{}", image.hits());
    }

    #[test]
    fn jumps_are_not_bridged_and_nonsense_is_refused() {
        let (mut points, pixels) = wave(|_, _| [0.0, 0.0]);
        for (p, pixel) in points.iter_mut().zip(&pixels) {
            p[2] = if pixel % 40 < 20 { 0.0 } else { -1.0 };
        }
        // Half a pixel off: middles of pixels between the two surfaces belong to neither.
        points.iter_mut().zip(&pixels).filter(|(_, i)| *i % 40 >= 20).for_each(|(p, _)| p[0] += 0.01);
        let image = orthographic_image(&points, &pixels, 40, 30).unwrap();
        assert!(image.points().all(|(_, p)| p[2].abs() < 1e-6 || (p[2] + 1.0).abs() < 1e-6));
        let turned: Vec<[f32; 3]> = points.iter().map(|p| [p[1], p[0], p[2]]).collect();
        assert_eq!(orthographic_image(&turned, &pixels, 40, 30), None);
        assert_eq!(orthographic_image(&points, &pixels, 40, 29), None);
        assert_eq!(orthographic_image(&[], &[], 40, 30), None);
        points[5][0] = 1e30;
        assert_eq!(orthographic_image(&points, &pixels, 40, 30), None);
        points[5][0] = f32::NAN;
        assert_eq!(orthographic_image(&points, &pixels, 40, 30), None);
    }
}
