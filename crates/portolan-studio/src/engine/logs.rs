//! What the studio shows: a log of the plane and one of space, recorded or simulated.

use portolan::geom::Pose;
use portolan::map::Tsdf3;
use portolan::scan::{FrameFilter, Scan};
use portolan_io::scan_log::ScanLog;

/// The two logs that every session looks at. They never change.
#[derive(Default)]
pub struct Logs {
    /// What the views of the plane show.
    pub source_2d: Source2d,
    /// What the view of space shows.
    pub source_3d: Source3d,
}

/// Scans of the plane.
#[derive(Default)]
pub enum Source2d {
    /// The chapter's lap through the Apartment, over and over.
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

/// Scans of space.
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
    },
    /// A map that was made before: nothing is left to fuse, all can be looked at.
    Map {
        /// Its name, for people.
        name: String,
        /// Every session has a snapshot of it.
        tsdf: Box<Tsdf3>,
    },
}
