//! Organised scans of space: rows and columns, and where a pixel looks.

use super::RefusedBeams;

/// A pinhole camera without distortion, in the axes of computer vision: x right, y down, z forward. Pixel `(u, v)`
/// has its centre at `u`, `v` exactly.
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
    /// x and y of the centre of pixel `(0, 0)` (metres).
    pub first: [f64; 2],
    /// From one column to the next along x, from one row to the next along y (metres).
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
        /// z of the plane from which values are measured downwards (metres); everything lies below it.
        top: f64,
    },
}

/// An organised scan: one value per pixel, row by row, in the sensor's frame.
///
/// A positive value is a surface (metres, of what the projection says). 0: nothing is known. A negative value: no
/// surface up to so far.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeImage {
    /// Where pixels look.
    pub projection: Projection,
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// `columns * rows` values (metres), row by row.
    pub values: Vec<f32>,
    /// Red, green, blue of each pixel, if the sensor sees colour. Empty: it does not.
    pub colors: Vec<[u8; 3]>,
    /// Readings that were refused when the image was built, by cause.
    pub refused: RefusedBeams,
}

impl RangeImage {
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
        self.values.iter().enumerate().filter(|(_, v)| **v != 0.0).map(|(i, &v)| {
            let (row, column) = (i / self.columns, i % self.columns);
            let end = self.point(column, row, f64::from(v.abs()));
            let origin = match &self.projection {
                Projection::Orthographic { top, .. } => [end[0], end[1], *top],
                _ => [0.0; 3],
            };
            (origin, end, v > 0.0)
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_look_where_the_projection_says() {
        let image = |projection| RangeImage {
            projection,
            columns: 2,
            rows: 2,
            values: vec![0.0, 2.0, -3.0, 0.0],
            colors: Vec::new(),
            refused: RefusedBeams::default(),
        };
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
