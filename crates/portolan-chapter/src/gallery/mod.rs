//! One log, the same poses, every representation: what each costs, and how true its answers are.
//!
//! The library reads no clock: the caller passes one. Accuracy needs a [`Truth`](portolan_sim::Truth), which the simulator has.

mod against_truth;
mod asker;
mod build;
mod costs;
mod crossover;
mod document;
mod fields;
mod foretold;
mod measured;
mod probes;
mod row;
mod run;
mod table;
mod turned;

pub use crossover::{CloudCrossover, TreeCrossover, tree_crossovers_at};
pub use document::document;
pub use fields::MeasuredField;
pub use foretold::Foretold;
pub use measured::{Gallery, GallerySettings, HitGrid};
pub use probes::Clock;
pub use row::{Cost, LEVEL, Row, Winner, Workload};
pub use run::run;
pub use turned::{Accuracy, FieldAccuracy, RowAccuracy, Turn, Turned, TurnedTruth, turned};
