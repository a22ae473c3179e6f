//! Volumetric mapping in two and three dimensions.
//!
//! Every map here is the same recursive estimator in another costume. Three choices make a map: a **sweep**
//! turns a scan into evidence, a **cell** says how evidence moves an estimate, a **store** holds the cells.
//! Read-only **fields** are derived from maps. The crate does no input or output, prints nothing and reads
//! no clock.

pub mod geom;
pub mod radiance;
pub mod scan;
