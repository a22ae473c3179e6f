//! Volumetric mapping in two and three dimensions.
//!
//! Every map here is the same recursive estimator in another costume. Three choices make a map: a **sweep**
//! turns a scan into evidence, a **cell** says how evidence moves an estimate, a **store** holds the cells.
//! Read-only **fields** are derived from maps. The crate does no input or output, prints nothing and reads
//! no clock.

mod answer;
pub mod cell;
pub mod field;
pub mod gallery;
pub mod geom;
pub mod map;
pub mod radiance;
pub mod scan;
pub mod store;
pub mod surface;
pub mod sweep;

pub use answer::Answer;
