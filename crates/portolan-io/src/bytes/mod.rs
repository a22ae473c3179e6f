//! Bytes in and out: compression, lines of bounded length, numbers, files that appear whole or not at all.

mod atomic;
mod lines;
mod number;
mod open;
mod scalar;
mod temporary;

pub use atomic::{rename_durable, write_atomic, write_durable};
pub use open::{Compression, Input, open};

pub(crate) use atomic::{Prepared, prepare};
pub(crate) use lines::Lines;
pub(crate) use number::{check_padding, columns, fields, header_line, number_words, parse_f64, whole};
pub(crate) use open::{open_file, read_failed};
pub(crate) use scalar::{Endian, Scalar, u32_at, u64_at};
