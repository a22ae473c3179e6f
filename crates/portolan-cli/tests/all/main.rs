//! The program as its users run it. One test program: each would link all of it again.
#![allow(clippy::unwrap_used, reason = "in a test a panic is the report")]
#![allow(clippy::print_stdout, reason = "tables of errors are part of the report")]

mod bad_input;
mod bags;
mod clouds;
mod commands;
mod damaged_scans;
mod demo;
mod eval_3d;
mod faults;
mod first_steps;
mod folders;
mod handover;
mod ledgers;
mod map_3d;
mod movers;
mod octomap;
mod planner_lines;
mod radiance;
mod real_3d_logs;
mod real_logs;
mod sigma;
mod signals;
mod studio;
mod studio_probe;
mod support;
mod up;
mod written_files;
