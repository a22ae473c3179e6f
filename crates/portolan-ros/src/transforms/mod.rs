//! The tree of frames at a time.
