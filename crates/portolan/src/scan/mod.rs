//! What a sensor delivers: beams with a direction, a range and a kind, in the sensor's frame.
//!
//! What each kind of beam does to a map:
//!
//! | kind | what was measured | frees space | adds a surface |
//! |---|---|---|---|
//! | [`BeamKind::Hit`] | a surface at `range` | up to it | yes |
//! | [`BeamKind::MaxRange`] | nothing nearer than `range` (a reading beyond the caller's limit) | up to `range` | never |
//! | [`BeamKind::NoReturn`] | no echo: open space, glass, black cloth | up to `range`, which is 0 unless the caller gives another | never |
//! | [`BeamKind::Dropped`] | nothing at all, or a reading that was refused | no | never |
//! | [`BeamKind::SelfHit`] | the robot's own body | no | never |
//! | [`BeamKind::Mover`] | something that was not there at other times | up to it | never |

mod angles;
mod beam;
mod bridges;
mod deskew;
mod fingerprint;
mod frame_filter;
mod incidence;
mod laser;
mod layout_finder;
mod movable;
mod organised;
mod point_scan;
mod range_image;
mod range_surface;
mod record;
mod rings;
mod spherical_layout;
mod stats;
mod strips;
mod ways;

pub(crate) use angles::atan2;
pub use beam::{Beam, BeamKind};
pub(crate) use bridges::{Bridge, Bridges};
pub use fingerprint::Fingerprint;
pub use frame_filter::{Body, FrameFilter};
pub use incidence::cos_incidence;
pub(crate) use incidence::{MAX_OPENING, MAX_SLOPE, connected};
pub use laser::RangeLimits;
pub use layout_finder::LayoutFinder;
pub use movable::Movable;
pub use organised::OrganisedPoints;
pub use point_scan::{Frame, Origin, PointScan};
#[cfg(test)]
pub(crate) use range_image::testing::broken as broken_images;
pub use range_image::{Orthographic, Pinhole, Projection, RangeImage, Spherical};
pub use range_surface::orthographic_image;
pub use record::{BeamOrder, Scan};
pub use spherical_layout::SphericalLayout;
pub use stats::{BeamCounts, RefusedBeams, ScanStats};
pub use strips::Delivered;
pub(crate) use strips::strips;
pub use ways::{ScanWays, Way, WhyRays};
