//! What is wrong with a path or a body before any map is asked.

/// A path, a body or a setting that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A path without a point, a body without a sphere.
    #[error("{0} is empty")]
    Empty(&'static str),
    /// A coordinate is NaN or infinite, or so large that lengths are.
    #[error("{what} {index} is not finite, or lengths are not")]
    NotFinite {
        /// What it belongs to.
        what: &'static str,
        /// The how-manieth.
        index: usize,
    },
    /// A number outside of its range.
    #[error("{what} is {value}: it must be {must}")]
    Range {
        /// Which number.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// More pieces than anyone needs.
    #[error("{what} would take more than {limit} pieces")]
    TooMany {
        /// What would.
        what: &'static str,
        /// As many are allowed.
        limit: usize,
    },
}
