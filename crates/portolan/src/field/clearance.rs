//! What a planner may rely on: an interval that holds the distance to the nearest surface.

use crate::answer::Answer;

/// How far the nearest obstacle is from a point, at least and at most (meters). About the distance without its sign;
/// the side is said apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Never above the exact distance; not negative.
    pub lower: f64,
    /// Never below the exact distance; infinite where the nearest obstacle is beyond what is maintained.
    pub upper: f64,
    /// The point is inside of the surface, where the estimate is negative.
    pub inside: bool,
}

/// What space that was never observed means to the one who asks. Its default is that of all that takes one: demands of paths,
/// the command line and what it writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UnknownSpace {
    /// An obstacle: clearance is the distance to the nearest surface or the nearest unknown cell, whichever is nearer, and
    /// a point in unknown space has none.
    #[default]
    Pessimistic,
    /// No obstacle: only the surface counts, also where the point itself is in unknown space.
    Optimistic,
}

impl UnknownSpace {
    /// What it counts as, in one word: `obstacle` or `free`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pessimistic => "obstacle",
            Self::Optimistic => "free",
        }
    }
}

/// A field that certifies clearance: what path checks and planners need of a map.
///
/// Statuses: known, both bounds are finite; saturated, only `lower` says something; unknown, the point lies in space
/// that was not observed (for [`UnknownSpace::Optimistic`]: and nothing is maintained there); outside, nowhere near
/// the map.
pub trait ClearanceField<const D: usize>: Sync {
    /// The interval at a point (world), as narrow as the field can make it. O(1), but where a field looks closer.
    fn clearance(&self, p_world: [f64; D], unknown: UnknownSpace) -> Answer<Clearance>;

    /// An interval that is only as narrow as it takes to tell whether the clearance is at least `enough` (meters):
    /// decides whatever [`ClearanceField::clearance`] decides, and may cost less.
    fn clearance_against(&self, p_world: [f64; D], unknown: UnknownSpace, enough: f64) -> Answer<Clearance> {
        let _ = enough;
        self.clearance(p_world, unknown)
    }

    /// Signed distance (meters) and the exact derivative of the same interpolant, not certified. O(1).
    fn distance_and_gradient(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])>;

    /// Edge of a cell (meters): the length below which differences of position mean little.
    fn resolution(&self) -> f64;
}
