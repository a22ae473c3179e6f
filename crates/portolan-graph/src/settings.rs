//! Settings of the optimizer, and its report.

use crate::error::GraphError;
use crate::kernel::Kernel;

/// Settings of [`PoseGraph::optimize`](crate::PoseGraph::optimize).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Applied to edges of the kind [`EdgeKind::Closure`](crate::EdgeKind::Closure). [`Kernel::None`] by default.
    pub kernel: Kernel,
    /// How a robust kernel is applied; no effect with [`Kernel::None`]. [`Approach::Better`] by default.
    pub approach: Approach,
    /// Limit of the number of linear systems solved by each approach. 200 by default.
    pub max_iterations: usize,
    /// Relative decrease of the cost in a step below which the optimizer has converged. 1e-6 by default.
    pub relative_tolerance: f64,
    /// Initial damping, in units of the diagonal of the system. 1e-6 by default: nearly Gauss-Newton.
    pub damping: f64,
    /// Whether a graph of several components is refused. By default one vertex of each component is held.
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

/// How a robust kernel is applied. The cost under kernels other than Huber's has many minima, and the approach decides
/// which one is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Approach {
    /// At full scale from the first step: finds the minimum nearest to the initial poses. For good initial poses, such
    /// as chained odometry that drifts less than the error of true closures.
    Direct,
    /// At a scale at which no edge is an outlier, halved down to the scale of the kernel (graduated non-convexity,
    /// Yang et al. 2020): nearly independent of the initial poses, but fails where outliers dominate least squares.
    Graduated,
    /// Both; the result with the lower cost is kept.
    Better,
}

/// Why the optimizer stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// The last step lowered the cost by less than the tolerance.
    Converged,
    /// No step lowers the cost at any damping: a minimum to the last digit.
    Stalled,
    /// [`Settings::max_iterations`] was reached.
    IterationLimit,
    /// All vertices are held, or the graph has no edges.
    NothingToMove,
}

/// The result of an optimization, beside the poses.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// `sum r^T Omega r` without kernels: of the initial poses, then after each accepted step.
    pub chi_square: Vec<f64>,
    /// The minimized cost, with kernels, at the same steps. It is not monotone while a kernel is narrowed.
    /// With [`Approach::Better`] both lists are those of the result that was kept.
    pub cost: Vec<f64>,
    /// Number of linear systems solved by all approaches, rejected steps included.
    pub iterations: usize,
    /// Why the optimizer stopped.
    pub stop: Stop,
    /// Number of connected components of the graph.
    pub components: usize,
    /// Ids of the vertices held in components without a fixed vertex: the first vertex of each.
    pub held: Vec<u64>,
    /// Number of blocks of the sparse factor off its diagonal.
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
