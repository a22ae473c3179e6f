//! Levenberg-Marquardt over the poses of a graph.

use portolan::geom::Pose;

use crate::components::anchors;
use crate::error::GraphError;
use crate::graph::PoseGraph;
use crate::kernel::Kernel;
use crate::settings::{Approach, Report, Settings, Stop};
use crate::sparse::{Cholesky, SymmetricBlocks};
use crate::system::{Cost, System};
use crate::tangent::stepped;

impl<const D: usize> PoseGraph<D> {
    /// Moves the free vertices to a minimum of the cost, by Levenberg-Marquardt (Madsen, Nielsen & Tingleff 2004,
    /// section 3.2, with the damping scaled by the diagonal). The result is the same bytes on every machine.
    /// On an error the graph is unchanged.
    ///
    /// Each iteration costs O(edges) and one sparse factorization.
    ///
    /// # Errors
    /// [`GraphError::Setting`], [`GraphError::Disconnected`] (only with [`Settings::require_connected`]),
    /// [`GraphError::NotFinite`], [`GraphError::Singular`].
    pub fn optimize(&mut self, settings: &Settings) -> Result<Report, GraphError> {
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
            2 => Descent::<D, 3>::new(self, &anchors.held).run(settings, &mut report)?.write(self),
            _ => Descent::<D, 6>::new(self, &anchors.held).run(settings, &mut report)?.write(self),
        }
        Ok(report)
    }
}

/// The history of one descent, or of several after each other.
#[derive(Default)]
struct Trace {
    chi_square: Vec<f64>,
    cost: Vec<f64>,
    iterations: usize,
    stop: Option<Stop>,
}

impl Trace {
    fn push(&mut self, cost: Cost) {
        self.chi_square.push(cost.chi_square);
        self.cost.push(cost.robust);
    }

    fn ended(self, stop: Stop) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Appends a later descent. Its first entry has the poses of the last entry here, under another kernel.
    fn append(&mut self, later: Self) {
        self.chi_square.pop();
        self.cost.pop();
        self.chi_square.extend(later.chi_square);
        self.cost.extend(later.cost);
        self.iterations += later.iterations;
        self.stop = later.stop;
    }

    fn write_to(self, report: &mut Report, other_iterations: usize) {
        report.chi_square = self.chi_square;
        report.cost = self.cost;
        report.iterations = self.iterations + other_iterations;
        report.stop = self.stop.unwrap_or(Stop::NothingToMove);
    }
}

/// A step that fails at this damping will not succeed at a larger one.
const LARGEST_DAMPING: f64 = 1e12;

struct Descent<const D: usize, const B: usize> {
    system: System<D, B>,
    poses: Vec<Pose<D>>,
    h: SymmetricBlocks<B>,
    g: Vec<[f64; B]>,
    factor: Cholesky<B>,
}

impl<const D: usize, const B: usize> Descent<D, B> {
    fn new(graph: &PoseGraph<D>, held: &[bool]) -> Self {
        let system = System::new(graph, held);
        Self {
            poses: graph.vertices.iter().map(|v| v.world_from_vertex).collect(),
            h: SymmetricBlocks::zero(&system.at.pattern),
            g: vec![[0.0; B]; system.at.free.len()],
            factor: Cholesky::new(&system.at.pattern),
            system,
        }
    }

    /// Runs the approaches of the settings and keeps the result with the lowest cost.
    fn run(mut self, settings: &Settings, report: &mut Report) -> Result<Self, GraphError> {
        report.factor_blocks = self.system.at.pattern.factor_blocks();
        let direct = |s: &mut Self| s.descend(settings.kernel, settings.relative_tolerance, settings);
        let Some(k) = settings.kernel.scale() else {
            direct(&mut self)?.write_to(report, 0);
            return Ok(self);
        };
        match settings.approach {
            Approach::Direct => direct(&mut self)?.write_to(report, 0),
            Approach::Graduated => self.narrow(k, settings)?.write_to(report, 0),
            Approach::Better => {
                let start = self.poses.clone();
                let straight = direct(&mut self)?;
                let kept = std::mem::replace(&mut self.poses, start);
                let narrowed = self.narrow(k, settings)?;
                if narrowed.cost.last() < straight.cost.last() {
                    narrowed.write_to(report, straight.iterations);
                } else {
                    self.poses = kept;
                    straight.write_to(report, narrowed.iterations);
                }
            }
        }
        Ok(self)
    }

    /// Narrows the kernel from a scale at which no edge is an outlier to the scale `k`, halving it in each stage.
    fn narrow(&mut self, k: f64, settings: &Settings) -> Result<Trace, GraphError> {
        let halvings = (0.5 * libm::log2(2.0 * self.system.worst(&self.poses) / (k * k))).ceil();
        let mut all = Trace::default();
        // 2^200 is wider than any cost that needs a stage; NaN (no edge has an error) becomes 0.
        for stage in (0..=halvings.clamp(0.0, 200.0) as i32).rev() {
            let kernel = settings.kernel.with_scale(libm::scalbn(k, stage));
            // Intermediate stages only have to stay near the minimum.
            let tolerance = settings.relative_tolerance.max(if stage > 0 { 1e-2 } else { 0.0 });
            let left = Settings { max_iterations: settings.max_iterations - all.iterations, ..*settings };
            all.append(self.descend(kernel, tolerance, &left)?);
        }
        Ok(all)
    }

    fn descend(&mut self, kernel: Kernel, tolerance: f64, settings: &Settings) -> Result<Trace, GraphError> {
        let mut trace = Trace::default();
        let mut cost = finite(self.system.cost(&self.poses, kernel))?;
        trace.push(cost);
        if self.g.is_empty() {
            return Ok(trace);
        }
        let (mut damping, mut growth) = (settings.damping, 2.0);
        loop {
            self.system.linearize(&self.poses, kernel, &mut self.h, &mut self.g);
            let accepted = loop {
                if trace.iterations >= settings.max_iterations {
                    return Ok(trace.ended(Stop::IterationLimit));
                }
                trace.iterations += 1;
                let Some((poses, predicted)) = self.step(damping) else {
                    if damping >= LARGEST_DAMPING {
                        return Err(GraphError::Singular { iteration: trace.iterations - 1 });
                    }
                    damping = (10.0 * damping).max(1e-9);
                    continue;
                };
                let new = self.system.cost(&poses, kernel);
                let gain = (cost.robust - new.robust) / predicted;
                // A cost that is not finite compares false: the step is rejected.
                if new.robust <= cost.robust && gain.is_finite() {
                    self.poses = poses;
                    let fit = 2.0 * gain - 1.0;
                    damping *= (1.0 - fit * fit * fit).max(1.0 / 3.0);
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
                return Ok(trace.ended(Stop::Stalled));
            };
            let lowered = cost.robust - new.robust;
            trace.push(new);
            if lowered <= tolerance * cost.robust {
                return Ok(trace.ended(Stop::Converged));
            }
            cost = new;
        }
    }

    /// The poses after a damped step, and the decrease of the cost that the linear model predicts.
    fn step(&mut self, damping: f64) -> Option<(Vec<Pose<D>>, f64)> {
        let pattern = &self.system.at.pattern;
        self.factor.factor(pattern, &self.h, damping)?;
        let step = self.factor.solve(pattern, &self.g);
        let mut poses = self.poses.clone();
        let mut predicted = 0.0;
        for (variable, (step, g)) in step.iter().zip(&self.g).enumerate() {
            let diagonal = self.h.diagonal_of(pattern, variable);
            for k in 0..B {
                predicted += step[k] * (damping * diagonal[k] * step[k] + g[k]);
            }
            let vertex = self.system.at.free[variable];
            poses[vertex] = rigid(stepped(&poses[vertex], step))?;
        }
        Some((poses, predicted))
    }

    fn write(self, graph: &mut PoseGraph<D>) {
        for &vertex in &self.system.at.free {
            graph.vertices[vertex].world_from_vertex = self.poses[vertex];
        }
    }
}

/// The pose with its rotation made orthonormal again after rounding; `None` where the step overflowed.
fn rigid<const D: usize>(pose: Pose<D>) -> Option<Pose<D>> {
    Pose::from_matrix(pose.rotation, pose.translation).ok().map(|(pose, _)| pose)
}

fn finite(cost: Cost) -> Result<Cost, GraphError> {
    let finite = cost.chi_square.is_finite() && cost.robust.is_finite();
    finite.then_some(cost).ok_or(GraphError::NotFinite)
}
