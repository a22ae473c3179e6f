//! Errors of graphs and of the optimizer.

use portolan::geom::PoseError;

/// Why a graph was refused or could not be optimized.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// A vertex with this id exists already.
    #[error("vertex {id} exists already")]
    DuplicateVertex {
        /// The id.
        id: u64,
    },
    /// No vertex has this id.
    #[error("vertex {id} does not exist")]
    UnknownVertex {
        /// The id.
        id: u64,
    },
    /// Both ends of an edge are the same vertex.
    #[error("an edge connects vertex {id} with itself")]
    SelfEdge {
        /// The id.
        id: u64,
    },
    /// A pose has an entry that is not finite, or its matrix is not a rotation.
    #[error("{what}: {source}")]
    Pose {
        /// The vertex or edge of the pose.
        what: String,
        /// The defect.
        source: PoseError,
    },
    /// An upper triangle has the wrong length.
    #[error("an information matrix has {expected} numbers in its upper triangle, not {found}")]
    InformationLength {
        /// 6 in 2-D, 21 in 3-D.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// An information matrix has an entry that is NaN or infinite.
    #[error("an information matrix has an entry that is not finite")]
    InformationNotFinite,
    /// An information matrix is not positive definite.
    #[error("an information matrix is not positive definite: pivot {pivot:.3e} in row {row}")]
    InformationNotPositive {
        /// Row of the first pivot that is not positive.
        row: usize,
        /// The pivot.
        pivot: f64,
    },
    /// The graph is not connected, and [`Settings::require_connected`](crate::Settings::require_connected) is set.
    #[error("the graph is not connected: it has {components} components")]
    Disconnected {
        /// Number of connected components.
        components: usize,
    },
    /// The system is singular at any damping: the information spans too many orders of magnitude.
    #[error("the linear system of iteration {iteration} is singular")]
    Singular {
        /// The iteration, from 0; also 0 in the computation of initial poses.
        iteration: usize,
    },
    /// The initial cost overflows: poses or information are too large.
    #[error("the cost is not finite: poses or information are too large")]
    NotFinite,
    /// A setting is out of range.
    #[error("setting {name} is {value}: {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The values allowed.
        expected: &'static str,
    },
}
