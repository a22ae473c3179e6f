//! Bags of ROS 1 and ROS 2 read without ROS.
//!
//! | module | holds |
//! |---|---|
//! | [`container`] | MCAP, sqlite3 and ROS 1 bags as one thing: topics, an index, messages as bytes |
//! | [`message`] | definitions of messages, bytes to values, and the messages that maps are made of |
//! | [`transforms`] | the tree of frames at a time |

pub mod container;
mod error;
pub mod message;
pub mod transforms;

pub use error::{BagError, Result};
