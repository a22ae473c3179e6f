//! What the studio shows: a 2-D log and a 3-D log or map, recorded or simulated.

use portolan::geom::Pose;
use portolan::map::{Attenuation, Tsdf3};
use portolan::scan::{FrameFilter, Scan};
use portolan::uncertainty::SurfaceSigma;
use portolan_io::scan_log::ScanLog;

/// The two logs that every session looks at. They never change.
#[derive(Default)]
pub struct Logs {
    /// What the 2-D views show.
    pub source_2d: Source2d,
    /// What the 3-D view shows.
    pub source_3d: Source3d,
}

/// 2-D scans.
#[derive(Default)]
pub enum Source2d {
    /// A lap through the Apartment, over and over.
    #[default]
    Apartment,
    /// A log that was read.
    Recorded {
        /// Its name, for people.
        name: String,
        /// Scans and where they were taken.
        scans: Vec<(Pose<2>, Scan<2>)>,
    },
}

/// 3-D frames, or a map.
#[derive(Default)]
pub enum Source3d {
    /// The simulated building, of which the truth is known.
    #[default]
    Building,
    /// A log whose frames are read when they are asked for.
    Recorded {
        /// Poses, and where the frames are.
        log: Box<ScanLog>,
        /// Which readings are used.
        filter: FrameFilter,
        /// Unit vector upward in its world.
        up: [f64; 3],
    },
    /// A map that was made before: nothing is left to fuse, all can be looked at.
    Map {
        /// Its name, for people.
        name: String,
        /// Every session has a snapshot of it.
        tsdf: Box<Tsdf3>,
        /// Unit vector upward in its world.
        up: [f64; 3],
        /// What its run found out beside it.
        beside: Box<BesideMap>,
    },
}

/// What is known of a map beside its cells.
#[derive(Default)]
pub struct BesideMap {
    /// How sure its surface is.
    pub sigma: Option<SurfaceSigma>,
    /// Returns of what moved, which are not in it (world, meters).
    pub movers: Vec<[f64; 3]>,
    /// Which share of the looks its cells stop.
    pub attenuation: Option<Attenuation<3>>,
}

impl Logs {
    /// The name of what was given, and whether it is in 3-D; `None`: all is simulated.
    pub(super) fn given(&self) -> Option<(&str, bool)> {
        match (&self.source_2d, &self.source_3d) {
            (_, Source3d::Recorded { log, .. }) => Some((log.name(), true)),
            (_, Source3d::Map { name, .. }) => Some((name, true)),
            (Source2d::Recorded { name, .. }, _) => Some((name, false)),
            (Source2d::Apartment, Source3d::Building) => None,
        }
    }
}
