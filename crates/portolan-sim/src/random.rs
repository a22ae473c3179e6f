//! Random numbers that are the same on every platform.

/// SplitMix64 (Steele, Lea & Flood 2014): small, fast, and any two seeds give independent streams.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The stream of a seed and an index: streams of different indices are independent, so that they can be
    /// drawn in any order and on any thread.
    pub fn stream(seed: u64, index: u64) -> Self {
        let mut mixer = Self::from_state(seed ^ index.wrapping_mul(0xD1B5_4A32_D192_ED03));
        Self::from_state(mixer.bits())
    }

    /// The generator in a given state.
    pub fn from_state(state: u64) -> Self {
        Self { state }
    }

    /// Sixty-four random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Standard normal (Box & Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_are_normal() {
        let mut random = Random::stream(7, 0);
        let draws: Vec<f64> = (0..100_000).map(|_| random.normal()).collect();
        let mean = draws.iter().sum::<f64>() / 1e5;
        let variance = draws.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 1e5;
        let beyond_two = draws.iter().filter(|v| v.abs() > 2.0).count() as f64 / 1e5;
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02 && (beyond_two - 0.0455).abs() < 0.003);
    }

    #[test]
    fn streams_differ() {
        assert_ne!(Random::stream(1, 0).bits(), Random::stream(1, 1).bits());
        assert_ne!(Random::stream(1, 0).bits(), Random::stream(2, 0).bits());
    }
}
