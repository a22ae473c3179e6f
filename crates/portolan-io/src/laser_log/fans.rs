//! Bearings that scans share, computed once.

use std::collections::HashMap;

/// The most beams of all different fans together.
const MOST_BEAMS: usize = 1 << 23;

/// Bearings with their unit vectors.
#[derive(Clone, Debug)]
pub(crate) struct Fan {
    pub(crate) bearings: Vec<f64>,
    pub(crate) directions: Vec<[f64; 2]>,
}

/// Bearings at even steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FanShape {
    /// The first bearing (radians).
    pub(crate) start: f64,
    /// From beam to beam (radians); negative for a scanner that turns clockwise.
    pub(crate) step: f64,
    /// Beams.
    pub(crate) beams: usize,
}

impl FanShape {
    fn bearing(&self, i: usize) -> f64 {
        self.start + i as f64 * self.step
    }
}

/// The different fans of a log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fans {
    all: Vec<Fan>,
    of_shape: HashMap<(u64, u64, usize), u32>,
    beams: usize,
}

impl Fans {
    /// The number of the fan of a shape, which is made where it is new; `None` for a log of too many different ones.
    pub(crate) fn number(&mut self, shape: FanShape) -> Option<u32> {
        // 0.0 and -0.0 are one angle.
        let key = ((shape.start + 0.0).to_bits(), (shape.step + 0.0).to_bits(), shape.beams);
        if let Some(&fan) = self.of_shape.get(&key) {
            return Some(fan);
        }
        self.beams = self.beams.saturating_add(shape.beams);
        if self.beams > MOST_BEAMS {
            return None;
        }
        let bearings: Vec<f64> = (0..shape.beams).map(|i| shape.bearing(i)).collect();
        let directions = bearings.iter().map(|b| [b.cos(), b.sin()]).collect();
        let fan = self.all.len() as u32;
        self.all.push(Fan { bearings, directions });
        self.of_shape.insert(key, fan);
        Some(fan)
    }

    /// All, by number.
    pub(crate) fn into_all(self) -> Vec<Fan> {
        self.all
    }
}
