//! Any file that holds a map or something made of one, opened by what it is.

use std::path::{Path, PathBuf};

use anyhow::bail;
use portolan_io::scan_log::{ScanLog, ScanLogOptions};
use portolan_io::{
    CarmenLog, Container, EsdfFile, FileKind, MapFile, MapServerMap, OctomapTree, Pgm, Polyline, detect,
    map_dimension, read_geojson,
};

use crate::log::describe;
use crate::space::available_memory;

/// What a file holds.
pub(crate) enum Source {
    /// `map.portolan` of the plane
    Map(Box<MapFile<2>>),
    /// `map.portolan` of space
    SpaceMap(Box<MapFile<3>>),
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
    /// A log
    Log(Box<CarmenLog>),
    /// A log of scans of space
    ScanLog(Box<ScanLog>),
}

/// Opens a file or a folder.
pub(crate) fn open(path: &Path) -> anyhow::Result<Source> {
    Ok(match detect(path)? {
        FileKind::Portolan => of_map(&Container::read(path)?)?,
        FileKind::PortolanFolder => of_map(&Container::read(path.join("map.portolan"))?)?,
        FileKind::EsdfBin => Source::Esdf(EsdfFile::read(path)?),
        FileKind::MapServerYaml => Source::Server(MapServerMap::read(path)?),
        FileKind::Pgm => match yaml_beside(path) {
            Some(yaml) => Source::Server(MapServerMap::read(yaml)?),
            None => Source::Image(Pgm::read(path)?),
        },
        FileKind::GeoJson => Source::Contour(read_geojson(path)?),
        FileKind::OctomapBt | FileKind::OctomapOt => Source::Octomap(Box::new(OctomapTree::read(path)?)),
        FileKind::CarmenLog => Source::Log(Box::new(CarmenLog::read(path)?)),
        FileKind::ScanLog(_) => Source::ScanLog(Box::new(ScanLog::open(path, &ScanLogOptions::default())?)),
        FileKind::Unknown(what) => bail!("{}: not recognised: {what}", path.display()),
        kind => bail!("{}: is {}, which is not read yet", path.display(), describe(&kind)),
    })
}

fn of_map(container: &Container) -> anyhow::Result<Source> {
    Ok(match map_dimension(container)? {
        2 => Source::Map(Box::new(MapFile::from_container(container, readable())?)),
        _ => Source::SpaceMap(Box::new(MapFile::from_container(container, readable())?)),
    })
}

/// What a map may take in memory (bytes): what the machine has free, 4 GiB at least.
fn readable() -> u64 {
    available_memory().unwrap_or(0).max(4 << 30)
}

/// The yaml file that belongs to an image.
fn yaml_beside(path: &Path) -> Option<PathBuf> {
    Some(path.with_extension("yaml")).filter(|p| p.is_file())
}

impl Source {
    /// What the user should know before he trusts it.
    pub(crate) fn warning(&self) -> Option<String> {
        if let Self::Octomap(file) = self {
            let colors = "it has colours, which are passed over: what is written from it has none";
            return file.colors_left_out().then(|| colors.into());
        }
        let Self::Server(map) = self else { return None };
        let cells = map.unknown_gray_taken_for_free;
        (cells > 0).then(|| {
            format!(
                "{cells} cells have the grey of unknown (205 or 206) but count as free, because free_thresh is above \
                 0.196; lower it to keep them unknown"
            )
        })
    }

    /// What it is, in words.
    pub(crate) fn describe(&self) -> &'static str {
        match self {
            Self::Map(_) => "a portolan map",
            Self::SpaceMap(_) => "a portolan map of space",
            Self::Esdf(_) => "a distance field (esdf.bin)",
            Self::Server(_) => "a map_server map",
            Self::Image(_) => "a PGM image without its yaml file",
            Self::Contour(_) => "a contour (GeoJSON)",
            Self::Octomap(file) if file.is_binary() => "an OctoMap tree of free and occupied (.bt)",
            Self::Octomap(_) => "an OctoMap tree of log odds (.ot)",
            Self::Log(_) => "a CARMEN log",
            Self::ScanLog(log) => log.kind().label(),
        }
    }
}
