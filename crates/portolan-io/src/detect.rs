//! What kind of file this is: by its content first, then by its name.

use std::path::{Path, PathBuf};

use crate::bytes::open;
use crate::mesh::{MeshFormat, mesh_format};
use crate::ros_log::is_bag;
use crate::scan_log::ScanLogKind;
use crate::{Result, container, esdf_bin};

/// How much of a file is read (unpacked bytes).
const HEAD: u64 = 64 << 10;

/// What a file or folder is.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileKind {
    /// A CARMEN log: [`crate::LaserLog::read_carmen`].
    CarmenLog,
    /// A bag of ROS 1 or ROS 2, a file or a folder: [`crate::LaserLog::read_bag`] or [`crate::scan_log::ScanLog`], by its
    /// [`crate::bag_dimension`].
    Bag,
    /// portolan's own map: [`crate::Container`].
    Portolan,
    /// A folder with a `map.portolan`, as `map` and `demo` write it.
    PortolanFolder,
    /// A distance field: [`crate::EsdfFile`].
    EsdfBin,
    /// A gray image: [`crate::Pgm`].
    Pgm,
    /// The yaml file of a map_server map: [`crate::MapServerMap`].
    MapServerYaml,
    /// Contours: [`crate::read_geojson`].
    GeoJson,
    /// A picture of contours; not read.
    Svg,
    /// OctoMap's tree of free and occupied: [`crate::OctomapTree`].
    OctomapBt,
    /// OctoMap's tree of log odds: [`crate::OctomapTree`].
    OctomapOt,
    /// A log of 3-D scans with poses: [`crate::scan_log::ScanLog`].
    ScanLog(ScanLogKind),
    /// A mesh of triangles: [`crate::mesh_counts`], and [`crate::read_ply_mesh`] for PLY.
    Mesh(MeshFormat),
    /// Any other file; the text gives what was found and which formats are read.
    Unknown(String),
}

/// Finds out what a file or folder is.
///
/// # Errors
/// [`crate::IoError`] where it cannot be opened or read.
pub fn detect(path: impl AsRef<Path>) -> Result<FileKind> {
    let path = path.as_ref();
    if path.is_dir() {
        if path.join("map.portolan").is_file() {
            return Ok(FileKind::PortolanFolder);
        }
        if let Some(kind) = ScanLogKind::recognize(path) {
            return Ok(of_log(kind));
        }
        return Ok(FileKind::Unknown(unknown_folder(path)));
    }
    if path.is_file() && is_bag(path) {
        return Ok(FileKind::Bag);
    }
    let head = open(path)?.read_up_to(HEAD)?;
    let as_log = || ScanLogKind::recognize(path).map(of_log);
    let kind = by_content(path, &head).or_else(as_log).or_else(|| by_name(path, &head));
    Ok(kind.unwrap_or_else(|| unknown(&head)))
}

/// Folders inside a folder that are looked at, and how many are named.
const MOST_FOLDERS: usize = 500;
const NAMED: usize = 3;

/// What a folder lacks, and where in it something may be: logs are often given by a folder too high.
fn unknown_folder(path: &Path) -> String {
    let inside = |folder: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut all: Vec<PathBuf> = entries.take(MOST_FOLDERS).map(|entry| entry.path()).collect();
        all.sort();
        all
    };
    let children = inside(path);
    if children.is_empty() {
        return "an empty folder; give the folder or the file that holds the scans".into();
    }
    let folders = |all: Vec<PathBuf>| all.into_iter().filter(|p| p.is_dir()).collect::<Vec<_>>();
    let near = folders(children);
    let far = near.iter().flat_map(|folder| folders(inside(folder))).take(MOST_FOLDERS);
    let is_something = |p: &PathBuf| p.join("map.portolan").is_file() || ScanLogKind::recognize(p).is_some();
    let found: Vec<PathBuf> = near.iter().cloned().chain(far).filter(is_something).collect();
    if found.is_empty() {
        return "a folder without map.portolan and without scans of a known layout; name a file inside it"
            .into();
    }
    let named: Vec<_> = found.iter().take(NAMED).map(|p| p.display().to_string()).collect();
    let more = if found.len() > NAMED { format!(" and {} more", found.len() - NAMED) } else { String::new() };
    format!("a folder above logs or maps; name one of them: {}{more}", named.join(", "))
}

/// A bag is a log of either dimension.
fn of_log(kind: ScanLogKind) -> FileKind {
    match kind {
        ScanLogKind::Bag => FileKind::Bag,
        kind => FileKind::ScanLog(kind),
    }
}

fn by_content(path: &Path, head: &[u8]) -> Option<FileKind> {
    let starts: [(&[u8], _); 4] = [
        (container::MAGIC, FileKind::Portolan),
        (esdf_bin::MAGIC, FileKind::EsdfBin),
        (b"# Octomap OcTree binary file", FileKind::OctomapBt),
        (b"# Octomap OcTree file", FileKind::OctomapOt),
    ];
    if let Some((_, kind)) = starts.into_iter().find(|(start, _)| head.starts_with(start)) {
        return Some(kind);
    }
    if let [b'P', b'2' | b'5', next, ..] = head
        && (next.is_ascii_whitespace() || *next == b'#')
    {
        return Some(FileKind::Pgm);
    }
    if let Some(format) = mesh_format(path, head) {
        return Some(FileKind::Mesh(format));
    }
    let text = String::from_utf8_lossy(head);
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if start.starts_with('{') && start.contains("\"type\"") && GEOJSON_WORDS.iter().any(|w| start.contains(w))
    {
        return Some(FileKind::GeoJson);
    }
    if start.starts_with('<') && start.contains("<svg") {
        return Some(FileKind::Svg);
    }
    if text.lines().any(|line| {
        let word = line.split_ascii_whitespace().next().unwrap_or("");
        CARMEN_WORDS.split(' ').any(|known| known == word)
            || line.starts_with("# message_name ")
            || line.starts_with("# message formats")
    }) {
        return Some(FileKind::CarmenLog);
    }
    let has = |key: &str| text.lines().any(|l| l.trim_start().starts_with(key));
    (has("image:") && has("resolution:")).then_some(FileKind::MapServerYaml)
}

/// Words that only GeoJSON objects have.
const GEOJSON_WORDS: [&str; 3] = ["\"Feature\"", "\"FeatureCollection\"", "\"coordinates\""];

/// First words of lines of CARMEN logs.
const CARMEN_WORDS: &str =
    "FLASER RLASER ROBOTLASER1 ROBOTLASER2 RAWLASER1 RAWLASER2 ODOM PARAM SYNC TRUEPOS NEFF OLDLASER";

/// By the name, for a file whose content has no format (an empty or broken one): the reader's error is more useful.
fn by_name(path: &Path, head: &[u8]) -> Option<FileKind> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let name = [".gz", ".bz2"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
    let (_, extension) = name.rsplit_once('.')?;
    // Text under a text format's name; noise under it is unknown.
    let text = !head.contains(&0);
    match extension {
        "log" | "clf" if text => Some(FileKind::CarmenLog),
        "yaml" | "yml" if text => Some(FileKind::MapServerYaml),
        "geojson" if text => Some(FileKind::GeoJson),
        "svg" if text => Some(FileKind::Svg),
        "pgm" => Some(FileKind::Pgm),
        "portolan" => Some(FileKind::Portolan),
        "bt" => Some(FileKind::OctomapBt),
        "ot" => Some(FileKind::OctomapOt),
        "glb" => Some(FileKind::Mesh(MeshFormat::Glb)),
        "obj" if text => Some(FileKind::Mesh(MeshFormat::Obj)),
        _ => None,
    }
}

fn unknown(head: &[u8]) -> FileKind {
    let seen = match head {
        [] => "it is empty".to_owned(),
        [0x89, b'P', b'N', b'G', ..] => "it is a PNG picture (convert it to PGM)".to_owned(),
        _ => format!("it starts with {}", crate::error::shown(&head[..head.len().min(16)])),
    };
    let known = "known are CARMEN logs, logs of 3-D scans (depth images or lidar scans with poses), clouds (PCD, PLY, E57, PTX, LAS, LAZ, KITTI .bin, \
                 xyz), map.portolan, esdf.bin, PGM, map_server yaml, GeoJSON, OctoMap (.bt, .ot, .graph), meshes (PLY, GLB, OBJ)";
    FileKind::Unknown(format!("{seen}; {known}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{bad_bytes, real_data};

    fn kind_of(name: &str, bytes: &[u8]) -> FileKind {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        detect(&path).unwrap()
    }

    #[test]
    fn content_comes_before_the_name() {
        use FileKind::*;
        let container = crate::ContainerWriter::new().to_bytes();
        for (bytes, kind) in [
            (&container[..], Portolan),
            (b"PORTESDF", EsdfBin),
            (b"P5\n1 1\n255\n0", Pgm),
            (b"P2#c\n1 1\n255\n0", Pgm),
            (b"image: a.pgm\nresolution: 1\n", MapServerYaml),
            (b" {\"type\":\"Feature\"}", GeoJson),
            (b"<?xml version='1.0'?>\n<svg/>", Svg),
            (b"# Octomap OcTree binary file\nid OcTree", OctomapBt),
            (b"# Octomap OcTree file\nid OcTree", OctomapOt),
            (b"# message_name [message contents]\n", CarmenLog),
            (b"# hello\n\nFLASER 1 2", CarmenLog),
        ] {
            assert_eq!(kind_of("file.xyz", bytes), kind);
            assert_eq!(kind_of("file.log", bytes), kind);
        }
        assert_eq!(kind_of("empty.gfs.log", b""), CarmenLog);
        assert!(
            matches!(kind_of("noise.log", b"\x00\x01\x02"), Unknown(text) if text.contains("it starts with"))
        );
        assert!(matches!(kind_of("a.png", b"\x89PNG"), Unknown(text) if text.contains("PNG")));
        assert!(matches!(kind_of("none", b""), Unknown(text) if text.contains("it is empty; known are")));
    }

    #[test]
    fn meshes_are_told_from_clouds() {
        use crate::{write_glb, write_obj, write_ply_cloud, write_ply_mesh};
        let folder = tempfile::tempdir().unwrap();
        let mesh = portolan::surface::Mesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        for mesh in [mesh, Default::default()] {
            // Under names without meaning, and under those of clouds.
            for name in ["mesh", "mesh.xyz"] {
                let path = folder.path().join(name);
                write_ply_mesh(&path, &mesh).unwrap();
                assert_eq!(detect(&path).unwrap(), FileKind::Mesh(MeshFormat::Ply));
                write_glb(&path, &mesh).unwrap();
                assert_eq!(detect(&path).unwrap(), FileKind::Mesh(MeshFormat::Glb));
                write_obj(&path, &mesh).unwrap();
                let empty = mesh.vertices.is_empty();
                assert!(empty || detect(&path).unwrap() == FileKind::Mesh(MeshFormat::Obj));
            }
            let path = folder.path().join("mesh.obj");
            write_obj(&path, &mesh).unwrap();
            assert_eq!(detect(&path).unwrap(), FileKind::Mesh(MeshFormat::Obj));
        }
        let cloud = crate::PointCloudFile { points: vec![[1.0; 3]], ..Default::default() };
        let path = folder.path().join("cloud.ply");
        write_ply_cloud(&path, &cloud).unwrap();
        assert_eq!(detect(&path).unwrap(), FileKind::ScanLog(ScanLogKind::Clouds));
        // MeshLab's clouds have an element of no faces.
        let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 0\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n";
        assert_eq!(kind_of("a.ply", text.as_bytes()), FileKind::ScanLog(ScanLogKind::Clouds));
        assert_eq!(kind_of("a.xyz", b"1 2 3\n4 5 6\n"), FileKind::ScanLog(ScanLogKind::Clouds));
        assert!(
            matches!(kind_of("a.txt", b"v for vendetta\n"), FileKind::Unknown(text) if text.contains("meshes (PLY"))
        );
    }

    #[test]
    fn folders_are_maps_where_they_hold_one() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(detect(folder.path()).unwrap(), FileKind::Unknown(_)));
        std::fs::write(folder.path().join("map.portolan"), b"").unwrap();
        assert_eq!(detect(folder.path()).unwrap(), FileKind::PortolanFolder);
        assert!(detect(folder.path().join("missing")).is_err());
    }

    #[test]
    fn no_bytes_make_it_panic() {
        for bytes in bad_bytes(b"P5 {\"type\":\"Feature\"} # Octomap\nFLASER", 21, 500) {
            let _ = by_content(Path::new("a"), &bytes).unwrap_or_else(|| unknown(&bytes));
        }
    }

    #[test]
    fn real_files_are_recognized() {
        use FileKind::*;
        for (name, kind) in [
            ("lidar2d_carmen/intel-corrected.log.gz", CarmenLog),
            ("lidar2d_carmen/intel.clf.bz2", CarmenLog),
            ("maps_2d/depot.yaml", MapServerYaml),
            ("maps_2d/willow-full.pgm", Pgm),
            ("maps_octomap/geb079.bt", OctomapBt),
            ("rangescan_stanford_bunny/reconstruction/bun_zipper.ply", Mesh(MeshFormat::Ply)),
            ("rgbd_redkitchen", ScanLog(ScanLogKind::SevenScenes)),
        ] {
            let Some(path) = real_data(name) else { continue };
            assert_eq!(detect(path).unwrap(), kind);
        }
    }
}
