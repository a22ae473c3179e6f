//! A radiance field on a line: bins of density and reflectance, and the rays that cross them.
//!
//! A thin layer over [`ray`](super::ray): it cuts a ray into samples and keeps which bin each came from. A
//! field in 2-D or 3-D does the same with cells.

use super::ray::{Background, Sample};
use serde::Serialize;

/// Quantities that a bin has besides its depth: reflectance and the square of the distance.
///
/// The square is no property of the bin; rendered like a color it gives the second moment of the return.
pub const COLORS: usize = 2;

/// Equal bins along a line; bin `i` covers `[i, i + 1) · resolution` from `origin`.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Lower end of bin 0, m.
    pub origin: f64,
    /// Length of a bin, m.
    pub resolution: f64,
    /// Volume density per bin, 1/m, not negative.
    pub density: Vec<f64>,
    /// Reflectance per bin, 0 to 1.
    pub reflectance: Vec<f64>,
}

/// A ray along the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineRay {
    /// Where it starts, m.
    pub origin: f64,
    /// Towards larger coordinates, or smaller ones.
    pub ascending: bool,
}

/// What lies behind the line, alike for every ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Far {
    /// Distance of the far plane from the origin of the ray, m.
    pub depth: f64,
    /// Reflectance of the far plane.
    pub reflectance: f64,
}

impl Default for Far {
    /// The chapter's far plane at 10 m, of middle gray.
    fn default() -> Self {
        Self { depth: 10.0, reflectance: 0.5 }
    }
}

impl Far {
    /// As the ray integral wants it.
    pub fn background(&self) -> Background<COLORS> {
        Background { depth: self.depth, color: [self.reflectance, self.depth * self.depth] }
    }
}

/// The bins that a ray crosses: sample `i` lies in bin `first ± i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Bin of the first sample.
    pub first: usize,
    /// Number of samples.
    pub count: usize,
    /// Whether bins come in ascending order.
    pub ascending: bool,
}

impl Crossing {
    /// The bin of sample `i`.
    pub fn bin(&self, i: usize) -> usize {
        if self.ascending { self.first + i } else { self.first - i }
    }

    /// The sample in a bin, if the ray crosses it.
    pub fn sample_in(&self, bin: usize) -> Option<usize> {
        let i = if self.ascending { bin.checked_sub(self.first) } else { self.first.checked_sub(bin) };
        i.filter(|i| *i < self.count)
    }
}

impl Line {
    /// A line of `bins` bins, all of the same density and reflectance.
    pub fn uniform(origin: f64, resolution: f64, bins: usize, density: f64, reflectance: f64) -> Self {
        Self { origin, resolution, density: vec![density; bins], reflectance: vec![reflectance; bins] }
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.density.len()
    }

    /// Center of a bin, m.
    pub fn centre(&self, bin: usize) -> f64 {
        self.origin + (bin as f64 + 0.5) * self.resolution
    }

    /// The bins that a ray crosses. The bin of the origin counts with the part in front of it; a ray that
    /// starts outside and looks away crosses none.
    pub fn crossing(&self, ray: &LineRay) -> Crossing {
        let place = (ray.origin - self.origin) / self.resolution;
        let bins = self.bins();
        let none = Crossing { first: 0, count: 0, ascending: ray.ascending };
        if ray.ascending {
            let first = place.floor().max(0.0);
            if first >= bins as f64 || place.is_nan() {
                return none;
            }
            Crossing { first: first as usize, count: bins - first as usize, ascending: true }
        } else {
            // An origin exactly on a border looks into the bin below it.
            let above = place.ceil().min(bins as f64);
            if above <= 0.0 || place.is_nan() {
                return none;
            }
            Crossing { first: above as usize - 1, count: above as usize, ascending: false }
        }
    }

    /// Writes the samples of a ray, in order, into the front of `samples`: `crossing(ray).count` of them.
    ///
    /// # Panics
    /// When `samples` is too short; as many as there are bins are always enough.
    pub fn sample(&self, ray: &LineRay, crossing: &Crossing, samples: &mut [Sample<COLORS>]) {
        for (i, sample) in samples[..crossing.count].iter_mut().enumerate() {
            let bin = crossing.bin(i);
            let low = self.origin + bin as f64 * self.resolution;
            let high = low + self.resolution;
            let (near, far) = if ray.ascending {
                (low - ray.origin, high - ray.origin)
            } else {
                (ray.origin - high, ray.origin - low)
            };
            let near = near.max(0.0);
            let depth = 0.5 * (near + far);
            *sample = Sample {
                density: self.density[bin],
                length: far - near,
                depth,
                color: [self.reflectance[bin], depth * depth],
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(ray: LineRay) -> (Crossing, Vec<Sample<COLORS>>) {
        let line = Line::uniform(1.0, 0.5, 4, 2.0, 0.3);
        let crossing = line.crossing(&ray);
        let mut out = vec![Sample { density: 0.0, length: 0.0, depth: 0.0, color: [0.0; 2] }; 4];
        line.sample(&ray, &crossing, &mut out);
        out.truncate(crossing.count);
        (crossing, out)
    }

    #[test]
    fn rays_cross_bins_in_their_own_order() {
        let (up, s) = samples(LineRay { origin: 1.75, ascending: true });
        assert_eq!((up.first, up.count), (1, 3));
        assert_eq!((s[0].length, s[0].depth), (0.25, 0.125));
        assert_eq!((s[1].length, s[1].depth), (0.5, 0.5));
        assert_eq!(up.sample_in(3), Some(2));
        assert_eq!(up.sample_in(0), None);
        let (down, s) = samples(LineRay { origin: 1.75, ascending: false });
        assert_eq!((down.first, down.count), (1, 2));
        assert_eq!((s[1].length, s[1].depth), (0.5, 0.5));
        assert_eq!(down.sample_in(0), Some(1));
        assert_eq!(down.sample_in(2), None);
    }

    #[test]
    fn rays_from_outside_enter_at_the_end() {
        let (crossing, s) = samples(LineRay { origin: 0.0, ascending: true });
        assert_eq!(crossing.count, 4);
        assert_eq!((s[0].length, s[0].depth), (0.5, 1.25));
        assert_eq!(samples(LineRay { origin: 5.0, ascending: false }).1.len(), 4);
        assert_eq!(samples(LineRay { origin: 5.0, ascending: true }).1.len(), 0);
        assert_eq!(samples(LineRay { origin: 0.5, ascending: false }).1.len(), 0);
        assert_eq!(samples(LineRay { origin: f64::NAN, ascending: true }).1.len(), 0);
        // On a border: each way sees only whole bins.
        assert_eq!(samples(LineRay { origin: 2.0, ascending: false }).1[0].length, 0.5);
        assert_eq!(samples(LineRay { origin: 2.0, ascending: true }).1[0].length, 0.5);
    }
}
