//! Every file format that portolan reads or writes, one file each.
//!
//! | format | read | write |
//! |---|---|---|
//! | CARMEN log (plain, gzip, bzip2) | [`LaserLog`], [`detect_no_return`] | |
//! | bags of ROS 1 and ROS 2 | [`LaserLog`], [`scan_log::ScanLog`], [`BagInfo`] | |
//! | pose files (`x y theta`, `t x y theta`, TUM) | [`read_poses_2d`] | |
//! | PCD (text, binary, packed) | [`read_pcd`] | [`write_pcd`] |
//! | PLY clouds (text, binary) | [`read_ply_cloud`] | [`write_ply_cloud`] |
//! | KITTI velodyne `.bin` | [`read_kitti_bin`] | [`write_kitti_bin`] |
//! | XYZ, CSV, PTS | [`read_xyz`] | |
//! | LAS, LAZ, COPC | [`read_points`] | |
//! | E57, PTX (scans with poses) | [`read_posed_clouds`], [`read_points`] | |
//! | OctoMap scan graph | [`read_scan_graph`] | |
//! | 3-D poses (matrices, KITTI, TUM, Redwood) | [`poses3::read_poses_3d`] | |
//! | logs of 3-D scans with poses | [`scan_log::ScanLog`] | as KITTI, TUM RGB-D, 7-Scenes: [`LogWriter`] |
//! | `map.portolan` | [`MapFile`]; its chunks: [`Container`] | [`MapFile::write`]; its chunks: [`ContainerWriter`] |
//! | messages of ROS 2 in MCAP | | of a map: [`write_map_mcap`] |
//! | `esdf.bin` | [`EsdfFile`] | [`write_esdf`] |
//! | ROS map_server (yaml + pgm) | [`MapServerMap`] | [`write_map_server`] |
//! | costs of Nav2, as a map_server map | | [`write_costmap`] |
//! | numpy `.npy`, `.npz` | [`read_npy`], [`read_npz`] | [`write_npy`], [`write_npz`] |
//! | OctoMap `.bt`, `.ot` | [`OctomapTree`] | [`write_octomap_bt`], [`write_octomap_ot`] |
//! | PGM | [`Pgm`] | [`Pgm::write`] |
//! | GeoJSON contours | [`read_geojson`] | [`write_geojson`] |
//! | SVG contours | | [`write_svg`] |
//! | PLY meshes (written binary) | [`read_ply_mesh`], [`mesh_counts`] | [`write_ply_mesh`] |
//! | GLB meshes (glTF 2.0) | [`read_mesh`] | [`write_glb`] |
//! | OBJ meshes | [`read_mesh`] | [`write_obj`] |
//! | which files of a folder one run wrote (JSON) | [`Manifest`] | [`Manifest::write`] |
//! | query points, answers (CSV) | [`QueryPoints`] | [`write_answer`] |
//!
//! [`detect`] finds out what a file is. Readers and writers handle plain data (slices, grids, stores); only
//! [`MapFile`] holds maps.
//!
//! No reader trusts its bytes. A length in a file is checked against the bytes that are there before memory is taken, packed data is unpacked as a stream up to a limit, lines end after 4 MiB,
//! and whatever the bytes are, the result is a value or an [`IoError`] whose one line names file, place, field,
//! value, and what to do. Every writer goes through [`write_atomic`], so that no half file is left behind.

mod answer_row;
mod bytes;
mod carmen;
mod container;
mod costmap;
mod detect;
mod e57_file;
mod error;
mod esdf_bin;
mod geojson;
mod kitti_bin;
mod las_file;
mod laser_log;
mod log_writer;
mod manifest;
mod map_file;
mod map_messages;
mod map_picture;
mod map_server;
mod mesh;
mod numpy;
mod octomap;
mod pcd;
mod pgm;
mod ply;
mod points;
mod points_csv;
mod poses;
pub mod poses3;
mod ptx;
mod ros_log;
mod scan_graph;
pub mod scan_log;
mod svg;
#[cfg(test)]
mod testing;
mod xyz;

pub use answer_row::{
    AnswerRow, HELD_BACK, SigmaColumns, certified_reach, write_answer, write_answer_header,
};
pub use bytes::{Compression, Input, open, rename_durable, write_atomic, write_durable};
pub use carmen::{CarmenStats, RefusedScan, RefusedScans, ScanFault, ScanMessage};
pub use container::{Chunk, Container, ContainerWriter};
pub use costmap::write_costmap;
pub use detect::{FileKind, detect};
pub use e57_file::{E57About, e57_about};
pub use error::{IoError, Result};
pub use esdf_bin::{EsdfFile, esdf_to_bytes, write_esdf};
pub use geojson::{geojson_to_bytes, parse_geojson, read_geojson, write_geojson};
pub use kitti_bin::{read_kitti_bin, write_kitti_bin};
pub use laser_log::{LaserLog, LaserLogStats, RawLaserScan, TimeOrder, detect_no_return};
pub use log_writer::{LogLayout, LogWriter};
pub use manifest::{FileSum, Manifest};
pub use map_file::{
    AttenuationBricks, ColorBricks, LedgerFile, MapFile, MapHeader, OccupancyBricks, TsdfBricks,
    add_ledger_files, map_dimension, scans_of_sum, sweep_of, sweep_word, weights_of, weights_word,
};
pub use map_messages::{MapMessages, write_map_mcap};
pub use map_server::{MapCell, MapMode, MapServerInfo, MapServerMap, write_map_server};
pub use mesh::{
    MeshCounts, MeshFormat, glb_to_bytes, mesh_area, mesh_counts, parse_mesh_counts, ply_mesh_to_bytes,
    read_mesh, write_glb, write_obj, write_ply_mesh,
};
pub use numpy::{NpyArray, NpyValues, parse_npy, parse_npz, read_npy, read_npz, write_npy, write_npz};
pub use octomap::{
    OCTOMAP_FREE, OCTOMAP_OCCUPIED, OctomapTree, octomap_bt_to_bytes, write_octomap_bt, write_octomap_ot,
};
pub use pcd::{read_pcd, write_pcd};
pub use pgm::Pgm;
pub use ply::{PlyMesh, parse_ply_mesh, read_ply_cloud, read_ply_mesh, write_ply_cloud};
pub use points::{
    CloudGrid, PointCloudFile, PointFormat, PosedCloud, RefusedPoints, Viewpoint, parse_points, point_format,
    read_points, read_posed_clouds,
};
pub use points_csv::QueryPoints;
pub use poses::{TimedPose, parse_poses_2d, read_poses_2d};
pub use ros_log::{BagChoice, BagInfo, BagLogStats, EdgeOfBag, TopicOfBag, bag_dimension};
pub use scan_graph::{ScanGraphNode, parse_scan_graph, read_scan_graph};
pub use svg::{SvgStyle, svg_text, write_svg};
pub use xyz::read_xyz;

/// Points joined by straight segments (meters); a closed line repeats its first point at the end.
pub type Polyline = Vec<[f64; 2]>;
