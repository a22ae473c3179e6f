//! The estimators: how one scan's evidence moves what is believed of a cell.
//!
//! Every cell is a recursive filter. [`Cell::fuse`] is its definition, one cell and one observation at a
//! time; [`Cell::fuse_run`] is the same filter over a run of neighbouring cells, equal to the last bit, and
//! what the stores call.

mod brick;
mod color;
mod distances;
mod hit_length;
mod hit_length_brick;
mod hit_lengths;
mod hit_miss;
mod log_odds;
mod model;
mod packed;
mod signed_distance;
mod stop_rule;
mod sums;

pub use brick::{DistanceBrick, LogOddsBrick};
pub use color::{Color, ColorBrick, ColorObservation, ColorRule, Colors};
pub use distances::{DistanceObservation, Distances};
pub use hit_length::{AttenuationRule, HitLength};
pub use hit_length_brick::{HitLengthBrick, HitLengthPlanes};
pub use hit_lengths::{HitLengthObservation, HitLengths, LENGTH_UNITS};
pub use hit_miss::{Endpoint, HitMiss};
pub use log_odds::{LogOdds8, LogOdds32, LogOddsEvent, LogOddsRule, LogOddsValue, ProbabilityTable};
pub use model::{OccupancyModel, OccupancyModelError};
pub use signed_distance::{DistancePlanes, FusionEvent, SignedDistance, TsdfRule, TsdfRuleError};
pub use stop_rule::{StopRule, mean_chord};
pub use sums::{
    ColorSum, DISTANCE_STEPS, DistanceSum, HitLengthSum, HitMissSum, MOST_SUM, MOST_WEIGHT_UNITS, Sign,
    SumBrick, SumCell, SumPlanes, SumTsdfRule, SumWidth, WEIGHT_UNITS,
};

/// What one scan says about the cells of a block: at most one observation per cell.
pub trait Evidence: Clone + Send + Sync {
    /// The observation of one cell.
    type One: Copy;

    /// Evidence about a block of `cells` cells that says nothing yet.
    fn silent(cells: usize) -> Self;

    /// Forgets everything.
    fn clear(&mut self);

    /// What it says about cell `i` of the block; `None`: nothing.
    fn one(&self, i: usize) -> Option<Self::One>;

    /// Number of cells that it says something about.
    fn observed(&self) -> usize;

    /// Forgets the observations of all cells but those that `inside` accepts.
    fn keep(&mut self, inside: impl Fn(usize) -> bool);
}

/// Cells in structure-of-arrays form.
pub trait Planes<C>: Clone + Send + Sync {
    /// `n` cells that were never observed.
    fn unobserved(n: usize) -> Self;

    /// Number of cells.
    fn len(&self) -> usize;

    /// Whether there is no cell.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Cell `i`; `None`: never observed.
    fn get(&self, i: usize) -> Option<C>;

    /// Overwrites cell `i`.
    fn set(&mut self, i: usize, cell: Option<C>);

    /// Bytes that the planes hold.
    fn bytes(&self) -> usize;
}

/// A recursive estimator of one cell.
pub trait Cell: Copy + PartialEq + std::fmt::Debug + Send + Sync {
    /// The filter's settings.
    type Rule: Sync;
    /// Many cells.
    type Planes: Planes<Self>;
    /// The cells of one brick, shared between snapshots until changed.
    type Brick: Planes<Self>;
    /// One scan's evidence about a block.
    type Evidence: Evidence;
    /// What one step of the filter did.
    type Event;

    /// One step of the filter. `cell` is `None` where nothing was ever observed.
    fn fuse(
        cell: Option<Self>,
        observation: <Self::Evidence as Evidence>::One,
        rule: &Self::Rule,
    ) -> (Self, Self::Event);

    /// [`Cell::fuse`] over `len` cells, `planes[start..]` against `evidence[from..]`: the same bits.
    fn fuse_run(
        planes: &mut Self::Planes,
        start: usize,
        evidence: &Self::Evidence,
        from: usize,
        len: usize,
        rule: &Self::Rule,
    );

    /// [`Cell::fuse`] over a whole brick: the same bits. `evidence` is that of a block.
    fn fuse_brick(brick: &mut Self::Brick, evidence: &Self::Evidence, rule: &Self::Rule);
}
