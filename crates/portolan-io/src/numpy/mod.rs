//! numpy's files: one array (`.npy`), or several with names (`.npz`, a zip of them).

mod array;
mod npy;
mod npz;

pub use array::{NpyArray, NpyValues};
pub use npy::{parse_npy, read_npy, write_npy};
pub use npz::{parse_npz, read_npz, write_npz};
