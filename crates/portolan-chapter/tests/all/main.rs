//! The textbook's figures and tables. One test program: each would compile the engine's generic code again.
#![allow(clippy::unwrap_used, reason = "in a test a panic is the report")]
#![allow(clippy::print_stdout, reason = "tables of errors are part of the report")]

mod corrected_lap;
mod ghost;
mod intel_relations;
mod radiance;
mod turned;
mod worked_examples;
