//! Volumetric mapping in two and three dimensions: range scans with known poses, fused once, into the maps that
//! robots, renderers and people ask different questions of.
//!
//! ```
//! use portolan::{Answer, Mapper, geom::Pose, scan::{RangeLimits, Scan}};
//!
//! // A laser in the middle of a room of 4 m x 4 m, 360 beams.
//! let bearings: Vec<f64> = (0..360).map(|d| f64::from(d - 180).to_radians()).collect();
//! let ranges: Vec<f64> = bearings.iter().map(|b| 2.0 / b.cos().abs().max(b.sin().abs())).collect();
//! let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
//!
//! let mut mapper = Mapper::<2>::new(0.05);                                   // cells of 5 cm
//! mapper.integrate(&Pose::<2>::new(0.0, 0.0, 0.0), &scan)?;
//!
//! // Where is the surface? How far is it, and which way is away from it? And what is not known?
//! assert!((mapper.contour().length() - 16.0).abs() < 0.2);
//! let esdf = mapper.esdf().expect("distances are made by default");
//! let (clearance, away) = esdf.distance_and_gradient([1.5, 0.02]).known().expect("seen by the laser");
//! assert!((clearance - 0.5).abs() < 0.01 && away[0] < -0.99);
//! assert_eq!(esdf.distance([2.4, 2.4]), Answer::Unknown);
//! # Ok::<(), portolan::map::MapError>(())
//! ```
//!
//! [`Mapper`] is the recipe: the maps that are asked for, made so that they fit each other. Below it, three choices make a
//! map: a [`sweep`] turns a scan into evidence, a [`cell`] is the estimator that evidence moves, a [`store`] holds the
//! cells; [`map::integrate`] is the one way a scan enters any map. Read-only fields are derived from maps: a distance
//! [`field`], a [`surface`]. The crate does no input or output, prints nothing, starts no threads of its own and reads no
//! clock.
//!
//! | question | answered by | cost |
//! |---|---|---|
//! | is this point occupied? | [`map::Occupancy`], in bricks, a dense array or a tree | one look-up |
//! | where is the surface? | [`map::Tsdf`], then [`surface::marching_squares`], [`surface::marching_cubes`] | one pass over the cells |
//! | how far to the nearest surface, and which way is away? | [`field::Esdf`], kept up to date with its map | one interpolation |
//! | how far for certain, at least and at most? | [`field::ClearanceField`] of it | a look at the surface nearby |
//! | is this path free, this pose of a robot, and where would it be? | [`plan`] over a field | steps of the clearance |
//! | what share of beams does a cell stop, and what would a sensor read along a ray? | [`map::Attenuation`], [`beam_model::RangeDistribution`] | one look-up; one walk |
//! | where does the known end, and what would be seen from there? | [`explore`] over a map | changed bricks |
//! | what of many maps together, or without a scan, or with it elsewhere? | [`Ledger`], whose evidence adds up | a pass over the cells of the difference |
//! | how near is the nearest measurement? | [`map::Cloud`] | a k-d tree |

mod answer;
pub mod beam_model;
pub mod cell;
pub mod explore;
pub mod field;
pub mod geom;
pub mod handover;
pub mod ledger;
pub mod map;
pub mod mapper;
pub mod movers;
mod parallel;
pub mod plan;
pub mod scan;
mod sets;
pub mod store;
pub mod surface;
pub mod sweep;
#[cfg(test)]
mod testing;
pub mod uncertainty;

pub use answer::{Answer, Status};
pub use ledger::Ledger;
pub use mapper::{Mapper, MapperSettings};

/// The code of the front page of the project is compiled as it is printed.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
