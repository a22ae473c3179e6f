//! A turn of a moving lidar as strips of columns, each as if taken at one moment.

use super::{PointScan, Projection, RangeImage, Spherical};
use crate::geom::vector::{add, norm};
use crate::geom::{Pose, Trajectory};
use std::f64::consts::{PI, TAU};

/// A scan of points as its sensor delivered it, where its motion was taken out of the points ([`PointScan::deskew`]): rings are
/// rings here.
#[derive(Clone, Debug, PartialEq)]
pub struct Delivered {
    /// Surfaces, in the sensor's frame of their moment (meters).
    pub(super) points: Vec<[f32; 3]>,
    /// Free ends, the same.
    pub(super) free_ends: Vec<[f32; 3]>,
    /// Where all rays begin in that frame (meters).
    pub(super) origin: [f64; 3],
    /// `scan_from_sensor` by the times of the points.
    pub(super) scan_from_sensor: Trajectory<3>,
}

impl Delivered {
    /// Points, free ends and their common origin, for the search for rows and columns.
    pub(crate) fn rays(&self) -> (&[[f32; 3]], &[[f32; 3]], [f64; 3]) {
        (&self.points, &self.free_ends, self.origin)
    }
}

/// Within a strip the lidar turns at most so far (radians) and moves at most this share of a cell: what is wrong within it then is
/// far below what a cell resolves.
const MOST_TURN: f64 = 0.0044;
const MOST_WAY_CELLS: f64 = 0.1;
/// A strip has at least so many columns.
const FEWEST_COLUMNS: usize = 8;
/// Readings of a column whose times differ by more than this share of the scan are of two turns.
const ONE_COLUMN: f64 = 0.02;

/// Share of the readings that strips must show; else times are in no order of columns, and rays lose nothing.
const FEWEST_SHOWN: f64 = 0.95;

/// The strips of a scan, for maps with cells of this edge (meters): images with their `scan_from_image`, next to each other, that
/// share a column each. `image` is about the common origin of what was delivered, with columns once round. `None` where columns
/// have no times in order: a sensor of another kind.
///
/// A turn of the lidar while it scans changes the azimuth from one column to the next, and a strip has the step that it has. What
/// is seen twice in one turn, at its seam, is there twice; where nothing was seen between its end and its beginning nothing is.
pub(crate) fn strips(scan: &PointScan, image: &RangeImage, cell: f64) -> Option<Vec<(Pose<3>, RangeImage)>> {
    let delivered = scan.delivered.as_deref()?;
    let Projection::Spherical(lidar) = &image.projection else { return None };
    if !image.is_full_turn() {
        return None;
    }
    let times = Times::of(delivered, &scan.times, lidar, image)?;
    let (first, last) = delivered.scan_from_sensor.span()?;
    let about = Pose { translation: delivered.origin, ..Pose::IDENTITY };
    let mut motion = delivered.scan_from_sensor.motion(f64::INFINITY);
    let mut at = |time: f64| motion.at(time.clamp(first, last)).ok().map(|pose| pose * about);
    let whole = at(first)?.inverse() * at(last)?;
    let cos =
        (0.5 * (whole.rotation[0][0] + whole.rotation[1][1] + whole.rotation[2][2] - 1.0)).clamp(-1.0, 1.0);
    let parts = (cos.acos() / MOST_TURN).max(norm(whole.translation) / (MOST_WAY_CELLS * cell)).ceil();
    let columns = image.columns;
    let width = ((columns as f64 / parts.max(1.0)) as usize).clamp(FEWEST_COLUMNS, columns);

    let mut all = Vec::new();
    for run in times.runs() {
        let mut from = 0;
        while from + 1 < run.len() {
            let to = (from + width).min(run.len() - 1);
            let part = &run[from..=to];
            let middle = part[part.len() / 2];
            let scan_from_image = at(times.column[middle])?;
            let image_from_scan = scan_from_image.inverse();
            let moved: Vec<Pose<3>> =
                part.iter().map(|c| Some(image_from_scan * at(times.column[*c])?)).collect::<Option<_>>()?;
            all.push((scan_from_image, times.strip(image, lidar, part, &moved)?));
            from = to;
        }
    }
    let shown: usize = all.iter().map(|(_, strip): &(Pose<3>, RangeImage)| strip.hits()).sum();
    (shown as f64 >= FEWEST_SHOWN * image.hits() as f64).then_some(all)
}

/// When the pixels of an image were measured.
struct Times {
    /// Of each column; NaN where nothing says so.
    column: Vec<f64>,
    /// Of each pixel with a surface.
    pixel: Vec<f32>,
    /// The most by which times of one column differ (seconds).
    spread: f64,
}

impl Times {
    fn of(delivered: &Delivered, times: &[f32], lidar: &Spherical, image: &RangeImage) -> Option<Self> {
        let (first, last) =
            times.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
        let spread = ONE_COLUMN * f64::from(last - first);
        let mut pixel = vec![f32::NAN; image.values.len()];
        let mut by_column: Vec<Vec<f32>> = vec![Vec::new(); image.columns];
        for (p, t) in delivered.points.iter().zip(times) {
            let [x, y, z]: [f64; 3] = std::array::from_fn(|k| f64::from(p[k]) - delivered.origin[k]);
            let turn = (y.atan2(x) - lidar.first_azimuth) / lidar.azimuth_step;
            let column = (turn.round() as i64).rem_euclid(image.columns as i64) as usize;
            by_column[column].push(*t);
            let flat = x.hypot(y);
            let elevation = z.atan2(flat) as f32;
            let below = lidar.elevations.partition_point(|e| *e > elevation);
            let near = |r: &usize| (lidar.elevations[*r] - elevation).abs();
            let rows = [below.checked_sub(1), (below < image.rows).then_some(below)];
            let Some(row) = rows.into_iter().flatten().min_by(|a, b| near(a).total_cmp(&near(b))) else {
                continue;
            };
            // The nearest of several has the pixel; so has its time.
            let at = row * image.columns + column;
            if (f64::from(image.values[at]) - flat.hypot(z)).abs() <= 1e-3 {
                pixel[at] = *t;
            }
        }
        let middle = |mut all: Vec<f32>| {
            let half = all.len() / 2;
            if all.is_empty() {
                f64::NAN
            } else {
                f64::from(*all.select_nth_unstable_by(half, f32::total_cmp).1)
            }
        };
        let column: Vec<f64> = by_column.into_iter().map(middle).collect();
        let known = column.iter().filter(|t| t.is_finite()).count();
        (2 * known > image.columns && spread > 0.0).then_some(Self { column: filled(column)?, pixel, spread })
    }

    /// Columns next to each other whose times go on: a turn, cut where it begins.
    fn runs(&self) -> Vec<Vec<usize>> {
        let n = self.column.len();
        let goes_on = |c: usize| (self.column[(c + 1) % n] - self.column[c]).abs() <= self.spread;
        let cut = (0..n).find(|c| !goes_on(*c)).map_or(0, |c| c + 1);
        let mut runs: Vec<Vec<usize>> = vec![Vec::new()];
        for k in 0..n {
            let c = (cut + k) % n;
            if let Some(run) = runs.last_mut() {
                run.push(c);
            }
            if !goes_on(c) && k + 1 < n {
                runs.push(Vec::new());
            }
        }
        // Times that jump all the time are those of no turn; without a cut the last column is beside the first.
        if cut == 0
            && goes_on(n - 1)
            && let Some(run) = runs.last_mut()
        {
            run.push(0);
        }
        runs
    }

    /// The image of these columns, `moved` being `image_from_sensor` of each. `None` where azimuths do not go on.
    fn strip(
        &self,
        image: &RangeImage,
        lidar: &Spherical,
        part: &[usize],
        moved: &[Pose<3>],
    ) -> Option<RangeImage> {
        let azimuth = |k: usize| {
            let (sin, cos) = (lidar.first_azimuth + lidar.azimuth_step * part[k] as f64).sin_cos();
            let [x, y, _] = moved[k].rotate([cos, sin, 0.0]);
            y.atan2(x)
        };
        let last = part.len() - 1;
        let (from, to) = (azimuth(0), azimuth(last));
        let nominal = lidar.azimuth_step * last as f64;
        // The whole turns that the two ends do not tell.
        let way = nominal + wrapped(to - from - nominal);
        let azimuth_step = way / last as f64;
        if !(0.5..2.0).contains(&(azimuth_step / lidar.azimuth_step)) || way.abs() > TAU {
            return None;
        }
        let mut values = vec![0.0f32; part.len() * image.rows];
        for row in 0..image.rows {
            for (k, &column) in part.iter().enumerate() {
                let at = row * image.columns + column;
                let value = image.values[at];
                let other_turn = (f64::from(self.pixel[at]) - self.column[column]).abs() > self.spread;
                if value == 0.0 || other_turn {
                    continue;
                }
                let ray = image.ray(column as f64, row);
                let end = ray.map(|r| r * f64::from(value.abs()));
                let range = norm(add(moved[k].rotate(end), moved[k].translation));
                values[row * part.len() + k] = range.copysign(f64::from(value)) as f32;
            }
        }
        let spherical =
            Spherical { elevations: lidar.elevations.clone(), first_azimuth: wrapped(from), azimuth_step };
        Some(RangeImage::from_ranges(spherical, part.len(), values))
    }
}

/// Columns without a reading get the time between those of their neighbours. `None` where there is no time at all.
fn filled(mut times: Vec<f64>) -> Option<Vec<f64>> {
    let n = times.len();
    let known: Vec<usize> = (0..n).filter(|c| times[*c].is_finite()).collect();
    let (first, last) = (*known.first()?, *known.last()?);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for c in a + 1..b {
            let share = (c - a) as f64 / (b - a) as f64;
            // Across a seam the nearer of the two is right, and between is nothing.
            times[c] = if share < 0.5 { times[a] } else { times[b] };
        }
    }
    (0..first).for_each(|c| times[c] = times[first]);
    (last + 1..n).for_each(|c| times[c] = times[last]);
    Some(times)
}

/// The angle in `(-pi, pi]`.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * ((angle - PI) / TAU).ceil()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Aabb;
    use crate::scan::LayoutFinder;

    const COLUMNS: usize = 512;

    /// Constant twist: 2 m/s, 90 degrees/s about a leaning axis.
    fn pose(time: f64) -> Pose<3> {
        let half = 0.5 * std::f64::consts::FRAC_PI_2;
        let axis = [0.1, -0.05, 1.0].map(|v: f64| v / (1.0f64 + 0.0125).sqrt());
        let q = [axis[0] * half.sin(), axis[1] * half.sin(), axis[2] * half.sin(), half.cos()];
        let second = Pose::<3>::from_quaternion([2.0, 0.0, 0.05], q).unwrap();
        Pose::IDENTITY.toward(&second, time)
    }

    const ROOM: Aabb<3> = Aabb { min: [-6.0, -5.0, -1.0], max: [7.0, 5.0, 3.0] };

    /// A turn of a lidar in a room, `direction` columns a time step; its first column looks along y.
    fn turned(direction: f64) -> PointScan {
        let (mut points, mut times) = (Vec::new(), Vec::new());
        for column in 0..COLUMNS {
            let share = column as f64 / COLUMNS as f64;
            let (time, azimuth) = (0.1 * share, 0.5 * PI + direction * TAU * share);
            let at = pose(time);
            for ring in 0..32 {
                let e = 0.35 - 0.02 * f64::from(ring);
                let ray = [e.cos() * azimuth.cos(), e.cos() * azimuth.sin(), e.sin()];
                let world = at.rotate(ray);
                let range = (0..3)
                    .map(|k| {
                        let wall = if world[k] > 0.0 { ROOM.max[k] } else { ROOM.min[k] };
                        (wall - at.translation[k]) / world[k]
                    })
                    .fold(f64::INFINITY, f64::min);
                points.push(ray.map(|v| (v * range) as f32));
                times.push(time as f32);
            }
        }
        let mut scan = PointScan::new(points, [0.0; 3]);
        scan.times = times;
        let trajectory = Trajectory::new((0..30).map(|k| 0.01 * f64::from(k)).map(|t| (t, pose(t)))).unwrap();
        scan.deskew(&pose(0.0), &mut trajectory.motion(0.1), 0.0).unwrap();
        scan
    }

    #[test]
    fn every_strip_shows_the_room_where_it_is() {
        for direction in [1.0, -1.0] {
            let scan = turned(direction);
            let (points, _, origin) = scan.delivered.as_deref().unwrap().rays();
            let image = LayoutFinder::default().image(points, origin, 0.1).unwrap();
            let strips = strips(&scan, &image, 0.1).unwrap();
            assert!((30..50).contains(&strips.len()), "{}", strips.len());
            let (mut shown, mut worst) = (0, 0.0f64);
            for (scan_from_image, strip) in &strips {
                assert_eq!(strip.check(), Ok(()));
                shown += strip.hits();
                for (_, p) in strip.points() {
                    // The scan's pose is the identity.
                    let p = scan_from_image.transform_point(p);
                    let off = |k: usize| (p[k] - ROOM.min[k]).min(ROOM.max[k] - p[k]).abs();
                    worst = worst.max((0..3).map(off).fold(f64::INFINITY, f64::min));
                }
            }
            // Pixels of one column a strip are in two.
            assert!(shown + 64 >= points.len(), "{direction}: {shown} of {}", points.len());
            assert!(worst < 0.01, "{direction}: {worst}");
        }
    }

    #[test]
    fn times_without_order_are_no_turn() {
        let mut scan = turned(1.0);
        let count = scan.times.len();
        scan.times = (0..count).map(|i| 0.1 * ((i * 7919) % count) as f32 / count as f32).collect();
        let (points, _, origin) = scan.delivered.as_deref().unwrap().rays();
        let image = LayoutFinder::default().image(points, origin, 0.1).unwrap();
        assert!(strips(&scan, &image, 0.1).is_none());
    }
}
