//! The answer of a map to a query.

/// The answer of a map to a query at a point. Unknown is never encoded as a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer<T> {
    /// The value.
    Known(T),
    /// A distance beyond the range that the map maintains: at least this much, with the sign of the side.
    Saturated(T),
    /// The point lies inside the map and was not observed.
    Unknown,
    /// The point lies outside the map.
    Outside,
}

impl<T> Answer<T> {
    /// The value of [`Answer::Known`]; `None` for all others.
    pub fn known(self) -> Option<T> {
        match self {
            Self::Known(value) => Some(value),
            _ => None,
        }
    }

    /// The same status with another value.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Answer<U> {
        match self {
            Self::Known(value) => Answer::Known(f(value)),
            Self::Saturated(value) => Answer::Saturated(f(value)),
            Self::Unknown => Answer::Unknown,
            Self::Outside => Answer::Outside,
        }
    }

    /// `known`, `saturated`, `unknown` or `outside`.
    pub fn status(&self) -> &'static str {
        match self {
            Self::Known(_) => "known",
            Self::Saturated(_) => "saturated",
            Self::Unknown => "unknown",
            Self::Outside => "outside",
        }
    }
}
