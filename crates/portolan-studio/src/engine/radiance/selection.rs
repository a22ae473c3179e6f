//! What of the run is looked at.

/// A ray and a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Selection {
    /// The rays to learn from, then those held out.
    pub(super) ray: Option<usize>,
    pub(super) bin: Option<usize>,
}
