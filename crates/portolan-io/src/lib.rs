//! Every file format that portolan reads or writes, one file each.
//!
//! | format | read | write |
//! |---|---|---|
//! | CARMEN log (plain, gzip, bzip2) | [`CarmenLog`], [`detect_no_return`] | |
//! | pose files (`x y theta`, `t x y theta`, TUM) | [`read_poses_2d`] | |
//! | `map.portolan` | [`MapFile`]; its chunks: [`Container`] | [`MapFile::write`], [`ContainerWriter`] |
//! | `esdf.bin` | [`EsdfFile`] | [`write_esdf`] |
//! | ROS map_server (yaml + pgm) | [`MapServerMap`] | [`write_map_server`] |
//! | PGM | [`Pgm`] | [`Pgm::write`] |
//! | GeoJSON contours | [`read_geojson`] | [`write_geojson`] |
//! | SVG contours | | [`write_svg`] |
//! | PLY meshes (binary) | | [`write_ply_mesh`] |
//! | GLB meshes (glTF 2.0) | | [`write_glb`] |
//! | OBJ meshes | | [`write_obj`] |
//! | query points, answers (CSV) | [`QueryPoints`] | [`write_answer`] |
//!
//! [`detect`] tells what a file is. The formats know plain data (slices and grids), not maps.
//!
//! What holds for every reader: bytes are never trusted. A length in a file is checked against the bytes that
//! are there before memory is taken, packed data is unpacked as a stream up to a limit, lines end after 4 MiB,
//! and whatever the bytes are, the result is a value or an [`IoError`] whose one line names file, place, field,
//! value, and what to do. Every writer goes through [`write_atomic`], so that no half file is left behind.

mod bytes;
mod carmen;
mod container;
mod detect;
mod error;
mod esdf_bin;
mod geojson;
mod map_file;
mod map_server;
mod mesh;
mod pgm;
mod points_csv;
mod poses;
mod svg;
#[cfg(test)]
mod testing;

pub use bytes::{Compression, Input, open, write_atomic};
pub use carmen::{
    CarmenLog, CarmenScan, CarmenStats, RefusedScan, RefusedScans, ScanFault, ScanMessage, TimeOrder,
    detect_no_return,
};
pub use container::{Chunk, Container, ContainerWriter};
pub use detect::{FileKind, detect};
pub use error::IoError;
pub use esdf_bin::{EsdfBin, EsdfFile, write_esdf};
pub use geojson::{parse_geojson, read_geojson, write_geojson};
pub use map_file::{MapFile, MapHeader, sweep_of, sweep_word, weights_of, weights_word};
pub use map_server::{MapCell, MapMode, MapServerInfo, MapServerMap, write_map_server};
pub use mesh::{write_glb, write_obj, write_ply_mesh};
pub use pgm::Pgm;
pub use points_csv::{AnswerRow, AnswerStatus, QueryPoints, write_answer, write_answer_header};
pub use poses::{TimedPose, parse_poses_2d, read_poses_2d};
pub use svg::{SvgStyle, write_svg};

/// Points joined by straight segments (metres); a closed line repeats its first point at the end.
pub type Polyline = Vec<[f64; 2]>;
