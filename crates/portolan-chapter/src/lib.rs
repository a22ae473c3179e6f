//! What belongs to the textbook behind portolan and not to the engine: its experiments, its report, its exercises.
//!
//! The text is chapter 19, *Modern Map Representations* (part V, *Mapping and SLAM*), of an online textbook titled
//! *Probabilistic Robotics*. Author unknown: the chapter names none, and the book of the same title (Thrun, Burgard
//! & Fox 2005) is another one. Sections, derivations (D1 to D4) and exercises are cited by number. The answers to its
//! seven exercises are in `docs/EXERCISES.md`; `tests/exercises/` computes every number there.
//!
//! Not for mapping: whoever wants a map depends on `portolan` alone.
//!
//! | module | holds | command |
//! |---|---|---|
//! | [`gallery`] | one log in every representation: what each costs, how true its answers are | `gallery`, `demo` |
//! | [`memory`] | bytes of a tree against an array, by the text's formula | |
//! | [`poses`] | the poses of the lap: scan matching, loop closures, pose graph, and how far off they are | `demo` |
//! | [`ghost`](mod@ghost) | a chair that moves: how long a map believes in it, and what forgetting costs | `demo` |
//! | [`radiance`] | a radiance field on a line, fitted through its renderer | `radiance` |
//! | [`experiment`], [`pictures`], [`report`], [`radiance_report`] | the numbers of a run as JSON, pictures, text and `report.html` | |
//!
//! [`MapRepr`] is the text's thesis as an interface. The textbook's march and its distance transform are parts of the
//! engine, to be chosen there: [`BeamSweep::March`](portolan::map::BeamSweep::March),
//! [`esdf_from_tsdf`](portolan::field::esdf_from_tsdf).
//!
//! No module opens files or reads a clock; the caller passes one.
//!
//! ```
//! use portolan::geom::Grid;
//! use portolan_chapter::gallery::{GallerySettings, run};
//! use portolan_sim::{LapConfig, Truth, apartment, lap};
//!
//! let world = apartment().world;
//! let log = lap(&world, &LapConfig { scans: 20, ..Default::default() });
//! let grid = Grid::new([0.0; 2], 0.1, [120, 90]);
//! let settings = GallerySettings::new(grid, 1000, Some(world.wall_length()));
//! let start = std::time::Instant::now();
//! let gallery = run(&log, &settings, Some(&world as &dyn Truth<2>), &mut || start.elapsed().as_secs_f64())?;
//! assert_eq!(gallery.rows.len(), 9);
//! # Ok::<(), portolan::map::MapError>(())
//! ```

pub mod experiment;
pub mod gallery;
pub mod ghost;
pub mod memory;
pub mod pictures;
pub mod poses;
pub mod radiance;
pub mod radiance_report;
pub mod report;
mod repr;

pub use repr::{Abilities, MapRepr};
