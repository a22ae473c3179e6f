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

/// What an [`Answer`] is, without its value. In a byte, as batches, arrays and files hold it: 0 unknown, 1 known,
/// 2 saturated, 3 outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Inside the map, where nothing was observed.
    #[default]
    Unknown = 0,
    /// The map knows.
    Known = 1,
    /// Beyond what the map maintains: at least so far.
    Saturated = 2,
    /// Outside of the map.
    Outside = 3,
}

impl<T> Answer<T> {
    /// The value of [`Answer::Known`]; `None` for all others.
    pub fn known(self) -> Option<T> {
        match self {
            Self::Known(value) => Some(value),
            _ => None,
        }
    }

    /// The value where there is one: known, or at least so much.
    pub fn value(self) -> Option<T> {
        match self {
            Self::Known(value) | Self::Saturated(value) => Some(value),
            Self::Unknown | Self::Outside => None,
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

    /// What the answer is.
    pub fn status(&self) -> Status {
        match self {
            Self::Known(_) => Status::Known,
            Self::Saturated(_) => Status::Saturated,
            Self::Unknown => Status::Unknown,
            Self::Outside => Status::Outside,
        }
    }
}

impl Status {
    /// Of a byte; `None` above 3.
    pub fn of_byte(byte: u8) -> Option<Self> {
        [Self::Unknown, Self::Known, Self::Saturated, Self::Outside].get(usize::from(byte)).copied()
    }

    /// In a byte.
    pub fn byte(self) -> u8 {
        self as u8
    }

    /// `known`, `saturated`, `unknown` or `outside`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Known => "known",
            Self::Saturated => "saturated",
            Self::Unknown => "unknown",
            Self::Outside => "outside",
        }
    }

    /// Whether there is a value: known or saturated.
    pub fn has_value(self) -> bool {
        matches!(self, Self::Known | Self::Saturated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_words_are_those_of_files() {
        let words = ["unknown", "known", "saturated", "outside"];
        for (byte, word) in (0..4).zip(words) {
            let status = Status::of_byte(byte).unwrap();
            assert_eq!((status.byte(), status.word()), (byte, word));
        }
        assert_eq!(Status::of_byte(4), None);
        assert_eq!(Answer::Saturated(3).map(|v| v + 1).status(), Status::Saturated);
        assert_eq!((Answer::Saturated(3).value(), Answer::<u8>::Unknown.value()), (Some(3), None));
    }
}
