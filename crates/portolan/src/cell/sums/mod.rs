//! Cells of whole-number sums: evidence that adds up.
//!
//! The filters of the clamped cells depend on the order of what they see: a clamp, a mean in floating point, a limit that is
//! met. The same estimates are quotients of sums (the information filter), and sums of whole numbers are the same in any
//! order, in any number of parts, on any number of machines, and what was added can be taken away again. So these cells keep
//! the sums, and what the clamped cells hold is computed from them when it is read ([`SumCell::estimate`]).
//!
//! | cell | sums | estimate |
//! |---|---|---|
//! | [`DistanceSum`] | weight times distance, weight | [`SignedDistance`](super::SignedDistance) |
//! | [`ColorSum`] | weight times red, green, blue, weight | [`Color`](super::Color) |
//! | [`HitMissSum`] | scans that hit, scans that passed | [`LogOdds8`](super::LogOdds8), clamped once, at the end |
//! | [`HitLengthSum`] | beams that ended, length of all beams, scans | [`HitLength`](super::HitLength) |
//!
//! Nothing is forgotten by a cell of sums: to forget is to take away what is old.

mod brick;
mod color;
mod distance;
mod hit_length;
mod hit_miss;

pub use brick::{MOST_SUM, SumBrick, SumWidth};
pub use color::ColorSum;
pub use distance::{DISTANCE_STEPS, DistanceSum, MOST_WEIGHT_UNITS, SumTsdfRule, WEIGHT_UNITS};
pub use hit_length::HitLengthSum;
pub use hit_miss::HitMissSum;

use super::{Cell, Planes};

/// Whether evidence is added or taken away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sign {
    /// Added.
    #[default]
    Plus,
    /// Taken away.
    Minus,
}

impl Sign {
    /// 1 or -1.
    #[inline(always)]
    pub fn factor(self) -> i32 {
        match self {
            Self::Plus => 1,
            Self::Minus => -1,
        }
    }

    /// The other one.
    pub fn opposite(self) -> Self {
        match self {
            Self::Plus => Self::Minus,
            Self::Minus => Self::Plus,
        }
    }
}

/// A cell whose state is a few sums of whole numbers.
pub trait SumCell: Cell<Brick: SumPlanes<Self> + std::fmt::Debug> {
    /// The clamped cell that answers the same questions.
    type Estimate: Cell<Evidence = Self::Evidence, Rule: Clone + std::fmt::Debug + Send>;

    /// Settings of the sums that go with those of the estimate.
    fn rule(of: &<Self::Estimate as Cell>::Rule, sign: Sign) -> Self::Rule;

    /// What the sums say.
    fn estimate(self, rule: &<Self::Estimate as Cell>::Rule) -> Self::Estimate;

    /// What the sums of a brick say.
    fn estimates(
        sums: &Self::Brick,
        rule: &<Self::Estimate as Cell>::Rule,
    ) -> <Self::Estimate as Cell>::Brick;

    /// Whether these sums can be those of observations that were added. Those that more was taken away from than was there
    /// cannot, as far as it shows.
    fn is_possible(sums: &[i64]) -> bool;
}

/// Bricks of cells of sums.
pub trait SumPlanes<C>: Planes<C> {
    /// Adds another brick's sums to this one's, or takes them away, cell by cell. `false`: a sum would pass
    /// [`MOST_SUM`]; the brick is then as before.
    #[must_use]
    fn add(&mut self, other: &Self, sign: Sign) -> bool;

    /// Whether all sums are zero.
    fn is_zero(&self) -> bool;

    /// Whether all sums can be those of observations ([`SumCell::is_possible`]).
    fn is_possible(&self) -> bool;
}
