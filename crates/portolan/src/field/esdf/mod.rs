//! The signed distance field of a map in bricks: from the surface over the nearest crossings to certified clearance.
//!
//! | step | folder or file | what comes out |
//! |---|---|---|
//! | 1 | `surface` | the segments or triangles of every cell, and where they cross the lattice's edges |
//! | 2 | `transform` | for every cell the edge whose crossing is nearest (a feature) and how far it is (a power) |
//! | 3 | `measure` | the distance to the segments or triangles around that crossing, when a brick is read |
//! | 4 | `obstacles` | cells that are obstacles without being surface, and how far the nearest is |
//! | 5 | `clearance` | at any point an interval that holds the distance |
//! | | `follow` | steps 1 to 4 again where the map changed |
//! | | `cells`, `unknown`, `cell_distances` | step 2 from cells instead of crossings: the textbook's seeds, a mask; unknown cells, and obstacles without surface |
//! | | `of_cells` | a field of obstacles alone, where nothing else is known |
//! | | `field`, `query`, `bricks`, `export` | what is held, and what is read of it |
//!
//! ```text
//!    o     o     o     o      o  node: the center of a cell, with the filter's estimate
//!                             x  crossing of an edge between a node inside (-) and one in free space (+)
//!    o+----o+----o+----o+    \\  element: segment (2-D) or triangle (3-D) between crossings
//!    |     |     |     |      q  a cell: its feature is the edge of the nearest x, its power |q - x|^2 + h(x);
//!    |     x\\\\\x     |          h(x) <= D / 4 makes x answer for all elements around it, so that
//!    x\\\\/|     |\\\\\x          sqrt(power - D / 4) <= distance to the elements <= sqrt(power)
//!    o-    o-    o-    o-
//! ```

mod bricks;
mod cell_distances;
mod cell_mask;
mod cells;
mod clearance;
mod export;
mod field;
mod follow;
mod measure;
mod obstacles;
mod of_cells;
mod query;
mod settings;
mod surface;
mod transform;
mod unknown;

pub use clearance::{LessNoise, SurfaceNoise};
pub use field::Esdf;
pub use obstacles::{LEAST_HITS, ObstacleCells, PointKind};
pub use settings::{EsdfMethod, EsdfSettings, EsdfUpdate};

/// Bricks in one task of those that take microseconds each.
const TOGETHER: usize = 32;
