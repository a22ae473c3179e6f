//! Readings of a sensor as scans: points, ranges of a planar laser, rings of a lidar, depth images.

use numpy::{PyArrayDescrMethods, PyUntypedArrayMethods};
use portolan::scan::{Frame, FrameFilter, Pinhole, PointScan, RangeImage, RangeLimits, Scan, Spherical};
use pyo3::prelude::*;

use crate::arrays::{Numbers, Points, checked, converted, shown};
use crate::dimension::Either;
use crate::fault::value_error;

/// A scan of either dimension.
pub(crate) type AnyScan = Either<Scan<2>, Frame>;

/// Depth cameras do not see so far (meters): such readings are in another unit, unless it is said.
const FAR: f32 = 100.0;

/// The arguments of `integrate` that are about readings.
pub(crate) struct Readings<'a, 'py> {
    pub(crate) points: Option<&'a Bound<'py, PyAny>>,
    pub(crate) ranges: Option<&'a Bound<'py, PyAny>>,
    pub(crate) bearings: Option<&'a Bound<'py, PyAny>>,
    pub(crate) elevations: Option<&'a Bound<'py, PyAny>>,
    pub(crate) depth: Option<&'a Bound<'py, PyAny>>,
    pub(crate) intrinsics: Option<&'a Bound<'py, PyAny>>,
    pub(crate) depth_scale: Option<f64>,
    pub(crate) colors: Option<&'a Bound<'py, PyAny>>,
    pub(crate) origin: Option<&'a Bound<'py, PyAny>>,
    pub(crate) min_range: Option<f64>,
    pub(crate) max_range: Option<f64>,
    pub(crate) no_return: Option<f64>,
    pub(crate) no_return_free: Option<f64>,
}

impl<'py> Readings<'_, 'py> {
    /// The scan. Arguments that its kind has no use for are refused, not ignored.
    pub(crate) fn scan(&self) -> PyResult<AnyScan> {
        self.check_limits()?;
        match (self.points, self.ranges, self.depth) {
            (Some(points), None, None) => {
                let only = "is for depth images and ranges; points were given";
                self.refuse(
                    &["bearings", "elevations", "intrinsics", "depth_scale", "no_return", "no_return_free"],
                    only,
                )?;
                self.of_points(points)
            }
            (None, Some(ranges), None) => {
                self.refuse(&["intrinsics", "depth_scale", "origin", "colors"], "is not for ranges")?;
                self.of_ranges(ranges)
            }
            (None, None, Some(depth)) => {
                let only = "is not for depth images";
                self.refuse(&["bearings", "elevations", "origin", "no_return", "no_return_free"], only)?;
                self.of_depth(depth).map(Either::Three)
            }
            (None, None, None) => Err(value_error("points, ranges or depth must be given")),
            _ => Err(value_error("points, ranges, depth: give one of them")),
        }
    }

    fn check_limits(&self) -> PyResult<()> {
        let all = [
            ("min_range", self.min_range),
            ("max_range", self.max_range),
            ("no_return", self.no_return),
            ("no_return_free", self.no_return_free),
        ];
        if let Some((name, v)) =
            all.into_iter().find_map(|(name, v)| Some((name, v.filter(|v| !(*v >= 0.0))?)))
        {
            return Err(value_error(format!("{name}: must be a length in meters, not negative, got {v}")));
        }
        match (self.min_range.unwrap_or(0.0), self.max_range.unwrap_or(f64::INFINITY)) {
            (min, max) if min >= max => {
                Err(value_error(format!("min_range: must be below max_range ({max}), got {min}")))
            }
            _ => Ok(()),
        }
    }

    fn refuse(&self, names: &[&str], why: &str) -> PyResult<()> {
        let given = [
            ("bearings", self.bearings.is_some()),
            ("elevations", self.elevations.is_some()),
            ("intrinsics", self.intrinsics.is_some()),
            ("depth_scale", self.depth_scale.is_some()),
            ("colors", self.colors.is_some()),
            ("origin", self.origin.is_some()),
            ("no_return", self.no_return.is_some()),
            ("no_return_free", self.no_return_free.is_some()),
        ];
        match given.iter().find(|(name, given)| *given && names.contains(name)) {
            Some((name, _)) => Err(value_error(format!("{name}: {why}"))),
            None => Ok(()),
        }
    }

    fn limits(&self) -> RangeLimits {
        let open = RangeLimits::default();
        RangeLimits {
            min: self.min_range.unwrap_or(open.min),
            max: self.max_range.unwrap_or(open.max),
            no_return: self.no_return.unwrap_or(open.no_return),
            no_return_free: self.no_return_free.unwrap_or(open.no_return_free),
        }
    }

    /// The limits of range on a 3-D scan.
    fn filtered(&self, frame: Frame) -> Frame {
        if self.min_range.is_none() && self.max_range.is_none() {
            return frame;
        }
        let open = FrameFilter::default();
        let filter = FrameFilter {
            min_range: self.min_range.unwrap_or(open.min_range),
            max_range: self.max_range.unwrap_or(open.max_range),
            ..open
        };
        filter.apply(frame).0
    }

    fn of_points(&self, given: &Bound<'py, PyAny>) -> PyResult<AnyScan> {
        let points = Points::of(given, "points")?;
        if points.shape().len() != 2 {
            return Err(value_error(format!(
                "points: an array of shape {} was given; (N, 2) or (N, 3) are wanted",
                shown(points.shape())
            )));
        }
        match points.chunks()? {
            Either::Two(points) => {
                self.refuse(&["colors", "origin"], "is for 3-D points")?;
                if self.min_range.is_none() && self.max_range.is_none() {
                    return Ok(Either::Two(Scan::from_points(points)));
                }
                let bearings: Vec<_> = points.iter().map(|p| p[1].atan2(p[0])).collect();
                let ranges: Vec<_> = points.iter().map(|p| p[0].hypot(p[1])).collect();
                Ok(Either::Two(Scan::from_laser(&bearings, &ranges, &self.limits())))
            }
            Either::Three(points) => {
                let origin = match self.origin {
                    Some(origin) => Numbers::of(origin, "origin")?.exactly::<3>()?,
                    None => [0.0; 3],
                };
                let mut scan = PointScan::new(points.iter().map(|p| p.map(|v| v as f32)), origin);
                if let Some(colors) = self.colors {
                    let colors = colors_of(colors, &[points.len(), 3], "points")?;
                    if scan.points.len() != points.len() {
                        return Err(value_error(format!(
                            "points: {} of {} are not finite or lie on the sensor, so that colors do not fit; leave them out",
                            points.len() - scan.points.len(),
                            points.len()
                        )));
                    }
                    scan.colors = colors;
                }
                Ok(Either::Three(self.filtered(Frame::Points(scan))))
            }
        }
    }

    fn of_ranges(&self, given: &Bound<'py, PyAny>) -> PyResult<AnyScan> {
        let ranges = Numbers::of(given, "ranges")?;
        let Some(bearings) = self.bearings else {
            return Err(value_error("bearings: must be given with ranges, one for each (radians)"));
        };
        let bearings = Numbers::of(bearings, "bearings")?;
        let angles = bearings.values()?;
        if let Some(i) = angles.iter().position(|v| !v.is_finite()) {
            return Err(value_error(format!("bearings: number {i} is {}", angles[i])));
        }
        let (least, most) = angles.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        // A seam that is named twice is a little more than a turn.
        if most - least > 1.05 * std::f64::consts::TAU {
            return Err(value_error(format!(
                "bearings: from {least} to {most} is more than a turn; they are radians, not degrees"
            )));
        }
        let one_each = |n: usize| match bearings.shape() == [n] {
            true => Ok(()),
            false => Err(bearings.wrong(bearings.shape(), &format!("{n} bearings, one for each range,"))),
        };
        match (ranges.shape(), self.elevations) {
            (&[n], None) => {
                one_each(n)?;
                Ok(Either::Two(Scan::from_laser(angles, ranges.values()?, &self.limits())))
            }
            (&[rows, columns], Some(elevations)) => {
                one_each(columns)?;
                self.refuse(&["no_return", "no_return_free"], "is for planar lasers; rings were given")?;
                let elevations = Numbers::of(elevations, "elevations")?;
                if elevations.shape() != [rows] {
                    return Err(
                        elevations.wrong(elevations.shape(), &format!("{rows} elevations, one a row,"))
                    );
                }
                let image = rings(angles, elevations.values()?, ranges.values()?)?;
                Ok(Either::Three(self.filtered(Frame::Image(image))))
            }
            (shape, elevations) => Err(ranges.wrong(
                shape,
                if elevations.is_some() {
                    "ranges of shape (rows, columns), with elevations (rows,) and bearings (columns,),"
                } else {
                    "ranges of shape (N,), or (rows, columns) with elevations,"
                },
            )),
        }
    }

    fn of_depth(&self, given: &Bound<'py, PyAny>) -> PyResult<Frame> {
        let array = checked(given, "depth")?;
        let kind = array.dtype().kind();
        let &[rows, columns] = array.shape() else {
            return Err(value_error(format!(
                "depth: an array of shape {} was given; (rows, columns) is wanted",
                shown(array.shape())
            )));
        };
        let camera = self.camera()?;
        let depth = converted::<f32>(&array, "f4")?;
        let scale = match self.depth_scale {
            Some(scale) if scale > 0.0 && scale.is_finite() => scale,
            Some(scale) => return Err(value_error(format!("depth_scale: must be positive, got {scale}"))),
            // Whole numbers are seldom meters: a guess here would be a map of the wrong size.
            None if kind != b'f' => {
                return Err(value_error(
                    "depth_scale: must be given for whole numbers: 1000 where they are millimeters, 1 where they are meters",
                ));
            }
            None => 1.0,
        };
        let depths: Vec<f32> = match scale == 1.0 {
            true => depth.as_slice()?.to_vec(),
            false => depth.as_slice()?.iter().map(|d| (f64::from(*d) / scale) as f32).collect(),
        };
        if self.depth_scale.is_none() {
            let mut seen: Vec<f32> = depths.iter().copied().filter(|d| *d > 0.0).collect();
            let middle = seen.len() / 2;
            if !seen.is_empty() && *seen.select_nth_unstable_by(middle, f32::total_cmp).1 > FAR {
                return Err(value_error(format!(
                    "depth: half of the readings are beyond {FAR} m; give depth_scale, 1000 where they are millimeters, 1 where they \
                     are meters"
                )));
            }
        }
        let mut image = RangeImage::from_depth(camera, columns, rows, depths);
        if let Some(colors) = self.colors {
            image = image.with_colors(colors_of(colors, &[rows, columns, 3], "depth")?);
        }
        image.check().map_err(|why| value_error(format!("depth: {why}")))?;
        Ok(self.filtered(Frame::Image(image)))
    }

    fn camera(&self) -> PyResult<Pinhole> {
        let Some(given) = self.intrinsics else {
            return Err(value_error(
                "intrinsics: must be given with depth: (fx, fy, cx, cy) in pixels, or a 3 x 3 matrix",
            ));
        };
        let numbers = Numbers::of(given, "intrinsics")?;
        let v = numbers.values()?;
        let [fx, fy, cx, cy] = match numbers.shape() {
            [4] => [v[0], v[1], v[2], v[3]],
            [3, 3] => {
                let rest = [v[1].abs(), v[3].abs(), v[6].abs(), v[7].abs(), (v[8] - 1.0).abs()];
                if rest.iter().any(|r| !(*r < 1e-9)) {
                    return Err(value_error(
                        "intrinsics: the matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew",
                    ));
                }
                [v[0], v[4], v[2], v[5]]
            }
            shape => return Err(numbers.wrong(shape, "(fx, fy, cx, cy) or a 3 x 3 matrix")),
        };
        Ok(Pinhole { fx, fy, cx, cy })
    }
}

/// A turning lidar's rows, the highest first.
fn rings(bearings: &[f64], elevations: &[f64], ranges: &[f64]) -> PyResult<RangeImage> {
    let columns = bearings.len();
    let step = match bearings {
        [first, .., last] => (last - first) / (columns - 1) as f64,
        _ => return Err(value_error("bearings: at least two columns are wanted")),
    };
    let even = bearings
        .iter()
        .enumerate()
        .all(|(i, b)| (b - bearings[0] - i as f64 * step).abs() < 1e-3 * step.abs());
    if !even || step == 0.0 {
        return Err(value_error(
            "bearings: columns of rings must be at even steps; give points where they are not",
        ));
    }
    let descending = elevations.windows(2).all(|w| w[0] > w[1]);
    let ascending = elevations.windows(2).all(|w| w[0] < w[1]);
    if !(descending || ascending) {
        return Err(value_error("elevations: must ascend or descend"));
    }
    let rows = ranges.chunks(columns);
    let (elevations, values): (Vec<f32>, Vec<f32>) = if descending {
        (elevations.iter().map(|v| *v as f32).collect(), rows.flatten().map(|v| *v as f32).collect())
    } else {
        (
            elevations.iter().rev().map(|v| *v as f32).collect(),
            rows.rev().flatten().map(|v| *v as f32).collect(),
        )
    };
    let lidar = Spherical { elevations, first_azimuth: bearings[0], azimuth_step: step };
    let image = RangeImage::from_ranges(lidar, columns, values);
    image.check().map_err(|why| value_error(format!("ranges: {why}")))?;
    Ok(image)
}

/// Red, green and blue of each reading, as bytes.
fn colors_of(given: &Bound<'_, PyAny>, shape: &[usize], of: &str) -> PyResult<Vec<[u8; 3]>> {
    let array = checked(given, "colors")?;
    if array.shape() != shape {
        return Err(value_error(format!(
            "colors: an array of shape {} was given; {} is wanted, as {of}",
            shown(array.shape()),
            shown(shape)
        )));
    }
    if !matches!((array.dtype().kind(), array.dtype().itemsize()), (b'u', 1)) {
        return Err(value_error(format!("colors: must be bytes (uint8, 0 to 255), got {}", array.dtype())));
    }
    Ok(converted::<u8>(&array, "u1")?.as_slice()?.as_chunks().0.to_vec())
}
