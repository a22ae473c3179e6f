//! Clouds that kept their rows and columns: which sensor has such rows and columns?

use std::f64::consts::{PI, TAU};

use super::{Pinhole, Projection, RangeImage, Spherical};

/// Fewer points tell nothing about the sensor.
const FEWEST: usize = 64;
/// So many of the points have to be where the projection puts their pixel, to half a pixel.
const SHARE: f64 = 0.95;

/// A cloud with rows and columns, about the sensor.
#[derive(Clone, Copy, Debug)]
pub struct OrganisedPoints<'a> {
    /// Points (meters) about the sensor, in its frame.
    pub points: &'a [[f32; 3]],
    /// The pixel of each point, `row * columns + column`; no two are the same.
    pub pixels: &'a [u32],
    /// Red, green, blue of each point, or nothing.
    pub colors: &'a [[u8; 3]],
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl OrganisedPoints<'_> {
    /// The image of these points with the projection that fits their pixels: a pinhole camera (x right, y down, z forward),
    /// or a turning lidar (rows of one elevation, in any order; columns a constant angle apart; rows that were turned by
    /// whole columns, as some sensors deliver them, are turned back; rows and columns may be exchanged). Ranges and depths
    /// are those of the points; their directions become those of their pixels, off by less than half a pixel.
    ///
    /// `None` where points are not where any of these projections has its pixels: clouds from which the sensor's motion was
    /// taken out, cameras with distortion, meshes. O(points log points).
    pub fn image(&self) -> Option<RangeImage> {
        let size = self.columns.checked_mul(self.rows)?;
        let fits = self.points.len() >= FEWEST
            && self.pixels.len() == self.points.len()
            && self.pixels.iter().all(|p| (*p as usize) < size)
            && self.points.iter().flatten().all(|v| v.is_finite());
        if !fits {
            return None;
        }
        self.pinhole().or_else(|| self.spherical(false)).or_else(|| self.spherical(true))
    }

    /// Column and row of point `i`; with `exchanged` the other way round.
    fn place(&self, i: usize, exchanged: bool) -> [usize; 2] {
        let pixel = self.pixels[i] as usize;
        let (column, row) = (pixel % self.columns, pixel / self.columns);
        if exchanged { [row, column] } else { [column, row] }
    }

    fn pinhole(&self) -> Option<RangeImage> {
        // x / z is linear in the column, y / z in the row.
        let mut lines = [Line::default(); 2];
        for (i, p) in self.points.iter().enumerate() {
            if !(p[2] > 0.0) {
                return None;
            }
            let place = self.place(i, false);
            for k in 0..2 {
                lines[k].add(place[k] as f64, f64::from(p[k]) / f64::from(p[2]));
            }
        }
        let [[ax, bx], [ay, by]] = [lines[0].fit()?, lines[1].fit()?];
        if !(ax > 0.0 && ay > 0.0) {
            return None;
        }
        let camera = Pinhole { fx: 1.0 / ax, fy: 1.0 / ay, cx: -bx / ax, cy: -by / ay };
        let near = (0..self.points.len()).filter(|&i| {
            let (p, place) = (self.points[i].map(f64::from), self.place(i, false));
            let u = camera.fx * p[0] / p[2] + camera.cx;
            let v = camera.fy * p[1] / p[2] + camera.cy;
            (u - place[0] as f64).abs() < 0.5 && (v - place[1] as f64).abs() < 0.5
        });
        if (near.count() as f64) < SHARE * self.points.len() as f64 {
            return None;
        }
        let pixel = |i: usize| Some(self.pixels[i] as usize);
        let value = |i: usize| self.points[i][2];
        Some(self.filled(Projection::Pinhole(camera), [self.columns, self.rows], pixel, value))
    }

    fn spherical(&self, exchanged: bool) -> Option<RangeImage> {
        let [columns, rows] = if exchanged { [self.rows, self.columns] } else { [self.columns, self.rows] };
        if columns < 2 || rows < 2 {
            return None;
        }
        let polar: Vec<Polar> = self.points.iter().map(|p| Polar::of(*p)).collect();
        let place = |i: usize| self.place(i, exchanged);
        // Rows: their elevations, the highest first.
        let mut by_row = vec![Vec::new(); rows];
        (0..polar.len()).for_each(|i| by_row[place(i)[1]].push(i));
        let mut order: Vec<(f64, usize)> = Vec::new();
        for (row, members) in by_row.iter().enumerate() {
            order.extend(median(members.iter().map(|&i| polar[i].elevation).collect()).map(|e| (e, row)));
        }
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        if order.len() < 2 || order.windows(2).any(|w| w[0].0 - w[1].0 < 1e-5) {
            return None;
        }
        // Columns: the angle between them, then where each row begins.
        let mut row_members = by_row;
        row_members.iter_mut().for_each(|m| m.sort_by_key(|&i| place(i)[0]));
        let steps =
            row_members.iter().flat_map(|m| m.windows(2)).filter(|w| place(w[1])[0] == place(w[0])[0] + 1);
        let step = median(steps.map(|w| wrapped(polar[w[1]].azimuth - polar[w[0]].azimuth)).collect())?;
        // A median of neighbors is good to a few per cent; a full turn is exact.
        let turns = columns as f64 * step.abs() / TAU;
        let whole = (turns - 1.0).abs() < 0.05;
        let step = if whole { (TAU / columns as f64).copysign(step) } else { step };
        if !(step.abs() > 1e-6 && turns < 1.05) {
            return None;
        }
        let phase = |i: usize| polar[i].azimuth - step * place(i)[0] as f64;
        let reference = phase(*row_members[order[0].1].get(row_members[order[0].1].len() / 2)?);
        let starts = order.iter().map(|(_, row)| {
            median(row_members[*row].iter().map(|&i| wrapped(phase(i) - reference)).collect()).unwrap_or(0.0)
        });
        let starts: Vec<f64> = starts.collect();
        // Rows that begin whole columns later are turned back; what remains of it is shared among all.
        let (shifts, rest): (Vec<i64>, Vec<f64>) =
            starts.iter().map(|s| ((s / step).round() as i64, s - step * (s / step).round())).unzip();
        if !whole && shifts.iter().any(|s| *s != 0) {
            return None;
        }
        let first_azimuth = reference + median(rest)?;

        let mut new_row = vec![0; rows];
        order.iter().enumerate().for_each(|(k, (_, row))| new_row[*row] = k);
        let column_of = |i: usize| -> usize {
            let [column, row] = place(i);
            let shifted = column as i64 + shifts[new_row[row]];
            if whole { shifted.rem_euclid(columns as i64) as usize } else { column }
        };
        let near = (0..polar.len()).filter(|&i| {
            let k = new_row[place(i)[1]];
            let spacing = |a: usize, b: usize| (order[a].0 - order[b].0).abs();
            let gap = spacing(k.saturating_sub(1), k.max(1))
                .min(spacing(k.min(order.len() - 2), (k + 1).min(order.len() - 1)));
            let azimuth = first_azimuth + step * column_of(i) as f64;
            wrapped(polar[i].azimuth - azimuth).abs() < 0.5 * step.abs()
                && (polar[i].elevation - order[k].0).abs() < 0.5 * gap
        });
        if (near.count() as f64) < SHARE * polar.len() as f64 {
            return None;
        }
        let spherical = Spherical {
            elevations: order.iter().map(|(e, _)| *e as f32).collect(),
            first_azimuth: wrapped(first_azimuth),
            azimuth_step: step,
        };
        let pixel = |i: usize| (polar[i].range > 0.0).then(|| new_row[place(i)[1]] * columns + column_of(i));
        let value = |i: usize| polar[i].range as f32;
        Some(self.filled(Projection::Spherical(spherical), [columns, order.len()], pixel, value))
    }

    fn filled(
        &self,
        projection: Projection,
        [columns, rows]: [usize; 2],
        pixel: impl Fn(usize) -> Option<usize>,
        value: impl Fn(usize) -> f32,
    ) -> RangeImage {
        let mut values = vec![0.0; columns * rows];
        let with_colors = !self.colors.is_empty() && self.colors.len() == self.points.len();
        let mut colors = vec![[0; 3]; if with_colors { values.len() } else { 0 }];
        for i in 0..self.points.len() {
            let Some(at) = pixel(i) else { continue };
            values[at] = value(i);
            if with_colors {
                colors[at] = self.colors[i];
            }
        }
        RangeImage::new(projection, columns, rows, values).with_colors(colors)
    }
}

/// A point in the lidar's coordinates.
struct Polar {
    range: f64,
    azimuth: f64,
    elevation: f64,
}

impl Polar {
    fn of(p: [f32; 3]) -> Self {
        let [x, y, z] = p.map(f64::from);
        let flat = x.hypot(y);
        Self { range: flat.hypot(z), azimuth: y.atan2(x), elevation: z.atan2(flat) }
    }
}

/// A least-squares line.
#[derive(Clone, Copy, Default)]
struct Line {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl Line {
    fn add(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
    }

    /// Slope and offset; `None` where all `x` are one.
    fn fit(&self) -> Option<[f64; 2]> {
        let spread = self.xx - self.x * self.x / self.n;
        let slope = (self.xy - self.x * self.y / self.n) / spread;
        (spread > 1e-6 && slope.is_finite()).then(|| [slope, (self.y - slope * self.x) / self.n])
    }
}

/// The angle in `(-pi, pi]`.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * ((angle - PI) / TAU).ceil()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of a bumpy room without some of its pixels, and its points.
    fn sensed(projection: Projection, columns: usize, rows: usize) -> (RangeImage, Vec<[f32; 3]>, Vec<u32>) {
        let value = |i: usize| {
            let (u, v) = ((i % columns) as f32, (i / columns) as f32);
            if i % 17 == 3 { 0.0 } else { 5.0 + (0.1 * u).sin() + (0.2 * v).cos() }
        };
        let values: Vec<f32> = (0..columns * rows).map(value).collect();
        let image = RangeImage::new(projection, columns, rows, values);
        let (pixels, points) = image.points().map(|(i, p)| (i as u32, p.map(|v| v as f32))).unzip();
        (image, points, pixels)
    }

    fn recovered(points: &[[f32; 3]], pixels: &[u32], columns: usize, rows: usize) -> Option<RangeImage> {
        OrganisedPoints { points, pixels, colors: &[], columns, rows }.image()
    }

    fn same_points(image: &RangeImage, points: &[[f32; 3]], tolerance: f64) {
        let mut found: Vec<[f64; 3]> = image.points().map(|(_, p)| p).collect();
        let mut expected: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
        assert_eq!(found.len(), expected.len());
        let order = |a: &[f64; 3], b: &[f64; 3]| {
            let key = |p: &[f64; 3]| p.map(|v| (v * 1e3).round() as i64);
            key(a).cmp(&key(b))
        };
        found.sort_by(order);
        expected.sort_by(order);
        for (p, q) in found.iter().zip(&expected) {
            assert!(crate::geom::vector::distance(*p, *q) < tolerance, "{p:?} {q:?}");
        }
    }

    #[test]
    fn cameras_are_found() {
        let camera = Pinhole { fx: 60.0, fy: 55.0, cx: 31.5, cy: 20.0 };
        let (image, points, pixels) = sensed(Projection::Pinhole(camera), 64, 48);
        let found = recovered(&points, &pixels, 64, 48).unwrap();
        let Projection::Pinhole(c) = found.projection else { panic!("{:?}", found.projection) };
        assert!((c.fx - 60.0).abs() < 1e-3 && (c.fy - 55.0).abs() < 1e-3 && (c.cx - 31.5).abs() < 1e-3);
        assert!(found.values.iter().zip(&image.values).all(|(a, b)| (a - b).abs() < 1e-5));
    }

    /// Elevations that are not evenly spaced, first row highest.
    fn lidar(columns: usize, step: f64) -> (RangeImage, Vec<[f32; 3]>, Vec<u32>) {
        let elevations = (0..16).map(|r| 0.3 - 0.03 * r as f32 - 0.0005 * (r * r) as f32).collect();
        sensed(
            Projection::Spherical(Spherical { elevations, first_azimuth: 2.9, azimuth_step: step }),
            columns,
            16,
        )
    }

    #[test]
    fn lidars_are_found_whole_in_part_and_turned_over() {
        for (columns, step) in [(200, TAU / 200.0), (200, -TAU / 200.0), (80, 0.01)] {
            let (image, points, pixels) = lidar(columns, step);
            let found = recovered(&points, &pixels, columns, 16).unwrap();
            let Projection::Spherical(s) = &found.projection else { panic!() };
            assert!((s.azimuth_step - step).abs() < 1e-5 && (s.first_azimuth - 2.9).abs() < 1e-3, "{s:?}");
            assert!(found.values.iter().zip(&image.values).all(|(a, b)| (a - b).abs() < 1e-5));
            // The lowest row first.
            let upside: Vec<u32> = pixels
                .iter()
                .map(|p| (15 - p / columns as u32) * columns as u32 + p % columns as u32)
                .collect();
            assert_eq!(recovered(&points, &upside, columns, 16).unwrap().values, found.values);
            // Rows as columns.
            let exchanged: Vec<u32> =
                pixels.iter().map(|p| p % columns as u32 * 16 + p / columns as u32).collect();
            assert_eq!(recovered(&points, &exchanged, 16, columns).unwrap().values, found.values);
        }
    }

    #[test]
    fn rows_that_were_turned_are_turned_back() {
        let (_, points, pixels) = lidar(200, TAU / 200.0);
        let staggered: Vec<u32> = pixels
            .iter()
            .map(|p| {
                let (row, column) = (p / 200, p % 200);
                row * 200 + (column + [0, 3, 6, 9][row as usize % 4]) % 200
            })
            .collect();
        let found = recovered(&points, &staggered, 200, 16).unwrap();
        same_points(&found, &points, 1e-4);
    }

    #[test]
    fn what_has_no_projection_has_no_image() {
        let (_, points, pixels) = lidar(200, TAU / 200.0);
        let shuffled: Vec<u32> = (0..pixels.len()).map(|i| pixels[(i * 7919) % pixels.len()]).collect();
        assert!(recovered(&points, &shuffled, 200, 16).is_none());
        assert!(recovered(&points[..20], &pixels[..20], 200, 16).is_none());
        assert!(recovered(&points, &pixels, 100, 16).is_none());
        assert!(recovered(&points, &pixels[1..], 200, 16).is_none());
        let mut broken = points.clone();
        broken[3][1] = f32::NAN;
        assert!(recovered(&broken, &pixels, 200, 16).is_none());
        assert!(recovered(&vec![[0.0; 3]; 640], &(0..640).collect::<Vec<_>>(), 64, 10).is_none());
    }
}
