//! What is wrong with a graph.

use portolan::geom::PoseError;

/// Why a graph is refused or cannot be solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// The id is taken.
    #[error("vertex {id} exists already")]
    DuplicateVertex {
        /// The id.
        id: u64,
    },
    /// There is no such vertex.
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
    /// A pose has entries that are not finite, or a rotation that is none.
    #[error("{what}: {source}")]
    Pose {
        /// Which pose.
        what: String,
        /// What is wrong with it.
        source: PoseError,
    },
    /// An upper triangle of the wrong length.
    #[error("an information matrix has {expected} numbers in its upper triangle, not {found}")]
    InformationLength {
        /// 6 in the plane, 21 in space.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// An information matrix has an entry that is NaN or infinite.
    #[error("an information matrix has an entry that is not finite")]
    InformationNotFinite,
    /// An information matrix is not positive definite.
    #[error("an information matrix is not positive definite: pivot {pivot:.3e} in row {row}")]
    InformationNotPositive {
        /// Row of the first bad pivot.
        row: usize,
        /// The pivot.
        pivot: f64,
    },
    /// The graph falls apart, and the settings forbid it.
    #[error("the graph has {components} parts that no edge connects")]
    Disconnected {
        /// Number of parts.
        components: usize,
    },
    /// The system stays singular however much it is damped: information that spans too many orders of
    /// magnitude.
    #[error("the linear system of iteration {iteration} is singular")]
    Singular {
        /// The iteration, from 0; 0 also for a start that is computed.
        iteration: usize,
    },
    /// The cost at the start overflows: poses or information too large.
    #[error("the cost is not finite: poses or information are too large")]
    NotFinite,
    /// A setting is out of range.
    #[error("setting {name} is {value}: {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
}
