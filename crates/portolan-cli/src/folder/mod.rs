//! A folder of results is one thing: one run writes to it at a time, and its files are a set.
//!
//! | what | file |
//! |---|---|
//! | one run at a time | `lock.rs` |
//! | from the first look at a folder to the last file | `results.rs` |
//! | what readers check | `check.rs` |

mod check;
mod lock;
mod results;

pub(crate) use check::{check_file, forget, half_written, warn};
pub(crate) use results::Results;
