//! Files with a log, a map or something derived from a map, opened by their kind.

use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan_io::scan_log::{ScanLog, ScanLogOptions};
use portolan_io::{
    BagChoice, EsdfFile, FileKind, LaserLog, MapFile, MapServerInfo, MapServerMap, MeshFormat, OctomapTree,
    Pgm, PlyMesh, Polyline, bag_dimension, detect, read_geojson, read_mesh,
};

use crate::dimension::{Dimension, Given};
use crate::folder::check_file;
use crate::log::describe;
use crate::mapping::available_memory;
use crate::saved::SavedMap;

/// What a file holds.
pub(crate) enum Source {
    /// A 2-D `map.portolan`
    Map2(Box<MapFile<2>>),
    /// A 3-D `map.portolan`
    Map3(Box<MapFile<3>>),
    /// `esdf.bin`
    Esdf(EsdfFile),
    /// A map_server map
    Server(MapServerMap),
    /// An image without a yaml file
    Image(Pgm),
    /// A contour
    Contour(Vec<Polyline>),
    /// A `.bt` or `.ot`
    Octomap(Box<OctomapTree>),
    /// A log of 2-D scans
    Log2(Box<LaserLog>),
    /// A log of 3-D scans
    Log3(Box<ScanLog>),
    /// A mesh of triangles
    Mesh(Box<MeshSource>),
}

/// A mesh and the format of its file.
pub(crate) struct MeshSource {
    pub(crate) mesh: PlyMesh,
    format: MeshFormat,
}

/// Opens a file or a folder.
pub(crate) fn open(path: &Path) -> anyhow::Result<Source> {
    let kind = detect(path)?;
    if !matches!(kind, FileKind::Portolan | FileKind::PortolanFolder) && path.is_file() {
        check_file(path)?;
    }
    Ok(match kind {
        FileKind::Portolan => of_map(path)?,
        FileKind::PortolanFolder => of_map(&path.join("map.portolan"))?,
        FileKind::EsdfBin => Source::Esdf(EsdfFile::read(path)?),
        FileKind::MapServerYaml => Source::Server(MapServerMap::read(path)?),
        FileKind::Pgm => match yaml_beside(path) {
            Some(yaml) => Source::Server(MapServerMap::read(yaml)?),
            None => Source::Image(Pgm::read(path)?),
        },
        FileKind::GeoJson => Source::Contour(read_geojson(path)?),
        FileKind::OctomapBt | FileKind::OctomapOt => Source::Octomap(Box::new(OctomapTree::read(path)?)),
        FileKind::CarmenLog => Source::Log2(Box::new(LaserLog::read_carmen(path)?)),
        FileKind::Bag if bag_dimension(path, &BagChoice::default())? == 2 => {
            Source::Log2(Box::new(LaserLog::read_bag(path, &ScanLogOptions::default())?))
        }
        FileKind::Bag | FileKind::ScanLog(_) => {
            Source::Log3(Box::new(ScanLog::open(path, &ScanLogOptions::default())?))
        }
        FileKind::Mesh(format) => Source::Mesh(Box::new(MeshSource { mesh: read_mesh(path)?, format })),
        FileKind::Unknown(what) => bail!("{}: not recognized: {what}", path.display()),
        kind => bail!("{}: is {}, which cannot be read yet", path.display(), describe(&kind)),
    })
}

fn of_map(path: &Path) -> anyhow::Result<Source> {
    Ok(match SavedMap::read(path, readable())? {
        SavedMap::Two(file) => Source::Map2(file),
        SavedMap::Three(file) => Source::Map3(file),
    })
}

/// Memory for a map (bytes): what the machine has free, 4 GiB at least.
fn readable() -> u64 {
    available_memory().unwrap_or(0).max(4 << 30)
}

/// The yaml file beside an image, if it names that image and no other.
fn yaml_beside(path: &Path) -> Option<PathBuf> {
    let yaml = Some(path.with_extension("yaml")).filter(|p| p.is_file())?;
    let info = MapServerInfo::parse(portolan_io::open(&yaml).ok()?).ok()?;
    (info.image.file_name() == path.file_name()).then_some(yaml)
}

impl Source {
    /// Refuses options that were given and that files of this dimension have no use for.
    pub(crate) fn check<A: clap::Args>(&self, given: &Given<()>) -> anyhow::Result<()> {
        let dimension = match self {
            Self::Image(_) => return Ok(()),
            Self::Map2(_) | Self::Server(_) | Self::Contour(_) | Self::Log2(_) => Dimension::Two,
            Self::Esdf(EsdfFile::Two(_)) => Dimension::Two,
            Self::Map3(_) | Self::Octomap(_) | Self::Log3(_) | Self::Mesh(_) => Dimension::Three,
            Self::Esdf(EsdfFile::Three(_)) => Dimension::Three,
        };
        dimension.check::<A, _>(given, "the file")
    }

    /// What lowers the trust in it.
    pub(crate) fn warning(&self) -> Option<String> {
        if let Self::Octomap(file) = self {
            let colors = "its colors are not read, and are missing in what is written from it";
            return file.colors_left_out().then(|| colors.into());
        }
        let Self::Server(map) = self else { return None };
        let mut all = map.notes.clone();
        let cells = map.unknown_gray_taken_for_free;
        if cells > 0 {
            all.push(format!(
                "{cells} cells have the gray of unknown (205 or 206) but count as free, because free_thresh is above \
                 0.196; lower it to keep them unknown"
            ));
        }
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// What it is.
    pub(crate) fn describe(&self) -> &'static str {
        match self {
            Self::Map2(_) => "a 2-D portolan map",
            Self::Map3(_) => "a 3-D portolan map",
            Self::Esdf(_) => "a distance field (esdf.bin)",
            Self::Server(_) => "a map_server map",
            Self::Image(_) => "a PGM image without its yaml file",
            Self::Contour(_) => "a contour (GeoJSON)",
            Self::Octomap(file) if file.is_binary() => "an OctoMap tree of free and occupied (.bt)",
            Self::Octomap(_) => "an OctoMap tree of log odds (.ot)",
            Self::Log2(log) if log.format() == "bag" => "a bag of ROS",
            Self::Log2(_) => "a CARMEN log",
            Self::Log3(log) => log.kind().label(),
            Self::Mesh(mesh) => match mesh.format {
                MeshFormat::Ply => "a mesh (PLY)",
                MeshFormat::Glb => "a mesh (GLB, binary glTF)",
                MeshFormat::Obj => "a mesh (OBJ)",
                _ => "a mesh",
            },
        }
    }
}
