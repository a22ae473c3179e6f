//! The Euclidean distance transform over bricks: for every cell the nearest seed, axis by axis.
//!
//! The separable transform runs once along each axis. A pass reads bricks (inputs) and fills bricks (outputs), line by
//! line; what lies between two passes is a stage:
//!
//! ```text
//! seeds -> [pass along x] -> stage -> [pass along y] -> stage -> [pass along z] -> squared distances
//! ```
//!
//! A pass fills only bricks that a later pass looks at, no further than an upper bound of what will be found (the
//! output's budget). Nothing is computed twice, as it is where tiles with a halo are solved one by one.
//!
//! | file | what |
//! |---|---|
//! | `bounds` | how far each brick must look: the bound of a witness, a seed that bricks hand on to their neighbors |
//! | `outputs` | which bricks each pass must fill so that the next one can |
//! | `stage` | values and features of bricks between two passes |
//! | `layout`, `pass` | lines of bricks laid side by side, and one pass over them |
//! | `search`, `min_plus` | the least along a line: from centers, from boxes, with the feature that it comes from |
//! | `roots` | the first pass from crossings, whose places on the line are real numbers |
//! | `feature` | an edge of the lattice as seen from a cell, in 32 bits |
//! | `edges` | the accurate transform: all passes from crossings |
//! | `cell_rule`, `seeds`, `squared` | the transform from cells |

mod bounds;
mod cell_rule;
mod edges;
mod feature;
mod layout;
mod min_plus;
mod outputs;
mod pass;
mod planes_mut;
mod roots;
mod search;
mod seeds;
mod squared;
mod stage;

pub(super) use bounds::{Witness, bounds, furthest_of_cells};
pub(super) use cell_rule::{CellRule, mask, sign};
pub(super) use edges::edge_distances;
pub(crate) use feature::Feature;
pub(super) use layout::layout;
pub(super) use outputs::{Output, within};
pub(super) use search::{FromBoxes, FromCenters, RowSearch, Source};
pub(super) use seeds::SeedMap;
pub(super) use squared::squared_distances;
pub(super) use stage::{Input, Stage};
