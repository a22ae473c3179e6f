//! Clearance: the truncated field beside the Euclidean one, a probe into both, and paths that are certified or not.

mod arrows;
mod ask;
mod fields;
mod meter;
mod path;
mod probe;
mod rings;
mod state;
#[cfg(test)]
mod tests;

pub(super) use state::Clearance;
