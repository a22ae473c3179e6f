//! Errors in paths, bodies and settings.

/// Why a path, a body or a setting was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A path without points or a body without spheres.
    #[error("{0} is empty")]
    Empty(&'static str),
    /// A coordinate is NaN or infinite, or so large that a length overflows.
    #[error("{what} {index} has a coordinate or a length that is not finite")]
    NotFinite {
        /// Point, piece or sphere.
        what: &'static str,
        /// Its index, from 0.
        index: usize,
    },
    /// A number is outside its range.
    #[error("{what} is {value}: it must be {must}")]
    Range {
        /// The name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The range allowed.
        must: &'static str,
    },
    /// The result would have too many pieces.
    #[error("{what} would take more than {limit} pieces")]
    TooMany {
        /// The thing in question.
        what: &'static str,
        /// The largest number allowed.
        limit: usize,
    },
}
