//! Organised 3-D scans: rows and columns, and where a pixel looks.

use super::RefusedBeams;

/// A pinhole camera without distortion, in the axes of computer vision: x right, y down, z forward. Pixel `(u, v)`
/// has its center at `u`, `v` exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Focal length along x (pixels).
    pub fx: f64,
    /// Focal length along y (pixels).
    pub fy: f64,
    /// Principal point, x (pixels).
    pub cx: f64,
    /// Principal point, y (pixels).
    pub cy: f64,
}

/// A turning lidar: every row a ring of one elevation, every column an azimuth.
#[derive(Clone, Debug, PartialEq)]
pub struct Spherical {
    /// Elevation of each row above the sensor's x-y plane (radians), strictly descending: the first row looks highest.
    pub elevations: Vec<f32>,
    /// Azimuth of column 0 (radians, counter-clockwise from x).
    pub first_azimuth: f64,
    /// Azimuth from one column to the next (radians); negative: clockwise.
    pub azimuth_step: f64,
}

/// Parallel rays along -z of the sensor's frame: a scanner whose origin is at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthographic {
    /// x and y of the center of pixel `(0, 0)` (meters).
    pub first: [f64; 2],
    /// From one column to the next along x, from one row to the next along y (meters).
    pub step: [f64; 2],
}

/// Where the pixels of a [`RangeImage`] look, and what their values measure.
#[derive(Clone, Debug, PartialEq)]
pub enum Projection {
    /// Values are depths: z of the surface.
    Pinhole(Pinhole),
    /// Values are ranges: the distance from the sensor.
    Spherical(Spherical),
    /// Values are depths below the plane z = `top`, so that they are positive.
    Orthographic {
        /// The rays.
        rays: Orthographic,
        /// z of the plane from which values are measured downwards (meters); everything lies below it.
        top: f64,
    },
}

/// An organised scan: one value per pixel, row by row, in the sensor's frame.
///
/// A positive value is a surface (meters, of what the projection says). 0: nothing is known. A negative value: no
/// surface up to so far.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeImage {
    /// Where pixels look.
    pub projection: Projection,
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// `columns * rows` values (meters), row by row.
    pub values: Vec<f32>,
    /// Red, green, blue of each pixel, if the sensor sees color. Empty: it does not.
    pub colors: Vec<[u8; 3]>,
    /// Which pixels have a color: one that another camera did not see has none. Empty: all, where there are colors.
    pub colored: Vec<bool>,
    /// Readings that were refused when the image was built, by cause.
    pub refused: RefusedBeams,
}

impl RangeImage {
    /// An image of one value per pixel, row by row (meters, of what the projection says), without colors. Nothing is checked
    /// here: see [`RangeImage::check`]. For cameras and lidars see [`RangeImage::from_depth`] and
    /// [`RangeImage::from_ranges`].
    pub fn new(projection: Projection, columns: usize, rows: usize, values: impl Into<Vec<f32>>) -> Self {
        let (values, colors, refused) = (values.into(), Vec::new(), RefusedBeams::default());
        Self { projection, columns, rows, values, colors, colored: Vec::new(), refused }
    }

    /// The image of a depth camera: depths along its axis (meters), row by row; 0 where there is no reading.
    ///
    /// ```
    /// use portolan::scan::{Pinhole, RangeImage};
    ///
    /// let camera = Pinhole { fx: 2.0, fy: 2.0, cx: 0.5, cy: 0.0 };
    /// let image = RangeImage::from_depth(camera, 2, 1, [0.0, 3.0]).with_colors([[0; 3], [255, 0, 0]]);
    /// assert_eq!(image.check(), Ok(()));
    /// assert_eq!(image.points().collect::<Vec<_>>(), [(1, [0.75, 0.0, 3.0])]);
    /// ```
    pub fn from_depth(camera: Pinhole, columns: usize, rows: usize, depths: impl Into<Vec<f32>>) -> Self {
        Self::new(Projection::Pinhole(camera), columns, rows, depths)
    }

    /// The image of a turning lidar: ranges (meters), ring by ring, the highest first; 0 where there is no reading.
    pub fn from_ranges(lidar: Spherical, columns: usize, ranges: impl Into<Vec<f32>>) -> Self {
        let rows = lidar.elevations.len();
        Self::new(Projection::Spherical(lidar), columns, rows, ranges)
    }

    /// The same image with a color (red, green, blue) for each pixel.
    pub fn with_colors(self, colors: impl Into<Vec<[u8; 3]>>) -> Self {
        Self { colors: colors.into(), colored: Vec::new(), ..self }
    }

    /// The same image with the colors that some of its pixels have.
    pub fn with_some_colors(self, colors: impl IntoIterator<Item = Option<[u8; 3]>>) -> Self {
        let (colors, colored) = colors.into_iter().map(|c| (c.unwrap_or_default(), c.is_some())).unzip();
        Self { colors, colored, ..self }
    }

    /// Whether rows, columns, values and rays fit together, so that every pixel has a ray. O(rows).
    ///
    /// Maps check their images: one that fails is refused, and nothing of it is used. Its values may be
    /// anything.
    ///
    /// # Errors
    /// The reason, in words.
    pub fn check(&self) -> Result<(), &'static str> {
        let cells = self.columns.saturating_mul(self.rows);
        let fits = |holds: bool, why: &'static str| if holds { Ok(()) } else { Err(why) };
        fits(cells > 0, "it has no pixels")?;
        let largest = self.columns.max(self.rows);
        fits(
            largest <= 1 << 20 && cells <= 1 << 28,
            "it has more than 2^20 rows or columns, or 2^28 pixels",
        )?;
        fits(self.values.len() == cells, "its values are not one per pixel")?;
        fits(self.colors.is_empty() || self.colors.len() == cells, "its colors are not one per pixel")?;
        fits(
            self.colored.is_empty() || self.colored.len() == self.colors.len(),
            "which of its pixels have a color is not told of each",
        )?;
        match &self.projection {
            Projection::Pinhole(c) => {
                fits(c.fx.is_normal() && c.fy.is_normal(), "a focal length is 0 or not finite")?;
                fits(c.cx.is_finite() && c.cy.is_finite(), "its principal point is not finite")
            }
            Projection::Spherical(s) => {
                fits(
                    s.elevations.len() == self.rows && self.rows <= usize::from(u16::MAX),
                    "its elevations are not one per row",
                )?;
                fits(
                    s.elevations.iter().all(|e| e.abs() < 1.58),
                    "an elevation is no angle up to 90 degrees",
                )?;
                fits(s.elevations.windows(2).all(|w| w[0] > w[1]), "its elevations do not descend")?;
                fits(
                    s.first_azimuth.is_finite() && s.azimuth_step.is_normal(),
                    "its azimuths are not finite, or do not differ",
                )?;
                // Half a column for rounding.
                let turn = std::f64::consts::TAU * 1.0005 + 0.5 * s.azimuth_step.abs();
                fits(self.columns as f64 * s.azimuth_step.abs() < turn, "its columns go round more than once")
            }
            Projection::Orthographic { rays, top } => {
                fits(rays.step.iter().all(|s| s.is_normal()), "a step between its rays is 0 or not finite")?;
                fits(rays.first.iter().chain([top]).all(|v| v.is_finite()), "its rays are not finite")
            }
        }
    }

    /// Whether the columns of a turning sensor go once round, so that the last one is a neighbor of the first: where a full
    /// turn has as many columns as the image to within half a column. One column less leaves a gap as wide as two steps, in
    /// which nothing was measured; one more looks where the first one does. Both are no neighbors of the first.
    pub fn is_full_turn(&self) -> bool {
        let Projection::Spherical(s) = &self.projection else { return false };
        (std::f64::consts::TAU / s.azimuth_step.abs() - self.columns as f64).abs() < 0.5
    }

    /// The unit of a pixel's value in the sensor's frame: a surface of value `v` lies at `ray * v` (pinhole, spherical).
    /// Pixel coordinates may lie between pixels. For parallel rays use [`RangeImage::point`].
    #[inline]
    pub fn ray(&self, column: f64, row: usize) -> [f64; 3] {
        match &self.projection {
            Projection::Pinhole(c) => [(column - c.cx) / c.fx, (row as f64 - c.cy) / c.fy, 1.0],
            Projection::Spherical(s) => {
                let (sin_a, cos_a) = (s.first_azimuth + column * s.azimuth_step).sin_cos();
                let (sin_e, cos_e) = f64::from(s.elevations[row]).sin_cos();
                [cos_e * cos_a, cos_e * sin_a, sin_e]
            }
            Projection::Orthographic { .. } => [0.0, 0.0, -1.0],
        }
    }

    /// Where the surface of a pixel lies in the sensor's frame, for a positive value.
    #[inline]
    pub fn point(&self, column: usize, row: usize, value: f64) -> [f64; 3] {
        if let Projection::Orthographic { rays, top } = &self.projection {
            return [
                rays.first[0] + column as f64 * rays.step[0],
                rays.first[1] + row as f64 * rays.step[1],
                top - value,
            ];
        }
        self.ray(column as f64, row).map(|k| k * value)
    }

    /// The points of all surfaces in the sensor's frame, row by row, with the index of their pixels.
    pub fn points(&self) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        self.values.iter().enumerate().filter(|(_, v)| **v > 0.0).map(|(i, &v)| {
            let (row, column) = (i / self.columns, i % self.columns);
            (i, self.point(column, row, f64::from(v)))
        })
    }

    /// Origin and end of every reading in the sensor's frame, row by row, and whether a surface is at the end.
    pub fn readings(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3], bool)> + '_ {
        (0..self.values.len()).filter_map(|pixel| self.reading(pixel))
    }

    /// Origin and end of a pixel's reading in the sensor's frame, and whether a surface is at the end; `None`: it has none.
    #[inline]
    pub fn reading(&self, pixel: usize) -> Option<([f64; 3], [f64; 3], bool)> {
        let v = self.values[pixel];
        if v == 0.0 {
            return None;
        }
        let (row, column) = (pixel / self.columns, pixel % self.columns);
        let end = self.point(column, row, f64::from(v.abs()));
        let origin = match &self.projection {
            Projection::Orthographic { top, .. } => [end[0], end[1], *top],
            _ => [0.0; 3],
        };
        Some((origin, end, v > 0.0))
    }

    /// Whether the rays are parallel: there is no point that they come from.
    pub fn has_parallel_rays(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// Number of surfaces.
    pub fn hits(&self) -> usize {
        self.values.iter().filter(|v| **v > 0.0).count()
    }
}

/// Images that contradict themselves, one way each.
#[cfg(test)]
pub(crate) mod testing {
    use super::*;

    /// One that does not.
    pub(crate) fn whole() -> RangeImage {
        let camera = Pinhole { fx: 4.0, fy: 4.0, cx: 1.0, cy: 0.5 };
        RangeImage::from_depth(camera, 3, 2, [1.0, 2.0, -1.0, 0.0, 1.5, f32::NAN]).with_colors([[9; 3]; 6])
    }

    pub(crate) fn broken() -> Vec<(RangeImage, &'static str)> {
        let mut all = Vec::new();
        let mut add = |why, change: &dyn Fn(&mut RangeImage)| {
            let mut image = whole();
            change(&mut image);
            all.push((image, why));
        };
        add("0x0", &|i| (i.columns, i.rows, i.values, i.colors) = (0, 0, Vec::new(), Vec::new()));
        add("no columns", &|i| i.columns = 0);
        add("too few values", &|i| i.values.truncate(5));
        add("too many values", &|i| i.values.push(1.0));
        add("columns times rows overflows", &|i| (i.columns, i.rows) = (usize::MAX, 2));
        add("colours", &|i| i.colors.truncate(4));
        for (fx, cx) in [(0.0, 1.0), (f64::NAN, 1.0), (f64::INFINITY, 1.0), (4.0, f64::NAN)] {
            add("pinhole", &|i| i.projection = Projection::Pinhole(Pinhole { fx, fy: 4.0, cx, cy: 0.5 }));
        }
        for (elevations, azimuth_step) in [
            (vec![], 0.1),
            (vec![0.1], 0.1),
            (vec![0.1, 0.1], 0.1),
            (vec![0.1, f32::NAN], 0.1),
            (vec![0.1, 0.0], 0.0),
            (vec![0.1, 0.0], f64::NAN),
            (vec![0.1, 0.0], 4.0),
        ] {
            add("spherical", &|i| {
                let elevations = elevations.clone();
                i.projection =
                    Projection::Spherical(Spherical { elevations, first_azimuth: 0.0, azimuth_step });
            });
        }
        for (step, top) in [(0.0, 1.0), (f64::INFINITY, 1.0), (0.1, f64::NAN)] {
            add("orthographic", &|i| {
                let rays = Orthographic { first: [0.0; 2], step: [step, 0.1] };
                i.projection = Projection::Orthographic { rays, top };
            });
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::testing::{broken, whole};
    use super::*;

    #[test]
    fn images_that_contradict_themselves_are_refused() {
        for (image, why) in broken() {
            assert!(image.check().is_err(), "{why}");
        }
        assert_eq!(whole().check(), Ok(()));
    }

    #[test]
    fn pixels_look_where_the_projection_says() {
        let image = |projection| RangeImage::new(projection, 2, 2, [0.0, 2.0, -3.0, 0.0]);
        let camera = image(Projection::Pinhole(Pinhole { fx: 2.0, fy: 4.0, cx: 0.0, cy: 0.0 }));
        assert_eq!(camera.points().collect::<Vec<_>>(), [(1, [1.0, 0.0, 2.0])]);
        let lidar = image(Projection::Spherical(Spherical {
            elevations: vec![0.0, -0.5],
            first_azimuth: 0.0,
            azimuth_step: std::f64::consts::FRAC_PI_2,
        }));
        let (_, p) = lidar.points().next().unwrap();
        assert!((p[1] - 2.0).abs() < 1e-12 && p[0].abs() < 1e-12);
        let scanner = image(Projection::Orthographic {
            rays: Orthographic { first: [1.0, 1.0], step: [0.5, 0.5] },
            top: 5.0,
        });
        assert_eq!(scanner.points().collect::<Vec<_>>(), [(1, [1.5, 1.0, 3.0])]);
        assert_eq!(scanner.hits(), 1);
    }
}
