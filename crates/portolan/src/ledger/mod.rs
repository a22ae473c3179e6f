//! Evidence that adds up: maps of whole-number sums, which merge, give scans back and follow corrected poses, exactly.
//!
//! A [`Ledger`] holds what a [`Mapper`](crate::Mapper) holds, as sums ([`crate::cell::SumCell`]): of signed distances, of colors, of
//! hits and misses, of hits and lengths. It also lists its scans, each with the pose that it was fused at. Every scan is read by
//! itself, without what earlier ones taught, and is taken wholly or not at all. So, to the last bit,
//!
//! - parts of a log that were fused apart, in any number, order or place, merge into the ledger of the whole log;
//! - a scan that is taken away leaves the ledger of never having had it;
//! - a scan that is moved leaves the ledger of having fused it where it is now.
//!
//! What cannot be told from a slip is refused: a scan that is there already, one that never was, another scan under the
//! name of one that was, parts made with other settings or on another lattice.
//!
//! [`Ledger::mapper`] makes the clamped maps of it, which answer all questions: surface, distances, clearance, paths.
//!
//! Which of the two, when: the clamped cells forget, look by look, and need no list of scans; a ledger forgets what it is
//! told to ([`Ledger::subtract`], [`Ledger::take_out`]), and where things moved it believes the majority of looks.

mod epochs;
mod error;
mod fuse;
mod merge;
mod parts;
mod scans;
mod sum_map;
mod view;

pub use epochs::Epochs;
pub use error::LedgerError;
pub use merge::check_settings;
pub use parts::LedgerSums;
pub use scans::{LedgerScans, ScanRecord};

use crate::mapper::MapperSettings;
use sum_map::{SumAttenuation, SumOccupancy, SumTsdf};

/// Maps of sums and the list of the scans in them.
///
/// A clone is a snapshot: bricks are shared until one side changes them.
///
/// ```
/// use portolan::{Ledger, MapperSettings, geom::Pose, scan::{RangeLimits, Scan}};
///
/// let bearings: Vec<f64> = (0..360).map(|d| f64::from(d - 180).to_radians()).collect();
/// let room = |x: f64| -> Vec<f64> {
///     bearings.iter().map(|b| (2.0 - x * b.cos().signum()).abs() / b.cos().abs().max(0.7)).collect()
/// };
/// let scan = |x: f64| Scan::from_laser(&bearings, &room(x), &RangeLimits::default());
/// let at = |x: f64| Pose::<2>::new(x, 0.0, 0.0);
///
/// let settings = MapperSettings::<2>::new(0.05);
/// let mut whole = Ledger::new(settings)?;
/// let (mut a, mut b) = (Ledger::new(settings)?, Ledger::new(settings)?);
/// for (i, x) in [0.0, 0.1, 0.2, 0.3].into_iter().enumerate() {
///     whole.add("log", i as u64, &at(x), &scan(x))?;
///     (if i % 2 == 0 { &mut a } else { &mut b }).add("log", i as u64, &at(x), &scan(x))?;
/// }
/// b.merge(&a)?;
/// assert!(b == whole);
/// // One scan was somewhere else, as a loop closure says.
/// whole.repose("log", 3, &at(0.31), &scan(0.3))?;
/// whole.repose("log", 3, &at(0.3), &scan(0.3))?;
/// assert!(b == whole);
/// assert!(whole.add("log", 3, &at(0.3), &scan(0.3)).is_err()); // it is there already
/// # Ok::<(), portolan::ledger::LedgerError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Ledger<const D: usize> {
    settings: MapperSettings<D>,
    occupancy: Option<SumOccupancy<D>>,
    tsdf: Option<SumTsdf<D>>,
    attenuation: Option<SumAttenuation<D>>,
    scans: LedgerScans<D>,
}
