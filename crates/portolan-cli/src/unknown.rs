//! What unknown space counts as: one default for all commands, the library's.

use portolan::field::UnknownSpace;

/// What unknown space counts as in an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum UnknownArg {
    /// Free
    Optimistic,
    /// An obstacle
    Pessimistic,
}

impl UnknownArg {
    /// As the library has it; without the option its default.
    pub(crate) fn space(given: Option<Self>) -> UnknownSpace {
        match given {
            Some(Self::Optimistic) => UnknownSpace::Optimistic,
            Some(Self::Pessimistic) => UnknownSpace::Pessimistic,
            None => UnknownSpace::default(),
        }
    }
}

/// What unknown cells become in an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum UnknownCells {
    /// Free
    Optimistic,
    /// An obstacle
    Pessimistic,
    /// NaN, in plain arrays
    Nan,
}

impl UnknownCells {
    /// What they count as, `None` where they stay unknown; without the option the library's default.
    pub(crate) fn space(given: Option<Self>) -> Option<UnknownSpace> {
        match given {
            Some(Self::Optimistic) => Some(UnknownSpace::Optimistic),
            Some(Self::Pessimistic) => Some(UnknownSpace::Pessimistic),
            Some(Self::Nan) => None,
            None => Some(UnknownSpace::default()),
        }
    }

    /// What they count as, in one word.
    pub(crate) fn word(given: Option<Self>) -> &'static str {
        Self::space(given).map_or(STAYS, UnknownSpace::word)
    }
}

/// Of outputs that say of unknown cells that they are.
pub(crate) const STAYS: &str = "unknown";
