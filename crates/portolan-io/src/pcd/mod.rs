//! PCD, the point-cloud files of the Point Cloud Library, versions .5 to .7: text, binary, and binary packed by LZF.
//!
//! A header of lines, `#` for comments, in this order or any other:
//!
//! | line | meaning |
//! |---|---|
//! | `VERSION` | 0.7 |
//! | `FIELDS` (`COLUMNS`) | names; `_` is padding |
//! | `SIZE`, `TYPE`, `COUNT` | bytes (1, 2, 4, 8), kind (I, U, F) and number of values of each field |
//! | `WIDTH`, `HEIGHT`, `POINTS` | an organized cloud has `HEIGHT` rows |
//! | `VIEWPOINT` | position and `w x y z` of the sensor: reported, never applied |
//! | `DATA` | `ascii`, `binary` (point by point) or `binary_compressed` (field by field), little-endian; the last line |
//!
//! Read are `x y z`, `intensity` (or `i`, `reflectivity`), `rgb`/`rgba` (packed `0x00RRGGBB`, also where its type is float) or `r g b`,
//! `normal_x normal_y normal_z`, `ring`, and a time (`t`, `time`, `timestamp`, ...: whole numbers are nanoseconds, others
//! seconds). Bytes behind the last binary point are ignored (writers pad files to whole pages).

mod columns;
mod header;
mod lzf;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use read::read_pcd;
pub(crate) use read::{parse, read_viewpoint};
pub use write::write_pcd;
