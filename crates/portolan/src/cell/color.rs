//! Color beside distance: a weighted mean per channel.

use super::packed::ARC_HEADER;
use super::{Cell, Evidence, Planes};
use std::sync::Arc;

/// An estimated color. 16 bits a channel: with 8, a mean of many scans no longer moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color {
    /// Red, green, blue; 65535 is full.
    pub rgb: [u16; 3],
    /// Accumulated weight as a floating-point number of 16 bits without sign: 5 of the exponent, 11 of the mantissa,
    /// `2^(weight / 2048 - 24) * (1 + weight % 2048 / 2048)` (whole divisions), from 2^-24 up to the rule's limit. Positive.
    ///
    /// So that weights of any size add up: at a thousandth each, too, four thousand observations are a mean.
    pub weight: u16,
}

/// From the exponent of an `f32` to that of a weight's word, in the latter's bits.
const BIAS: u32 = (127 - 24) << 11;

impl Color {
    /// The color in bytes, rounded.
    pub fn rgb8(self) -> [u8; 3] {
        self.rgb.map(|v| ((u32::from(v) + 128) / 257) as u8)
    }

    /// The accumulated weight.
    #[inline]
    pub fn weight(self) -> f32 {
        f32::from_bits((u32::from(self.weight) + BIAS) << 12)
    }

    /// The word of a positive weight, rounded to nearest; never the word of what was not observed.
    #[inline]
    pub(super) fn word(weight: f32) -> u16 {
        (((weight.to_bits() + 0x800) >> 12).saturating_sub(BIAS)).clamp(1, u32::from(u16::MAX)) as u16
    }
}

/// Settings of the color filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorRule {
    /// Clamp of the weight, at most 255.
    pub w_max: f32,
}

/// One scan's color of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorObservation {
    /// Red, green, blue in bytes.
    pub rgb: [u8; 3],
    /// Weight. Positive.
    pub weight: f32,
}

/// Colors of a block; weight 0: nothing is said about the cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Colors {
    rgb: Box<[[u8; 3]]>,
    weight: Box<[f32]>,
}

impl Colors {
    /// Sets the observation of cell `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, o: ColorObservation) {
        self.rgb[i] = o.rgb;
        self.weight[i] = o.weight;
    }
}

impl Evidence for Colors {
    type One = ColorObservation;

    fn silent(cells: usize) -> Self {
        Self { rgb: vec![[0; 3]; cells].into(), weight: vec![0.0; cells].into() }
    }

    fn clear(&mut self) {
        self.weight.fill(0.0);
    }

    #[inline(always)]
    fn one(&self, i: usize) -> Option<ColorObservation> {
        let weight = self.weight[i];
        (weight > 0.0).then(|| ColorObservation { rgb: self.rgb[i], weight })
    }

    fn observed(&self) -> usize {
        self.weight.iter().map(|&w| u32::from(w > 0.0)).sum::<u32>() as usize
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        self.weight.iter_mut().enumerate().filter(|(i, _)| !inside(*i)).for_each(|(_, w)| *w = 0.0);
    }
}

/// Colors of a brick's cells: four words each, red, green, blue, weight; weight 0: never observed.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorBrick(Arc<[[u16; 4]]>);

impl ColorBrick {
    /// A brick from its words, x fastest.
    pub fn from_words(words: &[[u16; 4]]) -> Self {
        Self(words.into())
    }

    /// Red, green, blue, weight of every cell.
    pub fn words(&self) -> &[[u16; 4]] {
        &self.0
    }
}

impl Planes<Color> for ColorBrick {
    fn unobserved(n: usize) -> Self {
        Self(std::iter::repeat_n([0; 4], n).collect())
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<Color> {
        let [r, g, b, weight] = self.0[i];
        (weight > 0).then_some(Color { rgb: [r, g, b], weight })
    }

    fn set(&mut self, i: usize, cell: Option<Color>) {
        Arc::make_mut(&mut self.0)[i] = cell.map_or([0; 4], |c| [c.rgb[0], c.rgb[1], c.rgb[2], c.weight]);
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0) + ARC_HEADER
    }
}

impl Cell for Color {
    type Rule = ColorRule;
    type Planes = ColorBrick;
    type Brick = ColorBrick;
    type Evidence = Colors;
    type Event = ();

    /// The weighted mean, as of a distance: `K = w / (W + w)`, `C <- C + K (c - C)`, `W <- min(W + w, W_max)`, in words
    /// of 16 bits, rounded to nearest.
    #[inline]
    fn fuse(cell: Option<Self>, o: ColorObservation, rule: &ColorRule) -> (Self, ()) {
        let (before, weight) = cell.map_or(([0; 3], 0.0), |c| (c.rgb, c.weight()));
        let total = weight + o.weight;
        let gain = o.weight / total;
        let rgb = std::array::from_fn(|k| {
            let (prior, seen) = (f32::from(before[k]), f32::from(o.rgb[k]) * 257.0);
            (prior + gain * (seen - prior)).round() as u16
        });
        (Self { rgb, weight: Self::word(total.min(rule.w_max).min(255.0)) }, ())
    }

    fn fuse_run(
        planes: &mut ColorBrick,
        start: usize,
        evidence: &Colors,
        from: usize,
        len: usize,
        rule: &ColorRule,
    ) {
        for i in 0..len {
            if let Some(o) = evidence.one(from + i) {
                let fused = Self::fuse(planes.get(start + i), o, rule).0;
                planes.set(start + i, Some(fused));
            }
        }
    }

    fn fuse_brick(brick: &mut ColorBrick, evidence: &Colors, rule: &ColorRule) {
        let cells = brick.len();
        Self::fuse_run(brick, 0, evidence, 0, cells, rule);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_of_many_scans_still_moves() {
        let rule = ColorRule { w_max: 64.0 };
        let mut cell = None;
        for _ in 0..200 {
            cell = Some(Color::fuse(cell, ColorObservation { rgb: [200, 10, 0], weight: 1.0 }, &rule).0);
        }
        assert_eq!(cell.map(Color::rgb8), Some([200, 10, 0]));
        for _ in 0..2000 {
            cell = Some(Color::fuse(cell, ColorObservation { rgb: [100, 10, 255], weight: 1.0 }, &rule).0);
        }
        assert_eq!(cell.map(Color::rgb8), Some([100, 10, 255]));
    }

    #[test]
    fn small_weights_count() {
        let rule = ColorRule { w_max: 64.0 };
        let (first, ()) = Color::fuse(None, ColorObservation { rgb: [50; 3], weight: 1e-4 }, &rule);
        assert!(first.weight > 0 && first.rgb8() == [50; 3]);
    }
    #[test]
    fn words_hold_weights() {
        let word = |w: f32| Color { rgb: [0; 3], weight: Color::word(w) };
        for w in [0.25, 1.0, 3.0, 64.0, 255.0] {
            assert_eq!(word(w).weight(), w);
        }
        for w in [1e-6, 3.3e-4, 0.1, 17.77] {
            assert!((word(w).weight() / w - 1.0).abs() <= 1.0 / 4096.0);
        }
        let ends = (word(1e-30).weight, word(f32::MIN_POSITIVE).weight, word(1e30).weight);
        assert_eq!(ends, (1, 1, u16::MAX));
        assert!((1..u16::MAX).all(|w| {
            let of = |weight| Color { rgb: [0; 3], weight };
            of(w).weight() < of(w + 1).weight() && Color::word(of(w).weight()) == w
        }));
    }

    #[test]
    fn a_thousand_small_weights_are_a_mean() {
        let rule = ColorRule { w_max: 64.0 };
        for weight in [1e-4f32, 1e-3, 1.0 / 512.0, 0.01] {
            let (mut cell, mut mean) = (None, [0.0f64; 3]);
            for i in 0..1000u32 {
                let rgb = if i < 500 { [200, 10, 0] } else { [100, 10, 255] };
                mean = std::array::from_fn(|k| mean[k] + f64::from(rgb[k]) / 1000.0);
                cell = Some(Color::fuse(cell, ColorObservation { rgb, weight }, &rule).0);
            }
            let cell = cell.unwrap();
            // Half a word lost a step, and half of the last of 12 bits of the weight.
            assert!((0..3).all(|k| (f64::from(cell.rgb8()[k]) - mean[k]).abs() <= 3.0), "{weight} {cell:?}");
            assert!((cell.weight() / (1000.0 * weight) - 1.0).abs() < 0.05, "{weight} {}", cell.weight());
        }
    }
}
