//! Levenberg-Marquardt over the poses of a graph.

use portolan::geom::Pose;

use crate::components::anchors;
use crate::error::GraphError;
use crate::graph::PoseGraph;
use crate::kernel::Kernel;
use crate::sparse::{Cholesky, SymmetricBlocks};
use crate::system::{Cost, System};
use crate::tangent::stepped;

/// How to optimise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Applied to edges of the kind [`EdgeKind::Closure`](crate::EdgeKind::Closure). None by default.
    pub kernel: Kernel,
    /// Whether the kernel starts wide, so that at first nothing is an outlier, and narrows to its scale by factors
    /// of two in `k²` (graduated non-convexity, Yang et al. 2020). It makes bounded kernels nearly independent of
    /// the start. On by default; without effect where there is no kernel.
    pub graduated: bool,
    /// Linear systems solved at most, in all. 100 by default.
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
            graduated: true,
            max_iterations: 100,
            relative_tolerance: 1e-6,
            damping: 1e-6,
            require_connected: false,
        }
    }
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
    /// The cost that was minimised, with kernels, at the same moments. Not monotone where the kernel narrows.
    pub cost: Vec<f64>,
    /// Linear systems solved, steps that were taken back included.
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
    fn validate(&self) -> Result<(), GraphError> {
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

impl<const D: usize> PoseGraph<D> {
    /// Moves the free vertices to a minimum of the cost, by Levenberg-Marquardt (Madsen, Nielsen & Tingleff 2004,
    /// section 3.2, with the damping scaled by the diagonal). The result is the same bytes on every machine.
    /// On an error the graph is left as it was.
    ///
    /// Each iteration costs O(edges) and one sparse factorisation.
    ///
    /// # Errors
    /// [`GraphError::Setting`], [`GraphError::Disconnected`] (where asked for), [`GraphError::NotFinite`],
    /// [`GraphError::Singular`].
    pub fn optimise(&mut self, settings: &Settings) -> Result<Report, GraphError> {
        settings.validate()?;
        let anchors = anchors(self);
        if settings.require_connected && anchors.components > 1 {
            return Err(GraphError::Disconnected { components: anchors.components });
        }
        let mut report = Report {
            chi_square: Vec::new(),
            cost: Vec::new(),
            iterations: 0,
            stop: Stop::NothingToMove,
            components: anchors.components,
            held: anchors.chosen.iter().map(|&k| self.vertices[k].id).collect(),
            factor_blocks: 0,
        };
        match D {
            2 => Descent::<D, 3>::new(self, &anchors.held)?.run(settings, &mut report)?.write(self),
            _ => Descent::<D, 6>::new(self, &anchors.held)?.run(settings, &mut report)?.write(self),
        }
        Ok(report)
    }
}

/// Nothing is further from a minimum than this much damping.
const LARGEST_DAMPING: f64 = 1e12;

struct Descent<const D: usize, const B: usize> {
    system: System<D, B>,
    poses: Vec<Pose<D>>,
    h: SymmetricBlocks<B>,
    g: Vec<[f64; B]>,
    factor: Cholesky<B>,
}

impl<const D: usize, const B: usize> Descent<D, B> {
    fn new(graph: &PoseGraph<D>, held: &[bool]) -> Result<Self, GraphError> {
        let system = System::new(graph, held);
        Ok(Self {
            poses: graph.vertices.iter().map(|v| v.world_from_vertex).collect(),
            h: SymmetricBlocks::zero(&system.pattern),
            g: vec![[0.0; B]; system.free.len()],
            factor: Cholesky::new(&system.pattern),
            system,
        })
    }

    /// All stages: one without a graduated kernel, else from wide to narrow.
    fn run(mut self, settings: &Settings, report: &mut Report) -> Result<Self, GraphError> {
        report.factor_blocks = self.system.pattern.factor_blocks();
        let widest = match settings.kernel.scale() {
            Some(k) if settings.graduated => (2.0 * self.system.worst(&self.poses) / (k * k)).log2().ceil(),
            _ => 0.0,
        };
        // 2^200 is wider than any cost that is worth a stage.
        for stage in (0..=widest.clamp(0.0, 200.0) as i32).rev() {
            let kernel = match settings.kernel.scale() {
                Some(k) => settings.kernel.with_scale(k * 2f64.powi(stage).sqrt()),
                None => Kernel::None,
            };
            // On the way it is enough to stay near the minimum.
            let tolerance = settings.relative_tolerance.max(if stage > 0 { 1e-2 } else { 0.0 });
            self.descend(kernel, tolerance, settings, report)?;
        }
        Ok(self)
    }

    fn descend(
        &mut self,
        kernel: Kernel,
        tolerance: f64,
        settings: &Settings,
        report: &mut Report,
    ) -> Result<(), GraphError> {
        let mut cost = finite(self.system.cost(&self.poses, kernel), report.iterations)?;
        if report.chi_square.is_empty() {
            report.chi_square.push(cost.chi_square);
            report.cost.push(cost.robust);
        }
        if self.g.is_empty() {
            return Ok(());
        }
        let (mut damping, mut growth) = (settings.damping, 2.0);
        loop {
            self.system.linearise(&self.poses, kernel, &mut self.h, &mut self.g);
            let accepted = loop {
                if report.iterations >= settings.max_iterations {
                    report.stop = Stop::IterationLimit;
                    return Ok(());
                }
                report.iterations += 1;
                let Some((poses, predicted)) = self.step(damping) else {
                    if damping >= LARGEST_DAMPING {
                        return Err(GraphError::Singular { iteration: report.iterations - 1 });
                    }
                    damping = (10.0 * damping).max(1e-9);
                    continue;
                };
                let new = self.system.cost(&poses, kernel);
                let gain = (cost.robust - new.robust) / predicted;
                // A cost that is not finite compares false: the step is taken back.
                if new.robust <= cost.robust && gain.is_finite() {
                    self.poses = poses;
                    damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                    growth = 2.0;
                    break Some(new);
                }
                let flat = predicted <= 1e-14 * cost.robust;
                if flat || damping >= LARGEST_DAMPING {
                    break None;
                }
                damping = (growth * damping).max(1e-9);
                growth *= 2.0;
            };
            let Some(new) = accepted else {
                report.stop = Stop::Stalled;
                return Ok(());
            };
            let lowered = cost.robust - new.robust;
            report.chi_square.push(new.chi_square);
            report.cost.push(new.robust);
            if lowered <= tolerance * cost.robust {
                report.stop = Stop::Converged;
                return Ok(());
            }
            cost = new;
        }
    }

    /// The poses after a damped step, and by how much the linear model says that the cost falls.
    fn step(&mut self, damping: f64) -> Option<(Vec<Pose<D>>, f64)> {
        let pattern = &self.system.pattern;
        self.factor.factor(pattern, &self.h, damping)?;
        let step = self.factor.solve(pattern, &self.g);
        let mut poses = self.poses.clone();
        let mut predicted = 0.0;
        for (variable, (step, g)) in step.iter().zip(&self.g).enumerate() {
            let diagonal = self.h.diagonal_of(pattern, variable);
            for k in 0..B {
                predicted += step[k] * (damping * diagonal[k] * step[k] + g[k]);
            }
            let vertex = self.system.free[variable];
            poses[vertex] = rigid(stepped(&poses[vertex], step))?;
        }
        Some((poses, predicted))
    }

    fn write(self, graph: &mut PoseGraph<D>) {
        for &vertex in &self.system.free {
            graph.vertices[vertex].world_from_vertex = self.poses[vertex];
        }
    }
}

/// Rounding undone, so that a thousand steps leave a rotation a rotation; `None` where the step overflowed.
fn rigid<const D: usize>(pose: Pose<D>) -> Option<Pose<D>> {
    Pose::from_matrix(pose.rotation, pose.translation).ok().map(|(pose, _)| pose)
}

fn finite(cost: Cost, iteration: usize) -> Result<Cost, GraphError> {
    if cost.chi_square.is_finite() && cost.robust.is_finite() {
        Ok(cost)
    } else {
        Err(GraphError::NotFinite { iteration })
    }
}
