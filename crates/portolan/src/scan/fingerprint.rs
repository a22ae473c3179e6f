//! A number that tells scans apart.

use super::{BeamKind, Delivered, Frame, Origin, PointScan, Projection, RangeImage, Scan};

/// Mixes words into one (the finalizer of SplitMix64, Steele, Lea & Flood 2014): the same on every platform, in every
/// version, so that it can be kept in files. No cryptographic strength.
#[derive(Clone, Copy)]
struct Mix(u64);

impl Mix {
    fn word(&mut self, word: u64) {
        let z = (self.0 ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        self.0 = z ^ (z >> 31);
    }

    fn reals(&mut self, numbers: &[f64]) {
        self.word(numbers.len() as u64);
        numbers.iter().for_each(|v| self.word(v.to_bits()));
    }

    fn singles(&mut self, numbers: &[f32]) {
        self.word(numbers.len() as u64);
        for pair in numbers.chunks(2) {
            let high = pair.get(1).map_or(0, |v| u64::from(v.to_bits()));
            self.word(high << 32 | u64::from(pair[0].to_bits()));
        }
    }

    fn bytes(&mut self, colors: &[[u8; 3]]) {
        self.word(colors.len() as u64);
        for pair in colors.chunks(2) {
            let [[r, g, b], [s, h, c]] = [pair[0], pair.get(1).copied().unwrap_or_default()];
            self.word(u64::from_le_bytes([r, g, b, s, h, c, 0, 0]));
        }
    }

    fn colors(&mut self, image: &RangeImage) {
        self.bytes(&image.colors);
        self.word(image.colored.len() as u64);
        for flags in image.colored.chunks(64) {
            self.word(flags.iter().fold(0, |word, flag| word << 1 | u64::from(*flag)));
        }
    }

    fn image(&mut self, image: &RangeImage) {
        match &image.projection {
            Projection::Pinhole(p) => self.reals(&[p.fx, p.fy, p.cx, p.cy]),
            Projection::Spherical(s) => {
                self.singles(&s.elevations);
                self.reals(&[s.first_azimuth, s.azimuth_step]);
            }
            Projection::Orthographic { rays, top } => {
                self.reals(&[rays.first[0], rays.first[1], rays.step[0], rays.step[1], *top]);
            }
        }
        self.word(image.columns as u64);
        self.singles(&image.values);
    }
}

/// What a map reads of a scan, colors left out, as one number.
pub trait Fingerprint {
    /// The same for the same readings; for others another one, but for one chance in 2^64.
    fn fingerprint(&self) -> u64;

    /// The same of readings and colors.
    fn fingerprint_with_colors(&self) -> u64 {
        self.fingerprint()
    }
}

impl<const D: usize> Fingerprint for Scan<D> {
    fn fingerprint(&self) -> u64 {
        let mut mix = Mix(1);
        for i in 0..self.len() {
            let beam = self.beam(i);
            mix.reals(&beam.direction);
            mix.reals(&[beam.range]);
            mix.word(match beam.kind {
                BeamKind::Hit => 0,
                BeamKind::MaxRange => 1,
                BeamKind::NoReturn => 2,
                BeamKind::Dropped => 3,
                BeamKind::SelfHit => 4,
                BeamKind::Mover => 5,
            });
            mix.reals(&self.origin(i));
        }
        mix.0
    }
}

impl Fingerprint for RangeImage {
    fn fingerprint(&self) -> u64 {
        let mut mix = Mix(2);
        mix.image(self);
        mix.0
    }

    fn fingerprint_with_colors(&self) -> u64 {
        let mut mix = Mix(self.fingerprint());
        mix.colors(self);
        mix.0
    }
}

impl Fingerprint for PointScan {
    fn fingerprint(&self) -> u64 {
        let mut mix = Mix(3);
        match &self.origin {
            Origin::Unknown => mix.word(0),
            Origin::Common(origin) => mix.reals(origin),
            Origin::PerPoint(origins) => mix.singles(origins.as_flattened()),
        }
        mix.singles(self.points.as_flattened());
        mix.singles(self.free_ends.as_flattened());
        if let Some(image) = &self.image {
            mix.image(image);
        }
        if let Some(Delivered { points, free_ends, origin, scan_from_sensor }) = self.delivered.as_deref() {
            mix.singles(points.as_flattened());
            mix.singles(free_ends.as_flattened());
            mix.reals(origin);
            mix.singles(&self.times);
            for (time, pose) in scan_from_sensor.iter() {
                mix.reals(&[time]);
                mix.reals(pose.rotation.as_flattened());
                mix.reals(&pose.translation);
            }
        }
        mix.0
    }

    fn fingerprint_with_colors(&self) -> u64 {
        let mut mix = Mix(self.fingerprint());
        mix.bytes(&self.colors);
        if let Some(image) = &self.image {
            mix.colors(image);
        }
        mix.0
    }
}

impl Fingerprint for Frame {
    fn fingerprint(&self) -> u64 {
        match self {
            Self::Image(image) => image.fingerprint(),
            Self::Points(scan) => scan.fingerprint(),
        }
    }

    fn fingerprint_with_colors(&self) -> u64 {
        match self {
            Self::Image(image) => image.fingerprint_with_colors(),
            Self::Points(scan) => scan.fingerprint_with_colors(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::RangeLimits;

    #[test]
    fn every_reading_counts() {
        let scan = |ranges: &[f64]| Scan::from_laser(&[0.0, 0.1, 0.2], ranges, &RangeLimits::default());
        let one = scan(&[1.0, 2.0, 3.0]).fingerprint();
        assert_eq!(one, scan(&[1.0, 2.0, 3.0]).fingerprint());
        let others = [[1.0, 2.0, 3.5], [2.0, 1.0, 3.0], [1.0, f64::NAN, 3.0]];
        assert!(others.iter().all(|ranges| scan(ranges).fingerprint() != one));
        let points = |origin| PointScan::new([[1.0f32, 2.0, 3.0], [2.0, 0.0, 0.0]], origin).fingerprint();
        assert_ne!(points([0.0; 3]), points([0.0, 0.0, 0.1]));
        let colored = |rgb| {
            let mut scan = PointScan::new([[1.0f32, 2.0, 3.0], [2.0, 0.0, 0.0]], [0.0; 3]);
            scan.colors = vec![[1, 2, 3], rgb];
            (scan.fingerprint(), scan.fingerprint_with_colors())
        };
        let [(a, with_a), (b, with_b)] = [colored([9; 3]), colored([9, 9, 8])];
        assert!(a == b && with_a != with_b && with_a == colored([9; 3]).1);
        // Kept in files: a change of the mixing would make every scan another one.
        assert_eq!(points([0.0; 3]), 0x8f9a_afce_fe07_9ca1);
    }
}
