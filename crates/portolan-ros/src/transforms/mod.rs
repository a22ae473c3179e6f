//! The tree of frames at a time.
//!
//! [`FrameTreeBuilder`] takes the transforms of a bag in their order; [`FrameTree`] answers with the pose of one frame in another
//! at a time, or with the edge that is missing and by how much. Nothing that contradicts itself is resolved in silence:
//! [`FrameTree::notes`] has it. [`Track`] is one edge, or the poses of a topic.

mod builder;
#[cfg(test)]
mod tests;
mod track;
mod tree;

pub use builder::FrameTreeBuilder;
pub use track::{Track, TrackBuilder};
pub use tree::{EdgeInfo, FrameTree, NoTransform};
