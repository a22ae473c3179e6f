//! What the optimiser is told, and what it tells.

use crate::error::GraphError;
use crate::kernel::Kernel;

/// How to optimise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Applied to edges of the kind [`EdgeKind::Closure`](crate::EdgeKind::Closure). None by default.
    pub kernel: Kernel,
    /// How a kernel is brought in; without effect where there is none. [`Approach::Better`] by default.
    pub approach: Approach,
    /// Linear systems solved at most, by each approach. 200 by default.
    pub max_iterations: usize,
    /// Converged where a step lowers the cost by less than this part of it. 1e-6 by default.
    pub relative_tolerance: f64,
    /// First damping, in units of the diagonal of the system. 1e-6 by default: nearly Gauss-Newton.
    pub damping: f64,
    /// Whether a graph in several parts is refused. By default one vertex of each part is held.
    pub require_connected: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            kernel: Kernel::None,
            approach: Approach::Better,
            max_iterations: 200,
            relative_tolerance: 1e-6,
            damping: 1e-6,
            require_connected: false,
        }
    }
}

/// How a robust kernel is brought in. Kernels other than Huber's have many minima, and which one is found depends
/// on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Approach {
    /// With its scale from the first step on: finds the minimum next to the start. Right where the start is good,
    /// say by chained odometry that drifts less than the closures' own errors allow.
    Direct,
    /// It starts so wide that nothing is an outlier and narrows to its scale by halves (graduated non-convexity,
    /// Yang et al. 2020): nearly independent of the start, but least squares must not be misled too far.
    Graduated,
    /// Both, and the lower cost is kept.
    Better,
}

/// Why the optimiser stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// The last step lowered the cost by less than the tolerance.
    Converged,
    /// No step lowers the cost, however small: a minimum to the last digit.
    Stalled,
    /// The limit of [`Settings::max_iterations`] was reached before.
    IterationLimit,
    /// No vertex is free, or there is no edge.
    NothingToMove,
}

/// What the optimiser did.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// `sum r^T Omega r` without kernels: at the start, then after each accepted step.
    pub chi_square: Vec<f64>,
    /// The cost that was minimised, with kernels, at the same moments. It is not monotone where a kernel narrows.
    /// Where two approaches were tried, both lists are of the one that was kept.
    pub cost: Vec<f64>,
    /// Linear systems solved, steps that were taken back included, by all approaches tried.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
    /// Parts of the graph that no edge connects.
    pub components: usize,
    /// Ids of vertices held because no vertex of their part was fixed: the first of each such part.
    pub held: Vec<u64>,
    /// Blocks off the diagonal of the sparse factor: what the fill costs.
    pub factor_blocks: usize,
}

impl Settings {
    pub(crate) fn validate(&self) -> Result<(), GraphError> {
        self.kernel.validate()?;
        let refuse = |name, value, expected| Err(GraphError::Setting { name, value, expected });
        if !(0.0..1.0).contains(&self.relative_tolerance) {
            return refuse("relative_tolerance", self.relative_tolerance, "in [0, 1)");
        }
        if !(0.0..=1e6).contains(&self.damping) {
            return refuse("damping", self.damping, "in [0, 1e6]");
        }
        Ok(())
    }
}
