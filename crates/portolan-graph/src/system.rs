//! From edges to the linear system of a step: `H = sum J^T w Omega J`, `g = -sum J^T w Omega r`.

use portolan::geom::Pose;

use crate::graph::{Edge, EdgeKind, PoseGraph, quadratic};
use crate::kernel::Kernel;
use crate::sparse::{Block, Pattern, SymmetricBlocks};
use crate::tangent::{error_pose, linearize, residual};

/// The unknowns of a graph: its free vertices, and the pairs of them that edges join.
pub(crate) struct Numbering {
    pub(crate) pattern: Pattern,
    /// Vertex of each variable.
    pub(crate) free: Vec<usize>,
    /// Variable of each vertex; `None` where it is held.
    pub(crate) variable: Vec<Option<usize>>,
    /// For each edge, its number among the pairs of the pattern, where both ends are free.
    pub(crate) pair: Vec<usize>,
}

impl Numbering {
    pub(crate) fn new<const D: usize>(graph: &PoseGraph<D>, held: &[bool]) -> Self {
        let mut variable = vec![None; held.len()];
        let free: Vec<usize> = (0..held.len()).filter(|&k| !held[k]).collect();
        for (number, &vertex) in free.iter().enumerate() {
            variable[vertex] = Some(number);
        }
        let (mut pairs, mut pair) = (Vec::new(), Vec::new());
        for &[i, j] in &graph.ends {
            pair.push(pairs.len());
            if let (Some(a), Some(b)) = (variable[i], variable[j]) {
                pairs.push([a, b]);
            }
        }
        Self { pattern: Pattern::new(free.len(), &pairs), free, variable, pair }
    }
}

/// The edges of a graph prepared for many linearizations.
pub(crate) struct System<const D: usize, const B: usize> {
    pub(crate) at: Numbering,
    terms: Vec<Term<D, B>>,
}

struct Term<const D: usize, const B: usize> {
    ends: [usize; 2],
    j_from_i: Pose<D>,
    omega: Block<B>,
    robust: bool,
}

/// The cost of a set of poses.
#[derive(Clone, Copy)]
pub(crate) struct Cost {
    /// `sum r^T Omega r`.
    pub(crate) chi_square: f64,
    /// The same under the kernel: what is minimized.
    pub(crate) robust: f64,
}

impl<const D: usize, const B: usize> System<D, B> {
    pub(crate) fn new(graph: &PoseGraph<D>, held: &[bool]) -> Self {
        let term = |(edge, &ends): (&Edge<D>, &[usize; 2])| Term {
            ends,
            j_from_i: edge.i_from_j.inverse(),
            omega: edge.information.block(),
            robust: edge.kind == EdgeKind::Closure,
        };
        let terms = graph.edges.iter().zip(&graph.ends).map(term).collect();
        Self { at: Numbering::new(graph, held), terms }
    }

    pub(crate) fn cost(&self, poses: &[Pose<D>], kernel: Kernel) -> Cost {
        let mut cost = Cost { chi_square: 0.0, robust: 0.0 };
        for term in &self.terms {
            let s = term.chi_square(poses);
            cost.chi_square += s;
            cost.robust += term.kernel(kernel).cost_and_weight(s).0;
        }
        cost
    }

    /// The largest chi-square of an edge that kernels apply to.
    pub(crate) fn worst(&self, poses: &[Pose<D>]) -> f64 {
        let robust = self.terms.iter().filter(|term| term.robust);
        robust.fold(0.0, |worst: f64, term| worst.max(term.chi_square(poses)))
    }

    /// Fills `h` and `g` (both overwritten) at `poses`.
    pub(crate) fn linearize(
        &self,
        poses: &[Pose<D>],
        kernel: Kernel,
        h: &mut SymmetricBlocks<B>,
        g: &mut [[f64; B]],
    ) {
        h.clear();
        g.fill([0.0; B]);
        for (term, &pair) in self.terms.iter().zip(&self.at.pair) {
            let [i, j] = term.ends;
            let linear = linearize::<D, B>(&term.j_from_i, &poses[i], &poses[j]);
            let s = quadratic(&linear.residual, &term.omega);
            let weight = term.kernel(kernel).cost_and_weight(s).1;
            let omega = term.omega.map(|row| row.map(|v| weight * v));
            let sides = [(self.at.variable[i], &linear.by_i), (self.at.variable[j], &linear.by_j)];
            for (side, jacobian) in sides {
                let Some(variable) = side else { continue };
                let pulled = left_product(jacobian, &omega);
                let target = &mut g[variable];
                for r in 0..B {
                    for k in 0..B {
                        target[r] -= pulled[r][k] * linear.residual[k];
                    }
                }
                add_product(h.diagonal_mut(&self.at.pattern, variable), &pulled, jacobian);
            }
            if let (Some(a), Some(b)) = (self.at.variable[i], self.at.variable[j]) {
                let mut block = [[0.0; B]; B];
                add_product(&mut block, &left_product(&linear.by_i, &omega), &linear.by_j);
                h.add_pair(&self.at.pattern, pair, [a, b], &block);
            }
        }
    }
}

impl<const D: usize, const B: usize> Term<D, B> {
    fn chi_square(&self, poses: &[Pose<D>]) -> f64 {
        let [i, j] = self.ends;
        quadratic(&residual::<D, B>(&error_pose(&self.j_from_i, &poses[i], &poses[j])), &self.omega)
    }

    fn kernel(&self, kernel: Kernel) -> Kernel {
        if self.robust { kernel } else { Kernel::None }
    }
}

/// `a^T b`.
fn left_product<const B: usize>(a: &Block<B>, b: &Block<B>) -> Block<B> {
    let mut out = [[0.0; B]; B];
    for k in 0..B {
        for r in 0..B {
            for c in 0..B {
                out[r][c] += a[k][r] * b[k][c];
            }
        }
    }
    out
}

/// `x += a b`.
fn add_product<const B: usize>(x: &mut Block<B>, a: &Block<B>, b: &Block<B>) {
    for r in 0..B {
        for k in 0..B {
            for c in 0..B {
                x[r][c] += a[r][k] * b[k][c];
            }
        }
    }
}
