//! The graph: poses, and relative poses measured between them.

use portolan::geom::Pose;
use rustc_hash::FxHashMap;

use crate::error::GraphError;
use crate::information::Information;
use crate::tangent::{error_pose, residual};

/// A pose to be estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex<const D: usize> {
    /// Any number that is unique in the graph.
    pub id: u64,
    /// The estimate.
    pub world_from_vertex: Pose<D>,
    /// Whether the optimizer keeps the pose as it is.
    pub fixed: bool,
}

/// The origin of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EdgeKind {
    /// From one pose to the next: robust kernels are not applied.
    Odometry,
    /// A place recognized again, perhaps wrongly: robust kernels are applied.
    Closure,
}

/// A measured relative pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge<const D: usize> {
    /// Id of the vertex in whose frame it was measured.
    pub i: u64,
    /// Id of the vertex that was measured.
    pub j: u64,
    /// The measurement: the pose of `j` in the frame of `i`.
    pub i_from_j: Pose<D>,
    /// The inverse covariance of the measurement.
    pub information: Information<D>,
    /// The origin of the edge.
    pub kind: EdgeKind,
}

/// Poses and relative poses measured between them, in 2-D or 3-D.
///
/// All poses are finite and rigid, all information matrices positive definite: anything else is refused when added.
///
/// ```
/// use portolan::geom::Pose;
/// use portolan_graph::{Edge, EdgeKind, Information, PoseGraph, Settings};
///
/// // A square loop: four sides of 1 m with a left turn; the last one is the closure.
/// let mut graph = PoseGraph::<2>::new();
/// let side = Pose::<2>::new(1.0, 0.0, std::f64::consts::FRAC_PI_2);
/// let mut pose = Pose::IDENTITY;
/// for id in 0..4 {
///     graph.add_vertex(id, pose)?;
///     pose = pose * Pose::<2>::new(1.1, 0.0, 1.5); // wheel odometry
/// }
/// for i in 0..4 {
///     graph.add_edge(Edge {
///         i,
///         j: (i + 1) % 4,
///         i_from_j: side,
///         information: Information::from_sigmas(0.05, 0.02)?,
///         kind: if i < 3 { EdgeKind::Odometry } else { EdgeKind::Closure },
///     })?;
/// }
/// let report = graph.optimize(&Settings::default())?;
/// assert!(report.chi_square.last() < Some(&1e-9));
/// assert!((graph.pose(2).unwrap().translation[1] - 1.0).abs() < 1e-6);
/// # Ok::<(), portolan_graph::GraphError>(())
/// ```
#[derive(Clone, Debug)]
pub struct PoseGraph<const D: usize> {
    pub(crate) vertices: Vec<Vertex<D>>,
    pub(crate) edges: Vec<Edge<D>>,
    /// Indices into `vertices` of both ends of each edge.
    pub(crate) ends: Vec<[usize; 2]>,
    index: FxHashMap<u64, usize>,
}

impl<const D: usize> PoseGraph<D> {
    /// An empty graph.
    pub fn new() -> Self {
        const { assert!(D == 2 || D == 3, "graphs have two or three dimensions") };
        Self { vertices: Vec::new(), edges: Vec::new(), ends: Vec::new(), index: FxHashMap::default() }
    }

    /// Adds a pose, free to move.
    ///
    /// # Errors
    /// [`GraphError::DuplicateVertex`], [`GraphError::Pose`].
    pub fn add_vertex(&mut self, id: u64, world_from_vertex: Pose<D>) -> Result<(), GraphError> {
        let world_from_vertex = mended(&world_from_vertex, || format!("vertex {id}"))?;
        if self.index.contains_key(&id) {
            return Err(GraphError::DuplicateVertex { id });
        }
        self.index.insert(id, self.vertices.len());
        self.vertices.push(Vertex { id, world_from_vertex, fixed: false });
        Ok(())
    }

    /// Adds a measurement between two vertices of the graph. Two edges may join the same pair.
    ///
    /// # Errors
    /// [`GraphError::UnknownVertex`], [`GraphError::SelfEdge`], [`GraphError::Pose`].
    pub fn add_edge(&mut self, edge: Edge<D>) -> Result<(), GraphError> {
        if edge.i == edge.j {
            return Err(GraphError::SelfEdge { id: edge.i });
        }
        let ends = [self.index_of(edge.i)?, self.index_of(edge.j)?];
        let i_from_j = mended(&edge.i_from_j, || format!("edge {} to {}", edge.i, edge.j))?;
        self.edges.push(Edge { i_from_j, ..edge });
        self.ends.push(ends);
        Ok(())
    }

    /// Fixes a vertex at its pose, or frees it.
    ///
    /// # Errors
    /// [`GraphError::UnknownVertex`].
    pub fn set_fixed(&mut self, id: u64, fixed: bool) -> Result<(), GraphError> {
        let index = self.index_of(id)?;
        self.vertices[index].fixed = fixed;
        Ok(())
    }

    /// Replaces the pose of a vertex.
    ///
    /// # Errors
    /// [`GraphError::UnknownVertex`], [`GraphError::Pose`].
    pub fn set_pose(&mut self, id: u64, world_from_vertex: Pose<D>) -> Result<(), GraphError> {
        let index = self.index_of(id)?;
        self.vertices[index].world_from_vertex = mended(&world_from_vertex, || format!("vertex {id}"))?;
        Ok(())
    }

    /// The estimate of a vertex; `None` for an unknown id.
    pub fn pose(&self, id: u64) -> Option<&Pose<D>> {
        self.index.get(&id).map(|&index| &self.vertices[index].world_from_vertex)
    }

    /// The vertices, in the order in which they were added.
    pub fn vertices(&self) -> &[Vertex<D>] {
        &self.vertices
    }

    /// The edges, in the order in which they were added.
    pub fn edges(&self) -> &[Edge<D>] {
        &self.edges
    }

    /// `sum of r^T Omega r` over all edges, without kernels and without a factor of one half.
    pub fn chi_square(&self) -> f64 {
        self.edge_chi_squares().iter().sum()
    }

    /// `r^T Omega r` of each edge, in the order of [`PoseGraph::edges`].
    pub fn edge_chi_squares(&self) -> Vec<f64> {
        let one = |(edge, &[i, j]): (&Edge<D>, &[usize; 2])| {
            let (i, j) = (&self.vertices[i].world_from_vertex, &self.vertices[j].world_from_vertex);
            let error = error_pose(&edge.i_from_j.inverse(), i, j);
            match D {
                2 => quadratic(&residual::<D, 3>(&error), &edge.information.block()),
                _ => quadratic(&residual::<D, 6>(&error), &edge.information.block()),
            }
        };
        self.edges.iter().zip(&self.ends).map(one).collect()
    }

    pub(crate) fn index_of(&self, id: u64) -> Result<usize, GraphError> {
        self.index.get(&id).copied().ok_or(GraphError::UnknownVertex { id })
    }
}

impl<const D: usize> Default for PoseGraph<D> {
    fn default() -> Self {
        Self::new()
    }
}

/// `r^T omega r`.
#[inline]
pub(crate) fn quadratic<const B: usize>(r: &[f64; B], omega: &[[f64; B]; B]) -> f64 {
    let mut sum = 0.0;
    for a in 0..B {
        for b in 0..B {
            sum += r[a] * omega[a][b] * r[b];
        }
    }
    sum
}

/// The pose, exactly rigid.
fn mended<const D: usize>(pose: &Pose<D>, what: impl Fn() -> String) -> Result<Pose<D>, GraphError> {
    match Pose::from_matrix(pose.rotation, pose.translation) {
        Ok((pose, _)) => Ok(pose),
        Err(source) => Err(GraphError::Pose { what: what(), source }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::geom::PoseError;

    fn edge(i: u64, j: u64, i_from_j: Pose<2>) -> Edge<2> {
        let information = Information::from_sigmas(1.0, 1.0).unwrap();
        Edge { i, j, i_from_j, information, kind: EdgeKind::Closure }
    }

    #[test]
    fn bad_parts_are_refused_by_name() {
        let mut graph = PoseGraph::<2>::new();
        graph.add_vertex(u64::MAX, Pose::IDENTITY).unwrap();
        graph.add_vertex(7, Pose::IDENTITY).unwrap();
        assert_eq!(graph.add_vertex(7, Pose::IDENTITY), Err(GraphError::DuplicateVertex { id: 7 }));
        let nan = Pose { translation: [f64::NAN, 0.0], ..Pose::IDENTITY };
        let refused = |what: &str| Err(GraphError::Pose { what: what.into(), source: PoseError::NotFinite });
        assert_eq!(graph.add_vertex(8, nan), refused("vertex 8"));
        assert_eq!(graph.set_pose(7, nan), refused("vertex 7"));
        assert_eq!(graph.add_edge(edge(7, u64::MAX, nan)), refused(&format!("edge 7 to {}", u64::MAX)));
        assert_eq!(graph.add_edge(edge(7, 7, Pose::IDENTITY)), Err(GraphError::SelfEdge { id: 7 }));
        assert_eq!(graph.add_edge(edge(7, 9, Pose::IDENTITY)), Err(GraphError::UnknownVertex { id: 9 }));
        assert_eq!(graph.set_fixed(9, true), Err(GraphError::UnknownVertex { id: 9 }));
        assert!(graph.pose(8).is_none() && graph.edges().is_empty() && graph.vertices().len() == 2);
    }

    #[test]
    fn chi_square_has_no_half() {
        let mut graph = PoseGraph::<2>::new();
        graph.add_vertex(0, Pose::IDENTITY).unwrap();
        graph.add_vertex(1, Pose::<2>::new(3.0, 4.0, 0.0)).unwrap();
        graph.add_edge(edge(0, 1, Pose::IDENTITY)).unwrap();
        assert_eq!(graph.chi_square(), 25.0);
    }
}
