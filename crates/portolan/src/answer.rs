//! What a map says when asked.

/// An answer that says what it is. Unknown is never a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer<T> {
    /// The map knows.
    Known(T),
    /// Beyond what the map maintains: at least so much, with the sign of the side.
    Saturated(T),
    /// Inside the map, where nothing was observed.
    Unknown,
    /// Outside of the map.
    Outside,
}

impl<T> Answer<T> {
    /// The value where it is known.
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
