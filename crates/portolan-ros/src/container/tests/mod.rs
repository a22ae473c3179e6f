//! All containers against what was written into them, whole, damaged and cut.

mod damage;
mod mcap;
mod real;
mod ros1;
mod rosbags;
mod sqlite;
mod support;
